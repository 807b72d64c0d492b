use super::strategy::{Reseed, farthest_from};
use super::{Pool, Region};

/// Strategy 1: the point half way, by order of insertion, between the marker and the point farthest
/// from it, among those added under the current seed.
///
/// With the marker the n-th and the farthest the m-th point, the new seed is number (m + n)/2,
/// rounded.
pub struct Halfway;

impl Reseed for Halfway {
    fn next_seed(&self, pool: &Pool, region: &Region, marker: u32) -> Option<u32> {
        let points = region.current();
        let m = farthest_from(pool, points, marker)? + 1;
        let n = points.len() + 1;
        // Rounding may name the marker itself; the point before it stands in.
        let middle = (m + n).div_ceil(2).min(points.len());
        Some(points[middle - 1])
    }
}
