use super::super::{
    Format, FormatError,
    error::excerpt,
    scalar::{Endian, Scalar},
};
use crate::geometry::Grid;

/// How the body is written.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Encoding {
    Ascii,
    Binary(Endian),
}

/// What a property holds in each record.
#[derive(Clone, Copy, Debug)]
pub(super) enum Kind {
    Scalar(Scalar),
    /// A count, then that many items.
    List {
        count: Scalar,
        item: Scalar,
    },
}

/// A named column of an element.
#[derive(Debug)]
pub(super) struct Property<'a> {
    pub(super) name: &'a [u8],
    pub(super) kind: Kind,
}

/// A table of the body.
#[derive(Debug)]
pub(super) struct Element<'a> {
    name: &'a [u8],
    pub(super) count: u64,
    pub(super) properties: Vec<Property<'a>>,
}

/// The element with the points.
pub(super) struct Vertex {
    /// Its place among the elements.
    pub(super) element: usize,
    /// The places of x, y and z among its properties.
    pub(super) coordinates: [usize; 3],
}

/// A parsed header.
#[derive(Debug)]
pub(super) struct Header<'a> {
    pub(super) encoding: Encoding,
    pub(super) elements: Vec<Element<'a>>,
    /// Where the body starts.
    pub(super) body: usize,
    columns: Option<u64>,
    rows: Option<u64>,
}

fn error(line: usize, reason: impl Into<String>) -> FormatError {
    FormatError::Header { format: Format::Ply, line, reason: reason.into() }
}

impl<'a> Header<'a> {
    /// Parses the lines up to `end_header`.
    pub(super) fn parse(bytes: &'a [u8]) -> Result<Self, FormatError> {
        let end = if is_cr_alone(bytes) { b'\r' } else { b'\n' };
        let mut lines = Lines { bytes, position: 0, number: 0, end };
        if lines.next() != Some(b"ply") {
            return Err(error(1, "the first line must be \"ply\""));
        }
        let mut encoding = None;
        let mut header = Self {
            encoding: Encoding::Ascii,
            elements: vec![],
            body: 0,
            columns: None,
            rows: None,
        };
        loop {
            let line = lines.next().ok_or_else(|| error(lines.number, "end_header is missing"))?;
            let mut words = line.split(u8::is_ascii_whitespace).filter(|w| !w.is_empty());
            match words.next().unwrap_or_default() {
                b"end_header" => break,
                b"" | b"comment" => {}
                b"obj_info" => header.obj_info(words),
                b"format" => encoding = Some(parse_encoding(words.next(), lines.number)?),
                b"element" => header.elements.push(parse_element(words, lines.number)?),
                b"property" => {
                    let element = header.elements.last_mut();
                    let element = element
                        .ok_or_else(|| error(lines.number, "a property before any element"))?;
                    element.properties.push(parse_property(words, lines.number)?);
                }
                word => {
                    return Err(error(lines.number, format!("unknown keyword {}", excerpt(word))));
                }
            }
        }
        header.body = lines.position;
        header.encoding = encoding.ok_or_else(|| error(lines.number, "no format line"))?;
        Ok(header)
    }

    fn obj_info(&mut self, mut words: impl Iterator<Item = &'a [u8]>) {
        let (name, value) = (words.next(), words.next().and_then(unsigned));
        match name {
            Some(b"num_cols") => self.columns = value,
            Some(b"num_rows") => self.rows = value,
            _ => {}
        }
    }

    /// The element that holds the points: `vertex`, or else the first one with x, y and z.
    pub(super) fn vertex(&self) -> Result<Vertex, FormatError> {
        let named = self.elements.iter().position(|e| e.name == b"vertex");
        let candidates = named.map_or(0..self.elements.len(), |i| i..i + 1);
        candidates
            .filter_map(|element| {
                let coordinates = self.elements[element].coordinates()?;
                Some(Vertex { element, coordinates })
            })
            .next()
            .ok_or_else(|| FormatError::NoCoordinates {
                format: Format::Ply,
                found: self.field_names(),
            })
    }

    fn field_names(&self) -> String {
        let names: Vec<_> = self
            .elements
            .iter()
            .flat_map(|e| e.properties.iter().map(|p| (e.name, p)))
            .take(12)
            .map(|(e, p)| {
                let list = if matches!(p.kind, Kind::List { .. }) { " (a list)" } else { "" };
                format!("{}.{}{list}", excerpt(e), excerpt(p.name))
            })
            .collect();
        if names.is_empty() { "none".into() } else { names.join(", ") }
    }

    /// The grid the header states, where it has as many cells as there are points.
    pub(super) fn grid(&self, points: usize) -> Option<Grid> {
        let (width, height) =
            (usize::try_from(self.columns?).ok()?, usize::try_from(self.rows?).ok()?);
        (width.checked_mul(height)? == points).then_some(Grid { width, height })
    }
}

impl Property<'_> {
    pub(super) fn is_named(&self, name: &str) -> bool {
        self.name == name.as_bytes()
    }
}

impl Element<'_> {
    pub(super) fn is_named(&self, name: &str) -> bool {
        self.name == name.as_bytes()
    }

    /// Bytes of a binary record; `None` where lists make it vary.
    pub(super) fn stride(&self) -> Option<usize> {
        self.properties.iter().try_fold(0, |sum, p| match p.kind {
            Kind::Scalar(s) => Some(sum + s.size()),
            Kind::List { .. } => None,
        })
    }

    fn coordinates(&self) -> Option<[usize; 3]> {
        let find = |name: &[u8]| {
            self.properties.iter().position(|p| {
                matches!(p.kind, Kind::Scalar(_)) && p.name.eq_ignore_ascii_case(name)
            })
        };
        Some([find(b"x")?, find(b"y")?, find(b"z")?])
    }
}

fn parse_encoding(word: Option<&[u8]>, line: usize) -> Result<Encoding, FormatError> {
    match word {
        Some(b"ascii") => Ok(Encoding::Ascii),
        Some(b"binary_little_endian") => Ok(Encoding::Binary(Endian::Little)),
        Some(b"binary_big_endian") => Ok(Encoding::Binary(Endian::Big)),
        _ => Err(error(line, "format must be ascii, binary_little_endian or binary_big_endian")),
    }
}

fn parse_element<'a>(
    mut words: impl Iterator<Item = &'a [u8]>,
    line: usize,
) -> Result<Element<'a>, FormatError> {
    let name = words.next().ok_or_else(|| error(line, "an element without a name"))?;
    let count = words.next().and_then(unsigned);
    let count = count.ok_or_else(|| error(line, "an element needs a count, zero or more"))?;
    Ok(Element { name, count, properties: vec![] })
}

fn parse_property<'a>(
    mut words: impl Iterator<Item = &'a [u8]>,
    line: usize,
) -> Result<Property<'a>, FormatError> {
    let scalar = |word: Option<&[u8]>| {
        let word = word.unwrap_or_default();
        parse_scalar(word).ok_or_else(|| error(line, format!("unknown type {}", excerpt(word))))
    };
    let kind = match words.next() {
        Some(b"list") => {
            let (count, item) = (scalar(words.next())?, scalar(words.next())?);
            if matches!(count, Scalar::F32 | Scalar::F64) {
                return Err(error(line, "the count of a list must have an integer type"));
            }
            Kind::List { count, item }
        }
        word => Kind::Scalar(scalar(word)?),
    };
    let name = words.next().ok_or_else(|| error(line, "a property without a name"))?;
    Ok(Property { name, kind })
}

pub(super) fn parse_scalar(word: &[u8]) -> Option<Scalar> {
    Some(match word {
        b"char" | b"int8" => Scalar::I8,
        b"uchar" | b"uint8" => Scalar::U8,
        b"short" | b"int16" => Scalar::I16,
        b"ushort" | b"uint16" => Scalar::U16,
        b"int" | b"int32" => Scalar::I32,
        b"uint" | b"uint32" => Scalar::U32,
        b"int64" => Scalar::I64,
        b"uint64" => Scalar::U64,
        b"float" | b"float32" => Scalar::F32,
        b"double" | b"float64" => Scalar::F64,
        _ => return None,
    })
}

fn unsigned(word: &[u8]) -> Option<u64> {
    std::str::from_utf8(word).ok()?.parse().ok()
}

/// Whether the header's lines end with CR and no LF, as its first one does.
fn is_cr_alone(bytes: &[u8]) -> bool {
    let end = bytes.iter().position(|b| matches!(b, b'\r' | b'\n'));
    end.is_some_and(|i| bytes[i] == b'\r' && bytes.get(i + 1) != Some(&b'\n'))
}

/// Header lines, ended by LF or CR LF, or by CR alone.
struct Lines<'a> {
    bytes: &'a [u8],
    position: usize,
    number: usize,
    end: u8,
}

impl<'a> Lines<'a> {
    fn next(&mut self) -> Option<&'a [u8]> {
        let rest = &self.bytes[self.position..];
        // a line without its end is no line of a header
        let end = rest.iter().position(|&b| b == self.end)?;
        self.position += end + 1;
        self.number += 1;
        Some(rest[..end].trim_ascii())
    }
}
