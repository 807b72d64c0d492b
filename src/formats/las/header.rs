//! Numbers of a header, read before the library sees it.

use super::super::{Format, FormatError};

/// The error for a file that is not as the format says, for this reason.
pub(super) fn damaged(reason: &str) -> FormatError {
    FormatError::Damaged { format: Format::Las, reason: reason.into() }
}

/// Where the header says that the points start.
pub(super) fn point_offset(bytes: &[u8]) -> Option<usize> {
    u32_at(bytes, 96)
}

/// The number of two bytes, the lowest first, at that place; `None` where the file ends before.
pub(super) fn u16_at(bytes: &[u8], at: usize) -> Option<usize> {
    Some(u16::from_le_bytes(*bytes.get(at..)?.first_chunk()?).into())
}

/// That of four bytes.
pub(super) fn u32_at(bytes: &[u8], at: usize) -> Option<usize> {
    usize::try_from(u32::from_le_bytes(*bytes.get(at..)?.first_chunk()?)).ok()
}

/// That of eight bytes.
pub(super) fn u64_at(bytes: &[u8], at: usize) -> Option<usize> {
    usize::try_from(u64::from_le_bytes(*bytes.get(at..)?.first_chunk()?)).ok()
}
