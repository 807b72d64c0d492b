use super::{surface::FittedSurface, watched::watched};
use crate::fit::constant::constants;
use crate::segment::Monitor;
use crate::segment::rcond::grow::{Grown, Pool};

constants! {
    /// The most points a candidate is judged on.
    JUDGED: usize = 4096, Effort("points of one look");
}

/// A region grown from one seed point, its surface, and how much of the cloud supports it.
pub struct Candidate {
    /// The grown region and how it came about.
    pub grown: Grown,
    /// The surface that the region's points support best.
    pub surface: FittedSurface,
    /// About how many points the surface explains; see [`support`].
    pub support: f64,
}

impl Candidate {
    /// The surface of `grown` as it is, or as it was at an earlier size where that has more
    /// support: so a region that has run over a joint still yields the surface it began on. `None`
    /// where there is no fit.
    pub fn of(grown: Grown, pool: &Pool, threshold: f64, monitor: &dyn Monitor) -> Option<Self> {
        let members = grown.region.members();
        let first_two = [*pool.point(*members.first()?), *pool.point(*members.get(1)?)];
        let frame = grown.region.condition().frame();
        let (support, surface) = grown
            .region
            .stages()
            .filter_map(|scatter| FittedSurface::from_scatter(scatter, frame, first_two))
            .map(|surface| (support(&surface, pool, threshold, monitor), surface))
            .max_by(|a, b| a.0.total_cmp(&b.0))?;
        Some(Self { grown, surface, support })
    }
}

/// How many points the surface explains, each counted by 1 - (|x.a| / threshold)^2, on an even
/// sample of the available ones.
///
/// A mixture of two surfaces, grown from a seed near their joint, may well reach as many points
/// as either; but its residuals fill the threshold, so it is worth less than a pure region.
fn support(surface: &FittedSurface, pool: &Pool, threshold: f64, monitor: &dyn Monitor) -> f64 {
    let step = pool.available().len().div_ceil(JUDGED.get()).max(1);
    let worth = |&i: &u32| {
        let residual = surface.residual_within(pool.point(i), threshold)?;
        Some(1.0 - (residual / threshold).powi(2))
    };
    let judged = watched(pool.available().iter().step_by(step), monitor);
    judged.filter_map(worth).sum::<f64>() * step as f64
}
