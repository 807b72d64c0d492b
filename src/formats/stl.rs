//! STL, ascii and binary: the corners of the triangles, each place once.
//!
//! A corner comes again in every triangle that meets there. A cloud with each point six times would
//! mislead every count, so equal corners become one point, in the order of their first appearance.

use std::collections::HashSet;

use super::{
    Bounds, Format, FormatError,
    format::is_binary_stl,
    scalar::{Column, Endian, Scalar, decode_records},
    text::Words,
};
use crate::geometry::{PointCloud, Vec3};

/// Bytes before the first triangle, and of a triangle.
const HEADER: usize = 84;
const TRIANGLE: usize = 50;

/// Reads the distinct corners.
pub(super) fn read(bytes: &[u8], limits: &dyn Bounds) -> Result<PointCloud, FormatError> {
    // many binary files begin with "solid" too: the length decides first
    let corners = if !is_binary_stl(bytes) && bytes.trim_ascii_start().starts_with(b"solid") {
        ascii(bytes)?
    } else {
        binary(bytes)?
    };
    let mut seen = HashSet::with_capacity(corners.len() / 4);
    // adding zero makes -0 and 0 one
    let key = |p: &Vec3| p.map(|x| (x + 0.0).to_bits());
    let mut points = Vec::new();
    for corner in corners {
        if seen.insert(key(&corner)) {
            limits.check(points.len() as u64 + 1)?;
            points.push(corner);
        }
    }
    Ok(PointCloud::from_points(points))
}

fn truncated(announced: u64, found: u64) -> FormatError {
    FormatError::Truncated { format: Format::Stl, announced, found }
}

fn binary(bytes: &[u8]) -> Result<Vec<Vec3>, FormatError> {
    let count = bytes.get(80..HEADER).and_then(|b| b.first_chunk());
    let count = count.map(|&b| u32::from_le_bytes(b)).ok_or_else(|| truncated(1, 0))? as usize;
    let body = &bytes[HEADER..];
    if count > body.len() / TRIANGLE {
        return Err(truncated(3 * count as u64, 3 * (body.len() / TRIANGLE) as u64));
    }
    let corner = |i: usize| {
        let columns =
            [0, 1, 2].map(|axis| Column { scalar: Scalar::F32, offset: 12 * (i + 1) + 4 * axis });
        decode_records(&body[..count * TRIANGLE], TRIANGLE, Endian::Little, columns)
    };
    let [first, second, third] = [corner(0), corner(1), corner(2)];
    let triangles = first.into_iter().zip(second).zip(third);
    Ok(triangles.flat_map(|((a, b), c)| [a, b, c]).collect())
}

fn ascii(bytes: &[u8]) -> Result<Vec<Vec3>, FormatError> {
    let mut words = Words::new(Format::Stl, bytes, 0);
    let mut corners = Vec::new();
    while let Some(word) = words.next() {
        if word == b"vertex" {
            let mut corner = Vec3::zeros();
            for axis in 0..3 {
                let found = corners.len() as u64;
                let word = words.next().ok_or_else(|| truncated(found + 1, found))?;
                corner[axis] = words.number(word)?;
            }
            corners.push(corner);
        }
    }
    Ok(corners)
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::formats::Limits;

    const CORNERS: [[f32; 3]; 6] = [
        [0.0, 0.0, 0.0],
        [1.5, 0.0, 0.0],
        [0.0, 1.0, 0.0],
        [1.5, 0.0, -0.0],
        [1.5, 1.0, 0.0],
        [0.0, 1.0, 0.0],
    ];

    pub(in crate::formats) fn binary_file() -> Vec<u8> {
        let mut file = b"solid in name only".to_vec();
        file.resize(80, b' ');
        file.extend(2u32.to_le_bytes());
        for triangle in CORNERS.chunks(3) {
            file.extend([0; 12]);
            file.extend(triangle.iter().flatten().flat_map(|x| x.to_le_bytes()));
            file.extend([0; 2]);
        }
        file
    }

    pub(in crate::formats) fn ascii_file() -> String {
        let triangle = |c: &[[f32; 3]]| {
            let vertex = |p: &[f32; 3]| format!("   vertex {} {} {:e}\n", p[0], p[1], p[2]);
            let vertices: String = c.iter().map(vertex).collect();
            format!(" facet normal 0 0 1\n  outer loop\n{vertices}  endloop\n endfacet\n")
        };
        let body: String = CORNERS.chunks(3).map(triangle).collect();
        format!("solid plate\n{body}endsolid plate\n")
    }

    #[test]
    fn ascii_and_binary_give_each_corner_once() {
        let expected = [[0.0, 0.0, 0.0], [1.5, 0.0, 0.0], [0.0, 1.0, 0.0], [1.5, 1.0, 0.0]];
        for file in [binary_file(), ascii_file().into_bytes()] {
            assert_eq!(Format::detect(&file), Some(Format::Stl));
            let cloud = read(&file, &Limits { max_points: 4 }).unwrap();
            let points: Vec<[f64; 3]> = cloud.points.iter().map(|&p| p.into()).collect();
            assert_eq!(points, expected);
            assert_eq!(
                read(&file, &Limits { max_points: 3 }),
                Err(FormatError::TooManyPoints { points: 4, limit: 3 })
            );
        }
    }

    #[test]
    fn a_count_beyond_the_bytes_is_refused() {
        let mut file = binary_file();
        file[..5].copy_from_slice(b"rigid");
        file[83] = 255;
        let announced = 3 * (255 * (1 << 24) + 2);
        assert_eq!(
            read(&file, &Limits::default()),
            Err(FormatError::Truncated { format: Format::Stl, announced, found: 6 })
        );
    }
}
