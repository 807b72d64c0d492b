//! Numbers that count up by one from row to row.

use super::super::{FormatError, text};
use super::dialect::{Dialect, Line};

/// Rows that are enough to tell running numbers from coordinates.
pub(super) const FEWEST: usize = 5;

/// The whole number that a field may be; some write it as `12.0` or `1.2e1`.
pub(super) fn number(field: &[u8]) -> Option<i64> {
    /// Above this not every whole number is a double.
    const MOST: f64 = (1_u64 << 53) as f64;
    let field = text::unquoted(field);
    let whole = || text::number(field).filter(|x| x.fract() == 0.0 && x.abs() < MOST);
    std::str::from_utf8(field).ok()?.parse().ok().or_else(|| whole().map(|x| x as i64))
}

/// Running numbers in the first column, as far as they were read.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Running {
    last: Option<i64>,
}

impl Running {
    /// Whether a row's first field is the number behind that of the row before.
    pub(super) fn goes_on(&mut self, dialect: Dialect, row: &[u8]) -> bool {
        let number = number(dialect.first(row));
        let next = number.filter(|n| self.last.is_none_or(|last| last.checked_add(1) == Some(*n)));
        self.last = next;
        next.is_some()
    }

    /// Checks a row among those of running numbers.
    ///
    /// # Errors
    /// Its number is not the next: the first column may be a coordinate after all.
    pub(super) fn check(
        &mut self,
        dialect: Dialect,
        row: &[u8],
        line: usize,
    ) -> Result<(), FormatError> {
        if self.goes_on(dialect, row) { Ok(()) } else { Err(FormatError::FirstColumn { line }) }
    }
}

/// Whether the first column of all rows, and of enough of them, has running numbers.
pub(super) fn are_all(dialect: Dialect, rows: &[Line]) -> bool {
    let mut running = Running::default();
    rows.len() >= FEWEST && rows.iter().all(|(_, row)| running.goes_on(dialect, row))
}
