//! Whether points lie on one quadric of any type.

use crate::fit::constant::constants;
use crate::fit::general_fit;
use crate::geometry::{Quadric, Vec3};
use crate::segment::family::ROBUST;

constants! {
    /// Scatter about the quadric, in noise sigmas, that noise alone may give.
    NOISE_ALONE: f64 = 1.25, Trial(1.25, 1.25);
    /// Share of the distances, the lesser ones, that the scatter is read from.
    INNER: f64 = 0.8, Derived("INNER_MEAN_SQ belongs to it");
    /// Mean square of that share of normal distances, over that of all.
    INNER_MEAN_SQ: f64 = 0.44, Derived("erf and exp at the quantile 1.2816 of a normal distance");
}

/// The quadric of any type through points, where they scatter about it by no more than noise lets them.
pub fn one_quadric(points: &[Vec3], sigma: f64) -> Option<Quadric> {
    let quadric = general_fit(points, Some(ROBUST.get() * sigma))?;
    let mut sq: Vec<f64> = points.iter().map(|x| quadric.distance(x).powi(2)).collect();
    let inner = (INNER.get() * sq.len() as f64) as usize;
    sq.select_nth_unstable_by(inner, f64::total_cmp);
    let scatter = (sq[..inner].iter().sum::<f64>() / inner as f64 / INNER_MEAN_SQ.get()).sqrt();
    (scatter < NOISE_ALONE.get() * sigma).then_some(quadric)
}
