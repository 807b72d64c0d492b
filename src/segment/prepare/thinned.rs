//! A cloud thinned again and again, seen at the same sites.

use rayon::prelude::*;

use crate::fit::constant::constants;
use crate::geometry::Vec3;
use crate::segment::Monitor;
use crate::segment::prepare::closest::MANY;
use crate::segment::prepare::nearest::Runs;
use crate::segment::prepare::patch::Patch;
use crate::segment::random::SplitMix64;

constants! {
    /// Sites looked at, most; no more than twice as many as there are patches beside each other.
    SITES: usize = 1_000, Effort("sites whose patches are looked at");
    /// Points that the first level has at most: a surface of a thousandth of a larger cloud still has two patches.
    MOST: usize = 320_000, Effort("points of the first level");
    /// How much thinner each level is than the last, in powers of two.
    BITS: usize = 2, Derived("spacing doubles from level to level");
    /// Points that a level has at least.
    LEAST: usize = 96, Derived("four patches of 24");
}

/// Sites between two looks at whether the work was cancelled.
const WATCHED: usize = 64;

/// A cloud thinned at random, again and again. At random, as rows and grids taken evenly would make other rows.
pub struct Thinned<'a> {
    points: &'a [Vec3],
    /// The thinning of the first level, in powers of two.
    first: u32,
    monitor: &'a dyn Monitor,
}

impl<'a> Thinned<'a> {
    /// `points` in Morton order.
    pub fn of(points: &'a [Vec3], monitor: &'a dyn Monitor) -> Self {
        let first = (points.len() as f64 / MOST.get() as f64).log2().ceil().max(0.0) as u32;
        Self { points, first, monitor }
    }

    /// The patches of a level at the sites, in Morton order; `None` where the level has too few points.
    pub fn level(&self, level: u32) -> Option<Vec<Option<Patch>>> {
        let kept = self.kept(self.first + BITS.get() as u32 * level);
        if kept.len() < LEAST.get().max(MANY) {
            return None;
        }
        let points: Vec<Vec3> = kept.iter().map(|&i| self.points[i as usize]).collect();
        let runs = Runs::of(&points);
        let sites = (2 * self.points.len() / MANY).clamp(1, SITES.get());
        let at = |k: usize| k * self.points.len() / sites;
        let patch = |k: usize| {
            if k.is_multiple_of(WATCHED) && self.monitor.cancelled() {
                return None;
            }
            let site = at(k);
            let p = self.points[site];
            let after = kept.partition_point(|i| (*i as usize) < site);
            let near = runs.closest(&p, after);
            let q: [Vec3; MANY] = std::array::from_fn(|k| points[near.places()[k] as usize] - p);
            Patch::of(&q)
        };
        Some((0..sites).into_par_iter().with_min_len(16).map(patch).collect())
    }

    /// The points of which one in 2^`bits` is kept.
    fn kept(&self, bits: u32) -> Vec<u32> {
        let stays = |i: &u32| SplitMix64::new(u64::from(*i)).next_u64().trailing_zeros() >= bits;
        (0..self.points.len() as u32).into_par_iter().with_min_len(4096).filter(stays).collect()
    }
}
