use nalgebra::Rotation3;

use super::kind::FeatureType;
use crate::fit::Shape;
use crate::geometry::{Mat3, Vec3, perpendicular_frame};

/// Places of a step: three translations along the frame, three rotations about it, three sizes.
pub const SLOTS: usize = 9;

/// A feature in a frame of its own: see [`Shape`], whose fields these are.
///
/// Circle: the origin is the centre, w the normal, `size[0]` the radius. Line: w is its direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// What it is.
    pub kind: FeatureType,
    /// Its origin.
    pub origin: Vec3,
    /// Orthonormal columns u, v, w.
    pub frame: Mat3,
    /// Its sizes.
    pub size: [f64; 3],
}

impl Pose {
    /// A pose with axis (or normal) `w`; the other two directions are any.
    pub fn with_axis(kind: FeatureType, origin: Vec3, w: Vec3, size: [f64; 3]) -> Self {
        let w = w.normalize();
        let (u, v) = perpendicular_frame(&w);
        Self { kind, origin, frame: Mat3::from_columns(&[u, v, w]), size }
    }

    /// That of a surface.
    pub fn of(shape: &Shape) -> Self {
        let Shape { family, origin, frame, size } = *shape;
        Self { kind: FeatureType::of(family), origin, frame, size }
    }

    /// The surface; `None` for a curve.
    pub fn shape(&self) -> Option<Shape> {
        let Self { kind, origin, frame, size } = *self;
        Some(Shape { family: kind.family()?, origin, frame, size })
    }

    /// Axis, normal or direction.
    pub fn w(&self) -> Vec3 {
        self.frame.column(2).into_owned()
    }

    /// The pose after a step. `None` where a size leaves its range.
    pub fn stepped(&self, step: &[f64; SLOTS]) -> Option<Self> {
        let three = |k: usize| Vec3::new(step[k], step[k + 1], step[k + 2]);
        let mut next = *self;
        next.origin += self.frame * three(0);
        let turn = three(3);
        if turn != Vec3::zeros() {
            next.frame = orthonormal(&(self.frame * Rotation3::new(turn).matrix()));
        }
        for (size, d) in next.size.iter_mut().zip(&step[6..]) {
            *size += d;
        }
        next.is_proper().then_some(next)
    }

    /// Whether sizes are finite and in range.
    pub fn is_proper(&self) -> bool {
        let s = &self.size;
        let finite = self.origin.iter().chain(s).chain(self.frame.iter()).all(|v| v.is_finite());
        finite
            && match self.kind {
                FeatureType::Plane | FeatureType::Line => true,
                FeatureType::Sphere | FeatureType::Cylinder | FeatureType::Circle => s[0] > 0.0,
                FeatureType::Cone => s[1].abs() < std::f64::consts::FRAC_PI_2,
                FeatureType::EllipticCylinder | FeatureType::Torus => s[0] > 0.0 && s[1] > 0.0,
                FeatureType::Ellipsoid => s.iter().all(|s| *s > 0.0),
            }
    }

    /// The same feature with its origin slid along the plane or the axis beside `centroid`.
    pub fn recentred(&self, centroid: &Vec3) -> Self {
        if self.kind == FeatureType::Line {
            let w = self.w();
            return Self { origin: self.origin + w * (centroid - self.origin).dot(&w), ..*self };
        }
        self.shape().map_or(*self, |s| Self::of(&s.recentred(centroid)))
    }

    /// The same pose seen from a frame whose origin is `by` further off, then `scale` times as large.
    pub fn scaled(&self, scale: f64) -> Self {
        let mut size = self.size.map(|s| s * scale);
        if self.kind == FeatureType::Cone {
            size[1] = self.size[1];
        }
        Self { origin: self.origin * scale, size, ..*self }
    }

    /// The pose moved by `offset`.
    pub fn translated(&self, offset: &Vec3) -> Self {
        Self { origin: self.origin + offset, ..*self }
    }
}

/// Gram-Schmidt on the columns, so that rounding does not add up over many steps.
fn orthonormal(m: &Mat3) -> Mat3 {
    let w = m.column(2).normalize();
    let u = m.column(0).into_owned();
    let u = (u - w * u.dot(&w)).normalize();
    Mat3::from_columns(&[u, w.cross(&u), w])
}
