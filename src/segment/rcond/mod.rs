//! The seed's method: Figure 1, step by step.

pub mod candidate;
pub mod extract;
mod found;
pub mod grow;
pub mod merge;
pub mod refine;
mod report;
pub mod surface;
#[cfg(test)]
mod tests;
mod watched;

use candidate::Candidate;
use extract::{Extracted, extract};
use found::Found;
use merge::merge;
use refine::refine;
use report::report;

use super::random::SplitMix64;
use super::{Monitor, Parameters, SegmentError, Segmentation, Stage};
use crate::fit::constant::constants;
use crate::geometry::{Frame, PointCloud, Tolerance, Vec3, recover};
use crate::segment::rcond::grow::{Growth, Pool, RcondBelow};

constants! {
    /// How many seed points compete for each region. The seed draws one, and asks in its last sentence what
    /// to do when it lies badly.
    COMPETITORS: usize = 8, Effort("seeds that compete");
    /// They stop early once they have grown this many times the points there are: what they could tell
    /// apart they have.
    MOST_GROWN: usize = 2, Effort("points grown over");
    /// Largest mean square residual of a region over the threshold's square: an even spread has 1/3, noise
    /// of half the threshold 1/5.
    FULLEST: f64 = 0.25, Trial(0.25, 0.25);
}

/// The whole method.
///
/// # Errors
/// `monitor` cancelled the work, or the cloud has more points than can be indexed.
pub fn segment(
    cloud: &PointCloud,
    parameters: &Parameters,
    monitor: &dyn Monitor,
) -> Result<Segmentation, SegmentError> {
    let points = &cloud.points;
    let mut found = find(points, parameters, monitor)?;
    monitor.check()?;
    if parameters.merge {
        monitor.progress(Stage::Merge, 0.8);
        merge(&mut found, points, parameters.algebraic_threshold, monitor);
    }
    monitor.check()?;
    if parameters.refine {
        monitor.progress(Stage::Refine, 0.85);
        refine(&mut found, points, parameters, monitor);
    }
    monitor.check()?;
    monitor.progress(Stage::Report, 0.95);
    let report = report(found, points, parameters, monitor);
    monitor.check()?;
    Ok(report)
}

/// Extracts regions until the points are exhausted or too many seed points in a row fail.
fn find(
    points: &[Vec3],
    parameters: &Parameters,
    monitor: &dyn Monitor,
) -> Result<Found, SegmentError> {
    let mut pool = Pool::new(points)?;
    let mut random = SplitMix64::new(parameters.seed);
    let growth = Growth {
        criterion: RcondBelow(parameters.rcond_threshold),
        scale: Frame::of(points.iter().copied()).scale,
    };
    let mut found = Found { labels: vec![-1; points.len()], ..Found::default() };
    let mut failed = 0;
    while failed < parameters.max_failed_seeds
        && found.surfaces.len() < parameters.max_regions
        && pool.available().len() >= parameters.min_points
    {
        monitor.check()?;
        let left = pool.available().len() as f64 / points.len() as f64;
        monitor.progress(Stage::Grow, 0.8 * (1.0 - left));
        let (seeds, best) =
            compete(&pool, &growth, &mut random, parameters.algebraic_threshold, monitor);
        monitor.check()?;
        found.counters.trials += seeds;
        match best.and_then(|candidate| extract_region(&pool, &candidate, parameters, monitor)) {
            Some(extracted) => {
                monitor.check()?;
                found.accept(&pool, &extracted);
                pool.take(&extracted.members)?;
                failed = 0;
            }
            None => {
                found.counters.failed_trials += seeds;
                failed += seeds;
            }
        }
    }
    Ok(found)
}

/// Grows a region from each of several seed points; how many, and the best of them.
fn compete(
    pool: &Pool,
    growth: &Growth,
    random: &mut SplitMix64,
    threshold: f64,
    monitor: &dyn Monitor,
) -> (usize, Option<Candidate>) {
    let (mut seeds, mut grown, mut best) = (0, 0, None::<Candidate>);
    while seeds < COMPETITORS.get() && grown <= MOST_GROWN.get() * pool.available().len() {
        let Some(&seed) = random.pick(pool.available()) else { break };
        seeds += 1;
        let region = growth.grow(pool, seed, &|| monitor.cancelled());
        if monitor.cancelled() {
            break;
        }
        grown += region.region.members().len();
        let candidate = Candidate::of(region, pool, threshold, monitor);
        if candidate.as_ref().map(|c| c.support) > best.as_ref().map(|c| c.support) {
            best = candidate;
        }
    }
    (seeds, best)
}

/// Extracts the candidate's points from the cloud, after a look at what comes out: `None` where they
/// are too few, where their surface is imaginary or a pair of crossing planes, and where their
/// residuals fill the threshold evenly, as those of points that merely lie about do.
fn extract_region(
    pool: &Pool,
    candidate: &Candidate,
    parameters: &Parameters,
    monitor: &dyn Monitor,
) -> Option<Extracted> {
    let extracted = extract(pool, candidate, parameters.algebraic_threshold, monitor)?;
    let surface = &extracted.surface;
    let real = recover(&surface.quadric, &surface.frame, Tolerance::default()).is_some();
    let threshold = parameters.algebraic_threshold;
    let fits = surface.mean_sq_residual() <= FULLEST.get() * threshold * threshold;
    (real && fits && extracted.members.len() >= parameters.min_points).then_some(extracted)
}
