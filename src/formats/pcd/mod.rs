//! PCD, the Point Cloud Library's format, version 0.7: ascii, binary and binary_compressed.
//!
//! An own reader for the same reasons as for PLY: memory speed, and no trust in announced counts.

mod header;
mod lzf;

use header::{Data, Header};

use super::{
    Bounds, Format, FormatError,
    scalar::{Column, Endian, decode_column, decode_records},
    text::Words,
};
use crate::geometry::{PointCloud, Vec3};

/// Reads the points in their order; the holes of an organised cloud are NaN points.
pub(super) fn read(bytes: &[u8], limits: &dyn Bounds) -> Result<PointCloud, FormatError> {
    let header = Header::parse(bytes)?;
    let body = &bytes[header.body..];
    let points = match header.data {
        Data::Ascii => ascii(bytes, &header, limits)?,
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

fn binary(body: &[u8], header: &Header, limits: &dyn Bounds) -> Result<Vec<Vec3>, FormatError> {
    let count = checked_count(header, (body.len() / header.stride()) as u64, limits)?;
    let columns = header.coordinates()?.map(|place| {
        let offset = header.fields[..place].iter().map(|f| f.size()).sum();
        Column { scalar: header.fields[place].scalar, offset }
    });
    let records = &body[..count * header.stride()];
    Ok(decode_records(records, header.stride(), Endian::Little, columns))
}

/// One LZF block with all values of the first field, then all of the second, and so on.
fn compressed(body: &[u8], header: &Header, limits: &dyn Bounds) -> Result<Vec<Vec3>, FormatError> {
    let damaged =
        |reason: &str| FormatError::Damaged { format: Format::Pcd, reason: reason.into() };
    let size = |at: usize| body.get(at..)?.first_chunk().map(|&b| u32::from_le_bytes(b) as usize);
    let (Some(packed), Some(unpacked)) = (size(0), size(4)) else {
        return Err(truncated(header, 0));
    };
    let block = body.get(8..).and_then(|b| b.get(..packed)).ok_or_else(|| truncated(header, 0))?;
    if unpacked > block.len().saturating_mul(lzf::MAX_RATIO) {
        return Err(damaged("its compressed block cannot hold the announced size"));
    }
    let count = checked_count(header, (unpacked / header.stride()) as u64, limits)?;
    let columns = header.coordinates()?;
    let data = lzf::decompress(block, unpacked);
    let data = data.ok_or_else(|| damaged("its compressed block does not unpack"))?;
    let mut points = vec![Vec3::zeros(); count];
    for (axis, place) in columns.into_iter().enumerate() {
        let start: usize = header.fields[..place].iter().map(|f| f.size() * count).sum();
        let field = &header.fields[place];
        let values = &data[start..start + field.size() * count];
        let column = Column { scalar: field.scalar, offset: 0 };
        decode_column(values, field.size(), Endian::Little, column, &mut points, axis);
    }
    Ok(points)
}

fn ascii(bytes: &[u8], header: &Header, limits: &dyn Bounds) -> Result<Vec<Vec3>, FormatError> {
    let mut words = Words::new(Format::Pcd, bytes, header.body);
    let per_point: usize = header.fields.iter().map(|f| f.count).sum();
    let available = (words.remaining() as u64).div_ceil(2 * per_point as u64);
    let count = checked_count(header, available, limits)?;
    let places = header
        .coordinates()?
        .map(|place| header.fields[..place].iter().map(|f| f.count).sum::<usize>());
    let mut points = Vec::with_capacity(count);
    while points.len() < count {
        limits.check(points.len() as u64 + 1)?;
        let mut point = Vec3::zeros();
        for place in 0..per_point {
            let word = words.next().ok_or_else(|| truncated(header, points.len() as u64))?;
            if let Some(axis) = places.iter().position(|&p| p == place) {
                point[axis] = words.number(word)?;
            }
        }
        points.push(point);
    }
    Ok(points)
}

#[cfg(test)]
pub(super) mod tests;
