use super::{count, v1};
use crate::model::relations::{Measure, MeasureKind, Relation, RelationKind, Snapping};

impl From<RelationKind> for v1::RelationKind {
    fn from(kind: RelationKind) -> Self {
        match kind {
            RelationKind::Parallel => Self::Parallel,
            RelationKind::Perpendicular => Self::Perpendicular,
            RelationKind::Coaxial => Self::Coaxial,
            RelationKind::Coplanar => Self::Coplanar,
            RelationKind::Concentric => Self::Concentric,
            RelationKind::EqualRadius => Self::EqualRadius,
            RelationKind::EqualMajorRadius => Self::EqualMajorRadius,
            RelationKind::EqualAngle => Self::EqualAngle,
            RelationKind::EqualSemiAxes => Self::EqualSemiAxes,
            RelationKind::Tangent => Self::Tangent,
            RelationKind::Symmetric => Self::Symmetric,
            RelationKind::CirclePattern => Self::CirclePattern,
            RelationKind::GridPattern => Self::GridPattern,
        }
    }
}

fn vector([x, y, z]: [f64; 3]) -> v1::Vector {
    v1::Vector { x, y, z }
}

fn regions(all: &[usize]) -> Vec<u64> {
    all.iter().map(|&n| count(n)).collect()
}

impl From<&Relation> for v1::Relation {
    fn from(relation: &Relation) -> Self {
        Self {
            kind: v1::RelationKind::from(relation.kind).into(),
            regions: regions(&relation.regions),
            to: regions(&relation.to),
            deviation: relation.deviation,
            uncertainty: relation.uncertainty,
            p_value: relation.p_value,
            log_odds: relation.log_odds,
            accepted: relation.accepted,
            direction: relation.direction.map(vector),
            point: relation.point.map(vector),
            value: relation.value,
            count: relation.count.map(count),
            spacing: relation.spacing,
            counts: relation.counts.map(|c| regions(&c)).unwrap_or_default(),
            pitches: relation.pitches.map(Vec::from).unwrap_or_default(),
            grid_directions: relation.grid_directions.into_iter().flatten().map(vector).collect(),
        }
    }
}

impl From<&Measure> for v1::Measure {
    fn from(measure: &Measure) -> Self {
        let kind = match measure.kind {
            MeasureKind::Distance => v1::MeasureKind::Distance,
            MeasureKind::Angle => v1::MeasureKind::Angle,
        };
        Self {
            kind: kind.into(),
            regions: regions(&measure.regions),
            value: measure.value,
            uncertainty: measure.uncertainty,
        }
    }
}

impl From<Snapping> for v1::Snapping {
    fn from(snapping: Snapping) -> Self {
        let Snapping { chi2, freedom, p_value } = snapping;
        Self { chi2, freedom: count(freedom), p_value }
    }
}
