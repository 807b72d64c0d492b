//! What holds between surfaces, in words.

use super::{degrees, exact, number};
use crate::model::relations::{Measure, MeasureKind, Relation, RelationKind};

/// What a relation is called: `equal radius`.
pub fn relation_name(kind: RelationKind) -> &'static str {
    match kind {
        RelationKind::Parallel => "parallel",
        RelationKind::Perpendicular => "perpendicular",
        RelationKind::Coaxial => "coaxial",
        RelationKind::Coplanar => "coplanar",
        RelationKind::Concentric => "concentric",
        RelationKind::EqualRadius => "equal radius",
        RelationKind::EqualMajorRadius => "equal ring radius",
        RelationKind::EqualAngle => "equal angle",
        RelationKind::EqualSemiAxes => "equal semi-axes",
        RelationKind::Tangent => "tangent",
        RelationKind::Symmetric => "symmetric",
        RelationKind::CirclePattern => "circle pattern",
        RelationKind::GridPattern => "grid pattern",
    }
}

/// Who is related: `0, 4, 7`, or `0, 4 to 7`; pairs of mirrored ones as `0 and 4, 1 and 5`.
pub fn related(relation: &Relation) -> String {
    let list = |all: &[usize]| all.iter().map(usize::to_string).collect::<Vec<_>>().join(", ");
    if relation.kind == RelationKind::Symmetric {
        let pair = |pair: &[usize]| match pair {
            [a, b] if a != b => format!("{a} and {b}"),
            _ => list(&pair[..1]),
        };
        return relation.regions.chunks(2).map(pair).collect::<Vec<_>>().join(", ");
    }
    match &relation.to[..] {
        [] => list(&relation.regions),
        to => format!("{} to {}", list(&relation.regions), list(to)),
    }
}

/// What they have in common beside it: a radius, an angle, the pitch of a pattern; empty where that is nothing.
pub fn in_common(relation: &Relation) -> String {
    let mut all = Vec::new();
    if let (Some(count), Some(radius)) = (relation.count, relation.value) {
        all.push(format!("{count} places on diameter {}", number(2.0 * radius)));
    } else if let (Some([a, b]), Some([p, q])) = (relation.counts, relation.pitches) {
        let row = |n: usize, pitch: f64| format!("{n} every {}", number(pitch));
        all.push(if b > 1 { format!("{} by {}", row(a, p), row(b, q)) } else { row(a, p) });
    } else if let Some(value) = relation.value {
        all.push(match relation.kind {
            RelationKind::EqualAngle => degrees(value, None),
            _ => number(value),
        });
    }
    all.join(", ")
}

/// How far the surfaces are from it, with its standard uncertainty.
pub fn off(relation: &Relation) -> String {
    let Relation { deviation, uncertainty, .. } = relation;
    match relation.kind {
        RelationKind::Parallel | RelationKind::Perpendicular | RelationKind::EqualAngle => {
            degrees(*deviation, Some(*uncertainty))
        }
        _ => exact(*deviation, Some(*uncertainty)),
    }
}

/// A measure's name and value.
pub fn measure(measure: &Measure) -> (&'static str, String) {
    let Measure { value, uncertainty, .. } = measure;
    match measure.kind {
        MeasureKind::Distance => ("distance", exact(*value, Some(*uncertainty))),
        MeasureKind::Angle => ("angle", degrees(*value, Some(*uncertainty))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn relation(text: &str) -> Relation {
        let known = r#""p_value": 0.5, "log_odds": 9.0, "accepted": true"#;
        serde_json::from_str(&format!("{{{text}, {known}}}")).unwrap()
    }

    #[test]
    fn relations_are_told_in_a_designers_words() {
        let coaxial = relation(
            r#""kind": "coaxial", "regions": [0, 4, 7], "deviation": 0.0021, "uncertainty": 0.0032"#,
        );
        assert_eq!((relation_name(coaxial.kind), &related(&coaxial)[..]), ("coaxial", "0, 4, 7"));
        assert_eq!(off(&coaxial), "0.0021 ± 0.0032");
        let square = relation(
            r#""kind": "perpendicular", "regions": [0], "to": [1, 2], "deviation": 0.001, "uncertainty": 0.002"#,
        );
        assert_eq!((&related(&square)[..], &off(&square)[..]), ("0 to 1, 2", "0.06 ± 0.11°"));
        let mirrored = relation(
            r#""kind": "symmetric", "regions": [0, 4, 2, 2], "deviation": 0.1, "uncertainty": 0.1"#,
        );
        assert_eq!(related(&mirrored), "0 and 4, 2");
        let circle = relation(
            r#""kind": "circle_pattern", "regions": [3, 4], "value": 30.0, "count": 6, "deviation": 0.0, "uncertainty": 0.1"#,
        );
        assert_eq!(in_common(&circle), "6 places on diameter 60");
        let grid = relation(
            r#""kind": "grid_pattern", "regions": [3, 4], "counts": [4, 2], "pitches": [10.0, 5.0], "deviation": 0.0, "uncertainty": 0.1"#,
        );
        assert_eq!(in_common(&grid), "4 every 10 by 2 every 5");
    }
}
