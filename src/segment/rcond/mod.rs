//! The seed's method: Figure 1, step by step.

mod candidate;
mod extract;
mod merge;
mod refine;
mod surface;

use candidate::Candidate;
use extract::{Extracted, extract};
use merge::merge;
use refine::refine;
pub use surface::DirectSurface;

use super::random::SplitMix64;
use super::{Counters, Monitor, Parameters, SegmentError, Stage};
use crate::geometry::{Frame, Tolerance, Vec3, recover};
use crate::grow::{Growth, Pool, RcondBelow};

/// How many seed points compete for each region. The seed draws one, and asks in its last sentence what
/// to do when it lies badly.
const COMPETITORS: usize = 8;

/// The regions found, in the order they were extracted.
#[derive(Default)]
pub struct Found {
    /// Each region's surface.
    pub surfaces: Vec<DirectSurface>,
    /// Each point's region, -1 = none.
    pub labels: Vec<i32>,
    /// How much work it was.
    pub counters: Counters,
}

/// Finds regions until the points are exhausted or too many trials in a row fail.
pub fn find(
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
        found.counters.trials += 1;
        match trial(&pool, &growth, &mut random, parameters) {
            Some((extracted, strategies)) => {
                found.accept(&pool, &extracted, strategies);
                pool.take(&extracted.members)?;
                failed = 0;
            }
            None => {
                found.counters.failed_trials += 1;
                failed += 1;
            }
        }
    }
    monitor.check()?;
    if parameters.merge {
        monitor.progress(Stage::Merge, 0.8);
        merge(&mut found, points, parameters.algebraic_threshold);
    }
    if parameters.refine {
        monitor.progress(Stage::Refine, 0.85);
        refine(&mut found, points, parameters.algebraic_threshold, parameters.min_points);
    }
    Ok(found)
}

/// One region: seeds, growth, fit, the best candidate, its extraction.
fn trial(
    pool: &Pool,
    growth: &Growth,
    random: &mut SplitMix64,
    parameters: &Parameters,
) -> Option<(Extracted, [usize; 3])> {
    let threshold = parameters.algebraic_threshold;
    let seeds: Vec<u32> =
        (0..COMPETITORS).filter_map(|_| random.pick(pool.available()).copied()).collect();
    let best = seeds
        .iter()
        .filter_map(|&seed| Candidate::grow(growth, pool, seed, threshold))
        .max_by(|a, b| a.support.total_cmp(&b.support))?;
    let extracted = extract(pool, &best.surface, best.grown.region.members(), threshold)?;
    let surface = &extracted.surface;
    let real = recover(&surface.quadric, &surface.frame, Tolerance::default()).is_some();
    (real && extracted.members.len() >= parameters.min_points)
        .then_some((extracted, best.grown.strategies))
}

impl Found {
    fn accept(&mut self, pool: &Pool, extracted: &Extracted, strategies: [usize; 3]) {
        let label = self.surfaces.len() as i32;
        for &i in &extracted.members {
            self.labels[pool.cloud_index(i) as usize] = label;
        }
        self.surfaces.push(extracted.surface);
        self.counters.extraction_cycles.push(extracted.cycles.clone());
        let total = self.counters.strategies.get_or_insert([0; 3]);
        total.iter_mut().zip(strategies).for_each(|(t, s)| *t += s);
    }

    /// Each region's points, in the cloud's order.
    fn members(&self, points: &[Vec3]) -> Vec<Vec<Vec3>> {
        let mut members = vec![Vec::new(); self.surfaces.len()];
        for (point, &label) in points.iter().zip(&self.labels) {
            if let Some(of_region) = usize::try_from(label).ok().and_then(|l| members.get_mut(l)) {
                of_region.push(*point);
            }
        }
        members
    }

    /// Takes `fitted` as the surfaces; regions without one are dropped and the labels closed up.
    /// True where a region was dropped.
    fn keep(&mut self, fitted: Vec<Option<DirectSurface>>) -> bool {
        let mut next = 0;
        let new_label: Vec<i32> = fitted
            .iter()
            .map(|s| {
                if s.is_some() {
                    next += 1;
                    next - 1
                } else {
                    -1
                }
            })
            .collect();
        let dropped = next < fitted.len() as i32;
        self.surfaces = fitted.into_iter().flatten().collect();
        self.map_labels(|label| new_label[label]);
        dropped
    }

    fn relabel_merged(&mut self, kept: usize, gone: usize) {
        self.map_labels(|label| {
            let label = if label == gone { kept } else { label };
            (if label > gone { label - 1 } else { label }) as i32
        });
    }

    fn map_labels(&mut self, new_label: impl Fn(usize) -> i32) {
        for label in &mut self.labels {
            if let Ok(old) = usize::try_from(*label) {
                *label = new_label(old);
            }
        }
    }
}
