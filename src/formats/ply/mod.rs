//! PLY (G. Turk, The PLY polygon file format, 1994): the vertices, from ascii and binary files.
//!
//! Other elements and properties are skipped, lists among them. An own reader: records of a fixed
//! length decode at memory speed, and no announced count is believed before the bytes are there.

mod ascii;
mod binary;
mod header;

use header::{Encoding, Header};

use super::{Bounds, FormatError};
use crate::geometry::PointCloud;

/// Reads the vertices of a PLY file in their order.
///
/// Range grids keep that order too: `obj_info num_cols` and `num_rows` give the cloud its grid where
/// they match the number of vertices, holes being vertices with NaN coordinates.
pub(super) fn read(bytes: &[u8], limits: &dyn Bounds) -> Result<PointCloud, FormatError> {
    let header = Header::parse(bytes)?;
    let vertex = header.vertex()?;
    let points = match header.encoding {
        Encoding::Ascii => ascii::read(bytes, &header, &vertex, limits)?,
        Encoding::Binary(endian) => binary::read(bytes, &header, &vertex, endian, limits)?,
    };
    Ok(PointCloud { grid: header.grid(points.len()), ..PointCloud::from_points(points) })
}

#[cfg(test)]
pub(super) mod tests;
