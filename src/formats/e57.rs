//! E57 (ASTM E2807): the points of all scans in a file, in its common frame.

use std::io::Cursor;

use e57::{CartesianCoordinate, E57Reader, RecordDataType};

use super::{
    Bounds, Format, FormatError,
    guard::{check_density, guarded},
};
use crate::geometry::{PointCloud, Vec3};

/// Reads every scan, one behind the other, spherical coordinates converted and poses applied. Points the
/// scanner marked as invalid are holes.
pub(super) fn read(bytes: &[u8], limits: &dyn Bounds) -> Result<PointCloud, FormatError> {
    let points = guarded(Format::E57, || -> Result<_, e57::Error> {
        let mut reader = E57Reader::new(Cursor::new(bytes))?;
        let scans = reader.pointclouds();
        if let Err(error) = check(&scans, bytes.len(), limits) {
            return Ok(Err(error));
        }
        let mut points = Vec::new();
        for scan in &scans {
            for point in reader.pointcloud_simple(scan)? {
                if let Err(error) = limits.check(points.len() as u64 + 1) {
                    return Ok(Err(error));
                }
                match point {
                    Ok(point) => points.push(position(&point.cartesian)),
                    // a packet that completes no point; the next call goes on with the next packet
                    Err(e57::Error::Internal { .. }) => {}
                    Err(error) => return Err(error),
                }
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

fn check(scans: &[e57::PointCloud], bytes: usize, limits: &dyn Bounds) -> Result<(), FormatError> {
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

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::formats::Limits;
    use e57::{E57Writer, Record, RecordName, RecordValue};

    const POINTS: [[f64; 3]; 3] = [[1.5, -2.0, 1e6], [4.0, 5.0, 6.0], [7.0, 8.0, 9.0]];

    /// Two scans: one in doubles, its second point invalid, the other the same moved by a pose.
    pub(in crate::formats) fn file() -> Vec<u8> {
        let mut file = Cursor::new(Vec::new());
        let mut writer = E57Writer::new(&mut file, "file").unwrap();
        for (scan, shift) in [("a", 0.0), ("b", 100.0)] {
            let mut prototype =
                vec![Record::CARTESIAN_X_F64, Record::CARTESIAN_Y_F64, Record::CARTESIAN_Z_F64];
            let data_type = RecordDataType::Integer { min: 0, max: 2 };
            prototype.push(Record { name: RecordName::CartesianInvalidState, data_type });
            let mut points = writer.add_pointcloud(scan, prototype).unwrap();
            let translation = e57::Translation { x: shift, y: 0.0, z: 0.0 };
            let rotation = e57::Quaternion::default();
            points.set_transform(Some(e57::Transform { rotation, translation }));
            for (i, p) in POINTS.iter().enumerate() {
                let mut values: Vec<_> = p.iter().map(|&x| RecordValue::Double(x)).collect();
                values.push(RecordValue::Integer(if i == 1 { 2 } else { 0 }));
                points.add_point(values).unwrap();
            }
            points.finalize().unwrap();
        }
        writer.finalize().unwrap();
        drop(writer);
        file.into_inner()
    }

    #[test]
    fn all_scans_are_read_with_their_poses_and_holes() {
        let bytes = file();
        assert_eq!(Format::detect(&bytes), Some(Format::E57));
        let cloud = read(&bytes, &Limits { max_points: 6 }).unwrap();
        let xs: Vec<_> = cloud.points.iter().map(|p| p.x).collect();
        assert_eq!(xs, [1.5, 7.0, 101.5, 107.0]);
        assert_eq!(cloud.input_index, Some(vec![0, 2, 3, 5]));
        assert_eq!(
            read(&bytes, &Limits { max_points: 5 }),
            Err(FormatError::TooManyPoints { points: 6, limit: 5 })
        );
    }
}
