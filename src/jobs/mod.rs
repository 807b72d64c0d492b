//! Running segmentations: the pool of threads, its bounded queue, and what controls one run.
//!
//! Here alone rayon meets tokio.

mod budget;
mod control;
mod pool;

pub use budget::{ByteBudget, BytesHeld};
pub use control::{CancelOnDrop, Control, Progress, StageTimes, Stop};
pub use pool::{Lane, Overloaded, Place, Pool, PoolConfig, PoolError};
