//! The whole method, in the order of the seed's Figure 1: parameters, seeds, grow, extract, merge,
//! refine, report.

mod distance;
mod equation;
mod monitor;
mod parameters;
mod pipeline;
mod random;
mod rcond;
mod report;

pub use monitor::{Cancelled, Monitor, Silent, Stage};
pub use parameters::{
    Method, PARAMETERS, ParameterError, ParameterKind, ParameterSpec, Parameters,
};
pub use pipeline::{LARGEST_COORDINATE, SMALLEST_EXTENT, SegmentError, segment};
pub use report::{
    Continuity, Counters, Evidence, Extent, Fit, Neighbour, Region, Segmentation, Unassigned,
    Uncertainty,
};
