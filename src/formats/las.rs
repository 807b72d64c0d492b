//! LAS and LAZ (ASPRS): coordinates in f64, as integers times scale plus offset.

use std::io::Cursor;

use super::{
    Format, FormatError, Limits,
    guard::{check_density, guarded},
};
use crate::geometry::{PointCloud, Vec3};

/// Bytes decoded at a time.
const BATCH_BYTES: usize = 1 << 20;
/// Longest point record of a compressed file; its decoder keeps some kilobytes for each byte of it.
const MAX_COMPRESSED_RECORD: usize = 1024;

/// Reads the points in their order.
pub(super) fn read(bytes: &[u8], limits: &Limits) -> Result<PointCloud, FormatError> {
    let file = without_extended_records(bytes)?;
    let points = guarded(Format::Las, || -> Result<_, las::Error> {
        let mut reader = las::Reader::new(Cursor::new(file))?;
        let header = reader.header();
        if let Err(error) = check(header, bytes, limits) {
            return Ok(Err(error));
        }
        let (total, record) = (header.number_of_points(), usize::from(header.point_format().len()));
        let batch = (BATCH_BYTES / record.max(1)).max(1) as u64;
        let mut points = Vec::new();
        while (points.len() as u64) < total {
            let read = reader.read_points(batch)?;
            if read.is_empty() {
                break;
            }
            let coordinates = read.x().zip(read.y()).zip(read.z());
            points.extend(coordinates.map(|((x, y), z)| Vec3::new(x, y, z)));
        }
        Ok(Ok(points))
    })?;
    Ok(PointCloud::from_points(points))
}

fn damaged(reason: &str) -> FormatError {
    FormatError::Damaged { format: Format::Las, reason: reason.into() }
}

fn check(header: &las::Header, bytes: &[u8], limits: &Limits) -> Result<(), FormatError> {
    let total = header.number_of_points();
    let record = usize::from(header.point_format().len());
    if header.point_format().is_compressed {
        if record > MAX_COMPRESSED_RECORD {
            let what = format!("point records of {record} bytes in compressed form");
            return Err(FormatError::Unsupported { format: Format::Las, what });
        }
        check_density(Format::Las, total, bytes.len())?;
        check_chunk_table(bytes)?;
    } else {
        let body = bytes.len().saturating_sub(point_offset(bytes).unwrap_or(bytes.len()));
        let found = (body / record.max(1)) as u64;
        if total > found {
            return Err(FormatError::Truncated { format: Format::Las, announced: total, found });
        }
    }
    limits.check(total)
}

fn u32_at(bytes: &[u8], at: usize) -> Option<usize> {
    let four = bytes.get(at..)?.first_chunk()?;
    usize::try_from(u32::from_le_bytes(*four)).ok()
}

fn u64_at(bytes: &[u8], at: usize) -> Option<usize> {
    let eight = bytes.get(at..)?.first_chunk()?;
    usize::try_from(u64::from_le_bytes(*eight)).ok()
}

/// Where the header says that the points start.
fn point_offset(bytes: &[u8]) -> Option<usize> {
    u32_at(bytes, 96)
}

/// A copy of the file that announces no extended variable length records.
///
/// They hold nothing about the points, and the library reserves whatever length they announce.
fn without_extended_records(bytes: &[u8]) -> Result<Vec<u8>, FormatError> {
    let offset = point_offset(bytes).filter(|&offset| offset <= bytes.len());
    let minor = bytes.get(25).copied();
    let (Some(_), Some(minor)) = (offset, minor) else {
        return Err(damaged("the file ends before its points start"));
    };
    let mut file = bytes.to_vec();
    // LAS 1.4: start of the first extended record (u64), number of them (u32)
    if let (4.., Some(announced)) = (minor, file.get_mut(235..247)) {
        announced.fill(0);
    }
    Ok(file)
}

/// The library reserves room for as many chunks as a compressed file announces: there must be bytes for
/// them.
fn check_chunk_table(bytes: &[u8]) -> Result<(), FormatError> {
    let start = point_offset(bytes).unwrap_or_default();
    let offset = |at: usize| u64_at(bytes, at).filter(|&o| o > start);
    let table = offset(start).or_else(|| offset(bytes.len().saturating_sub(8)));
    let chunks = table.and_then(|at| u32_at(bytes, at.checked_add(4)?));
    if chunks.is_some_and(|n| n > bytes.len()) {
        return Err(damaged("its chunk table announces more chunks than the file has bytes"));
    }
    Ok(())
}
