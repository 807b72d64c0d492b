use std::{fs, io, path::Path};

use redb::{Database, ReadableDatabase, ReadableTable};

use super::{
    handle::{Trouble, guarded},
    row::{self, INPUTS, RECORDS, RESULTS, Rows},
};
use crate::jobs::StoreError;

/// Keeps what can be read of the damaged database that `look` opens: it goes into a new file at `path`,
/// and the damaged one is set aside, as `.redb.damaged`.
pub fn salvage(path: &Path, look: impl Fn() -> Result<Database, Trouble>) -> Result<(), Trouble> {
    let failed = |error: io::Error| Trouble::of(redb::Error::Io(error));
    let [new, damaged] = ["redb.new", "redb.damaged"].map(|end| path.with_extension(end));
    match fs::remove_file(&new) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => return Err(failed(error)),
        _ => {}
    }
    let from = guarded(&look)?;
    let kept = copy(&from, &new);
    // closing it would write, and the library may end the process over what is damaged
    std::mem::forget(from);
    let (jobs, parts) = kept?;
    fs::rename(path, &damaged).map_err(failed)?;
    fs::rename(&new, path).map_err(failed)?;
    tracing::error!(
        jobs,
        parts,
        damaged = %damaged.display(),
        "the job database is damaged: what can be read of it is kept, and the file is set aside"
    );
    Ok(())
}

/// Copies the rows that can be read; how many records, and how many inputs and results.
fn copy(from: &Database, to: &Path) -> Result<(usize, usize), Trouble> {
    let ids = ids(from);
    if ids.is_empty() {
        let nothing = "it is damaged, and no job in it can be read".to_owned();
        return Err(Trouble::apart(StoreError::Failed(nothing)));
    }
    let to = Database::create(to).map_err(Trouble::of)?;
    let mut counts = [0; 3];
    for (rows, count) in [RECORDS, INPUTS, RESULTS].into_iter().zip(&mut counts) {
        for &id in &ids {
            let Some(payload) = guarded(|| read(from, rows, id)).ok().flatten() else { continue };
            let transaction = to.begin_write().map_err(Trouble::of)?;
            {
                let mut table = transaction.open_table(rows.table).map_err(Trouble::of)?;
                row::put(&mut table, id, &row::sealed(rows, id, &payload), &payload)
                    .map_err(Trouble::of)?;
            }
            transaction.commit().map_err(Trouble::of)?;
            *count += 1;
        }
    }
    Ok((counts[0], counts[1] + counts[2]))
}

/// The jobs there are records of: read from both ends up to what cannot be read.
fn ids(from: &Database) -> Vec<u128> {
    let mut ids = Vec::new();
    for backwards in [false, true] {
        let mut seen = Vec::new();
        // what stops the reading is what is looked for
        let _ = guarded(|| {
            let transaction = from.begin_read().map_err(Trouble::of)?;
            let table = transaction.open_table(RECORDS.table).map_err(Trouble::of)?;
            let mut rows = table.iter().map_err(Trouble::of)?;
            while let Some(row) = if backwards { rows.next_back() } else { rows.next() } {
                seen.push(row.map_err(Trouble::of)?.0.value());
            }
            Ok(())
        });
        ids.append(&mut seen);
    }
    ids.sort_unstable();
    ids.dedup();
    ids
}

fn read(from: &Database, rows: Rows, id: u128) -> Result<Option<Vec<u8>>, Trouble> {
    let transaction = from.begin_read().map_err(Trouble::of)?;
    let table = transaction.open_table(rows.table).map_err(Trouble::of)?;
    let Some(value) = table.get(id).map_err(Trouble::of)? else { return Ok(None) };
    let payload = row::unsealed(rows, id, value.value());
    payload.map(|payload| Some(payload.to_vec())).ok_or_else(|| {
        let id = uuid::Uuid::from_u128(id);
        Trouble::apart(StoreError::Damaged { part: rows.part, id })
    })
}
