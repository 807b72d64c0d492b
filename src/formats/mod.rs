//! Bytes to point clouds, and results to bytes.
//!
//! [`read`] is the one entry for input. Whatever the bytes are, it answers with a cloud or a
//! [`FormatError`]: it never panics, and what a header announces is believed only as far as the bytes
//! behind it reach, so memory stays within a small multiple of the input.

mod announced;
mod bounds;
mod e57;
mod error;
mod foreign;
mod format;
mod guard;
mod hints;
mod las;
mod line;
mod memory;
mod mesh;
mod obj;
mod odd;
mod off;
mod origin;
mod pcd;
mod ply;
mod ptx;
mod read;
mod scalar;
mod stl;
mod text;
mod unpack;
mod write;
mod xyz;

pub use announced::{BYTES_PER_POINT, announced_points, bytes_beside};
pub use bounds::{Bounds, Limits, Watched};
pub use error::FormatError;
pub use format::Format;
pub use hints::{Columns, Hints};
pub use mesh::{MeshWay, Meshes};
pub use ply::Fields;
pub use read::read;
pub use unpack::Packing;
pub use write::{
    DIMENSIONS, Labelled, PICTURE_BYTES, RegionRow, Scene, region_color, write_deviations_npy,
    write_labelled_ply, write_labels_npy, write_picture, write_points_csv, write_regions_csv,
};

#[cfg(test)]
mod hostile;
