use super::super::{
    Bounds, Format, FormatError,
    memory::room_for,
    scalar::{Column, Endian, Scalar, decode_records, hand_on_records},
    sink::Sink,
};
use super::header::{Element, Header, Kind, Vertex};
use crate::geometry::Vec3;

/// Reads the vertices of a binary body.
pub(super) fn read(
    bytes: &[u8],
    header: &Header,
    vertex: &Vertex,
    endian: Endian,
    limits: &dyn Bounds,
) -> Result<Vec<Vec3>, FormatError> {
    let element = &header.elements[vertex.element];
    let mut body = body(bytes, header, vertex, endian)?;
    match element.stride() {
        Some(stride) => {
            let Records { bytes, stride, columns } = fixed(&body, element, vertex, stride, limits)?;
            decode_records(bytes, stride, endian, columns)
        }
        None => varying(&mut body, element, vertex, limits),
    }
}

/// Hands on the vertices of a binary body, in records of this length.
pub(super) fn pass(
    bytes: &[u8],
    header: &Header,
    vertex: &Vertex,
    (endian, stride): (Endian, usize),
    (limits, sink): (&dyn Bounds, &mut dyn Sink),
) -> Result<(), FormatError> {
    let element = &header.elements[vertex.element];
    let body = body(bytes, header, vertex, endian)?;
    let Records { bytes, stride, columns } = fixed(&body, element, vertex, stride, limits)?;
    sink.expect(element.count)?;
    hand_on_records(bytes, stride, endian, columns, sink)
}

/// The body from the vertices on.
fn body<'a>(
    bytes: &'a [u8],
    header: &Header,
    vertex: &Vertex,
    endian: Endian,
) -> Result<Body<'a>, FormatError> {
    let mut body = Body::new(&bytes[header.body..], endian);
    let count = header.elements[vertex.element].count;
    for other in &header.elements[..vertex.element] {
        body.skip(other).ok_or_else(|| truncated(count, 0))?;
    }
    Ok(body)
}

fn truncated(announced: u64, found: u64) -> FormatError {
    FormatError::Truncated { format: Format::Ply, announced, found }
}

/// Records of one length, and where the coordinates stand in each.
struct Records<'a> {
    bytes: &'a [u8],
    stride: usize,
    columns: [Column; 3],
}

fn fixed<'a>(
    body: &Body<'a>,
    element: &Element,
    vertex: &Vertex,
    stride: usize,
    limits: &dyn Bounds,
) -> Result<Records<'a>, FormatError> {
    let available = (body.rest.len() / stride) as u64;
    if element.count > available {
        return Err(truncated(element.count, available));
    }
    limits.check(element.count)?;
    let columns = vertex.coordinates.map(|place| column(element, place));
    let records = &body.rest[..element.count as usize * stride];
    Ok(Records { bytes: records, stride, columns })
}

/// The column of the scalar property at `place` of an element without lists.
fn column(element: &Element, place: usize) -> Column {
    let size = |kind| match kind {
        Kind::Scalar(scalar) | Kind::List { item: scalar, .. } => scalar.size(),
    };
    let offset = element.properties[..place].iter().map(|p| size(p.kind)).sum();
    let (Kind::Scalar(scalar) | Kind::List { item: scalar, .. }) = element.properties[place].kind;
    Column { scalar, offset }
}

/// Records with lists in them: each is walked.
fn varying(
    body: &mut Body,
    element: &Element,
    vertex: &Vertex,
    limits: &dyn Bounds,
) -> Result<Vec<Vec3>, FormatError> {
    // a record has a byte at least, a list's count
    let most = element.count.min(body.rest.len() as u64);
    let mut points = room_for(most.min(limits.most()))?;
    while (points.len() as u64) < element.count {
        limits.check(points.len() as u64 + 1)?;
        let point = body.record(element, vertex.coordinates);
        points.push(point.ok_or_else(|| truncated(element.count, points.len() as u64))?);
    }
    Ok(points)
}

/// The bytes not yet read.
pub(super) struct Body<'a> {
    rest: &'a [u8],
    endian: Endian,
}

impl<'a> Body<'a> {
    pub(super) fn new(rest: &'a [u8], endian: Endian) -> Self {
        Self { rest, endian }
    }

    fn advance(&mut self, bytes: usize) -> Option<()> {
        self.rest = self.rest.get(bytes..)?;
        Some(())
    }

    /// Passes over a whole element; `None` where the bytes end first.
    pub(super) fn skip(&mut self, element: &Element) -> Option<()> {
        if let Some(stride) = element.stride() {
            return self.advance(usize::try_from(element.count).ok()?.checked_mul(stride)?);
        }
        for _ in 0..element.count {
            element.properties.iter().try_for_each(|p| self.property(p.kind).map(drop))?;
        }
        Some(())
    }

    /// Passes over one property and gives the scalar's value (the count for a list).
    pub(super) fn property(&mut self, kind: Kind) -> Option<f64> {
        let (Kind::Scalar(scalar) | Kind::List { count: scalar, .. }) = kind;
        let value = scalar.read(self.endian, self.rest)?;
        self.advance(scalar.size())?;
        if let Kind::List { item, .. } = kind {
            // a negative count becomes zero: the list is empty
            self.advance((value as usize).checked_mul(item.size())?)?;
        }
        Some(value)
    }

    /// Reads a list of places into `items`, those there were given up.
    pub(super) fn list(&mut self, count: Scalar, item: Scalar, items: &mut Vec<u32>) -> Option<()> {
        items.clear();
        let length = count.read(self.endian, self.rest)? as usize;
        self.advance(count.size())?;
        let bytes = self.rest.get(..length.checked_mul(item.size())?)?;
        // a negative place becomes the first: such a face is as good as none
        items.extend(
            bytes.chunks(item.size()).filter_map(|b| Some(item.read(self.endian, b)? as u32)),
        );
        self.advance(bytes.len())
    }

    fn record(&mut self, element: &Element, coordinates: [usize; 3]) -> Option<Vec3> {
        let mut point = Vec3::zeros();
        for (place, property) in element.properties.iter().enumerate() {
            let value = self.property(property.kind)?;
            if let Some(axis) = coordinates.iter().position(|&c| c == place) {
                point[axis] = value;
            }
        }
        Some(point)
    }
}
