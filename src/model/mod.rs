//! What is derived from the regions of a segmentation.

pub mod relations;

use crate::fit::constant::Adjustable;

/// Every number that is decided with here.
pub fn constants() -> impl Iterator<Item = &'static dyn Adjustable> {
    relations::TABLES.iter().copied().flatten().copied()
}
