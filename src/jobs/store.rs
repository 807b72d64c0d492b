use std::{
    collections::HashMap,
    fmt::Debug,
    sync::{Mutex, MutexGuard, PoisonError},
};

use bytes::Bytes;
use uuid::Uuid;

use super::JobRecord;

/// A store that fails.
#[derive(Debug, thiserror::Error)]
pub enum StoreError {
    /// Another process has the database open.
    #[error("the job database is in use by another process")]
    InUse,
    /// The database fails.
    #[error("the job database fails: {0}")]
    Database(#[from] Box<redb::Error>),
    /// A record cannot be read or written.
    #[error("a job record is damaged: {0}")]
    Record(#[from] serde_json::Error),
}

/// Where jobs are kept: their records, inputs and results. Calls may block on a disk.
pub trait Store: Send + Sync + Debug {
    /// Whether jobs outlive the process.
    fn durable(&self) -> bool;
    /// Keeps a new job.
    ///
    /// # Errors
    /// The store fails; then nothing is kept.
    fn insert(&self, record: &JobRecord, input: Bytes) -> Result<(), StoreError>;
    /// Keeps a job's end and its result, both or neither.
    ///
    /// # Errors
    /// The store fails.
    fn finish(&self, record: &JobRecord, result: Option<Bytes>) -> Result<(), StoreError>;
    /// Forgets a job.
    ///
    /// # Errors
    /// The store fails.
    fn remove(&self, id: Uuid) -> Result<(), StoreError>;
    /// Every job kept, in the order of acceptance.
    ///
    /// # Errors
    /// The store fails.
    fn records(&self) -> Result<Vec<JobRecord>, StoreError>;
    /// A job's input.
    ///
    /// # Errors
    /// The store fails.
    fn input(&self, id: Uuid) -> Result<Option<Bytes>, StoreError>;
    /// A job's result.
    ///
    /// # Errors
    /// The store fails.
    fn result(&self, id: Uuid) -> Result<Option<Bytes>, StoreError>;
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
