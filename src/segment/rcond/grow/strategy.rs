use super::{Pool, Region};

/// Where growth goes on after a marker point: a point that would have lifted rcond over the
/// threshold.
pub trait Reseed: Sync {
    /// The new seed point, one of the region's; `None` where it has no points.
    fn next_seed(&self, pool: &Pool, region: &Region, marker: u32) -> Option<u32>;
}

/// The place in `points` of the one farthest from `marker`, the first of equals.
pub(super) fn farthest_from(pool: &Pool, points: &[u32], marker: u32) -> Option<usize> {
    let sq_dist = |i: u32| (pool.point(i) - pool.point(marker)).norm_squared();
    (0..points.len()).rev().max_by(|&a, &b| sq_dist(points[a]).total_cmp(&sq_dist(points[b])))
}
