//! The records of jobs: one key each, changed only on what is known of it.

use async_nats::jetstream::kv;
use serde::{Deserialize, Serialize};
use uuid::Uuid;

use super::{
    blobs::Blob,
    trouble::{told, trouble},
};
use crate::jobs::{JobRecord, JobState, StoreError};

/// All that is kept of a job beside its blobs.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Kept {
    /// The job.
    pub record: JobRecord,
    /// Its cloud.
    pub input: Blob,
    /// Its result.
    pub result: Option<Blob>,
    /// The process that runs it.
    pub worker: Option<Uuid>,
}

impl Kept {
    /// What the text of a record says.
    pub fn of(text: &[u8]) -> Option<Self> {
        serde_json::from_slice(text).ok()
    }

    /// The same job, waiting for a worker again.
    pub fn released(&self) -> Self {
        let mut new = self.clone();
        (new.record.state, new.record.started_ms) = (JobState::Queued, None);
        new.worker = None;
        new
    }

    fn text(&self) -> Result<bytes::Bytes, StoreError> {
        let text = serde_json::to_vec(self);
        text.map(Into::into).map_err(|error| StoreError::Failed(error.to_string()))
    }
}

/// The bucket of the records.
#[derive(Clone, Debug)]
pub struct Records {
    bucket: kv::Store,
}

impl Records {
    /// The records in a bucket.
    pub fn new(bucket: kv::Store) -> Self {
        Self { bucket }
    }

    /// The bucket.
    pub fn bucket(&self) -> &kv::Store {
        &self.bucket
    }

    /// Keeps the record of a new job.
    ///
    /// # Errors
    /// The servers are away or full.
    pub async fn create(&self, kept: &Kept) -> Result<(), StoreError> {
        match self.bucket.create(key(kept.record.id), kept.text()?).await {
            Ok(_) => Ok(()),
            // names are never given twice: an earlier try has come through
            Err(error) if error.kind() == kv::CreateErrorKind::AlreadyExists => Ok(()),
            Err(error) => Err(trouble(error)),
        }
    }

    /// What is kept of a job, and the revision of that.
    ///
    /// # Errors
    /// The servers are away, or the record is damaged.
    pub async fn get(&self, id: Uuid) -> Result<Option<(Kept, u64)>, StoreError> {
        let entry = self.bucket.entry(key(id)).await.map_err(trouble)?;
        let Some(entry) = entry.filter(|entry| entry.operation == kv::Operation::Put) else {
            return Ok(None);
        };
        let damaged = StoreError::Damaged { part: "record", id };
        let kept = Kept::of(&entry.value).ok_or(damaged)?;
        Ok(Some((kept, entry.revision)))
    }

    /// Changes what is kept of a job, on what it is at that very moment; `edit` gives nothing where it
    /// is to stay as it is. Returns what is kept then.
    ///
    /// # Errors
    /// [`StoreError::Ended`] where the job is forgotten; `edit` refuses; the servers are away.
    pub async fn change(
        &self,
        id: Uuid,
        edit: impl Fn(&Kept) -> Result<Option<Kept>, StoreError>,
    ) -> Result<Kept, StoreError> {
        loop {
            let (kept, revision) = self.get(id).await?.ok_or(StoreError::Ended(None))?;
            let Some(new) = edit(&kept)? else { return Ok(kept) };
            match self.bucket.update(key(id), new.text()?, revision).await {
                Ok(_) => return Ok(new),
                // somebody was faster, or an earlier try of this one
                Err(error) if error.kind() == kv::UpdateErrorKind::WrongLastRevision => {}
                Err(error) => return Err(trouble(error)),
            }
        }
    }

    /// Forgets a job of which nothing has changed since that revision; `false` where something has. One that
    /// arrives late, when its sender has given it up, finds another revision where the job was taken up since.
    ///
    /// # Errors
    /// The servers are away.
    pub async fn delete(&self, id: Uuid, revision: u64) -> Result<bool, StoreError> {
        // a purge does the same here, and leaves those who watch the bucket standing on servers of the 2.9 line
        match self.bucket.delete_expect_revision(key(id), Some(revision)).await {
            Ok(()) => Ok(true),
            Err(error) if error.kind() == kv::UpdateErrorKind::WrongLastRevision => Ok(false),
            // not every error keeps its kind
            Err(error) if told(&error).contains("wrong last sequence") => Ok(false),
            Err(error) => Err(trouble(error)),
        }
    }
}

/// The key of a job.
fn key(id: Uuid) -> String {
    id.to_string()
}
