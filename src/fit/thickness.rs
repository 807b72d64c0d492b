//! How thick the body is that an ellipse encloses.

use super::{Family, Shape};
use crate::geometry::Vec3;

impl Shape {
    /// The chord of an elliptic cylinder or an ellipsoid along the normal at the foot of `x`: from one wall to the other.
    /// Infinite for families whose least radius says how thick they are.
    ///
    /// With the unit normal u at the foot q of the surface q' A q = 1, the other end is at q - t u with
    /// t = 2 (u' A q) / (u' A u).
    pub fn thickness(&self, x: &Vec3) -> f64 {
        let axes = match self.family {
            Family::EllipticCylinder => 2,
            Family::Ellipsoid => 3,
            _ => return f64::INFINITY,
        };
        let offset = self.offset(x);
        let u = self.frame.tr_mul(&offset.normal);
        let q = self.frame.tr_mul(&(x - self.origin)) - offset.distance * u;
        let (mut across, mut square) = (0.0, 0.0);
        for k in 0..axes {
            let inverse = 1.0 / (self.size[k] * self.size[k]);
            across += u[k] * q[k] * inverse;
            square += u[k] * u[k] * inverse;
        }
        2.0 * across.abs() / square
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_ellipse_is_as_thick_as_its_axes_at_their_ends_and_thinner_towards_its_tip() {
        let shape = |family, size| {
            Shape::with_axis(family, Vec3::new(1.0, 2.0, 3.0), Vec3::new(0.6, 0.0, 0.8), size)
        };
        let ball = shape(Family::Ellipsoid, [5.0, 3.0, 2.0]);
        let tube = shape(Family::EllipticCylinder, [100.0, 3.0, 0.0]);
        let at = |s: &Shape, q: Vec3| s.thickness(&(s.origin + s.frame * q));
        for (k, size) in [5.0, 3.0, 2.0].into_iter().enumerate() {
            let mut end = Vec3::zeros();
            end[k] = size + 0.1;
            assert!((at(&ball, end) - 2.0 * size).abs() < 1e-9);
        }
        let near_tip = Vec3::new(95.0, 3.0 * (1.0 - 0.95_f64.powi(2)).sqrt(), 7.0);
        let straight = 2.0 * near_tip.y;
        assert!((at(&tube, near_tip) / straight - 1.0).abs() < 0.1);
        assert_eq!(at(&shape(Family::Cylinder, [1.0, 0.0, 0.0]), near_tip), f64::INFINITY);
    }
}
