//! Points of files that are not compressed: whole numbers, from the file itself.

use super::super::{
    Bounds, FormatError,
    scalar::{Column, Endian, Scalar, hand_on_records},
    sink::Sink,
};
use crate::geometry::Vec3;

/// Hands on the points in `records`, which hold as many as `header` announces; each is a scale times a number, and an
/// offset.
pub(super) fn hand_on(
    header: &las::Header,
    records: &[u8],
    limits: &dyn Bounds,
    sink: &mut dyn Sink,
) -> Result<(), FormatError> {
    let stride = usize::from(header.point_format().len());
    let length =
        usize::try_from(header.number_of_points()).ok().and_then(|n| n.checked_mul(stride));
    // the number was held against the length of the file
    let records = length.and_then(|length| records.get(..length)).unwrap_or_default();
    let transforms = header.transforms();
    let [x, y, z] = [transforms.x, transforms.y, transforms.z];
    let mut placed = Placed {
        scale: Vec3::new(x.scale, y.scale, z.scale),
        offset: Vec3::new(x.offset, y.offset, z.offset),
        block: Vec::new(),
        limits,
        sink,
    };
    // x, y and z come first in every point format
    let columns = [0, 4, 8].map(|offset| Column { scalar: Scalar::I32, offset });
    hand_on_records(records, stride.max(1), Endian::Little, columns, &mut placed)
}

/// Puts whole numbers where they are meant.
struct Placed<'a> {
    scale: Vec3,
    offset: Vec3,
    block: Vec<Vec3>,
    limits: &'a dyn Bounds,
    sink: &'a mut dyn Sink,
}

impl Sink for Placed<'_> {
    fn expect(&mut self, most: u64) -> Result<(), FormatError> {
        self.sink.expect(most)
    }

    fn take(&mut self, points: &[Vec3]) -> Result<(), FormatError> {
        self.limits.go_on()?;
        self.block.clear();
        self.block.extend(points.iter().map(|p| p.component_mul(&self.scale) + self.offset));
        self.sink.take(&self.block)
    }
}
