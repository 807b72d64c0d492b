//! The neighbourhood of a point, measured at once.

use crate::geometry::Vec3;
use crate::segment::prepare::candidates::K;

/// The neighbours of a point relative to it, coordinate by coordinate.
pub struct Around {
    x: [f64; K],
    y: [f64; K],
    z: [f64; K],
}

impl Around {
    /// `q` relative to the point.
    pub fn of(q: &[Vec3; K]) -> Self {
        Self { x: q.map(|p| p.x), y: q.map(|p| p.y), z: q.map(|p| p.z) }
    }

    /// How many lie nearer than `reach` times the length of `normal` to the plane through the point.
    #[inline(always)]
    pub fn near(&self, normal: &Vec3, reach: f64) -> u32 {
        let mut count = 0;
        for i in 0..K {
            let d = self.x[i] * normal.x + self.y[i] * normal.y + self.z[i] * normal.z;
            count += u32::from(d.abs() < reach);
        }
        count
    }
}
