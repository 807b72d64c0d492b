//! The whole method: parameters, what is done with a cloud, and what is found.
//!
//! `pipeline` checks the cloud and hands it to a method: `rcond`, the seed's, or `distance`, whose rooms stand here in
//! the order of the work:
//!
//! - `sample`: how many of the points surfaces are looked for on, and the result for all of them;
//! - `prepare`: points in order, their neighbours, normals and noise;
//! - `grow`: hypotheses from local starts (`family`: which surface explains a set of points), and the choice among them;
//! - `label`: which surface each point belongs to, and what has changed since that was last settled;
//! - `moves`: edits of a `partition` (surfaces and labels) that make its description shorter, at the prices of
//!   `objective`;
//! - `judge`: whether what was found is a surface at all;
//! - `discover`: the passes that lead from points to a partition;
//! - `hints`: what a person knows of places in the cloud;
//! - `tiles`: a cloud in parts that are worked on apart;
//! - `finish` and `report`: the last fits, and regions in the contract's terms with their uncertainty.

mod constants;
mod deviation;
mod dimensions;
mod discover;
mod distance;
mod equation;
mod extent;
mod family;
mod finish;
#[cfg(test)]
mod fixtures;
mod found;
mod grow;
mod hints;
mod judge;
mod label;
mod layers;
mod median;
mod monitor;
mod moves;
pub mod objective;
mod outcome;
mod parameters;
mod partition;
mod pipeline;
mod prepare;
mod random;
mod rcond;
mod report;
mod result;
mod sample;
pub mod tiles;
mod union;
mod whole;

pub use constants::constants;
pub use deviation::{Measures, deviations, surface_normals};
pub use dimensions::{Dimensions, Side};
pub use extent::Extent;
pub use monitor::{Cancelled, Monitor, Silent, Stage};
pub use outcome::{HintOutcome, Outcome};
pub use parameters::{
    HINT_EXAMPLE, Hint, HintAction, MAX_HINT_BYTES, MAX_HINTS, Method, PARAMETERS, ParameterError,
    ParameterKind, ParameterSpec, Parameters, truth,
};
pub use pipeline::{LARGEST_COORDINATE, SMALLEST_EXTENT, SegmentError, segment};
pub use prepare::steps::resolution;
pub use rcond::grow::PoolError;
pub use result::{
    Continuity, Counters, Evidence, Fit, Neighbour, Region, Sampling, SamplingKind, Segmentation,
    Snapped, Unassigned, Uncertainty, Warning,
};
