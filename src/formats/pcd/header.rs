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
    fields: Vec<&'a [u8]>,
    sizes: Vec<&'a [u8]>,
    types: Vec<&'a [u8]>,
    counts: Vec<&'a [u8]>,
    width: Option<u64>,
    height: Option<u64>,
    points: Option<u64>,
}

/// Largest number of values a point may have in one field.
const MAX_COUNT: usize = 1 << 20;

fn error(line: usize, reason: impl Into<String>) -> FormatError {
    FormatError::Header { format: Format::Pcd, line, reason: reason.into() }
}

fn unsigned(word: Option<&[u8]>, line: usize) -> Result<u64, FormatError> {
    let word = word.unwrap_or_default();
    let number = std::str::from_utf8(word).ok().and_then(|w| w.parse().ok());
    number.ok_or_else(|| error(line, format!("{:?} is no count", excerpt(word))))
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
        match keyword {
            b"VERSION" | b"VIEWPOINT" => {}
            b"FIELDS" | b"COLUMNS" => self.fields = words.collect(),
            b"SIZE" => self.sizes = words.collect(),
            b"TYPE" => self.types = words.collect(),
            b"COUNT" => self.counts = words.collect(),
            b"WIDTH" => self.width = Some(unsigned(words.next(), line)?),
            b"HEIGHT" => self.height = Some(unsigned(words.next(), line)?),
            b"POINTS" => self.points = Some(unsigned(words.next(), line)?),
            _ => return Err(error(line, format!("unknown keyword {}", excerpt(keyword)))),
        }
        Ok(())
    }

    fn into_header(self, data: Data, body: usize, line: usize) -> Result<Header<'a>, FormatError> {
        let fields = self.fields()?;
        let width = self.width.ok_or_else(|| error(line, "no WIDTH line"))?;
        let height = self.height.unwrap_or(1);
        let area = width.checked_mul(height);
        let points = self.points.or(area).ok_or_else(|| error(line, "WIDTH x HEIGHT overflows"))?;
        Ok(Header { fields, points, data, body, width, height })
    }

    fn fields(&self) -> Result<Vec<Field<'a>>, FormatError> {
        let n = self.fields.len();
        if n == 0 || self.sizes.len() != n || self.types.len() != n {
            return Err(error(1, "FIELDS, SIZE and TYPE must have as many entries"));
        }
        if !self.counts.is_empty() && self.counts.len() != n {
            return Err(error(1, "COUNT must have as many entries as FIELDS"));
        }
        let field = |i: usize| {
            let (size, kind) = (self.sizes[i], self.types[i]);
            let scalar = parse_scalar(kind, size).ok_or_else(|| {
                error(1, format!("unknown TYPE {} of SIZE {}", excerpt(kind), excerpt(size)))
            })?;
            let count = self.counts.get(i).map_or(Ok(1), |&count| unsigned(Some(count), 1))?;
            match usize::try_from(count) {
                Ok(count @ 1..=MAX_COUNT) => Ok(Field { name: self.fields[i], scalar, count }),
                _ => Err(error(1, format!("COUNT {count} is not in 1..={MAX_COUNT}"))),
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
