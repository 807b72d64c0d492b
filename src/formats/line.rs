//! How much of a text is looked at: the longest line, and how often the caller is asked.

use super::{Bounds, Columns, FormatError};

/// The most bytes a line may have: 64 for each of [`Columns::MAX`], rounded up. Longer comments are passed
/// over.
pub(super) const MAX_LINE_BYTES: usize = 64 * 1024;
const _: () = assert!(MAX_LINE_BYTES as u64 >= 64 * Columns::MAX);

/// Bytes passed between two looks at whether to go on: less than a millisecond.
const BYTES_A_LOOK: usize = 64 * 1024;

/// Refuses a line, which is no comment, of more than [`MAX_LINE_BYTES`].
pub(super) fn check_length(line: &[u8], number: usize) -> Result<(), FormatError> {
    if line.len() > MAX_LINE_BYTES {
        let most = MAX_LINE_BYTES;
        return Err(FormatError::LongLine { line: number, most, of: "bytes" });
    }
    Ok(())
}

/// Asks now and then whether to go on, however short or long lines are and whatever they hold.
pub(super) struct Pace<'a> {
    limits: &'a dyn Bounds,
    passed: usize,
}

impl<'a> Pace<'a> {
    /// One that asks at the first line.
    pub(super) fn new(limits: &'a dyn Bounds) -> Self {
        Self { limits, passed: BYTES_A_LOOK }
    }

    /// Counts a line.
    ///
    /// # Errors
    /// The cloud is not wanted any more.
    pub(super) fn pass(&mut self, line: &[u8]) -> Result<(), FormatError> {
        self.passed = self.passed.saturating_add(line.len() + 1);
        if self.passed > BYTES_A_LOOK {
            self.passed = 0;
            self.limits.go_on()?;
        }
        Ok(())
    }
}
