//! Where the points of a sample stand in the whole.

/// The place among `n` points of the `k`-th of `m` taken evenly.
pub fn place(k: usize, m: usize, n: usize) -> usize {
    k * n / m
}
