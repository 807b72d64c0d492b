use redb::{StorageError, Table, TableDefinition};
use sha2::{Digest, Sha256};
use uuid::Uuid;

use crate::jobs::{JobRecord, StoreError};

/// A row begins with the SHA-256 of its table's name, its job and what follows.
const DIGEST: usize = 32;

/// One of the tables, which has a row for each job.
#[derive(Clone, Copy)]
pub struct Rows {
    /// What a row is to its job.
    pub part: &'static str,
    /// The table.
    pub table: TableDefinition<'static, u128, &'static [u8]>,
}

const fn rows(part: &'static str, table: &'static str) -> Rows {
    Rows { part, table: TableDefinition::new(table) }
}

/// What is known of each job, as JSON.
pub const RECORDS: Rows = rows("record", "records");
/// What was submitted.
pub const INPUTS: Rows = rows("input", "inputs");
/// What came of it.
pub const RESULTS: Rows = rows("result", "results");

/// The digest that a row of `id` with `payload` begins with.
pub fn sealed(rows: Rows, id: u128, payload: &[u8]) -> [u8; DIGEST] {
    let head = Sha256::new().chain_update(rows.part).chain_update(id.to_be_bytes());
    head.chain_update(payload).finalize().into()
}

/// What a row holds, where it is what was written for this job.
pub fn unsealed(rows: Rows, id: u128, row: &[u8]) -> Option<&[u8]> {
    let (digest, payload) = row.split_at_checked(DIGEST)?;
    (sealed(rows, id, payload) == digest).then_some(payload)
}

/// Writes a row.
#[expect(deprecated, reason = "the row is let go before the transaction commits, as it must be")]
pub fn put(
    table: &mut Table<'_, u128, &'static [u8]>,
    id: u128,
    digest: &[u8; DIGEST],
    payload: &[u8],
) -> Result<(), StorageError> {
    let mut row = table.insert_reserve(id, DIGEST + payload.len())?;
    let (head, rest) = row.as_mut().split_at_mut(DIGEST);
    head.copy_from_slice(digest);
    rest.copy_from_slice(payload);
    Ok(())
}

/// A record as it is written.
///
/// # Errors
/// It cannot be written as JSON.
pub fn text_of(record: &JobRecord) -> Result<Vec<u8>, StoreError> {
    serde_json::to_vec(record).map_err(|error| StoreError::Failed(error.to_string()))
}

/// The record that was written so, if it was one.
pub fn record_of(text: &[u8]) -> Option<JobRecord> {
    serde_json::from_slice(text).ok()
}

/// The record in a row; `None`, and a line in the log, where the row is damaged.
pub fn record_in(id: u128, row: &[u8]) -> Option<JobRecord> {
    let record = unsealed(RECORDS, id, row);
    let record = record.and_then(record_of);
    if record.is_none() {
        let id = Uuid::from_u128(id);
        tracing::error!(job_id = %id, "the record of a job is damaged: the job is left out");
    }
    record
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_row_is_good_for_its_own_job_and_part_alone() {
        let row = [sealed(INPUTS, 7, b"abc").as_slice(), b"abc"].concat();
        assert_eq!(unsealed(INPUTS, 7, &row), Some(b"abc".as_slice()));
        assert_eq!(unsealed(INPUTS, 8, &row), None);
        assert_eq!(unsealed(RESULTS, 7, &row), None);
        for bit in 0..8 * row.len() {
            let mut flipped = row.clone();
            flipped[bit / 8] ^= 1 << (bit % 8);
            assert_eq!(unsealed(INPUTS, 7, &flipped), None);
        }
        assert_eq!(unsealed(INPUTS, 7, &row[..31]), None);
    }
}
