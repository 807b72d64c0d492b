//! One cloud in parts that are worked on apart, on other machines too.
//!
//! Surfaces are looked for on some of the points, taken evenly, as in any cloud too large to look at all of: see
//! [`Survey`]. What is done with every point is done tile by tile: who has a tile needs the [`Guide`], and what
//! comes of it is small. A first round sums each surface's normal equations over all points, by which it takes its
//! last step; a second one gives the points their labels, and sums what is told of the regions.
//!
//! A tile is any set of points that lie together; a point that lies between surfaces is placed by its neighbours
//! in its own tile, so that beside the border of two tiles it may be given to the other one. Copies of a point
//! belong into one tile.

mod guide;
mod label;
mod sums;
mod survey;
#[cfg(test)]
mod tests;

pub use guide::Guide;
pub use label::{Labelled, label};
pub use sums::Sums;
pub use survey::{Judgement, Survey};
