//! What labels are placed by.

use crate::fit::Ruler;
use crate::geometry::Vec3;

/// What labels are placed by: points, their neighbours, labels and surfaces.
pub trait Labelling {
    /// A point.
    fn point(&self, i: u32) -> &Vec3;
    /// The nearest other points to a point, nearest first, at most `K` of them.
    fn neighbours(&self, i: u32) -> &[u32];
    /// A point's label, -1 = none.
    fn label(&self, i: u32) -> i32;
    /// The surface of a label.
    fn ruler(&self, label: i32) -> &Ruler;
    /// 1 / sigma2.
    fn inverse(&self) -> f64;

    /// Squared distance of a point from a label's surface, in sigmas.
    fn sq(&self, label: i32, i: u32) -> f64 {
        self.ruler(label).distance(self.point(i)).powi(2) * self.inverse()
    }
}
