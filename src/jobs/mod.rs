//! Running segmentations: the pool of threads and its bounded queue, what controls one run, and the
//! jobs that outlive their request, in memory or on disk behind one trait.
//!
//! Here alone rayon meets tokio.

mod book;
mod budget;
mod control;
mod disk;
mod job;
mod nats;
mod parts;
mod pool;
mod record;
mod register;
mod store;
mod tally;
pub mod trace;

pub use book::{Book, BookConfig, Keeping, Runner, SubmitError, Work};
pub use budget::{ByteBudget, BytesHeld};
pub use control::{CancelOnDrop, Control, Progress, Stop};
pub use disk::DiskStore;
pub use job::{Ending, Job, JobView, Outcome};
pub use nats::{Blob, Nats, NatsConfig, NatsError, NatsStorage};
pub use parts::{Parts, PartsError};
pub use pool::{Lane, Overloaded, Place, Pool, PoolConfig, PoolError};
pub use record::{Fault, IdempotencyKey, JobRecord, JobState, Submission};
pub use store::{MemoryStore, Store, StoreError};
pub use tally::KeyShare;
