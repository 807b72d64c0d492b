//! Jobs in a database file: a handle that opens it again, rows that are known to be what was written.

use std::{
    collections::BTreeSet,
    path::Path,
    sync::{
        Mutex, MutexGuard, PoisonError,
        atomic::{AtomicBool, Ordering},
    },
};

use bytes::Bytes;
use redb::{Database, ReadableDatabase, ReadableTable, TableDefinition, WriteTransaction};
use uuid::Uuid;

use super::{JobRecord, Store, StoreError};
use file::DatabaseFile;
use handle::{Handle, Source, Trouble};
use room::Room;
use row::{INPUTS, RECORDS, RESULTS, Rows, record_in, record_of, text_of};
use running::Running;

mod file;
mod handle;
mod overlay;
mod room;
mod row;
mod running;
mod salvage;
#[cfg(test)]
mod tests;

/// Rows that are written to see whether there is room.
const PROBES: TableDefinition<'_, u128, &[u8]> = TableDefinition::new("probes");

/// Keeps jobs in one database file; what was accepted survives the end of the process, however
/// sudden. Every call that changes something returns only when the change is on the disk.
///
/// After an error of the file, or a panic of the database's library, the next call opens the database
/// again. Every row carries a digest, so that what was damaged is an error and never another answer.
#[derive(Debug)]
pub struct DiskStore {
    handle: Handle,
    running: Running,
    room: Room,
    // inserts that failed and may be there all the same
    unsure: Mutex<BTreeSet<u128>>,
}

/// The tables within one transaction.
struct Tables<'t> {
    records: redb::Table<'t, u128, &'static [u8]>,
    inputs: redb::Table<'t, u128, &'static [u8]>,
    results: redb::Table<'t, u128, &'static [u8]>,
}

impl<'t> Tables<'t> {
    fn open(transaction: &'t WriteTransaction) -> Result<Self, redb::TableError> {
        Ok(Self {
            records: transaction.open_table(RECORDS.table)?,
            inputs: transaction.open_table(INPUTS.table)?,
            results: transaction.open_table(RESULTS.table)?,
        })
    }

    fn remove(&mut self, id: u128) -> Result<(), redb::StorageError> {
        self.records.remove(id)?;
        self.inputs.remove(id)?;
        self.results.remove(id)?;
        Ok(())
    }
}

impl DiskStore {
    /// Opens the database at `path`, or makes it; it keeps up to `cache` bytes of the file in memory.
    ///
    /// # Errors
    /// The file cannot be used, is no database, or is in use by another process.
    pub fn open(path: &Path, cache: usize) -> Result<Self, StoreError> {
        let notes = path.with_extension("running");
        Self::new(DatabaseFile::new(path, cache), || {
            Running::open(&notes).map_err(|error| {
                StoreError::Failed(format!("{} cannot be used: {error}", notes.display()))
            })
        })
    }

    /// The store in the database of `source`, with the notes of what runs; they are opened once the
    /// database is this process's.
    fn new(
        source: impl Source + 'static,
        running: impl FnOnce() -> Result<Running, StoreError>,
    ) -> Result<Self, StoreError> {
        let handle = Handle::open(source)?;
        let (room, unsure) = (Room::default(), Mutex::default());
        let store = Self { handle, running: running()?, room, unsure };
        // tables come to be when they are opened for writing; reading needs them all
        store.change(0, |_| Ok(()))?;
        if let Err(error) = store.count_crashes() {
            // without them a job may be run once too often
            tracing::error!(%error, "the jobs that ran when the last process ended cannot be counted");
        }
        Ok(store)
    }

    /// Counts in its record the crash of each job that was at work when the last process ended.
    fn count_crashes(&self) -> Result<(), StoreError> {
        let mut crashed = Vec::new();
        for (id, crashes) in self.running.left().map_err(noted)? {
            let Ok(Some(text)) = self.read(RECORDS, id) else { continue };
            let Some(mut record) = record_of(&text) else { continue };
            // a note that was counted before is not counted again
            if !record.state.is_final() && record.crashes < crashes {
                record.crashes += 1;
                let text = text_of(&record)?;
                crashed.push((id.as_u128(), row::sealed(RECORDS, id.as_u128(), &text), text));
            }
        }
        let bytes = crashed.iter().map(|(_, _, text)| text.len() as u64).sum();
        if !crashed.is_empty() {
            self.change(bytes, |tables| {
                let mut rows = crashed.iter();
                rows.try_for_each(|(id, seal, text)| row::put(&mut tables.records, *id, seal, text))
            })?;
        }
        self.running.clear().map_err(noted)
    }

    fn unsure(&self) -> MutexGuard<'_, BTreeSet<u128>> {
        self.unsure.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// One transaction over the three tables, which writes about `bytes`; it may be tried twice.
    fn change(
        &self,
        bytes: u64,
        edit: impl Fn(&mut Tables<'_>) -> Result<(), redb::StorageError>,
    ) -> Result<(), StoreError> {
        self.handle.check()?;
        let unsure = self.unsure().clone();
        self.write(bytes, |database| {
            let transaction = database.begin_write().map_err(Trouble::of)?;
            let mut tables = Tables::open(&transaction).map_err(Trouble::of)?;
            unsure.iter().try_for_each(|id| tables.remove(*id)).map_err(Trouble::of)?;
            edit(&mut tables).map_err(Trouble::of)?;
            drop(tables);
            transaction.commit().map_err(Trouble::of)
        })?;
        self.unsure().retain(|id| !unsure.contains(id));
        Ok(())
    }

    /// A write, unless one has just failed.
    fn write(
        &self,
        bytes: u64,
        write: impl Fn(&Database) -> Result<(), Trouble>,
    ) -> Result<(), StoreError> {
        let done = self.handle.call(|database| {
            self.room.may_try().map_err(Trouble::apart)?;
            let done = write(database);
            if let Err(trouble) = &done
                && trouble.is_own()
            {
                // noted before others that wait for their turn try the same
                self.room.note(bytes, &Err(trouble.told()));
            }
            done
        });
        // a database that cannot be opened, and a panic, are seen here alone
        if !matches!(&done, Err(error) if !error.may_pass() || self.room.may_try().is_err()) {
            self.room.note(bytes, &done);
        }
        done
    }

    fn read(&self, rows: Rows, id: Uuid) -> Result<Option<Bytes>, StoreError> {
        let key = id.as_u128();
        self.handle.call(|database| {
            let transaction = database.begin_read().map_err(Trouble::of)?;
            let table = transaction.open_table(rows.table).map_err(Trouble::of)?;
            let Some(row) = table.get(key).map_err(Trouble::of)? else { return Ok(None) };
            let payload = row::unsealed(rows, key, row.value());
            let damaged = StoreError::Damaged { part: rows.part, id };
            let payload = payload.ok_or_else(|| Trouble::apart(damaged))?;
            Ok(Some(Bytes::copy_from_slice(payload)))
        })
    }
}

/// The failure of a note.
fn noted(error: std::io::Error) -> StoreError {
    Trouble::of(redb::Error::Io(error)).error()
}

impl Store for DiskStore {
    fn durable(&self) -> bool {
        true
    }

    fn insert(&self, record: &JobRecord, input: Bytes) -> Result<(), StoreError> {
        let (id, text) = (record.id.as_u128(), text_of(record)?);
        let seals = (row::sealed(RECORDS, id, &text), row::sealed(INPUTS, id, &input));
        let tried = AtomicBool::new(false);
        let kept = self.change((text.len() + input.len()) as u64, |tables| {
            tried.store(true, Ordering::Relaxed);
            row::put(&mut tables.records, id, &seals.0, &text)?;
            row::put(&mut tables.inputs, id, &seals.1, &input)
        });
        if kept.is_err() && tried.load(Ordering::Relaxed) {
            self.unsure().insert(id);
        }
        kept
    }

    fn begin(&self, record: &JobRecord) -> Result<(), StoreError> {
        self.running.add(record.id, record.crashes.saturating_add(1)).map_err(noted)
    }

    fn leave(&self, id: Uuid) {
        self.running.remove(id);
    }

    fn close(&self) {
        if let Err(error) = self.running.close() {
            tracing::warn!(%error, "the jobs at work count as crashed when they are cut short");
        }
    }

    fn finish(&self, record: &JobRecord, result: Option<Bytes>) -> Result<(), StoreError> {
        let (id, text) = (record.id.as_u128(), text_of(record)?);
        let seal = row::sealed(RECORDS, id, &text);
        let result = result.map(|result| (row::sealed(RESULTS, id, &result), result));
        let bytes = text.len() + result.as_ref().map_or(0, |(_, result)| result.len());
        self.change(bytes as u64, |tables| {
            row::put(&mut tables.records, id, &seal, &text)?;
            if let Some((seal, result)) = &result {
                row::put(&mut tables.results, id, seal, result)?;
            }
            Ok(())
        })
    }

    fn remove(&self, id: Uuid) -> Result<(), StoreError> {
        self.change(0, |tables| tables.remove(id.as_u128()))
    }

    fn records(&self) -> Result<Vec<JobRecord>, StoreError> {
        self.handle.call(|database| {
            let transaction = database.begin_read().map_err(Trouble::of)?;
            let table = transaction.open_table(RECORDS.table).map_err(Trouble::of)?;
            let mut records = Vec::new();
            for row in table.iter().map_err(Trouble::of)? {
                let (id, row) = row.map_err(Trouble::of)?;
                records.extend(record_in(id.value(), row.value()));
            }
            Ok(records)
        })
    }

    fn input(&self, id: Uuid) -> Result<Option<Bytes>, StoreError> {
        self.read(INPUTS, id)
    }

    fn result(&self, id: Uuid) -> Result<Option<Bytes>, StoreError> {
        self.read(RESULTS, id)
    }

    fn probe(&self) -> Result<(), StoreError> {
        self.handle.check()?;
        let Some(bytes) = self.room.to_try() else { return Ok(()) };
        let room = vec![0; usize::try_from(bytes).unwrap_or_default()];
        let put = |room: &[u8]| {
            self.write(room.len() as u64, |database| {
                let transaction = database.begin_write().map_err(Trouble::of)?;
                let mut table = transaction.open_table(PROBES).map_err(Trouble::of)?;
                table.insert(0, room).map_err(Trouble::of)?;
                drop(table);
                transaction.commit().map_err(Trouble::of)
            })
        };
        put(&room)?;
        // what it took is given back at once
        if bytes > 0 { put(&[]) } else { Ok(()) }
    }
}
