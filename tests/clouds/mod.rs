//! Clouds with exact truth, made in code: the same name and seed always give the same points.
//!
//! `smooth` holds chains of joined surfaces, scans and empty scenes, `cad` parts built from solids.
//! Tests, the accuracy table and the benchmarks share them.
#![allow(dead_code, reason = "each user of this module needs a part of it")]

pub mod cad;
pub mod cloud;
pub mod dump;
mod patch;
pub mod quick;
mod random;
pub mod score;
pub mod smooth;
mod solid;

pub use cloud::{Cloud, TrueSurface};
pub use patch::Patch;
pub use random::Random;
