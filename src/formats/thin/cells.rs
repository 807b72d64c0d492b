//! Cells of space.

use crate::geometry::Vec3;

/// A rotation, by the unnormalised quaternion w, x, y, z.
///
/// Cells along the axes of the world would have the planes of machined parts along their sides: noise would then put a few
/// points of a plane, all on one side of it, into cells of their own. No axis of these cells lies within 11 degrees of a
/// direction of whole numbers up to 3.
const TURN: [[f64; 3]; 3] = turn([0.538, -0.374, -0.533, -0.535]);

const fn turn([w, x, y, z]: [f64; 4]) -> [[f64; 3]; 3] {
    let s = 2.0 / (w * w + x * x + y * y + z * z);
    [
        [1.0 - s * (y * y + z * z), s * (x * y - z * w), s * (x * z + y * w)],
        [s * (x * y + z * w), 1.0 - s * (x * x + z * z), s * (y * z - x * w)],
        [s * (x * z - y * w), s * (y * z + x * w), 1.0 - s * (x * x + y * y)],
    ]
}

/// Cells on each axis beyond which rounding moves a point by more than a thousandth of a cell.
const MOST: f64 = (1u64 << 42) as f64;

/// Cubic cells.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cells {
    per_length: f64,
}

impl Cells {
    /// Cells of this edge.
    pub(super) fn of(edge: f64) -> Self {
        Self { per_length: edge.recip() }
    }

    /// The largest coordinate that points in them may have.
    pub(super) fn largest(self) -> f64 {
        // a turn makes a coordinate longer by the square root of three at most
        MOST / self.per_length / 2.0
    }

    /// A length, in cells.
    #[inline]
    pub(super) fn in_cells(self, length: f64) -> f64 {
        length * self.per_length
    }

    /// A point's place, in cells.
    #[inline]
    pub(super) fn place(self, p: &Vec3) -> [f64; 3] {
        TURN.map(|row| (row[0] * p.x + row[1] * p.y + row[2] * p.z) * self.per_length)
    }

    /// The cell of a point.
    #[inline]
    pub(super) fn cell(self, p: &Vec3) -> [i64; 3] {
        self.place(p).map(floor)
    }
}

/// The whole number at or below `x`, which is smaller than 2^53 in size; `f64::floor` is a call on older processors.
#[inline]
pub(super) fn floor(x: f64) -> i64 {
    let cut = x as i64;
    cut - i64::from((cut as f64) > x)
}

/// A number for a cell that looks like chance: enough so for a table.
#[inline]
pub(super) fn hash([x, y, z]: [i64; 3]) -> u64 {
    // odd numbers without pattern
    let sum = (x as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15)
        ^ (y as u64).wrapping_mul(0xc2b2_ae3d_27d4_eb4f)
        ^ (z as u64).wrapping_mul(0x1656_67b1_9e37_79f9);
    let mixed = (sum ^ (sum >> 32)).wrapping_mul(0xd6e8_feb8_6659_fd93);
    mixed ^ (mixed >> 32)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_turn_is_a_rotation() {
        let rows = TURN.map(Vec3::from);
        for (a, row) in rows.iter().enumerate() {
            for (b, other) in rows.iter().enumerate() {
                let expected = if a == b { 1.0 } else { 0.0 };
                assert!((row.dot(other) - expected).abs() < 1e-15);
            }
        }
        assert!((rows[0].cross(&rows[1]) - rows[2]).norm() < 1e-15);
    }

    #[test]
    fn no_axis_is_near_a_direction_that_parts_have() {
        let whole = || -3..=3i32;
        for row in TURN.map(Vec3::from) {
            for (x, y, z) in
                whole().flat_map(|x| whole().flat_map(move |y| whole().map(move |z| (x, y, z))))
            {
                let direction = Vec3::new(x.into(), y.into(), z.into());
                if direction.norm() > 0.0 {
                    let angle = (row.dot(&direction) / direction.norm()).abs().min(1.0).acos();
                    assert!(angle.to_degrees() > 11.0, "{direction:?}");
                }
            }
        }
    }
}
