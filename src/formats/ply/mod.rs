//! PLY (G. Turk, The PLY polygon file format, 1994): the vertices and faces, from ascii and binary files.
//!
//! Other elements and properties are skipped, lists among them. An own reader: records of a fixed
//! length decode at memory speed, and no announced count is believed before the bytes are there.

mod ascii;
mod binary;
mod faces;
mod fields;
mod header;

pub use fields::Fields;
use header::{Encoding, Header, Vertex};

use super::{
    Bounds, FormatError,
    mesh::{self, MeshWay, Meshes},
    scalar::Endian,
    sink::{About, Sink},
};
use crate::geometry::PointCloud;

/// Reads the vertices of a PLY file in their order.
///
/// Range grids keep that order too: `obj_info num_cols` and `num_rows` give the cloud its grid where
/// they match the number of vertices, holes being vertices with NaN coordinates.
pub(super) fn read(
    bytes: &[u8],
    how: &Meshes,
    limits: &dyn Bounds,
) -> Result<PointCloud, FormatError> {
    let header = Header::parse(bytes)?;
    let vertex = header.vertex()?;
    let points = match header.encoding {
        Encoding::Ascii => ascii::read(bytes, &header, &vertex, limits)?,
        Encoding::Binary(endian) => binary::read(bytes, &header, &vertex, endian, limits)?,
    };
    let grid = header.grid(points.len());
    let faces = match how.way {
        MeshWay::Vertices => mesh::Faces::default(),
        _ => faces::read(bytes, &header),
    };
    let cloud = mesh::cloud(points, &faces, how, limits)?;
    // samples lie on no grid
    Ok(PointCloud { grid: grid.filter(|_| cloud.mesh.is_none()), ..cloud })
}

/// Hands on the vertices of a file that is read for them alone, in records of one length; `None` for any other.
pub(super) fn pass(
    bytes: &[u8],
    how: &Meshes,
    limits: &dyn Bounds,
    sink: &mut dyn Sink,
) -> Result<Option<About>, FormatError> {
    let header = Header::parse(bytes)?;
    let vertex = header.vertex()?;
    match body(&header, &vertex, how) {
        Some(Body::Ascii) => ascii::pass(bytes, &header, &vertex, limits, sink)?,
        Some(Body::Binary(endian, stride)) => {
            binary::pass(bytes, &header, &vertex, (endian, stride), (limits, sink))?;
        }
        None => return Ok(None),
    }
    let count = header.elements[vertex.element].count;
    Ok(Some(About { grid: header.grid(count as usize), ..About::default() }))
}

/// A body that can be gone through.
enum Body {
    Ascii,
    /// The byte order and the length of the vertices' records.
    Binary(Endian, usize),
}

/// How the vertices are gone through, where no faces matter and records have one length.
fn body(header: &Header, vertex: &Vertex, how: &Meshes) -> Option<Body> {
    let has_faces = match how.way {
        MeshWay::Vertices => false,
        MeshWay::Faces => true,
        MeshWay::Auto => faces::element(header).is_some(),
    };
    let body = match header.encoding {
        Encoding::Ascii => Body::Ascii,
        Encoding::Binary(endian) => Body::Binary(endian, header.elements[vertex.element].stride()?),
    };
    (!has_faces).then_some(body)
}

/// Whether [`pass`] hands the points on.
pub(super) fn is_handed_on(bytes: &[u8], how: &Meshes) -> bool {
    let told = |header: &Header| Some(body(header, &header.vertex().ok()?, how).is_some());
    Header::parse(bytes).ok().and_then(|header| told(&header)).unwrap_or(false)
}

/// Whether the header announces faces.
pub(super) fn has_faces(bytes: &[u8]) -> bool {
    Header::parse(bytes).is_ok_and(|header| faces::element(&header).is_some())
}

/// The points that the header announces, as far as the bytes can hold them.
///
/// # Errors
/// The header is wrong.
pub(super) fn most_points(bytes: &[u8]) -> Result<u64, FormatError> {
    let header = Header::parse(bytes)?;
    let element = &header.elements[header.vertex()?.element];
    let body = bytes.len().saturating_sub(header.body);
    // a number takes two bytes of text; a list that varies takes a byte for its count
    let record = match (header.encoding, element.stride()) {
        (Encoding::Ascii, _) => 2 * element.properties.len(),
        (Encoding::Binary(_), stride) => stride.unwrap_or(element.properties.len()),
    };
    Ok(element.count.min(body.div_ceil(record.max(1)) as u64))
}

#[cfg(test)]
pub(super) mod tests;
