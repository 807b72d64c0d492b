//! Points in a frame of their own size.

use crate::geometry::Vec3;

/// Points moved to their centroid and scaled to unit root mean square.
#[derive(Clone, Copy, Debug)]
pub(super) struct Scaled {
    pub(super) centroid: Vec3,
    pub(super) scale: f64,
}

impl Scaled {
    pub(super) fn of(points: &[Vec3]) -> Self {
        let n = points.len() as f64;
        let centroid = points.iter().sum::<Vec3>() / n;
        let sq: f64 = points.iter().map(|p| (p - centroid).norm_squared()).sum();
        Self { centroid, scale: (sq / n).sqrt().max(1e-300) }
    }

    pub(super) fn to(&self, p: &Vec3) -> Vec3 {
        (p - self.centroid) / self.scale
    }
}
