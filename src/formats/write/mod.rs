//! Results as files: labels, labelled clouds, tables of regions.

mod npy;
mod ply;
mod table;

pub use npy::write_labels_npy;
pub use ply::{region_color, write_labelled_ply};
pub use table::{DIMENSIONS, RegionRow, write_regions_csv};
