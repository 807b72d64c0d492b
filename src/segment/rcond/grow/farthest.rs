use super::strategy::{Reseed, farthest_from};
use super::{Pool, Region};

/// Strategy 2: the point of the whole region that is farthest from the marker.
pub struct Farthest;

impl Reseed for Farthest {
    fn next_seed(&self, pool: &Pool, region: &Region, marker: u32) -> Option<u32> {
        farthest_from(pool, region.members(), marker).map(|i| region.members()[i])
    }
}
