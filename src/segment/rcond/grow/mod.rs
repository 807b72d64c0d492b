//! Growing one region from a seed point (the seed's section 3.1): the pool of points, the region,
//! the criterion, and the strategies by which growth goes on.

mod criterion;
mod farthest;
pub mod growth;
mod halfway;
pub mod near_marker;
pub mod neighbours;
mod pool;
pub mod region;
mod strategy;
#[cfg(test)]
mod tests;

pub use criterion::RcondBelow;
pub use farthest::Farthest;
pub use growth::{Grown, Growth};
pub use halfway::Halfway;
pub use near_marker::NearMarker;
pub use neighbours::Neighbours;
pub use pool::{Pool, PoolError};
pub use region::Region;
pub use strategy::Reseed;
