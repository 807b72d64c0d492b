use super::strategy::Reseed;
use super::{Pool, Region};
use crate::fit::constant::constants;

constants! {
    /// How many points before the marker.
    BEFORE: usize = 5, Trial(5.0, 5.0);
}

/// Strategy 3: near the marker, the point added five before it under the current seed; the first one
/// where fewer were added.
pub struct NearMarker;

impl Reseed for NearMarker {
    fn next_seed(&self, _: &Pool, region: &Region, _: u32) -> Option<u32> {
        let points = region.current();
        points.get(points.len().saturating_sub(BEFORE.get())).copied()
    }
}
