use std::path::Path;

use bytes::Bytes;
use redb::{
    Database, DatabaseError, ReadableDatabase, ReadableTable, TableDefinition, WriteTransaction,
};
use uuid::Uuid;

use super::{JobRecord, Store, StoreError};

const RECORDS: TableDefinition<'_, u128, &[u8]> = TableDefinition::new("records");
const INPUTS: TableDefinition<'_, u128, &[u8]> = TableDefinition::new("inputs");
const RESULTS: TableDefinition<'_, u128, &[u8]> = TableDefinition::new("results");

/// Keeps jobs in one database file; what was accepted survives the end of the process, however
/// sudden. Every call that changes something returns only when the change is on the disk.
#[derive(Debug)]
pub struct DiskStore {
    database: Database,
}

/// The tables within one transaction.
struct Tables<'t> {
    records: redb::Table<'t, u128, &'static [u8]>,
    inputs: redb::Table<'t, u128, &'static [u8]>,
    results: redb::Table<'t, u128, &'static [u8]>,
}

impl<'t> Tables<'t> {
    fn open(transaction: &'t WriteTransaction) -> Result<Self, redb::Error> {
        Ok(Self {
            records: transaction.open_table(RECORDS)?,
            inputs: transaction.open_table(INPUTS)?,
            results: transaction.open_table(RESULTS)?,
        })
    }
}

fn failed(error: impl Into<redb::Error>) -> StoreError {
    StoreError::Failed(error.into().to_string())
}

impl DiskStore {
    /// Opens the database at `path`, or makes it; it keeps up to `cache` bytes of the file in memory.
    ///
    /// # Errors
    /// The file cannot be used, is no database, or is in use by another process.
    pub fn open(path: &Path, cache: usize) -> Result<Self, StoreError> {
        let database = Database::builder().set_cache_size(cache).create(path);
        let database = database.map_err(|error| match error {
            DatabaseError::DatabaseAlreadyOpen => StoreError::InUse,
            other => failed(other),
        })?;
        let store = Self { database };
        // tables come to be when they are opened for writing; reading needs them all
        store.change(|_| Ok(()))?;
        Ok(store)
    }

    /// One transaction over the three tables.
    fn change(
        &self,
        edit: impl FnOnce(&mut Tables<'_>) -> Result<(), redb::Error>,
    ) -> Result<(), StoreError> {
        let transaction = self.database.begin_write().map_err(failed)?;
        let tables = Tables::open(&transaction);
        tables.and_then(|mut tables| edit(&mut tables)).map_err(failed)?;
        transaction.commit().map_err(failed)
    }

    fn read(
        &self,
        table: TableDefinition<'_, u128, &'static [u8]>,
        id: Uuid,
    ) -> Result<Option<Bytes>, StoreError> {
        let transaction = self.database.begin_read().map_err(failed)?;
        let table = transaction.open_table(table).map_err(failed)?;
        let value = table.get(id.as_u128()).map_err(failed)?;
        Ok(value.map(|value| Bytes::copy_from_slice(value.value())))
    }
}

impl Store for DiskStore {
    fn durable(&self) -> bool {
        true
    }

    fn insert(&self, record: &JobRecord, input: Bytes) -> Result<(), StoreError> {
        let (id, text) = (record.id.as_u128(), serde_json::to_vec(record).map_err(|e| StoreError::Failed(e.to_string()))?);
        self.change(|tables| {
            tables.records.insert(id, text.as_slice())?;
            tables.inputs.insert(id, input.as_ref())?;
            Ok(())
        })
    }

    fn finish(&self, record: &JobRecord, result: Option<Bytes>) -> Result<(), StoreError> {
        let (id, text) = (record.id.as_u128(), serde_json::to_vec(record).map_err(|e| StoreError::Failed(e.to_string()))?);
        self.change(|tables| {
            tables.records.insert(id, text.as_slice())?;
            if let Some(result) = &result {
                tables.results.insert(id, result.as_ref())?;
            }
            Ok(())
        })
    }

    fn remove(&self, id: Uuid) -> Result<(), StoreError> {
        let id = id.as_u128();
        self.change(|tables| {
            tables.records.remove(id)?;
            tables.inputs.remove(id)?;
            tables.results.remove(id)?;
            Ok(())
        })
    }

    fn records(&self) -> Result<Vec<JobRecord>, StoreError> {
        let transaction = self.database.begin_read().map_err(failed)?;
        let table = transaction.open_table(RECORDS).map_err(failed)?;
        let rows = table.iter().map_err(failed)?;
        rows.map(|row| {
            let (_, value) = row.map_err(failed)?;
            serde_json::from_slice(value.value()).map_err(|e| StoreError::Failed(e.to_string()))
        })
        .collect()
    }

    fn input(&self, id: Uuid) -> Result<Option<Bytes>, StoreError> {
        self.read(INPUTS, id)
    }

    fn result(&self, id: Uuid) -> Result<Option<Bytes>, StoreError> {
        self.read(RESULTS, id)
    }
}
