//! OBJ (Wavefront): the `v` lines, with or without faces.

use super::{Bounds, Format, FormatError, error::excerpt, text};
use crate::geometry::{PointCloud, Vec3};

/// Reads one point from each `v x y z [w | r g b]` line, in their order.
pub(super) fn read(bytes: &[u8], limits: &dyn Bounds) -> Result<PointCloud, FormatError> {
    let mut points = Vec::new();
    for (index, line) in text::lines(text::without_bom(bytes)).enumerate() {
        let mut words = line.split(u8::is_ascii_whitespace).filter(|w| !w.is_empty());
        if words.next() == Some(b"v") {
            limits.check(points.len() as u64 + 1)?;
            points.push(vertex(words, index + 1)?);
        }
    }
    Ok(PointCloud::from_points(points))
}

fn vertex<'a>(mut words: impl Iterator<Item = &'a [u8]>, line: usize) -> Result<Vec3, FormatError> {
    let format = Format::Obj;
    let mut point = Vec3::zeros();
    for axis in 0..3 {
        let word = words.next();
        let word =
            word.ok_or(FormatError::TooFewColumns { format, line, found: axis, needed: 3 })?;
        let bad = || FormatError::BadNumber { format, line, text: excerpt(word) };
        point[axis] = text::number(word).ok_or_else(bad)?;
    }
    Ok(point)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::formats::Limits;

    #[test]
    fn vertices_are_read_with_and_without_faces() {
        let text = b"# cube\r\no cube\nv 1 2 3\nvn 0 0 1\n v\t4 5 6 0.1 0.2 0.3\nf 1 2 1\n";
        let cloud = read(text, &Limits::default()).unwrap();
        assert_eq!(cloud.points, [Vec3::new(1.0, 2.0, 3.0), Vec3::new(4.0, 5.0, 6.0)]);
    }

    #[test]
    fn errors_name_the_line() {
        let error = |text: &[u8]| read(text, &Limits { max_points: 1 }).unwrap_err();
        let (format, line) = (Format::Obj, 2);
        assert_eq!(
            error(b"o a\nv 1 2\n"),
            FormatError::TooFewColumns { format, line, found: 2, needed: 3 }
        );
        assert_eq!(
            error(b"\nv 1 x 2\n"),
            FormatError::BadNumber { format, line, text: "x".into() }
        );
        assert_eq!(
            error(b"v 1 2 3\nv 1 2 3\n"),
            FormatError::TooManyPoints { points: 2, limit: 1 }
        );
    }
}
