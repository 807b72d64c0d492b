use super::strategy::Reseed;
use super::{Pool, Region};

/// How many points before the marker.
const BEFORE: usize = 5;

/// Strategy 3: near the marker, the point added five before it under the current seed; the first one
/// where fewer were added.
pub struct NearMarker;

impl Reseed for NearMarker {
    fn next_seed(&self, _: &Pool, region: &Region, _: u32) -> Option<u32> {
        let points = region.current();
        points.get(points.len().saturating_sub(BEFORE)).copied()
    }
}
