//! E57 (ASTM E2807): the points of all scans in a file, in its common frame.

use std::io::Cursor;

use e57::{CartesianCoordinate, E57Reader, RecordDataType};

use super::{
    Format, FormatError, Limits,
    guard::{check_density, guarded},
};
use crate::geometry::{PointCloud, Vec3};

/// Reads every scan, one behind the other, spherical coordinates converted and poses applied. Points the
/// scanner marked as invalid are holes.
pub(super) fn read(bytes: &[u8], limits: &Limits) -> Result<PointCloud, FormatError> {
    let points = guarded(Format::E57, || -> Result<_, e57::Error> {
        let mut reader = E57Reader::new(Cursor::new(bytes))?;
        let scans = reader.pointclouds();
        if let Err(error) = check(&scans, bytes.len(), limits) {
            return Ok(Err(error));
        }
        let mut points = Vec::new();
        for scan in &scans {
            for point in reader.pointcloud_simple(scan)? {
                points.push(position(&point?.cartesian));
            }
        }
        Ok(Ok(points))
    })?;
    Ok(PointCloud::from_points(points))
}

fn position(coordinate: &CartesianCoordinate) -> Vec3 {
    match *coordinate {
        CartesianCoordinate::Valid { x, y, z } => Vec3::new(x, y, z),
        _ => Vec3::repeat(f64::NAN),
    }
}

fn check(scans: &[e57::PointCloud], bytes: usize, limits: &Limits) -> Result<(), FormatError> {
    let total = scans.iter().fold(0u64, |sum, scan| sum.saturating_add(scan.records));
    check_density(Format::E57, total, bytes)?;
    limits.check(total)?;
    // records without a single bit end nowhere: the library would make them until memory is full
    let empty = |scan: &&e57::PointCloud| scan.prototype.iter().all(|r| is_constant(&r.data_type));
    if scans.iter().find(empty).is_some() {
        let reason = "a scan's records have no bits".into();
        return Err(FormatError::Damaged { format: Format::E57, reason });
    }
    Ok(())
}

fn is_constant(data_type: &RecordDataType) -> bool {
    match data_type {
        RecordDataType::Integer { min, max } => min >= max,
        RecordDataType::ScaledInteger { min, max, .. } => min >= max,
        _ => false,
    }
}
