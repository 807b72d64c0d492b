//! How much a request may say.

/// Most hints of one request.
pub const MAX_HINTS: usize = 64;
/// Most points, and most labels, of one hint.
pub const MAX_PLACES: usize = 64;
/// Longest text of all hints, in bytes.
pub const MAX_HINT_BYTES: usize = 48 << 10;
/// Largest coordinate, radius or tolerance.
pub const LARGEST_TOLD: f64 = 1e12;
