//! Fits: the scatter matrix, its condition and the seed's direct fit; starts without iteration,
//! orthogonal-distance least squares and their uncertainty.

pub(crate) mod blocks;
mod columns;
pub mod constant;
mod constrained;
pub(crate) mod correlation;
pub(crate) mod covariance;
mod direct;
mod eigen;
pub mod feature;
#[cfg(test)]
pub(crate) mod fits;
pub(crate) mod general;
pub(crate) mod held;
mod kernels;
pub mod least_squares;
mod linearised;
pub mod local_quadric;
mod loss;
mod near_quadric;
mod normal;
mod rcond;
pub(crate) mod retraction;
mod ruler;
mod scaled;
mod scatter;
mod section;
mod shape;
pub mod starts;
mod taubin;
mod thickness;

pub use covariance::Spread;
pub use direct::{direct_fit, direct_fit_through};
pub use general::general_fit;
pub use held::{Held, fit_held};
pub use near_quadric::may_hold;
pub use rcond::Condition;
pub use ruler::Ruler;
pub use scatter::{Matrix10, Scatter, Vector10, features};
pub use section::section_normals;
pub use shape::{Family, MAX_DOF, Offset, Shape};
pub use taubin::taubin_fit;
