//! LAS and LAZ (ASPRS): coordinates in f64, as integers times scale plus offset.

mod header;
mod laz;
mod records;
mod unit;

use std::{io::Cursor, sync::atomic::Ordering, thread};

use self::header::{damaged, point_offset, u16_at, u32_at, u64_at};
use super::{
    Bounds, Format, FormatError,
    guard::{MAX_POINTS_PER_BYTE, check_density, guarded},
    sink::{About, Sink},
};
use crate::geometry::{LengthUnit, PointCloud, Vec3};

/// The bit of the point format that LAZ sets.
const COMPRESSED: u8 = 128;
/// Bytes decoded at a time.
const BATCH_BYTES: usize = 1 << 20;

/// Reads the points in their order.
pub(super) fn read(bytes: &[u8], limits: &dyn Bounds) -> Result<PointCloud, FormatError> {
    let mut points = Vec::new();
    Ok(pass(bytes, limits, &mut points)?.cloud(points))
}

/// Hands the points on in their order.
pub(super) fn pass(
    bytes: &[u8],
    limits: &dyn Bounds,
    sink: &mut dyn Sink,
) -> Result<About, FormatError> {
    let start = point_offset(bytes).filter(|offset| *offset <= bytes.len());
    let start = start.ok_or_else(|| damaged("the file ends before its points start"))?;
    let head = without_extended_records(&bytes[..start]);
    // on a stack of its own: the library's recursions are stopped, but not at once
    let unit = thread::scope(|scope| {
        let thread = thread::Builder::new().stack_size(laz::STACK);
        let reading = thread.spawn_scoped(scope, || read_file(&head, bytes, limits, sink));
        let reading =
            reading.map_err(|_| FormatError::OutOfMemory { points: most_points(bytes) })?;
        reading.join().unwrap_or_else(|_| Err(damaged("its contents contradict each other")))
    })?;
    Ok(About { unit, ..About::default() })
}

/// Reads a file that begins with `head`, made of the same part of `bytes`.
fn read_file(
    head: &[u8],
    bytes: &[u8],
    limits: &dyn Bounds,
    sink: &mut dyn Sink,
) -> Result<Option<LengthUnit>, FormatError> {
    guarded(Format::Las, || -> Result<_, las::Error> {
        // the header alone first: making a reader already reserves what a compressed file announces
        let header = las::Header::new(Cursor::new(head))?;
        let unit = unit::unit(&header);
        let (points_end, layers) = match check(&header, bytes, limits) {
            Ok(checked) => checked,
            Err(error) => return Ok(Err(error)),
        };
        if let Err(error) = sink.expect(header.number_of_points()) {
            return Ok(Err(error));
        }
        if !header.point_format().is_compressed {
            let records = &bytes[head.len()..];
            return Ok(records::hand_on(&header, records, limits, sink).map(|()| unit));
        }
        let mut file = [head, &bytes[head.len()..]].concat();
        let mut end_of_points = points_end;
        if let Some(layers) = layers {
            (file, end_of_points) = layers.of_coordinates(&file, points_end);
        }
        let (window, end) = laz::Window::new(file);
        let mut reader = las::Reader::new(window)?;
        end.store(end_of_points, Ordering::Relaxed);
        Ok(hand_on(&mut reader, limits, sink)?.map(|()| unit))
    })
}

/// Hands on the points of a compressed file.
fn hand_on(
    reader: &mut las::Reader,
    limits: &dyn Bounds,
    sink: &mut dyn Sink,
) -> las::Result<Result<(), FormatError>> {
    let header = reader.header();
    let (total, record) = (header.number_of_points(), usize::from(header.point_format().len()));
    let batch = (BATCH_BYTES / record.max(1)).max(1) as u64;
    let (mut done, mut points) = (0, Vec::new());
    while done < total {
        if let Err(error) = limits.go_on() {
            return Ok(Err(error));
        }
        let read = reader.read_points(batch.min(total - done))?;
        if read.is_empty() {
            break;
        }
        points.clear();
        let coordinates = read.x().zip(read.y()).zip(read.z());
        points.extend(coordinates.map(|((x, y), z)| Vec3::new(x, y, z)));
        done += points.len() as u64;
        if let Err(error) = sink.take(&points) {
            return Ok(Err(error));
        }
    }
    Ok(Ok(()))
}

/// Holds what the header announces against the bytes; gives where the points end, and their layers if they
/// are in such.
fn check(
    header: &las::Header,
    bytes: &[u8],
    limits: &dyn Bounds,
) -> Result<(u64, Option<laz::Layers>), FormatError> {
    let announced = header.number_of_points();
    let checked = if header.point_format().is_compressed {
        check_density(Format::Las, announced, bytes.len())?;
        let is_laz = |v: &&las::Vlr| v.user_id == "laszip encoded" && v.record_id == 22204;
        let vlr = header.vlrs().iter().find(is_laz);
        laz::check(bytes, &vlr.ok_or_else(|| damaged("its LAZ record is missing"))?.data)?
    } else {
        let body = bytes.len().saturating_sub(point_offset(bytes).unwrap_or_default());
        let found = (body / usize::from(header.point_format().len()).max(1)) as u64;
        if announced > found {
            return Err(FormatError::Truncated { format: Format::Las, announced, found });
        }
        (bytes.len() as u64, None)
    };
    limits.check(announced)?;
    Ok(checked)
}

/// A copy of what stands before the points that announces no extended variable length records.
///
/// They hold nothing about the points, and the library reserves whatever length they announce.
fn without_extended_records(head: &[u8]) -> Vec<u8> {
    let mut copy = head.to_vec();
    // LAS 1.4: start of the first extended record (u64), number of them (u32)
    if let (Some(4..), Some(announced)) = (head.get(25), copy.get_mut(235..247)) {
        announced.fill(0);
    }
    copy
}

/// Whether the header says that its points are compressed.
pub(super) fn is_compressed(bytes: &[u8]) -> bool {
    bytes.get(104).is_some_and(|format| format & COMPRESSED != 0)
}

/// The points that the header announces, as far as the bytes can hold them.
pub(super) fn most_points(bytes: &[u8]) -> u64 {
    // the older count is 0 where it is too small, the newer one is there from version 1.4 on
    let older = u32_at(bytes, 107).unwrap_or_default();
    let newer = bytes.get(25).filter(|minor| **minor >= 4).and_then(|_| u64_at(bytes, 247));
    let announced = newer.unwrap_or_default().max(older) as u64;
    let most = if is_compressed(bytes) {
        (bytes.len() as u64).saturating_mul(MAX_POINTS_PER_BYTE)
    } else {
        let record = u16_at(bytes, 105).unwrap_or_default().max(1);
        let body = bytes.len().saturating_sub(point_offset(bytes).unwrap_or_default());
        (body / record) as u64
    };
    announced.min(most)
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::formats::Limits;

    /// A survey-like cloud far from the origin, with a step of 0.1 mm.
    pub(in crate::formats) fn file(format: u8, compressed: bool, n: usize) -> (Vec<u8>, Vec<Vec3>) {
        let mut builder = las::Builder::from((1, 4));
        builder.point_format = las::point::Format::new(format).unwrap();
        builder.point_format.is_compressed = compressed;
        let transforms = &mut builder.transforms;
        for (transform, offset) in
            [(&mut transforms.x, 4e5), (&mut transforms.y, 5e6), (&mut transforms.z, 0.0)]
        {
            (transform.scale, transform.offset) = (1e-4, offset);
        }
        let header = builder.into_header().unwrap();
        let mut writer = las::Writer::new(Cursor::new(Vec::new()), header).unwrap();
        let place = |i: usize| {
            let t = i as f64;
            Vec3::new(4e5 + t * 0.0123, 5e6 + 50.0 * (t / 9.0).sin(), -3.0 + t * 0.5)
        };
        let color = (format == 7).then(las::Color::default);
        let points: Vec<_> = (0..n).map(place).collect();
        for (i, p) in points.iter().enumerate() {
            let mut point = las::Point { x: p.x, y: p.y, z: p.z, color, ..las::Point::default() };
            // what else changes from point to point
            point.intensity = (i * i) as u16;
            point.gps_time = matches!(format, 1 | 3 | 6..).then_some(i as f64 / 7.0);
            writer.write_point(point).unwrap();
        }
        (writer.into_inner().unwrap().into_inner(), points)
    }

    #[test]
    fn coordinates_keep_their_tenth_of_a_millimetre_far_from_the_origin() {
        let compressed = [0, 1, 6, 7].map(|format| (format, true));
        for (format, compressed) in compressed.into_iter().chain([(0, false), (6, false)]) {
            let (bytes, points) = file(format, compressed, 300);
            assert_eq!(Format::detect(&bytes), Some(Format::Las));
            let cloud = read(&bytes, &Limits::of(300)).unwrap();
            assert_eq!(cloud.points.len(), 300);
            for (p, q) in cloud.points.iter().zip(&points) {
                assert!((p - q).amax() < 0.6e-4, "format {format}, compressed {compressed}");
            }
            assert_eq!(
                read(&bytes, &Limits::of(299)),
                Err(FormatError::TooManyPoints { points: 300, limit: 299 })
            );
        }
    }

    #[test]
    fn a_count_beyond_the_bytes_is_refused_before_it_is_believed() {
        for compressed in [false, true] {
            let (mut bytes, _) = file(0, compressed, 300);
            bytes[107..111].fill(0);
            bytes[247..255].copy_from_slice(&1_000_000_000_000u64.to_le_bytes());
            let error = read(&bytes, &Limits::default()).unwrap_err();
            assert!(
                matches!(error, FormatError::Truncated { announced: 1_000_000_000_000, .. }),
                "{error}"
            );
        }
    }

    #[test]
    fn announced_layers_and_chunks_beyond_the_file_are_refused() {
        let (bytes, _) = file(6, true, 300);
        let start = point_offset(&bytes).unwrap();
        let refused = |at: usize| {
            let mut bytes = bytes.clone();
            bytes[at..at + 4].fill(0xf0);
            matches!(read(&bytes, &Limits::default()), Err(FormatError::Damaged { .. }))
        };
        let first_layer = start + 8 + 30 + 4;
        let chunk_table = u64_at(&bytes, start).unwrap();
        assert!(refused(first_layer) && refused(first_layer + 32) && refused(chunk_table + 4));
    }

    #[test]
    fn layers_without_coordinates_are_left_out_of_every_chunk() {
        // more than two chunks of 50,000 points
        let (bytes, points) = file(7, true, 120_000);
        let cloud = read(&bytes, &Limits::default()).unwrap();
        assert_eq!(cloud.points.len(), points.len());
        assert!(cloud.points.iter().zip(&points).all(|(p, q)| (p - q).amax() < 0.6e-4));
        let header = las::Header::new(Cursor::new(&bytes)).unwrap();
        let (end, layers) = check(&header, &bytes, &Limits::default()).unwrap();
        let layers = layers.unwrap();
        let (slim, slim_end) = layers.of_coordinates(&bytes, end);
        // what is left has nothing more to leave out, but where its points end
        assert!(slim.len() < bytes.len() && slim_end < end);
        assert_eq!(layers.of_coordinates(&slim, slim_end), (slim, slim_end));
    }

    #[test]
    fn layers_of_a_compressor_without_layers_are_refused() {
        let (bytes, _) = file(6, true, 300);
        let record = bytes.windows(14).position(|w| w == b"laszip encoded").unwrap();
        let compressor = record - 2 + 54;
        assert_eq!(u16_at(&bytes, compressor), Some(3));
        for other in [0, 1, 2] {
            let mut bytes = bytes.clone();
            bytes[compressor] = other;
            let error = read(&bytes, &Limits::default()).unwrap_err();
            assert!(error.to_string().contains("compressor"), "{error}");
        }
    }
}
