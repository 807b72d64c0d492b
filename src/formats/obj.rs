//! OBJ (Wavefront): the `v` lines, and the faces where there are some.

use super::{
    Bounds, Format, FormatError,
    error::excerpt,
    memory::room_for,
    mesh::{self, Faces, Meshes},
    text,
};
use crate::geometry::{PointCloud, Vec3};

/// Lines read between two looks at whether to go on: many hold no vertex.
const LINES_A_LOOK: usize = 4096;

/// Reads one point from each `v x y z [w | r g b]` line, in their order, or samples of the faces.
pub(super) fn read(
    bytes: &[u8],
    how: &Meshes,
    limits: &dyn Bounds,
) -> Result<PointCloud, FormatError> {
    let mut points = room_for(most_points(bytes).min(limits.most()))?;
    let mut faces = Faces::default();
    let mut begun = Vec::new();
    for (index, line) in text::lines(text::without_bom(bytes)).enumerate() {
        if index % LINES_A_LOOK == 0 {
            limits.go_on()?;
        }
        if let Some(begin) = going_on(line, !begun.is_empty()) {
            begun.extend_from_slice(begin);
            begun.push(b' ');
        } else if begun.is_empty() {
            take(line, index + 1, &mut points, &mut faces, limits)?;
        } else {
            begun.extend_from_slice(line);
            take(&begun, index + 1, &mut points, &mut faces, limits)?;
            begun.clear();
        }
    }
    take(&begun, text::line_count(bytes) as usize, &mut points, &mut faces, limits)?;
    mesh::cloud(points, &faces, how, limits)
}

/// A line without the backslash that lets it go on in the next one, where it has such and is read: names and comments may
/// end in one that means nothing, as paths do.
fn going_on(line: &[u8], is_begun: bool) -> Option<&[u8]> {
    let begin = line.trim_ascii_end().strip_suffix(b"\\")?;
    let word = begin.split(u8::is_ascii_whitespace).find(|w| !w.is_empty());
    (is_begun || matches!(word, Some(b"v" | b"f" | b"fo"))).then_some(begin)
}

/// Takes the vertex or the face of a line; `number` is that of its last one.
fn take(
    line: &[u8],
    number: usize,
    points: &mut Vec<Vec3>,
    faces: &mut Faces,
    limits: &dyn Bounds,
) -> Result<(), FormatError> {
    let mut words = line.split(u8::is_ascii_whitespace).filter(|w| !w.is_empty());
    match words.next() {
        Some(b"v") => {
            limits.check(points.len() as u64 + 1)?;
            points.push(vertex(words, number)?);
        }
        Some(b"f" | b"fo") if !faces.are_wanted() => faces.push(&[]),
        Some(b"f" | b"fo") => {
            let face: Option<Vec<u32>> = words.map(|word| corner(word, points.len())).collect();
            // a face that names what is none counts, for faces are told by their number
            faces.push(&face.unwrap_or_default());
        }
        _ => {}
    }
    Ok(())
}

/// The most vertices that the lines can hold.
pub(super) fn most_points(bytes: &[u8]) -> u64 {
    text::line_count(bytes)
}

/// Whether there are faces among the lines.
pub(super) fn has_faces(bytes: &[u8]) -> bool {
    text::lines(bytes).any(|line| line.trim_ascii_start().starts_with(b"f"))
}

/// The place of the vertex in a face's word: `7`, `7/1/2`, or `-1` for the last one so far.
fn corner(word: &[u8], vertices: usize) -> Option<u32> {
    let vertex = word.split(|&b| b == b'/').next()?;
    let number: i64 = std::str::from_utf8(vertex).ok()?.parse().ok()?;
    let place = if number < 0 { number.checked_add(vertices as i64)? } else { number - 1 };
    u32::try_from(place).ok()
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
    use std::sync::atomic::{AtomicU32, Ordering};

    use super::*;
    use crate::formats::{Limits, mesh::tests::turned};

    #[test]
    fn vertices_are_read_with_and_without_faces() {
        let text = b"# cube\r\no cube\nv 1 2 3\nvn 0 0 1\n v\t4 5 6 0.1 0.2 0.3\nf 1 2 1\n";
        let cloud = read(text, &Meshes::default(), &Limits::default()).unwrap();
        assert_eq!(cloud.points, [Vec3::new(1.0, 2.0, 3.0), Vec3::new(4.0, 5.0, 6.0)]);
    }

    #[test]
    fn a_line_goes_on_behind_a_backslash_where_it_is_a_vertex_or_a_face() {
        let text = b"# from C:\\parts\\\nv 1 2 \\\n 3\no part\\\nv 4 \\ \r\n5 \\\r\n 6\nf 1 \\\n2 1\nv 7 8 9\\";
        let cloud = read(text, &Meshes::default(), &Limits::default()).unwrap();
        let told: Vec<[f64; 3]> = cloud.points.iter().map(|p| (*p).into()).collect();
        assert_eq!(told, [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0], [7.0, 8.0, 9.0]]);
        assert_eq!(cloud.mesh.unwrap().faces, 1);
        let error = read(b"v 1 \\\n2\n", &Meshes::default(), &Limits::of(1)).unwrap_err();
        let (format, line) = (Format::Obj, 2);
        assert_eq!(error, FormatError::TooFewColumns { format, line, found: 2, needed: 3 });
    }

    #[test]
    fn a_cloud_nobody_wants_any_more_is_not_read_through_its_faces() {
        let text = format!("v 1 2 3\n{}", "f 1 1 1\n".repeat(2 * LINES_A_LOOK));
        let looks = AtomicU32::new(0);
        #[derive(Debug)]
        struct Second<'a>(&'a AtomicU32);
        impl Bounds for Second<'_> {
            fn check(&self, _: u64) -> Result<(), FormatError> {
                Ok(())
            }

            fn most(&self) -> u64 {
                10
            }

            fn go_on(&self) -> Result<(), FormatError> {
                let first = self.0.fetch_add(1, Ordering::Relaxed) == 0;
                if first { Ok(()) } else { Err(FormatError::Stopped) }
            }
        }
        assert_eq!(
            read(text.as_bytes(), &Meshes::default(), &Second(&looks)),
            Err(FormatError::Stopped)
        );
        assert_eq!(looks.into_inner(), 2);
    }

    #[test]
    fn errors_name_the_line() {
        let error = |text: &[u8]| read(text, &Meshes::default(), &Limits::of(1)).unwrap_err();
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

    #[test]
    fn the_faces_of_a_cad_mesh_are_sampled_however_they_count() {
        let (points, faces) = turned(64, 15.0, 40.0, 15.0);
        let vertices: String =
            points.iter().map(|p| format!("v {} {} {}\n", p.x, p.y, p.z)).collect();
        let from_end = |i: u32| format!("{}", i64::from(i) - points.len() as i64);
        let from_start = |i: u32| format!("{}/1/{}", i + 1, i + 1);
        let ways: [&dyn Fn(u32) -> String; 2] = [&from_start, &from_end];
        for way in ways {
            let face = |f: &[u32; 3]| format!("f {} {} {}\n", way(f[0]), way(f[1]), way(f[2]));
            let file = vertices.clone() + &faces.iter().map(face).collect::<String>();
            let cloud = read(file.as_bytes(), &Meshes::default(), &Limits::default()).unwrap();
            let mesh = cloud.mesh.unwrap();
            assert_eq!((mesh.vertices, mesh.faces), (points.len(), faces.len()));
            assert!(mesh.samples.is_some());
        }
        assert_eq!(
            read(vertices.as_bytes(), &Meshes::default(), &Limits::default()).unwrap().points,
            points
        );
    }
}
