//! OFF (Geomview's object file format, ascii): the vertices and the faces.
//!
//! Lines are taken one by one: a vertex may have a normal, a colour and a place on a texture behind its coordinates, a
//! face a colour behind its corners.

use super::{
    Bounds, Format, FormatError,
    error::excerpt,
    memory::room_for,
    mesh::{self, Faces, Meshes},
    text,
};
use crate::geometry::{PointCloud, Vec3};

/// Lines read between two looks at whether to go on.
const LINES_A_LOOK: usize = 4096;

/// Whether a text's first word is that of an OFF file: `OFF`, with letters before it for what each vertex has.
pub(super) fn is_header(word: &[u8]) -> bool {
    let letters = word.strip_suffix(b"OFF").or_else(|| word.strip_suffix(b"off"));
    letters.is_some_and(|letters| letters.iter().all(|b| b"STCN4nstc".contains(b)))
}

/// Reads the vertices in their order, or samples of the faces. The first word may be missing where the format is named.
pub(super) fn read(
    bytes: &[u8],
    how: &Meshes,
    limits: &dyn Bounds,
) -> Result<PointCloud, FormatError> {
    let mut rows = Rows::of(bytes);
    let counts = rows.counts()?;
    let [vertices, announced] = counts;
    let lines = text::line_count(bytes);
    if vertices > lines {
        return Err(FormatError::Truncated {
            format: Format::Off,
            announced: vertices,
            found: lines,
        });
    }
    limits.check(vertices)?;
    let mut points = room_for(vertices)?;
    while (points.len() as u64) < vertices {
        if points.len().is_multiple_of(LINES_A_LOOK) {
            limits.go_on()?;
        }
        let found = points.len() as u64;
        let cut = FormatError::Truncated { format: Format::Off, announced: vertices, found };
        let (line, row) = rows.next().ok_or(cut)?;
        points.push(vertex(line, row)?);
    }
    let mut faces = Faces::default();
    let mut face = Vec::new();
    for (read, (_, row)) in (0..announced).zip(&mut rows) {
        if read.is_multiple_of(LINES_A_LOOK as u64) {
            limits.go_on()?;
        }
        if !faces.are_wanted() {
            faces.set_count(announced);
            break;
        }
        face.clear();
        let mut words = words(row);
        let corners: u32 = words.next().and_then(number).unwrap_or(0);
        face.extend(words.take(corners as usize).map_while(number::<u32>));
        // one cut short is none, and counts
        faces.push(if face.len() == corners as usize { &face } else { &[] });
    }
    mesh::cloud(points, &faces, how, limits)
}

/// The vertices that the header announces, as far as the lines can hold them.
pub(super) fn most_points(bytes: &[u8]) -> u64 {
    let announced = Rows::of(bytes).counts().map_or(0, |[vertices, _]| vertices);
    announced.min(text::line_count(bytes))
}

/// Whether the header announces faces.
pub(super) fn has_faces(bytes: &[u8]) -> bool {
    Rows::of(bytes).counts().is_ok_and(|[_, faces]| faces > 0)
}

fn words(row: &[u8]) -> impl Iterator<Item = &[u8]> {
    row.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty())
}

fn number<T: std::str::FromStr>(word: &[u8]) -> Option<T> {
    std::str::from_utf8(word).ok()?.parse().ok()
}

fn vertex(line: usize, row: &[u8]) -> Result<Vec3, FormatError> {
    let format = Format::Off;
    let mut point = Vec3::zeros();
    let mut words = words(row);
    for axis in 0..3 {
        let few = FormatError::TooFewColumns { format, line, found: axis, needed: 3 };
        let word = words.next().ok_or(few)?;
        let bad = || FormatError::BadNumber { format, line, text: excerpt(word) };
        point[axis] = text::number(word).ok_or_else(bad)?;
    }
    Ok(point)
}

/// The lines with anything but a comment in them, with their numbers from 1.
struct Rows<'a>(Box<dyn Iterator<Item = (usize, &'a [u8])> + 'a>);

impl<'a> Rows<'a> {
    fn of(bytes: &'a [u8]) -> Self {
        let told = |line: &'a [u8]| {
            let end = line.iter().position(|b| *b == b'#').unwrap_or(line.len());
            line[..end].trim_ascii()
        };
        let lines = text::lines(text::without_bom(bytes)).map(told);
        Self(Box::new((1..).zip(lines).filter(|(_, row)| !row.is_empty())))
    }

    /// Vertices and faces: behind the first word, or in a line of their own.
    fn counts(&mut self) -> Result<[u64; 2], FormatError> {
        let header = |line, reason: &str| FormatError::Header {
            format: Format::Off,
            line,
            reason: reason.into(),
        };
        let (mut line, mut row) = self.next().ok_or(header(1, "there is no line in it"))?;
        let first = words(row).next().unwrap_or_default();
        if is_header(first) {
            let unsupported = |what: &str| FormatError::Unsupported {
                format: Format::Off,
                what: what.to_owned(),
            };
            let rest = row[first.len()..].trim_ascii();
            if rest.starts_with(b"BINARY") {
                return Err(unsupported("binary numbers"));
            }
            if first.iter().any(|b| matches!(b, b'4' | b'n')) {
                return Err(unsupported("vertices of another dimension than three"));
            }
            row = rest;
            if row.is_empty() {
                (line, row) = self.next().ok_or(header(line, "the counts are missing"))?;
            }
        }
        let mut counts = words(row).map_while(number::<u64>);
        match (counts.next(), counts.next()) {
            (Some(vertices), Some(faces)) => Ok([vertices, faces]),
            _ => Err(header(line, "it needs the counts of vertices and faces")),
        }
    }
}

impl<'a> Iterator for Rows<'a> {
    type Item = (usize, &'a [u8]);

    fn next(&mut self) -> Option<Self::Item> {
        self.0.next()
    }
}
