//! Results as files: labels, labelled clouds, tables of regions.

mod faces;
mod labelled;
mod npy;
mod palette;
mod picture;
mod ply;
mod points;
mod table;

pub use faces::write_faces_csv;
pub use labelled::{EachPoint, Labelled, TakePoints};
pub use npy::{write_deviations_npy, write_labels_npy};
pub use palette::region_color;
pub use picture::{PICTURE_BYTES, Scene, write_picture};
pub use ply::write_labelled_ply;
pub use points::write_points_csv;
pub use table::{DIMENSIONS, RegionRow, write_regions_csv};
