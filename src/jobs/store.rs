use std::{
    collections::HashMap,
    fmt::Debug,
    sync::{Mutex, MutexGuard, PoisonError},
};

use bytes::Bytes;
use uuid::Uuid;

use super::JobRecord;

#[cfg(test)]
pub mod tests;

/// Why a store cannot do what it is asked.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum StoreError {
    /// Another process has the database open.
    #[error("the job database is in use by another process")]
    InUse,
    /// The disk or its quota is full.
    #[error("the disk has no room for the job database: {0}")]
    Full(String),
    /// The database or its file fails.
    #[error("the job database fails: {0}")]
    Failed(String),
    /// The servers that keep the jobs cannot be reached; they are waited for as long as it takes.
    #[error("the servers that keep the jobs cannot be reached: {0}")]
    Away(String),
    /// Another process has ended the job, as this record says, or forgotten it.
    #[error("another process has ended the job")]
    Ended(Option<Box<JobRecord>>),
    /// What is kept is not what was written.
    #[error("the {part} of job {id} is damaged")]
    Damaged {
        /// Record, input or result.
        part: &'static str,
        /// The job.
        id: Uuid,
    },
    /// What must be there is not.
    #[error("the {part} of job {id} is missing")]
    Missing {
        /// Input or result.
        part: &'static str,
        /// The job.
        id: Uuid,
    },
    /// The service ends before there is an answer.
    #[error("the service is shutting down")]
    Closed,
}

impl StoreError {
    /// Whether the same call may succeed later.
    pub fn may_pass(&self) -> bool {
        matches!(self, Self::Full(_) | Self::Failed(_) | Self::Away(_))
    }

    /// Whether the call is to be tried again as long as it takes.
    pub fn is_waited_for(&self) -> bool {
        matches!(self, Self::Full(_) | Self::Away(_))
    }
}

/// Where jobs are kept: their records, inputs and results. Calls may block on a disk.
pub trait Store: Send + Sync + Debug {
    /// Whether jobs outlive the process.
    fn durable(&self) -> bool;
    /// Keeps a new job.
    ///
    /// # Errors
    /// The store fails; then nothing is kept, or what is kept goes with the next change.
    fn insert(&self, record: &JobRecord, input: Bytes) -> Result<(), StoreError>;
    /// Notes that the job of `record` begins to run: should the process end before [`Self::leave`], the
    /// record that the next one finds counts a crash. The note need not outlive a loss of power, which
    /// is no job's doing.
    ///
    /// # Errors
    /// The store fails.
    fn begin(&self, _record: &JobRecord) -> Result<(), StoreError> {
        Ok(())
    }
    /// The job does not run any more.
    fn leave(&self, _id: Uuid) {}
    /// The process is told to end: from now on its end is no job's doing.
    fn close(&self) {}
    /// Keeps a job's end and its result, both or neither.
    ///
    /// # Errors
    /// The store fails, or another process was faster: [`StoreError::Ended`].
    fn finish(&self, record: &JobRecord, result: Option<Bytes>) -> Result<(), StoreError>;
    /// Forgets a job.
    ///
    /// # Errors
    /// The store fails.
    fn remove(&self, id: Uuid) -> Result<(), StoreError>;
    /// Every job kept, in the order of acceptance, without those whose record is damaged.
    ///
    /// # Errors
    /// The store fails.
    fn records(&self) -> Result<Vec<JobRecord>, StoreError>;
    /// A job's input.
    ///
    /// # Errors
    /// The store fails, or the input is not what was written.
    fn input(&self, id: Uuid) -> Result<Option<Bytes>, StoreError>;
    /// A job's result.
    ///
    /// # Errors
    /// The store fails, or the result is not what was written.
    fn result(&self, id: Uuid) -> Result<Option<Bytes>, StoreError>;
    /// Tries whether a job could be kept now.
    ///
    /// # Errors
    /// It could not.
    fn probe(&self) -> Result<(), StoreError> {
        Ok(())
    }
}

/// Keeps jobs in memory; they end with the process.
#[derive(Debug, Default)]
pub struct MemoryStore {
    kept: Mutex<HashMap<Uuid, Kept>>,
}

#[derive(Debug)]
struct Kept {
    record: JobRecord,
    input: Bytes,
    result: Option<Bytes>,
}

impl MemoryStore {
    fn kept(&self) -> MutexGuard<'_, HashMap<Uuid, Kept>> {
        self.kept.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Store for MemoryStore {
    fn durable(&self) -> bool {
        false
    }

    fn insert(&self, record: &JobRecord, input: Bytes) -> Result<(), StoreError> {
        let kept = Kept { record: record.clone(), input, result: None };
        self.kept().insert(record.id, kept);
        Ok(())
    }

    fn finish(&self, record: &JobRecord, result: Option<Bytes>) -> Result<(), StoreError> {
        if let Some(kept) = self.kept().get_mut(&record.id) {
            kept.record = record.clone();
            kept.result = result;
        }
        Ok(())
    }

    fn remove(&self, id: Uuid) -> Result<(), StoreError> {
        self.kept().remove(&id);
        Ok(())
    }

    fn records(&self) -> Result<Vec<JobRecord>, StoreError> {
        let mut records: Vec<_> = self.kept().values().map(|kept| kept.record.clone()).collect();
        records.sort_by_key(|record| record.id);
        Ok(records)
    }

    fn input(&self, id: Uuid) -> Result<Option<Bytes>, StoreError> {
        Ok(self.kept().get(&id).map(|kept| kept.input.clone()))
    }

    fn result(&self, id: Uuid) -> Result<Option<Bytes>, StoreError> {
        Ok(self.kept().get(&id).and_then(|kept| kept.result.clone()))
    }
}
