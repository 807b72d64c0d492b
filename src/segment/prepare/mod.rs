//! The points that a discovery works on: order, neighbours, normals, noise.

pub mod boxes;
pub mod candidates;
pub mod closest;
pub mod distinct;
pub mod even;
pub mod levels;
pub mod morton;
pub mod nearest;
pub mod noise;
pub mod normals;
pub mod off_rows;
pub mod patch;
pub mod place;
pub mod profiles;
pub mod sampling;
pub mod scene;
pub mod steps;
pub mod take;
#[cfg(test)]
mod tests;
pub mod thinned;
pub mod work;
