//! What is derived from the regions of a segmentation: their relations, datum systems, a boundary representation of the
//! part, and its STEP file.

pub mod brep;
pub mod datum;
pub mod relations;
pub mod step;

pub use brep::part::Source;
pub use step::step;

use crate::fit::constant::Adjustable;

/// Every number that is decided with here.
pub fn constants() -> impl Iterator<Item = &'static dyn Adjustable> {
    let tables = relations::TABLES.iter().chain(brep::TABLES).chain(step::TABLES);
    let tables = tables.chain(std::iter::once(&datum::CONSTANTS));
    tables.copied().flatten().copied()
}
