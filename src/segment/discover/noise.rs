//! The noise that surfaces leave.

use crate::fit::Ruler;
use crate::fit::constant::constants;
use crate::segment::family::Families;
use crate::segment::median::deviation;
use crate::segment::objective::MOST;
use crate::segment::partition::Partition;
use crate::segment::prepare::scene::Scene;

constants! {
    /// Labelled points that tell the noise, unless they are most of a small scene's.
    ENOUGH: usize = 100, Derived("the noise from so many is off by 1 / sqrt(2 n) = 7 %");
    /// Factor by which the noise may fall at once.
    LOWER: f64 = 0.2, Trial(0.2, 0.2);
}

/// Robust sigma of all labelled points about their surfaces.
pub fn residual_sigma(scene: &Scene, model: &Partition) -> Option<f64> {
    let labelled = model.labels.iter().zip(&scene.points).filter(|(l, _)| **l >= 0);
    let n = labelled.clone().count();
    if n < ENOUGH.get().min((MOST.get() * scene.len() as f64) as usize) {
        return None;
    }
    let rulers: Vec<Ruler> = model.shapes.iter().map(Ruler::of).collect();
    let sigma = deviation(labelled.map(|(&l, p)| rulers[l as usize].distance(p)))?;
    if n >= ENOUGH.get() {
        return Some(sigma);
    }
    // Of few points surfaces take up a good part of the noise.
    let taken: usize = model.shapes.iter().map(|s| s.family.dof()).sum();
    Some(sigma * (n as f64 / n.saturating_sub(taken).max(1) as f64).sqrt())
}

/// Takes the noise to be what is left at the surfaces found.
pub fn tighten(scene: &Scene, model: &Partition, families: &mut Families) {
    if let Some(s) = residual_sigma(scene, model) {
        families.sigma =
            s.max(families.sigma * LOWER.get()).min(families.sigma).max(families.floor);
    }
}
