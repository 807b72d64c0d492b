//! PCD, the Point Cloud Library's format, version 0.7: ascii, binary and binary_compressed.
//!
//! An own reader for the same reasons as for PLY: memory speed, and no trust in announced counts.

mod header;
mod lzf;

use header::{Data, Header};

use super::{
    Bounds, Format, FormatError,
    memory::zeros,
    scalar::{Column, Endian, Scalar, decode_column, decode_records, hand_on_records},
    sink::{About, Singly, Sink},
    text::Words,
};
use crate::geometry::{PointCloud, Vec3};

/// Reads the points in their order; the holes of an organised cloud are NaN points.
pub(super) fn read(bytes: &[u8], limits: &dyn Bounds) -> Result<PointCloud, FormatError> {
    let header = Header::parse(bytes)?;
    let body = &bytes[header.body..];
    let points = match header.data {
        Data::Ascii => {
            let mut points = Vec::new();
            ascii(bytes, &header, limits, &mut points)?;
            points
        }
        Data::Binary => binary(body, &header, limits)?,
        Data::Compressed => compressed(body, &header, limits)?,
    };
    Ok(PointCloud { grid: header.grid(), ..PointCloud::from_points(points) })
}

fn truncated(header: &Header, found: u64) -> FormatError {
    FormatError::Truncated { format: Format::Pcd, announced: header.points, found }
}

/// Checks an announced count against what the bytes can hold, then against the limit.
fn checked_count(
    header: &Header,
    available: u64,
    limits: &dyn Bounds,
) -> Result<usize, FormatError> {
    if header.points > available {
        return Err(truncated(header, available));
    }
    limits.check(header.points)?;
    Ok(header.points as usize)
}

/// Hands on the points of a file that is not compressed; `None` for any other.
pub(super) fn pass(
    bytes: &[u8],
    limits: &dyn Bounds,
    sink: &mut dyn Sink,
) -> Result<Option<About>, FormatError> {
    let header = Header::parse(bytes)?;
    match header.data {
        Data::Ascii => ascii(bytes, &header, limits, sink)?,
        Data::Binary => {
            let (records, columns) = records(&bytes[header.body..], &header, limits)?;
            sink.expect(header.points)?;
            hand_on_records(records, header.stride(), Endian::Little, columns, sink)?;
        }
        // its coordinates stand one kind behind the other
        Data::Compressed => return Ok(None),
    }
    Ok(Some(About { grid: header.grid(), ..About::default() }))
}

fn binary(body: &[u8], header: &Header, limits: &dyn Bounds) -> Result<Vec<Vec3>, FormatError> {
    let (records, columns) = records(body, header, limits)?;
    decode_records(records, header.stride(), Endian::Little, columns)
}

/// The records of a binary body, and where the coordinates stand in each.
fn records<'a>(
    body: &'a [u8],
    header: &Header,
    limits: &dyn Bounds,
) -> Result<(&'a [u8], [Column; 3]), FormatError> {
    let count = checked_count(header, (body.len() / header.stride()) as u64, limits)?;
    let columns = header.coordinates()?.map(|place| {
        let offset = header.fields[..place].iter().map(|f| f.size()).sum();
        Column { scalar: header.fields[place].scalar, offset }
    });
    Ok((&body[..count * header.stride()], columns))
}

/// One LZF block with all values of the first field, then all of the second, and so on. Nothing but the
/// coordinates is kept of it, for a block may unpack to 88 times its size.
fn compressed(body: &[u8], header: &Header, limits: &dyn Bounds) -> Result<Vec<Vec3>, FormatError> {
    let damaged =
        |reason: &str| FormatError::Damaged { format: Format::Pcd, reason: reason.into() };
    let (block, unpacked) = block(body).ok_or_else(|| truncated(header, 0))?;
    if unpacked > block.len().saturating_mul(lzf::MAX_RATIO) {
        return Err(damaged("its compressed block cannot hold the announced size"));
    }
    let count = checked_count(header, (unpacked / header.stride()) as u64, limits)?;
    let mut points = zeros(count as u64)?;
    let mut columns = header.coordinates()?.map(|place| Lane {
        start: header.fields[..place].iter().map(|f| f.size() * count).sum(),
        stride: header.fields[place].size(),
        scalar: header.fields[place].scalar,
        done: 0,
    });
    let mut unpacker = lzf::Unpacker::new(block, unpacked);
    while columns.iter().any(|column| column.done < count) {
        limits.go_on()?;
        let window =
            unpacker.next().ok_or_else(|| damaged("its compressed block does not unpack"))?;
        for (axis, column) in columns.iter_mut().enumerate() {
            column.take(window, &mut points, axis);
        }
    }
    Ok(points)
}

/// The compressed block and the size it unpacks to.
fn block(body: &[u8]) -> Option<(&[u8], usize)> {
    let size = |at: usize| body.get(at..)?.first_chunk().map(|&b| u32::from_le_bytes(b) as usize);
    let (packed, unpacked) = (size(0)?, size(4)?);
    Some((body.get(8..)?.get(..packed)?, unpacked))
}

/// The values of one coordinate in what a block unpacks to, one behind the other.
struct Lane {
    /// Where the first one begins.
    start: usize,
    /// From one to the next.
    stride: usize,
    scalar: Scalar,
    /// How many have been read.
    done: usize,
}

impl Lane {
    /// Reads the values that end within `window`.
    fn take(&mut self, window: &lzf::Window, points: &mut [Vec3], axis: usize) {
        let ended = window.end().saturating_sub(self.start);
        let whole = (ended + self.stride).saturating_sub(self.scalar.size()) / self.stride;
        let whole = whole.min(points.len());
        let begin = self.start + self.done * self.stride;
        let Some(bytes) = begin.checked_sub(window.start).and_then(|at| window.bytes.get(at..))
        else {
            return;
        };
        if let Some(new) = points.get_mut(self.done..whole) {
            let column = Column { scalar: self.scalar, offset: 0 };
            decode_column(bytes, self.stride, Endian::Little, column, new, axis);
            self.done = whole;
        }
    }
}

/// Whether [`pass`] hands the points on.
pub(super) fn is_handed_on(bytes: &[u8]) -> bool {
    Header::parse(bytes).is_ok_and(|header| !matches!(header.data, Data::Compressed))
}

/// The points that the header announces, as far as the bytes can hold them.
///
/// # Errors
/// The header is wrong.
pub(super) fn most_points(bytes: &[u8]) -> Result<u64, FormatError> {
    let header = Header::parse(bytes)?;
    let body = &bytes[header.body..];
    let most = match header.data {
        // a number takes two bytes
        Data::Ascii => body.len().div_ceil(2 * header.fields.len()),
        Data::Binary => body.len() / header.stride(),
        Data::Compressed => body.len().saturating_mul(lzf::MAX_RATIO) / header.stride(),
    };
    Ok(header.points.min(most as u64))
}

fn ascii(
    bytes: &[u8],
    header: &Header,
    limits: &dyn Bounds,
    sink: &mut dyn Sink,
) -> Result<(), FormatError> {
    let mut words = Words::new(Format::Pcd, bytes, header.body);
    let per_point: usize = header.fields.iter().map(|f| f.count).sum();
    let available = (words.remaining() as u64).div_ceil(2 * per_point as u64);
    let count = checked_count(header, available, limits)?;
    let places = header
        .coordinates()?
        .map(|place| header.fields[..place].iter().map(|f| f.count).sum::<usize>());
    sink.expect(count as u64)?;
    let mut points = Singly::new(sink, limits);
    while points.count() < count {
        let mut point = Vec3::zeros();
        for place in 0..per_point {
            let word = words.next().ok_or_else(|| truncated(header, points.count() as u64))?;
            if let Some(axis) = places.iter().position(|&p| p == place) {
                point[axis] = words.number(word)?;
            }
        }
        points.push(point)?;
    }
    points.end()
}

#[cfg(test)]
pub(super) mod tests;
