//! Bytes to point clouds, and results to bytes.
//!
//! [`read`] is the one entry for input. Whatever the bytes are, it answers with a cloud or a
//! [`FormatError`]: it never panics, and what a header announces is believed only as far as the bytes
//! behind it reach, so memory stays within a small multiple of the input.

mod error;
mod format;
mod ply;
mod read;
mod scalar;
mod text;
mod xyz;

pub use error::FormatError;
pub use format::Format;
pub use read::{Limits, read};
