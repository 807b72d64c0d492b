//! Labels: which surface each point belongs to.

pub mod around;
pub mod asked;
pub mod between;
pub mod blocks;
pub mod changes;
pub mod energy;
pub mod labelling;
pub mod relabel;
pub mod shares;
pub mod spread;
#[cfg(test)]
mod tests;
