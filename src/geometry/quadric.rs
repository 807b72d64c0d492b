use serde::{Deserialize, Serialize};

use super::{Mat3, Vec3};

/// How ten coefficients were scaled.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, utoipa::ToSchema)]
#[serde(rename_all = "lowercase")]
pub enum Scale {
    /// a10 = 1, the seed's scale.
    A10,
    /// Unit length: the surface passes through (or very near) the origin, so a10 is about zero.
    Unit,
}

/// The quadric a1 x2 + a2 y2 + a3 z2 + a4 xy + a5 yz + a6 xz + a7 x + a8 y + a9 z + a10 = 0 (1).
///
/// Coefficients are in the seed's order; their common factor is free.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Quadric(pub [f64; 10]);

impl Quadric {
    /// The quadric x'Qx + p'x + c = 0, Q symmetric.
    pub fn from_parts(q: &Mat3, p: &Vec3, c: f64) -> Self {
        Self([
            q[(0, 0)],
            q[(1, 1)],
            q[(2, 2)],
            2.0 * q[(0, 1)],
            2.0 * q[(1, 2)],
            2.0 * q[(0, 2)],
            p.x,
            p.y,
            p.z,
            c,
        ])
    }

    /// The quadratic part e of (11): half the mixed coefficients stand off its diagonal.
    pub fn e(&self) -> Mat3 {
        let a = &self.0;
        Mat3::new(
            a[0],
            a[3] / 2.0,
            a[5] / 2.0,
            a[3] / 2.0,
            a[1],
            a[4] / 2.0,
            a[5] / 2.0,
            a[4] / 2.0,
            a[2],
        )
    }

    /// The linear part (a7, a8, a9).
    pub fn linear(&self) -> Vec3 {
        Vec3::new(self.0[6], self.0[7], self.0[8])
    }

    /// The 4 x 4 matrix E of (11), with E44 = a10.
    pub fn e4(&self) -> nalgebra::Matrix4<f64> {
        let (e, p) = (self.e(), self.linear() / 2.0);
        let mut m = nalgebra::Matrix4::zeros();
        m.fixed_view_mut::<3, 3>(0, 0).copy_from(&e);
        m.fixed_view_mut::<3, 1>(0, 3).copy_from(&p);
        m.fixed_view_mut::<1, 3>(3, 0).copy_from(&p.transpose());
        m[(3, 3)] = self.0[9];
        m
    }

    /// The left-hand side of (1) at `x`: the algebraic residual.
    pub fn value(&self, x: &Vec3) -> f64 {
        (self.e() * x + self.linear()).dot(x) + self.0[9]
    }

    /// The gradient of (1) at `x`.
    pub fn gradient(&self, x: &Vec3) -> Vec3 {
        2.0 * self.e() * x + self.linear()
    }

    /// The same surface described in coordinates moved by `origin`: x_local = x - origin.
    pub fn moved_to(&self, origin: &Vec3) -> Self {
        let e = self.e();
        Self::from_parts(&e, &(self.linear() + 2.0 * e * origin), self.value(origin))
    }

    /// Coefficients for reports: a10 = 1, or unit length where a10 is too small to divide by
    /// (below 1e-12 of the coefficients' length).
    pub fn scaled(&self) -> (Self, Scale) {
        let norm = self.0.iter().map(|a| a * a).sum::<f64>().sqrt();
        if self.0[9].abs() > 1e-12 * norm {
            (Self(self.0.map(|a| a / self.0[9])), Scale::A10)
        } else {
            (Self(self.0.map(|a| a / norm)), Scale::Unit)
        }
    }

    /// Distance from `x` to the quadric, second order: the near root of F + gt + ht2 along the
    /// gradient. First order where that root does not exist; infinite where the gradient vanishes.
    pub fn distance(&self, x: &Vec3) -> f64 {
        let (value, gradient) = (self.value(x), self.gradient(x));
        let g = gradient.norm();
        if g == 0.0 {
            return f64::INFINITY;
        }
        let u = gradient / g;
        let h = (self.e() * u).dot(&u);
        let discriminant = g * g - 4.0 * h * value;
        if discriminant >= 0.0 {
            (2.0 * value / (g + discriminant.sqrt())).abs()
        } else {
            (value / g).abs()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn moving_the_origin_keeps_values() {
        let q = Quadric([1.0, 2.0, 3.0, 0.4, -0.5, 0.6, 7.0, -8.0, 9.0, 10.0]);
        let (x, origin) = (Vec3::new(0.3, -1.2, 2.5), Vec3::new(5.0, 6.0, -7.0));
        assert!((q.moved_to(&origin).value(&(x - origin)) - q.value(&x)).abs() < 1e-10);
    }

    #[test]
    fn a_surface_through_the_origin_is_scaled_to_unit_length() {
        let (q, scale) = Quadric([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 4.0, 0.0]).scaled();
        assert_eq!((q.0[8], scale), (1.0, Scale::Unit));
    }
}
