//! What points between surfaces count for each of them.

use rayon::prelude::*;

use crate::fit::Ruler;
use crate::fit::constant::constants;
use crate::segment::label::energy::Energies;
use crate::segment::label::relabel::SceneLabels;
use crate::segment::partition::Partition;
use crate::segment::prepare::scene::Scene;

constants! {
    /// Share of a point below which a surface has none in it.
    LEAST_SHARE: f64 = 0.01, Effort("shares that are not counted");
}

/// What a point between surfaces counts for each of them.
pub type Share = (u32, Vec<(i32, f64)>);

/// Labels of all points, and the shares of those between surfaces.
pub struct Labelled {
    /// One label a point, -1 = none.
    pub labels: Vec<i32>,
    /// Points that count for more than one surface, ascending.
    pub shares: Vec<Share>,
}

/// Shares of the labels from their energies.
pub fn posterior(energies: &Energies) -> Vec<(i32, f64)> {
    let least = energies.iter().map(|e| e.evidence).fold(f64::INFINITY, f64::min);
    let weighed = energies.iter().map(|e| (e.label, (-0.5 * (e.evidence - least)).exp()));
    let total: f64 = weighed.clone().map(|w| w.1).sum();
    weighed.map(|(l, w)| (l, w / total)).filter(|w| w.1 > LEAST_SHARE.get()).collect()
}

/// The shares of a scene's points beside boundaries.
pub fn shares(scene: &Scene, model: &Partition, sigma: f64) -> Vec<Share> {
    let rulers: Vec<Ruler> = model.shapes.iter().map(Ruler::of).collect();
    let inverse = 1.0 / (sigma * sigma);
    let of = SceneLabels { scene, rulers: &rulers, labels: &model.labels, inverse };
    (0..scene.len() as u32)
        .into_par_iter()
        .with_min_len(1024)
        .filter_map(|i| {
            if i % 1024 == 0 && scene.cancelled() {
                return None;
            }
            let own = model.labels[i as usize];
            let beside =
                |&j: &u32| model.labels[j as usize] >= 0 && model.labels[j as usize] != own;
            if own < 0 || !scene.neighbours(i as usize).iter().any(beside) {
                return None;
            }
            let share = posterior(&Energies::at(&of, i));
            share.iter().any(|s| s.0 != own).then_some((i, share))
        })
        .collect()
}
