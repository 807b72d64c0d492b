//! The most columns of a line.

use super::super::{FormatError, line::check_length};
use super::dialect::{Dialect, MAX_COLUMNS};

/// Refuses a line, which is no comment, of too many bytes or more than [`MAX_COLUMNS`].
pub(super) fn check(dialect: Dialect, line: &[u8], number: usize) -> Result<(), FormatError> {
    check_length(line, number)?;
    if dialect.is_wide(line) {
        return Err(wide(number));
    }
    Ok(())
}

/// The error for a line of more than [`MAX_COLUMNS`].
pub(super) fn wide(line: usize) -> FormatError {
    FormatError::LongLine { line, most: MAX_COLUMNS, of: "columns" }
}
