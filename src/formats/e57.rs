//! E57 (ASTM E2807): the points of all scans in a file, in its common frame.

use std::io::Cursor;

use e57::{CartesianCoordinate, E57Reader, RecordDataType, RecordName};

use super::{
    Bounds, Format, FormatError,
    guard::{MAX_POINTS_PER_BYTE, check_density, guarded},
    sink::{About, Singly, Sink},
};
use crate::geometry::{LengthUnit, PointCloud, Vec3};

/// Reads every scan, one behind the other, spherical coordinates converted and poses applied. Points the
/// scanner marked as invalid are holes.
pub(super) fn read(bytes: &[u8], limits: &dyn Bounds) -> Result<PointCloud, FormatError> {
    let mut points = Vec::new();
    Ok(pass(bytes, limits, &mut points)?.cloud(points))
}

/// Hands the points on, as [`read`] finds them.
pub(super) fn pass(
    bytes: &[u8],
    limits: &dyn Bounds,
    sink: &mut dyn Sink,
) -> Result<About, FormatError> {
    let resolution = guarded(Format::E57, || -> Result<_, e57::Error> {
        let mut reader = E57Reader::new(Cursor::new(bytes))?;
        let scans = reader.pointclouds();
        let expected =
            check(&scans, bytes.len(), limits).and_then(|()| sink.expect(records(&scans)));
        if let Err(error) = expected {
            return Ok(Err(error));
        }
        let mut points = Singly::new(sink, limits);
        let mut resolution = 0.0_f64;
        // the format allows a scan of no records to have no section in the file
        for scan in scans.iter().filter(|scan| scan.records > 0) {
            let scan = match upright(scan) {
                Ok(scan) => scan,
                Err(error) => return Ok(Err(error)),
            };
            let origin = scan.transform.as_ref().map(|pose| &pose.translation);
            let origin = origin.map_or(Vec3::zeros(), |t| Vec3::new(t.x, t.y, t.z));
            let mut farthest = 0.0_f64;
            for point in reader.pointcloud_simple(&scan)? {
                let point = match point {
                    Ok(point) => position(&point.cartesian),
                    // a packet that completes no point; the next call goes on with the next packet
                    Err(e57::Error::Internal { .. }) => continue,
                    Err(error) => return Err(error),
                };
                if let Err(error) = points.push(point) {
                    return Ok(Err(error));
                }
                let distance = (point - origin).norm();
                farthest = if distance.is_finite() { farthest.max(distance) } else { farthest };
            }
            resolution = resolution.max(step(&scan, farthest));
        }
        Ok(points.end().map(|()| resolution))
    })?;
    // the standard allows no other unit
    Ok(About { unit: Some(LengthUnit::M), resolution, grid: None })
}

/// The records that the header announces, as far as the bytes can hold them.
///
/// # Errors
/// The header is wrong.
pub(super) fn most_points(bytes: &[u8]) -> Result<u64, FormatError> {
    let reader = guarded(Format::E57, || E57Reader::new(Cursor::new(bytes)).map(Ok))?;
    let most = (bytes.len() as u64).saturating_mul(MAX_POINTS_PER_BYTE);
    Ok(records(&reader.pointclouds()).min(most))
}

/// The records of all scans.
fn records(scans: &[e57::PointCloud]) -> u64 {
    scans.iter().fold(0, |sum, scan| sum.saturating_add(scan.records))
}

/// The scan with the quaternion of its pose at length 1: another length would scale the points.
fn upright(scan: &e57::PointCloud) -> Result<e57::PointCloud, FormatError> {
    let mut scan = scan.clone();
    if let Some(pose) = &mut scan.transform {
        let q = &mut pose.rotation;
        let length = q.w.hypot(q.x).hypot(q.y.hypot(q.z));
        if !(length > 0.0 && length.is_finite()) {
            return Err(damaged("the rotation of a scan's pose is no quaternion"));
        }
        for part in [&mut q.w, &mut q.x, &mut q.y, &mut q.z] {
            *part /= length;
        }
    }
    Ok(scan)
}

/// The step in which the coordinates of a scan, up to the `farthest` from its origin, came before its pose was applied; nought
/// where none was or they are doubles.
fn step(scan: &e57::PointCloud, farthest: f64) -> f64 {
    if scan.transform.is_none() {
        return 0.0;
    }
    let farthest = farthest as f32;
    let is_length = |name: &RecordName| {
        use RecordName::{CartesianX, CartesianY, CartesianZ, SphericalRange};
        matches!(name, CartesianX | CartesianY | CartesianZ | SphericalRange)
    };
    let lengths = scan.prototype.iter().filter(|record| is_length(&record.name));
    let steps = lengths.map(|record| match record.data_type {
        RecordDataType::Single { .. } => f64::from(farthest.next_up() - farthest),
        RecordDataType::ScaledInteger { scale, .. } => scale.abs(),
        RecordDataType::Integer { .. } => 1.0,
        RecordDataType::Double { .. } => 0.0,
    });
    steps.filter(|step| step.is_finite()).fold(0.0, f64::max)
}

fn damaged(reason: &str) -> FormatError {
    FormatError::Damaged { format: Format::E57, reason: reason.into() }
}

/// Refuses a scan without coordinates: the library would give points without any.
fn check_coordinates((place, scan): (usize, &e57::PointCloud)) -> Result<(), FormatError> {
    if scan.has_cartesian() || scan.has_spherical() {
        return Ok(());
    }
    let names: Vec<_> = scan.prototype.iter().take(12).map(|r| format!("{:?}", r.name)).collect();
    Err(FormatError::ScanWithoutCoordinates { scan: place + 1, found: names.join(", ") })
}

fn position(coordinate: &CartesianCoordinate) -> Vec3 {
    match *coordinate {
        CartesianCoordinate::Valid { x, y, z } => Vec3::new(x, y, z),
        _ => Vec3::repeat(f64::NAN),
    }
}

fn check(scans: &[e57::PointCloud], bytes: usize, limits: &dyn Bounds) -> Result<(), FormatError> {
    let total = records(scans);
    check_density(Format::E57, total, bytes)?;
    limits.check(total)?;
    let mut full = scans.iter().enumerate().filter(|(_, scan)| scan.records > 0);
    full.try_for_each(check_coordinates)?;
    // records without a single bit end nowhere: the library would make them until memory is full
    let empty = |scan: &&e57::PointCloud| {
        scan.records > 0 && scan.prototype.iter().all(|r| is_constant(&r.data_type))
    };
    if scans.iter().any(|scan| empty(&scan)) {
        return Err(damaged("a scan's records have no bits"));
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
    use e57::{E57Writer, Record, RecordValue};

    const POINTS: [[f64; 3]; 3] = [[1.5, -2.0, 1e6], [4.0, 5.0, 6.0], [7.0, 8.0, 9.0]];

    /// Two scans: one in doubles, its second point invalid, the other the same moved by a pose.
    pub(in crate::formats) fn file() -> Vec<u8> {
        posed(e57::Quaternion::default(), &POINTS)
    }

    /// The same with another rotation of both, and other points.
    fn posed(rotation: e57::Quaternion, of: &[[f64; 3]]) -> Vec<u8> {
        let mut file = Cursor::new(Vec::new());
        let mut writer = E57Writer::new(&mut file, "file").unwrap();
        for (scan, shift, of) in [("a", 0.0, of), ("b", 100.0, &POINTS)] {
            let mut prototype =
                vec![Record::CARTESIAN_X_F64, Record::CARTESIAN_Y_F64, Record::CARTESIAN_Z_F64];
            let data_type = RecordDataType::Integer { min: 0, max: 2 };
            prototype.push(Record { name: RecordName::CartesianInvalidState, data_type });
            let mut points = writer.add_pointcloud(scan, prototype).unwrap();
            let translation = e57::Translation { x: shift, y: 0.0, z: 0.0 };
            points.set_transform(Some(e57::Transform { rotation: rotation.clone(), translation }));
            for (i, p) in of.iter().enumerate() {
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
        let cloud = read(&bytes, &Limits::of(6)).unwrap();
        let xs: Vec<_> = cloud.points.iter().map(|p| p.x).collect();
        assert_eq!(xs, [1.5, 7.0, 101.5, 107.0]);
        assert_eq!(cloud.input_index, Some(vec![0, 2, 3, 5]));
        assert_eq!(
            read(&bytes, &Limits::of(5)),
            Err(FormatError::TooManyPoints { points: 6, limit: 5 })
        );
    }

    #[test]
    fn lengths_are_metres_and_the_step_is_that_before_the_pose() {
        let cloud = read(&file(), &Limits::default()).unwrap();
        assert_eq!((cloud.unit, cloud.resolution), (Some(LengthUnit::M), 0.0));
        let mut scans = E57Reader::new(Cursor::new(file())).unwrap().pointclouds();
        let mut with = |data_type| {
            scans[1].prototype[2].data_type = data_type;
            step(&scans[1], 5.0)
        };
        // from 4 to 8 single numbers are 2^-21 apart
        assert_eq!(with(RecordDataType::Single { min: None, max: None }), 2_f64.powi(-21));
        let scaled = RecordDataType::ScaledInteger { min: 0, max: 9, scale: 1e-3, offset: 0.0 };
        assert_eq!(with(scaled), 1e-3);
        scans[1].transform = None;
        assert_eq!(step(&scans[1], 5.0), 0.0);
    }

    #[test]
    fn the_length_of_a_rotation_does_not_scale_the_points() {
        let turn = e57::Quaternion { w: 2.0, x: 0.0, y: 0.0, z: 2.0 };
        let cloud = read(&posed(turn, &POINTS), &Limits::default()).unwrap();
        // a quarter turn about z
        let first = Vec3::new(2.0, 1.5, 1e6);
        assert!((cloud.points[0] - first).norm() < 1e-9 * first.norm(), "{}", cloud.points[0]);
        let none = e57::Quaternion { w: 0.0, x: 0.0, y: 0.0, z: 0.0 };
        let error = read(&posed(none, &POINTS), &Limits::default()).unwrap_err();
        assert!(matches!(error, FormatError::Damaged { .. }), "{error}");
    }

    #[test]
    fn a_scan_without_records_is_passed_over() {
        let bytes = posed(e57::Quaternion::default(), &[]);
        let xs: Vec<_> =
            read(&bytes, &Limits::default()).unwrap().points.iter().map(|p| p.x).collect();
        assert_eq!(xs, [101.5, 107.0]);
    }

    #[test]
    fn a_scan_without_coordinates_is_refused_with_what_it_has() {
        let mut scans = E57Reader::new(Cursor::new(file())).unwrap().pointclouds();
        scans[1].prototype.remove(2);
        let error = check(&scans, 1000, &Limits::default()).unwrap_err();
        let found = "CartesianX, CartesianY, CartesianInvalidState".to_owned();
        assert_eq!(error, FormatError::ScanWithoutCoordinates { scan: 2, found });
    }
}
