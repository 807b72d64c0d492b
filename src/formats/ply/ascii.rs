use super::super::{
    Bounds, Format, FormatError,
    sink::{Singly, Sink},
    text::Words,
};
use super::header::{Element, Header, Kind, Vertex};
use crate::geometry::Vec3;

/// Reads the vertices of an ascii body: words between white space, whatever their lines.
pub(super) fn read(
    bytes: &[u8],
    header: &Header,
    vertex: &Vertex,
    limits: &dyn Bounds,
) -> Result<Vec<Vec3>, FormatError> {
    let mut points = Vec::new();
    pass(bytes, header, vertex, limits, &mut points)?;
    Ok(points)
}

/// Hands the vertices of an ascii body on.
pub(super) fn pass(
    bytes: &[u8],
    header: &Header,
    vertex: &Vertex,
    limits: &dyn Bounds,
    sink: &mut dyn Sink,
) -> Result<(), FormatError> {
    let mut words = Words::new(Format::Ply, bytes, header.body);
    let element = &header.elements[vertex.element];
    let truncated =
        |found| FormatError::Truncated { format: Format::Ply, announced: element.count, found };
    for other in &header.elements[..vertex.element] {
        skip(&mut words, other)?.ok_or_else(|| truncated(0))?;
    }
    // a number and the space behind it take two bytes
    let available = (words.remaining() as u64).div_ceil(2 * element.properties.len() as u64);
    if element.count > available {
        return Err(truncated(available));
    }
    limits.check(element.count)?;
    sink.expect(element.count)?;
    let mut points = Singly::new(sink, limits);
    for _ in 0..element.count {
        let point = record(&mut words, element, vertex.coordinates)?;
        points.push(point.ok_or_else(|| truncated(points.count() as u64))?)?;
    }
    points.end()
}

fn record(
    words: &mut Words,
    element: &Element,
    coordinates: [usize; 3],
) -> Result<Option<Vec3>, FormatError> {
    let mut point = Vec3::zeros();
    for (place, property) in element.properties.iter().enumerate() {
        let Some(word) = words.next() else { return Ok(None) };
        if let Some(axis) = coordinates.iter().position(|&c| c == place) {
            point[axis] = words.number(word)?;
        } else if skip_list(words, property.kind, word)?.is_none() {
            return Ok(None);
        }
    }
    Ok(Some(point))
}

/// Passes over a whole element; `None` where the words end first.
pub(super) fn skip(words: &mut Words, element: &Element) -> Result<Option<()>, FormatError> {
    if element.properties.is_empty() {
        return Ok(Some(()));
    }
    for _ in 0..element.count {
        for property in &element.properties {
            let Some(word) = words.next() else { return Ok(None) };
            if skip_list(words, property.kind, word)?.is_none() {
                return Ok(None);
            }
        }
    }
    Ok(Some(()))
}

/// Passes over a list's items; `word` is its count.
pub(super) fn skip_list(
    words: &mut Words,
    kind: Kind,
    word: &[u8],
) -> Result<Option<()>, FormatError> {
    let Kind::List { .. } = kind else { return Ok(Some(())) };
    let count: Option<u64> = std::str::from_utf8(word).ok().and_then(|w| w.parse().ok());
    let count = count.ok_or_else(|| words.bad_number(word))?;
    Ok((0..count).try_for_each(|_| words.next().map(drop)))
}
