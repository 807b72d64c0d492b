//! Distances of points from a feature and their derivatives, to machine accuracy.

use super::foot::foot;
use super::kind::FeatureType;
use super::pose::{Pose, SLOTS};
use crate::geometry::Vec3;

/// A feature prepared for measuring many points.
///
/// One rule at the foot point with unit normal n: moving the feature by e changes the distance by -n.e, turning it about
/// its origin by e changes it by -e.(q x n).
#[derive(Clone, Copy, Debug)]
pub struct Gauge {
    pose: Pose,
    sin: f64,
    cos: f64,
}

impl Gauge {
    /// That of a pose.
    pub fn of(pose: &Pose) -> Self {
        let angle = if pose.kind == FeatureType::Cone { pose.size[1] } else { 0.0 };
        let (sin, cos) = angle.sin_cos();
        Self { pose: *pose, sin, cos }
    }

    /// The signed distance from `x`; of a curve its length.
    pub fn distance(&self, x: &Vec3) -> f64 {
        let Pose { kind, size, .. } = self.pose;
        let q = self.local(x);
        let rho = || length([q[0], q[1]]);
        match kind {
            FeatureType::Plane => q[2],
            FeatureType::Sphere => length(q) - size[0],
            FeatureType::Cylinder => rho() - size[0],
            FeatureType::Cone => (rho() - size[0]) * self.cos - q[2] * self.sin,
            FeatureType::Torus => length([rho() - size[0], q[2]]) - size[1],
            FeatureType::EllipticCylinder => foot(&[size[0], size[1]], [q[0], q[1]]).0,
            FeatureType::Ellipsoid => foot(&size, q).0,
            FeatureType::Circle => length([rho() - size[0], q[2]]),
            FeatureType::Line => rho(),
        }
    }

    /// What form errors are the range of: the distance; of a circle that from its centre within its plane, of a line that from it.
    pub fn form_height(&self, x: &Vec3) -> f64 {
        match self.pose.kind {
            FeatureType::Circle => {
                let q = self.local(x);
                length([q[0], q[1]])
            }
            _ => self.distance(x),
        }
    }

    /// Gives the rows of `x` to `each`: one of a surface, two of a curve.
    #[inline]
    pub fn rows(&self, x: &Vec3, mut each: impl FnMut(f64, &[f64; SLOTS])) {
        let Pose { kind, size, .. } = self.pose;
        let q = self.local(x);
        let mut row = |d: f64, n: [f64; 3], sizes: [f64; 3]| each(d, &derivatives(q, n, sizes));
        match kind {
            FeatureType::Plane => row(q[2], [0.0, 0.0, 1.0], [0.0; 3]),
            FeatureType::Sphere => {
                let r = length(q).max(TINY);
                row(r - size[0], q.map(|v| v / r), [-1.0, 0.0, 0.0]);
            }
            FeatureType::Cylinder => {
                let (rho, c) = radial(q);
                row(rho - size[0], [c[0], c[1], 0.0], [-1.0, 0.0, 0.0]);
            }
            FeatureType::Cone => {
                let (rho, c) = radial(q);
                let Self { sin, cos, .. } = *self;
                let d = (rho - size[0]) * cos - q[2] * sin;
                let by_angle = -(rho - size[0]) * sin - q[2] * cos;
                row(d, [c[0] * cos, c[1] * cos, -sin], [-cos, by_angle, 0.0]);
            }
            FeatureType::Torus => {
                let (rho, c) = radial(q);
                let s = rho - size[0];
                let tube = length([s, q[2]]).max(TINY);
                let (out, up) = (s / tube, q[2] / tube);
                row(tube - size[1], [c[0] * out, c[1] * out, up], [-out, -1.0, 0.0]);
            }
            FeatureType::EllipticCylinder => {
                let a = [size[0], size[1]];
                let (d, n) = foot(&a, [q[0], q[1]]);
                let by = axis_slopes(&a, [q[0] - d * n[0], q[1] - d * n[1]], n);
                row(d, [n[0], n[1], 0.0], [by[0], by[1], 0.0]);
            }
            FeatureType::Ellipsoid => {
                let (d, n) = foot(&size, q);
                let f = std::array::from_fn(|i| q[i] - d * n[i]);
                row(d, n, axis_slopes(&size, f, n));
            }
            FeatureType::Circle => {
                let (rho, c) = radial(q);
                row(rho - size[0], [c[0], c[1], 0.0], [-1.0, 0.0, 0.0]);
                row(q[2], [0.0, 0.0, 1.0], [0.0; 3]);
            }
            FeatureType::Line => {
                row(q[0], [1.0, 0.0, 0.0], [0.0; 3]);
                row(q[1], [0.0, 1.0, 0.0], [0.0; 3]);
            }
        }
    }

    #[inline]
    fn local(&self, x: &Vec3) -> [f64; 3] {
        let q = self.pose.frame.tr_mul(&(x - self.pose.origin));
        [q.x, q.y, q.z]
    }
}

/// Below this a length counts as this, so that it can divide.
const TINY: f64 = 1e-300;

/// `f64::hypot` guards a range that unit-sized points never leave, and is slow.
fn length<const D: usize>(q: [f64; D]) -> f64 {
    q.iter().map(|v| v * v).sum::<f64>().sqrt()
}

fn radial(q: [f64; 3]) -> (f64, [f64; 2]) {
    let rho = length([q[0], q[1]]).max(TINY);
    (rho, [q[0] / rho, q[1] / rho])
}

#[inline]
fn derivatives(q: [f64; 3], n: [f64; 3], sizes: [f64; 3]) -> [f64; SLOTS] {
    [
        -n[0],
        -n[1],
        -n[2],
        q[2] * n[1] - q[1] * n[2],
        q[0] * n[2] - q[2] * n[0],
        q[1] * n[0] - q[0] * n[1],
        sizes[0],
        sizes[1],
        sizes[2],
    ]
}

/// Derivative of the distance by each semi-axis, -2 f_i2 / a_i3 / |grad F| at the foot f: with grad F = 2 f_i / a_i2 along n,
/// that is -n_i f_i / a_i.
fn axis_slopes<const D: usize>(a: &[f64; D], f: [f64; D], n: [f64; D]) -> [f64; D] {
    std::array::from_fn(|i| -n[i] * f[i] / a[i])
}
