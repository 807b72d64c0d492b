//! Parts of a job that other processes work on.

use bytes::Bytes;

use super::{Blob, Control, StoreError};

/// What comes of parts of a job that are given to whoever has time, this process among them.
///
/// Whatever is kept for them is forgotten with this.
pub trait Parts: Send + Sync {
    /// Keeps what one part is about.
    ///
    /// # Errors
    /// The store is away or full.
    fn keep(&self, part: Bytes) -> Result<Blob, StoreError>;

    /// Has every part worked on by one guide, and gives `take` what comes of each, in any order.
    ///
    /// # Errors
    /// The store is away or full, a part cannot be worked on, or `control` stops the job.
    fn each(
        &self,
        guide: Bytes,
        parts: &[Blob],
        control: &Control,
        take: &mut dyn FnMut(usize, Bytes) -> Result<(), PartsError>,
    ) -> Result<(), PartsError>;
}

/// Why parts of a job were not worked on.
#[derive(Debug, thiserror::Error)]
pub enum PartsError {
    /// The store fails.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// A part cannot be worked on.
    #[error("part {part} of the cloud cannot be worked on: {why}")]
    Failed {
        /// Which, from nought on.
        part: usize,
        /// Why.
        why: String,
    },
    /// The job is to stop.
    #[error("the job was stopped")]
    Stopped,
}
