//! The noise that surfaces leave.

use crate::fit::Ruler;
use crate::segment::family::Families;
use crate::segment::median::deviation;
use crate::segment::partition::Partition;
use crate::segment::prepare::scene::Scene;

/// Labelled points that tell the noise, unless they are most of a small scene's.
const ENOUGH: usize = 100;

/// Robust sigma of all labelled points about their surfaces.
pub fn residual_sigma(scene: &Scene, model: &Partition) -> Option<f64> {
    let labelled = model.labels.iter().zip(&scene.points).filter(|(l, _)| **l >= 0);
    let n = labelled.clone().count();
    if n < ENOUGH.min(scene.len() * 3 / 4) {
        return None;
    }
    let rulers: Vec<Ruler> = model.shapes.iter().map(Ruler::of).collect();
    let sigma = deviation(labelled.map(|(&l, p)| rulers[l as usize].distance(p)))?;
    if n >= ENOUGH {
        return Some(sigma);
    }
    // Of few points surfaces take up a good part of the noise.
    let taken: usize = model.shapes.iter().map(|s| s.family.dof()).sum();
    Some(sigma * (n as f64 / n.saturating_sub(taken).max(1) as f64).sqrt())
}

/// Takes the noise to be what is left at the surfaces found.
pub fn tighten(scene: &Scene, model: &Partition, families: &mut Families) {
    if let Some(s) = residual_sigma(scene, model) {
        families.sigma = s.max(families.sigma * 0.2).min(families.sigma * 1.05).max(families.floor);
    }
}
