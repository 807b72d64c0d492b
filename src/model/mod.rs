//! What is derived from regions: a boundary representation of the part, and its STEP file.

pub mod brep;
pub mod step;

pub use brep::part::Source;
pub use step::step;
