//! Text clouds: one point a line, coordinates separated by spaces, tabs, commas or semicolons.
//!
//! Lines that start with `#`, `//` or `%` are comments. A first line of names is a header: columns
//! named x, y and z are the coordinates, else the first three. A first line with one number alone
//! (PTS) is a point count and is passed over. Further columns are ignored. Between semicolons a comma
//! is a decimal point. An empty field between separators is a missing value (NaN).

use super::{Bounds, Format, FormatError, error::excerpt, text};
use crate::geometry::{PointCloud, Vec3};

/// Reads one point a line.
pub(super) fn read(bytes: &[u8], limits: &dyn Bounds) -> Result<PointCloud, FormatError> {
    let mut layout = None;
    let mut points = Vec::new();
    for (index, line) in text::lines(text::without_bom(bytes)).enumerate() {
        let line = line.trim_ascii();
        if line.is_empty() || text::is_comment(line) {
            continue;
        }
        let first = layout.is_none();
        let layout = layout.get_or_insert_with(|| Layout::of(line));
        if first && layout.is_heading(line) {
            continue;
        }
        limits.check(points.len() as u64 + 1)?;
        points.push(layout.point(line, index + 1)?);
    }
    Ok(PointCloud::from_points(points))
}

/// What stands between fields.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Separator {
    /// Any run of white space.
    Space,
    /// One comma or semicolon.
    Byte(u8),
}

/// Where the coordinates stand in a line.
#[derive(Debug)]
struct Layout {
    separator: Separator,
    /// The columns of x, y and z.
    columns: [usize; 3],
    /// Columns up to the last coordinate.
    needed: usize,
}

impl Layout {
    /// The layout that the first line, names or numbers, shows.
    fn of(line: &[u8]) -> Self {
        let separator = [b';', b','].into_iter().find(|b| line.contains(b));
        let separator = separator.map_or(Separator::Space, Separator::Byte);
        let mut layout = Self { separator, columns: [0, 1, 2], needed: 3 };
        if let Some(columns) = layout.named_columns(line) {
            layout.columns = columns;
            layout.needed = 1 + columns.into_iter().max().unwrap_or(2);
        }
        layout
    }

    fn named_columns(&self, line: &[u8]) -> Option<[usize; 3]> {
        let mut found = [None; 3];
        self.each_field(line, |column, field| {
            if let Some(axis) = axis_of(field) {
                found[axis].get_or_insert(column);
            }
            true
        });
        Some([found[0]?, found[1]?, found[2]?])
    }

    /// Whether the first line is one of names, or a point count.
    fn is_heading(&self, line: &[u8]) -> bool {
        let (mut fields, mut numbers, mut names) = (0, 0, 0);
        self.each_field(line, |column, field| {
            fields += 1;
            if self.columns.contains(&column) && !field.is_empty() {
                let is_number = self.number(field).is_some();
                numbers += usize::from(is_number);
                names += usize::from(!is_number);
            }
            true
        });
        (numbers == 0 && names > 0) || (fields == 1 && numbers == 1)
    }

    fn point(&self, line: &[u8], number: usize) -> Result<Vec3, FormatError> {
        let mut point = Vec3::zeros();
        let (mut seen, mut bad) = (0, None);
        self.each_field(line, |column, field| {
            seen = column + 1;
            if let Some(axis) = self.columns.iter().position(|&c| c == column) {
                match self.number(field) {
                    Some(value) => point[axis] = value,
                    None => bad = Some(field),
                }
            }
            bad.is_none() && seen < self.needed
        });
        if let Some(field) = bad {
            let text = excerpt(field);
            return Err(FormatError::BadNumber { format: Format::Xyz, line: number, text });
        }
        if seen < self.needed {
            return Err(FormatError::TooFewColumns {
                format: Format::Xyz,
                line: number,
                found: seen,
                needed: self.needed,
            });
        }
        Ok(point)
    }

    /// Calls `visit` with each field and its column until it says false.
    fn each_field<'a>(&self, line: &'a [u8], mut visit: impl FnMut(usize, &'a [u8]) -> bool) {
        match self.separator {
            Separator::Space => {
                let fields = line.split(u8::is_ascii_whitespace).filter(|f| !f.is_empty());
                let _ = fields.enumerate().all(|(column, field)| visit(column, field));
            }
            Separator::Byte(byte) => {
                let mut fields = line.split(|&b| b == byte).enumerate();
                let _ = fields.all(|(column, field)| visit(column, field.trim_ascii()));
            }
        }
    }

    fn number(&self, field: &[u8]) -> Option<f64> {
        if let Some(value) = text::number(field) {
            return Some(value);
        }
        let field = unquoted(field);
        if field.is_empty() {
            return Some(f64::NAN);
        }
        match self.separator {
            Separator::Byte(b';') if field.contains(&b',') => {
                let with_point: Vec<u8> =
                    field.iter().map(|&b| if b == b',' { b'.' } else { b }).collect();
                text::number(&with_point)
            }
            _ => text::number(field),
        }
    }
}

fn unquoted(field: &[u8]) -> &[u8] {
    field.strip_prefix(b"\"").and_then(|f| f.strip_suffix(b"\"")).unwrap_or(field)
}

/// The axis a column is named for: `x`, `X`, `"x"`, `x[mm]`, `x (mm)`, `x_mm` and the like.
fn axis_of(name: &[u8]) -> Option<usize> {
    let name = unquoted(name);
    let end = name.iter().position(|b| !b.is_ascii_alphanumeric()).unwrap_or(name.len());
    match name[..end].to_ascii_lowercase().as_slice() {
        b"x" => Some(0),
        b"y" => Some(1),
        b"z" => Some(2),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::formats::Limits;

    fn points(text: &str) -> Vec<[f64; 3]> {
        let cloud = read(text.as_bytes(), &Limits::default()).unwrap();
        cloud.points.iter().map(|&p| p.into()).collect()
    }

    #[test]
    fn any_usual_separator_is_read() {
        for text in [
            "1 2 3\n-4.5 5e-1 6\n",
            "  1\t2\t3\r\n-4.5\t0.5 6.0 255 255 255",
            "1,2,3\n-4.5, .5,6\n",
            "1 2 3\r-4.5 0.5 6\r",
            "1;2;3;a\n-4.5;+0.5;6;b\n\n",
            "1,0;2,0;3\n-4,5;0,5;6\n",
            "\"1\",\"2\",\"3\"\n\"-4.5\",0.5,6\n",
            "\u{feff}# comment\n1 2 3\n// another\n% one more\n-4.5 0.5 6\n",
        ] {
            assert_eq!(points(text), [[1.0, 2.0, 3.0], [-4.5, 0.5, 6.0]], "{text:?}");
        }
    }

    #[test]
    fn a_header_names_the_columns() {
        assert_eq!(points("x y z\n1 2 3\n"), [[1.0, 2.0, 3.0]]);
        assert_eq!(points("id,Z,Y [mm],\"X\",i\na,3,2,1,9\n"), [[1.0, 2.0, 3.0]]);
        assert_eq!(points("East North Up\n1 2 3\n"), [[1.0, 2.0, 3.0]]);
        assert_eq!(points("2\n1 2 3 77\n4 5 6 77\n"), [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]]);
    }

    #[test]
    fn missing_and_infinite_values_are_skipped_points() {
        let cloud = read(b",,\n1,2,3\n1,,3\nnan,0,0\n0,1e999,0\n4,5,6", &Limits::default());
        let cloud = cloud.unwrap();
        assert_eq!((cloud.input_len, cloud.skipped()), (6, 4));
        assert_eq!(cloud.input_index, Some(vec![1, 5]));
    }

    #[test]
    fn errors_name_the_line() {
        let error = |text: &str| read(text.as_bytes(), &Limits::default()).unwrap_err();
        let (format, line) = (Format::Xyz, 3);
        let text = "oops".to_string();
        assert_eq!(error("1 2 3\n\n4 oops 6"), FormatError::BadNumber { format, line, text });
        assert_eq!(
            error("# a\n1 2 3\n4 5"),
            FormatError::TooFewColumns { format, line, found: 2, needed: 3 }
        );
        assert_eq!(
            read(b"1 2 3\n4 5 6\n7 8 9", &Limits { max_points: 2 }),
            Err(FormatError::TooManyPoints { points: 3, limit: 2 })
        );
        assert!(read(b"1 2 3\n4 5 6", &Limits { max_points: 2 }).is_ok());
    }
}
