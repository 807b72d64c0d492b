use super::{Farthest, Halfway, NearMarker, Neighbours, Pool, RcondBelow, Region, Reseed};
use crate::fit::Condition;
use crate::fit::constant::constants;
use crate::geometry::Frame;

/// The seed's strategies in the order they are tried.
const STRATEGIES: [&dyn Reseed; 3] = [&Halfway, &Farthest, &NearMarker];

constants! {
    /// A new seed must enlarge the region by this share to count as progress. It bounds how often a
    /// region of n points is walked through to O(log n); the points it brought are kept either way.
    PROGRESS: f64 = 0.02, Effort("walks through one region");
}

/// Points that join between two looks at whether to stop.
const WATCHED: usize = 256;

/// How one region is grown (the seed's section 3.1).
#[derive(Clone, Copy, Debug)]
pub struct Growth {
    /// When a point may join.
    pub criterion: RcondBelow,
    /// The length that sums are kept in: about the size of a region.
    pub scale: f64,
}

/// A grown region and how it came about.
pub struct Grown {
    /// The region.
    pub region: Region,
    /// How often each strategy led on, in the seed's order.
    pub strategies: [usize; 3],
}

impl Growth {
    /// Grows a region from `seed` until no strategy leads on, or `stopped` says to leave off, which it is asked
    /// for each few points.
    pub fn grow(&self, pool: &Pool, seed: u32, stopped: &dyn Fn() -> bool) -> Grown {
        let frame = Frame { origin: *pool.point(seed), scale: self.scale };
        let mut region = Region::new(pool, Condition::new(frame));
        let mut strategies = [0; 3];
        let mut marker = self.extend(pool, &mut region, seed, stopped);
        let mut next = 0;
        while let (Some(at), Some(strategy)) = (marker, STRATEGIES.get(next)) {
            let Some(seed) = strategy.next_seed(pool, &region, at) else { break };
            if stopped() {
                break;
            }
            let (before, start) = (region.members().len(), region.seed_start());
            region.begin_seed();
            let new_marker = self.extend(pool, &mut region, seed, stopped);
            let added = region.members().len() - before;
            if added == 0 {
                region.return_to_seed(start);
            } else {
                marker = new_marker;
            }
            if added as f64 > PROGRESS.get() * before as f64 {
                strategies[next] += 1;
                next = 0;
            } else {
                next += 1;
            }
        }
        Grown { region, strategies }
    }

    /// Adds the neighbours of `seed` in order until one is refused: the marker. `None` where the
    /// pool is exhausted first, or the growth stopped.
    fn extend(
        &self,
        pool: &Pool,
        region: &mut Region,
        seed: u32,
        stopped: &dyn Fn() -> bool,
    ) -> Option<u32> {
        let mut neighbours = Neighbours::new(pool, *pool.point(seed));
        loop {
            if region.members().len().is_multiple_of(WATCHED) && stopped() {
                return None;
            }
            let index = neighbours.next_where(|i| pool.is_available(i) && !region.contains(i))?;
            let condition = region.condition().with(pool.point(index));
            if !self.criterion.accepts(&condition) {
                return Some(index);
            }
            region.add(index, condition);
        }
    }
}
