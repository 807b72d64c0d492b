//! Whether points lie on one quadric of any type.

use crate::fit::general_fit;
use crate::geometry::{Quadric, Vec3};

/// Scatter about the quadric, in noise sigmas, that noise alone may give.
const NOISE_ALONE: f64 = 1.25;

/// The quadric of any type through points, where they scatter about it by no more than noise lets them.
pub fn one_quadric(points: &[Vec3], sigma: f64) -> Option<Quadric> {
    let quadric = general_fit(points, Some(2.5 * sigma))?;
    let mut sq: Vec<f64> = points.iter().map(|x| quadric.distance(x).powi(2)).collect();
    // The inner four fifths of normal distances have 0.44 of the mean square.
    let inner = sq.len() * 4 / 5;
    sq.select_nth_unstable_by(inner, f64::total_cmp);
    let scatter = (sq[..inner].iter().sum::<f64>() / inner as f64 / 0.44).sqrt();
    (scatter < NOISE_ALONE * sigma).then_some(quadric)
}
