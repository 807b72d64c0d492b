//! Fitting: the scatter matrix, its condition, and the seed's direct fit.

mod direct;
mod rcond;
mod scatter;
mod section;

pub use direct::{direct_fit, direct_fit_through};
pub use rcond::Condition;
pub use scatter::{Matrix10, Scatter, Vector10, features};
pub use section::section_normals;
