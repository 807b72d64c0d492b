//! Bytes to point clouds, and results to bytes.
//!
//! [`read`] is the one entry for input. Whatever the bytes are, it answers with a cloud or a
//! [`FormatError`]: it never panics, and what a header announces is believed only as far as the bytes
//! behind it reach, so memory stays within a small multiple of the input.

mod advice;
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
mod sink;
mod stl;
mod text;
mod thin;
mod unpack;
mod write;
mod xyz;

pub use advice::thin_for;
pub use announced::{
    BYTES_PER_POINT, BYTES_PER_THINNED, announced_points, bytes_beside, bytes_read, is_handed_on,
};
pub use bounds::{Bounds, Limits, Watched};
pub use error::FormatError;
pub use format::Format;
pub use hints::{Columns, Hints};
pub use mesh::{MeshWay, Meshes};
pub use origin::take_holes;
pub use ply::Fields;
pub use read::{each_point, read};
pub use sink::{About, Sink};
pub use thin::thinned;
pub use unpack::Packing;
pub use write::{
    DIMENSIONS, EachPoint, Labelled, PICTURE_BYTES, RegionRow, Scene, TakePoints, region_color,
    write_deviations_npy, write_faces_csv, write_labelled_ply, write_labels_npy, write_picture,
    write_points_csv, write_regions_csv,
};

#[cfg(test)]
mod hostile;
