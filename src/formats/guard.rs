use std::panic::{AssertUnwindSafe, catch_unwind};

use super::{Format, FormatError};

/// Most points that one byte of a compressed file is believed to hold. Scans need at least a byte a
/// point; what announces more is no scan, and would make memory out of nothing.
pub(super) const MAX_POINTS_PER_BYTE: u64 = 64;

/// Runs a library's reader: its errors, and its panics, become a [`FormatError::Damaged`].
pub(super) fn guarded<T, E: std::fmt::Display>(
    format: Format,
    read: impl FnOnce() -> Result<Result<T, FormatError>, E>,
) -> Result<T, FormatError> {
    let damaged = |reason: String| FormatError::Damaged { format, reason };
    match catch_unwind(AssertUnwindSafe(read)) {
        Ok(Ok(done)) => done,
        Ok(Err(error)) => Err(damaged(error.to_string())),
        Err(_) => Err(damaged("its contents contradict each other".into())),
    }
}

/// Refuses a number of points that the bytes of a compressed file cannot hold.
pub(super) fn check_density(
    format: Format,
    announced: u64,
    bytes: usize,
) -> Result<(), FormatError> {
    let found = (bytes as u64).saturating_mul(MAX_POINTS_PER_BYTE);
    if announced > found {
        return Err(FormatError::Truncated { format, announced, found });
    }
    Ok(())
}
