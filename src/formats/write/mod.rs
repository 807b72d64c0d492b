//! Results as files: labels, labelled clouds, tables of regions.

mod npy;
mod ply;
mod points;
mod table;

pub use npy::{write_deviations_npy, write_labels_npy};
pub use ply::{Labelled, region_color, write_labelled_ply};
pub use points::write_points_csv;
pub use table::{DIMENSIONS, RegionRow, write_regions_csv};
