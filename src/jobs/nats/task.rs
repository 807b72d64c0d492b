//! A part of a job in the queue.

use serde::{Deserialize, Serialize};
use uuid::Uuid;

use super::blobs::Blob;
use crate::answer::BUILD;

/// The lane of the tasks, as a part of their subject.
pub const PARTS_LANE: &str = "tile";

/// A part of a job that is to be worked on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Task {
    /// The job.
    pub job: Uuid,
    /// How often parts of it were worked on before.
    pub round: u32,
    /// Which part.
    pub part: usize,
    /// The build that made the guide, which others may not be able to follow.
    pub build: String,
    /// By what.
    pub guide: Blob,
    /// What it is about.
    pub points: Blob,
}

impl Task {
    /// Its name in the queue.
    pub(super) fn name(&self) -> String {
        format!("{}-{}-{}", self.job, self.round, self.part)
    }

    /// Whether this build can work on it.
    pub fn is_of_this_build(&self) -> bool {
        self.build == BUILD
    }
}
