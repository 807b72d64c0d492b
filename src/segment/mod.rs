//! The whole method, in the order of the seed's Figure 1: parameters, seeds, grow, extract, merge,
//! refine, report.

mod discover;
mod distance;
mod equation;
mod family;
mod finish;
#[cfg(test)]
mod fixtures;
mod found;
mod grow;
mod judge;
mod label;
mod median;
mod monitor;
mod moves;
mod objective;
mod parameters;
mod partition;
mod pipeline;
mod prepare;
mod random;
mod rcond;
mod report;
mod result;
mod sample;
mod union;

pub use monitor::{Cancelled, Monitor, Silent, Stage};
pub use parameters::{
    Method, PARAMETERS, ParameterError, ParameterKind, ParameterSpec, Parameters,
};
pub use pipeline::{LARGEST_COORDINATE, SMALLEST_EXTENT, SegmentError, segment};
pub use rcond::grow::PoolError;
pub use result::{
    Continuity, Counters, Evidence, Extent, Fit, Neighbour, Region, Segmentation, Unassigned,
    Uncertainty,
};
