use super::DirectSurface;
use crate::grow::{Grown, Growth, Pool};

/// The most points a candidate is judged on.
const JUDGED: usize = 4096;

/// A region grown from one seed point, its surface, and how much of the cloud supports it.
pub struct Candidate {
    /// The grown region and how it came about.
    pub grown: Grown,
    /// The surface of the region's points.
    pub surface: DirectSurface,
    /// About how many points the surface explains; see [`support`].
    pub support: f64,
}

impl Candidate {
    /// Grows and fits from `seed`; `None` where the grown points have no fit.
    pub fn grow(growth: &Growth, pool: &Pool, seed: u32, threshold: f64) -> Option<Self> {
        let grown = growth.grow(pool, seed);
        let members = grown.region.members();
        let first_two = [*pool.point(*members.first()?), *pool.point(*members.get(1)?)];
        let condition = grown.region.condition();
        let surface =
            DirectSurface::from_scatter(*condition.scatter(), *condition.frame(), first_two)?;
        let support = support(&surface, pool, threshold);
        Some(Self { grown, surface, support })
    }
}

/// How many points the surface explains, each counted by 1 - (|x.a| / threshold)^2, on an even
/// sample of the available ones.
///
/// A mixture of two surfaces, grown from a seed near their joint, may well reach as many points
/// as either; but its residuals fill the threshold, so it is worth less than a pure region.
fn support(surface: &DirectSurface, pool: &Pool, threshold: f64) -> f64 {
    let step = pool.available().len().div_ceil(JUDGED).max(1);
    let worth = |&i: &u32| {
        let share = surface.residual(pool.point(i)) / threshold;
        if share < 1.0 { 1.0 - share * share } else { 0.0 }
    };
    pool.available().iter().step_by(step).map(worth).sum::<f64>() * step as f64
}
