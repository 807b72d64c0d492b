use super::super::{Format, FormatError, error::excerpt, scalar::Scalar};
use crate::geometry::Grid;

/// How the body is written.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Data {
    Ascii,
    Binary,
    Compressed,
}

/// A field of every point.
#[derive(Debug)]
pub(super) struct Field<'a> {
    name: &'a [u8],
    pub(super) scalar: Scalar,
    /// Values a point has in it.
    pub(super) count: usize,
}

impl Field<'_> {
    /// Bytes a point has in it.
    pub(super) fn size(&self) -> usize {
        self.scalar.size() * self.count
    }
}

/// A parsed header.
#[derive(Debug)]
pub(super) struct Header<'a> {
    pub(super) fields: Vec<Field<'a>>,
    pub(super) points: u64,
    pub(super) data: Data,
    /// Where the body starts.
    pub(super) body: usize,
    width: u64,
    height: u64,
}

/// The header's lines as they stand.
#[derive(Default)]
struct Entries<'a> {
    fields: Line<'a>,
    sizes: Line<'a>,
    types: Line<'a>,
    counts: Line<'a>,
    width: Option<u64>,
    height: Option<u64>,
    /// The count and its line.
    points: Option<(u64, usize)>,
}

/// The words of a line behind its keyword, and its number.
#[derive(Default)]
struct Line<'a> {
    words: Vec<&'a [u8]>,
    number: usize,
}

/// Largest number of values a point may have in one field.
const MAX_COUNT: usize = 1 << 20;

fn error(line: usize, reason: impl Into<String>) -> FormatError {
    FormatError::Header { format: Format::Pcd, line, reason: reason.into() }
}

fn unsigned(word: Option<&[u8]>, line: usize) -> Result<u64, FormatError> {
    let word = word.unwrap_or_default();
    let number = std::str::from_utf8(word).ok().and_then(|w| w.parse().ok());
    number.ok_or_else(|| error(line, format!("'{}' is no count", excerpt(word))))
}

impl<'a> Header<'a> {
    /// Parses the lines up to `DATA`.
    pub(super) fn parse(bytes: &'a [u8]) -> Result<Self, FormatError> {
        let (mut entries, mut position, mut number) = (Entries::default(), 0, 0);
        loop {
            number += 1;
            let rest = &bytes[position..];
            let end = rest.iter().position(|&b| b == b'\n');
            let end = end.ok_or_else(|| error(number, "the DATA line is missing"))?;
            position += end + 1;
            let mut words = rest[..end].split(u8::is_ascii_whitespace).filter(|w| !w.is_empty());
            let Some(keyword) = words.next().filter(|w| !w.starts_with(b"#")) else { continue };
            if keyword == b"DATA" {
                let data = parse_data(words.next(), number)?;
                return entries.into_header(data, position, number);
            }
            entries.take(keyword, words, number)?;
        }
    }

    /// Bytes of a point.
    pub(super) fn stride(&self) -> usize {
        self.fields.iter().map(Field::size).sum()
    }

    /// The places of x, y and z among the fields.
    pub(super) fn coordinates(&self) -> Result<[usize; 3], FormatError> {
        let find = |name: &[u8]| self.fields.iter().position(|f| f.name.eq_ignore_ascii_case(name));
        match (find(b"x"), find(b"y"), find(b"z")) {
            (Some(x), Some(y), Some(z)) => Ok([x, y, z]),
            _ => {
                let names: Vec<_> = self.fields.iter().take(12).map(|f| excerpt(f.name)).collect();
                Err(FormatError::NoCoordinates { format: Format::Pcd, found: names.join(", ") })
            }
        }
    }

    /// Rows and columns where the cloud is organised.
    pub(super) fn grid(&self) -> Option<Grid> {
        let fits = self.height > 1 && self.width.checked_mul(self.height) == Some(self.points);
        let (width, height) =
            (usize::try_from(self.width).ok()?, usize::try_from(self.height).ok()?);
        fits.then_some(Grid { width, height })
    }
}

impl<'a> Entries<'a> {
    fn take(
        &mut self,
        keyword: &[u8],
        mut words: impl Iterator<Item = &'a [u8]>,
        line: usize,
    ) -> Result<(), FormatError> {
        let mut all = || Line { words: words.by_ref().collect(), number: line };
        match keyword {
            b"VERSION" | b"VIEWPOINT" => {}
            b"FIELDS" | b"COLUMNS" => self.fields = all(),
            b"SIZE" => self.sizes = all(),
            b"TYPE" => self.types = all(),
            b"COUNT" => self.counts = all(),
            b"WIDTH" => self.width = Some(unsigned(words.next(), line)?),
            b"HEIGHT" => self.height = Some(unsigned(words.next(), line)?),
            b"POINTS" => self.points = Some((unsigned(words.next(), line)?, line)),
            _ => return Err(error(line, format!("unknown keyword {}", excerpt(keyword)))),
        }
        Ok(())
    }

    fn into_header(self, data: Data, body: usize, line: usize) -> Result<Header<'a>, FormatError> {
        let fields = self.fields(line)?;
        let (width, height) = match (self.width, self.height, self.points) {
            // files of version 0.5 have their points in one row
            (None, None, Some((points, _))) => (points, 1),
            (width, height, _) => {
                let width = width.ok_or_else(|| error(line, "no WIDTH line above this one"))?;
                (width, height.unwrap_or(1))
            }
        };
        let area = width.checked_mul(height);
        let area = area.ok_or_else(|| error(line, "WIDTH x HEIGHT overflows"))?;
        let points = match self.points {
            Some((points, line)) if points != area => {
                let reason = format!("POINTS {points} is not WIDTH {width} x HEIGHT {height}");
                return Err(error(line, reason));
            }
            _ => area,
        };
        Ok(Header { fields, points, data, body, width, height })
    }

    /// The fields that four lines describe; `end` is the header's last line.
    fn fields(&self, end: usize) -> Result<Vec<Field<'a>>, FormatError> {
        let n = self.fields.words.len();
        if n == 0 {
            return Err(error(end, "no FIELDS line above this one"));
        }
        for (keyword, line) in
            [("SIZE", &self.sizes), ("TYPE", &self.types), ("COUNT", &self.counts)]
        {
            // COUNT may be left out
            if line.words.len() != n && !(keyword == "COUNT" && line.words.is_empty()) {
                let at = if line.number > 0 { line.number } else { end };
                let found = line.words.len();
                let reason = format!("{keyword} has {found} entries and FIELDS has {n}");
                return Err(error(at, reason));
            }
        }
        let field = |i: usize| {
            let (size, kind) = (self.sizes.words[i], self.types.words[i]);
            let scalar = parse_scalar(kind, size).ok_or_else(|| {
                let reason = format!("unknown TYPE {} of SIZE {}", excerpt(kind), excerpt(size));
                error(self.types.number, reason)
            })?;
            let at = self.counts.number;
            let count = self.counts.words.get(i);
            let count = count.map_or(Ok(1), |&count| unsigned(Some(count), at))?;
            match usize::try_from(count) {
                Ok(count @ 1..=MAX_COUNT) => {
                    Ok(Field { name: self.fields.words[i], scalar, count })
                }
                _ => Err(error(at, format!("COUNT {count} is not in 1..={MAX_COUNT}"))),
            }
        };
        (0..n).map(field).collect()
    }
}

fn parse_data(word: Option<&[u8]>, line: usize) -> Result<Data, FormatError> {
    match word {
        Some(b"ascii") => Ok(Data::Ascii),
        Some(b"binary") => Ok(Data::Binary),
        Some(b"binary_compressed") => Ok(Data::Compressed),
        _ => Err(error(line, "DATA must be ascii, binary or binary_compressed")),
    }
}

fn parse_scalar(kind: &[u8], size: &[u8]) -> Option<Scalar> {
    Some(match (kind, size) {
        (b"I", b"1") => Scalar::I8,
        (b"I", b"2") => Scalar::I16,
        (b"I", b"4") => Scalar::I32,
        (b"I", b"8") => Scalar::I64,
        (b"U", b"1") => Scalar::U8,
        (b"U", b"2") => Scalar::U16,
        (b"U", b"4") => Scalar::U32,
        (b"U", b"8") => Scalar::U64,
        (b"F", b"4") => Scalar::F32,
        (b"F", b"8") => Scalar::F64,
        _ => return None,
    })
}
