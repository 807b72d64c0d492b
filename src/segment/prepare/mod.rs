//! The points that a discovery works on: order, neighbours, normals, noise.

pub mod around;
pub mod boxes;
pub mod candidates;
pub mod distinct;
pub mod morton;
pub mod nearest;
pub mod noise;
pub mod normals;
pub mod place;
pub mod residuals;
pub mod scene;
pub mod take;
#[cfg(test)]
mod tests;
pub mod work;
