//! Surfaces that run into each other smoothly.

use std::collections::BTreeMap;

use super::cluster::ODDS;
use super::constraint::{Constraint, Section, touch};
use super::joint::Innovation;
use super::positions::Line;
use super::search::{Accepted, Bundle, Search, learned_share, log_odds};
use super::sizes::DECADES;
use super::told::{Relation, RelationKind};
use crate::fit::Family;

/// What is known of directions and axes.
pub struct Known<'a> {
    /// Common directions.
    pub bundles: &'a [Bundle],
    /// Which of these are at right angles.
    pub square: &'a BTreeMap<[usize; 2], usize>,
    /// Common axes, of all bundles.
    pub lines: &'a [Vec<Line>],
}

impl Known<'_> {
    fn bundle(&self, face: usize) -> Option<usize> {
        self.bundles.iter().position(|b| b.faces.contains(&face))
    }

    fn parallel(&self, [a, b]: [usize; 2]) -> bool {
        self.bundle(a).is_some_and(|bundle| self.bundles[bundle].faces.contains(&b))
    }

    fn perpendicular(&self, [a, b]: [usize; 2]) -> bool {
        let (Some(a), Some(b)) = (self.bundle(a), self.bundle(b)) else { return false };
        self.square.contains_key(&[a.min(b), a.max(b)])
    }

    /// All that says what directions and axes of some faces have in common.
    fn needs(&self, faces: &[usize]) -> Vec<usize> {
        let bundles: Vec<usize> = faces.iter().filter_map(|&f| self.bundle(f)).collect();
        let both = |pair: &[usize; 2]| pair.iter().all(|b| bundles.contains(b));
        let square = self.square.iter().filter(|s| both(s.0)).map(|s| *s.1);
        let all_on = |l: &&Line| faces.iter().all(|f| l.faces.contains(f));
        let lines = self.lines.iter().flatten().filter(all_on).filter_map(|l| l.accepted);
        let parallel = bundles.iter().filter_map(|&b| self.bundles[b].accepted);
        square.chain(lines).chain(parallel).collect()
    }

    fn coaxial(&self, [a, b]: [usize; 2]) -> bool {
        self.lines.iter().flatten().any(|l| l.faces.contains(&a) && l.faces.contains(&b))
    }
}

/// Accepts which of the pairs of touching faces are tangent.
pub fn tangent(search: &mut Search, known: &Known, touching: &[[usize; 2]]) {
    let asked: Vec<(Constraint, Innovation, f64)> = touching
        .iter()
        .filter_map(|&pair| {
            let constraint = joint(search, known, pair)?;
            let innovation = search.ask(&constraint);
            let evidence = innovation.evidence(equations(&constraint), volume(search, &constraint));
            Some((constraint, innovation, evidence))
        })
        .collect();
    let evidence: Vec<f64> = asked.iter().map(|a| a.2).collect();
    let prior = log_odds(learned_share(&evidence, asked.len() as f64));
    for (constraint, innovation, evidence) in asked {
        let odds = evidence + prior;
        if odds > ODDS.get() && search.take(&constraint).is_some() {
            let regions = search.regions(&constraint.faces());
            let unit = search.frame.unit;
            let relation = Relation {
                deviation: innovation.largest.0.abs() * unit,
                uncertainty: innovation.largest.1 * unit,
                p_value: innovation.probability(),
                log_odds: odds,
                ..Relation::new(RelationKind::Tangent, regions)
            };
            let needs = known.needs(&constraint.faces());
            search.tell(Accepted::one(relation, vec![constraint], needs));
        }
    }
}

/// How two touching faces may be tangent, from what their directions and axes have in common.
fn joint(search: &Search, known: &Known, pair: [usize; 2]) -> Option<Constraint> {
    use Family::{Cone, Cylinder, Plane, Sphere, Torus};
    let shapes = pair.map(|k| &search.faces[k].shape);
    let mut families = shapes.map(|s| s.family);
    families.sort_unstable();
    let section = match families {
        [Plane, Cylinder] if known.perpendicular(pair) => Section::Across,
        [Cylinder, Cylinder] if known.parallel(pair) => Section::Across,
        [Plane, Sphere] => Section::Through,
        [Plane, Torus] if known.parallel(pair) => Section::Through,
        [Cylinder, Torus] if known.perpendicular(pair) => Section::Elbow,
        [Cylinder | Cone | Torus, Torus] if known.coaxial(pair) => Section::Through,
        [Sphere, Cylinder | Cone | Torus] if known.coaxial(pair) => Section::Through,
        _ => return None,
    };
    let gap = |outside| touch(shapes[0], shapes[1], section, outside).abs();
    Some(Constraint::Tangent { faces: pair, section, outside: gap(true) < gap(false) })
}

/// How many equations it has.
fn equations(constraint: &Constraint) -> usize {
    if matches!(constraint, Constraint::Tangent { section: Section::Elbow, .. }) { 3 } else { 1 }
}

/// The volume of what the residuals may be: a gap may be anything within the scene, a radius within its decades.
fn volume(search: &Search, constraint: &Constraint) -> f64 {
    let size = search.frame.size;
    match constraint {
        Constraint::Tangent { section: Section::Elbow, faces, .. } => {
            size * size * search.faces[faces[0]].shape.min_radius() * DECADES.get().ln()
        }
        _ => size,
    }
}
