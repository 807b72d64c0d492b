//! Hypotheses: surfaces grown from local starts, and the choice among them.

pub mod hypothesis;
pub mod search;
pub mod seeded;
pub mod select;
pub mod start;
#[cfg(test)]
mod tests;
pub mod walk;
