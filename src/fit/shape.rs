//! A surface as fits move it: its signed distance and the derivative of that distance.

use crate::geometry::{
    Cone, Cylinder, Ellipsoid, EllipticCylinder, Mat3, Plane, Quadric, Sphere, Surface,
    SurfaceType, Torus, Vec3, perpendicular_frame,
};

/// Largest number of degrees of freedom of any family.
pub const MAX_DOF: usize = 9;

/// The families that are fitted.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Family {
    /// Plane, 3 degrees of freedom.
    Plane,
    /// Sphere, 4.
    Sphere,
    /// Circular cylinder, 5.
    Cylinder,
    /// Circular cone, 6.
    Cone,
    /// Elliptic cylinder, 7.
    EllipticCylinder,
    /// Torus, 7. The only one that is no quadric.
    Torus,
    /// Ellipsoid, 9.
    Ellipsoid,
}

impl Family {
    /// Every family, by degrees of freedom.
    pub const ALL: [Self; 7] = [
        Self::Plane,
        Self::Sphere,
        Self::Cylinder,
        Self::Cone,
        Self::EllipticCylinder,
        Self::Torus,
        Self::Ellipsoid,
    ];

    /// Degrees of freedom.
    pub fn dof(self) -> usize {
        match self {
            Self::Plane => 3,
            Self::Sphere => 4,
            Self::Cylinder => 5,
            Self::Cone => 6,
            Self::EllipticCylinder | Self::Torus => 7,
            Self::Ellipsoid => 9,
        }
    }

    /// Description length of a shape fitted to `n` points: dof ln n, and more for the families that
    /// machined parts seldom have, so that a few leaked points do not buy them.
    pub fn description_length(self, n: usize) -> f64 {
        let prior = match self {
            Self::Plane => 0.0,
            Self::Cylinder => 4.0,
            Self::Cone => 8.0,
            Self::Sphere => 24.0,
            Self::Torus => 18.0,
            Self::EllipticCylinder => 40.0,
            Self::Ellipsoid => 60.0,
        };
        self.dof() as f64 * (n.max(2) as f64).ln() + prior
    }

    /// The type it is reported as.
    pub fn surface_type(self) -> SurfaceType {
        match self {
            Self::Plane => SurfaceType::Plane,
            Self::Sphere => SurfaceType::Sphere,
            Self::Cylinder => SurfaceType::Cylinder,
            Self::Cone => SurfaceType::Cone,
            Self::EllipticCylinder => SurfaceType::EllipticCylinder,
            Self::Ellipsoid => SurfaceType::Ellipsoid,
            Self::Torus => SurfaceType::Torus,
        }
    }
}

/// A surface of some family in a frame of its own.
///
/// `origin` should lie near the centroid of the points being fitted (for axial families: on the
/// axis beside it), so that translations and rotations stay nearly independent.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shape {
    /// The family.
    pub family: Family,
    /// Plane: a point of it. Sphere, torus, ellipsoid: the centre. Others: a point of the axis.
    pub origin: Vec3,
    /// Orthonormal columns u, v, w. Plane: w is the normal. Axial families: w is the axis.
    pub frame: Mat3,
    /// Sphere, cylinder: `[radius]`. Cone: `[radius at origin, half angle]` with the radius growing
    /// along w for a positive angle. Elliptic cylinder: `[a, b]`. Torus: `[major, minor]`.
    /// Ellipsoid: `[a, b, c]`.
    pub size: [f64; 3],
}

/// Signed distance to a shape (positive outside) and its unit gradient.
#[derive(Clone, Copy, Debug)]
pub struct Offset {
    /// Signed distance.
    pub distance: f64,
    /// Unit normal, pointing to the outside.
    pub normal: Vec3,
}

impl Shape {
    /// A shape with axis (or normal) `w`; the other two directions are any.
    pub fn with_axis(family: Family, origin: Vec3, w: Vec3, size: [f64; 3]) -> Self {
        let w = w.normalize();
        let (u, v) = perpendicular_frame(&w);
        Self { family, origin, frame: Mat3::from_columns(&[u, v, w]), size }
    }

    /// Axis or normal.
    pub fn w(&self) -> Vec3 {
        self.frame.column(2).into_owned()
    }

    /// Smallest radius of curvature scale of the shape (radius or smallest semi-axis); infinite for planes.
    pub fn min_radius(&self) -> f64 {
        match self.family {
            Family::Plane => f64::INFINITY,
            Family::Sphere | Family::Cylinder => self.size[0],
            Family::Cone => self.size[0].abs(),
            Family::EllipticCylinder => self.size[0].min(self.size[1]),
            Family::Torus => self.size[1],
            Family::Ellipsoid => self.size[0].min(self.size[1]).min(self.size[2]),
        }
    }

    /// Largest radius or semi-axis; zero for planes.
    pub fn max_radius(&self) -> f64 {
        match self.family {
            Family::Plane => 0.0,
            Family::Sphere | Family::Cylinder => self.size[0],
            Family::Cone => self.size[0].abs(),
            Family::EllipticCylinder | Family::Torus => self.size[0].max(self.size[1]),
            Family::Ellipsoid => self.size[0].max(self.size[1]).max(self.size[2]),
        }
    }

    /// How many times longer the longest semi-axis is than the shortest; 1 for families without any.
    pub fn elongation(&self) -> f64 {
        match self.family {
            Family::EllipticCylinder | Family::Ellipsoid => self.max_radius() / self.min_radius(),
            _ => 1.0,
        }
    }

    /// Signed distance from `x`, without the normal.
    #[inline]
    pub fn distance(&self, x: &Vec3) -> f64 {
        let q = x - self.origin;
        match self.family {
            Family::Plane => q.dot(&self.w()),
            Family::Sphere => q.norm() - self.size[0],
            Family::Cylinder => {
                let h = q.dot(&self.w());
                (q.norm_squared() - h * h).max(0.0).sqrt() - self.size[0]
            }
            Family::Cone => {
                let h = q.dot(&self.w());
                let rho = (q.norm_squared() - h * h).max(0.0).sqrt();
                let (sin, cos) = self.size[1].sin_cos();
                (rho - self.size[0]) * cos - h * sin
            }
            Family::Torus => {
                let h = q.dot(&self.w());
                let rho = (q.norm_squared() - h * h).max(0.0).sqrt();
                ((rho - self.size[0]).powi(2) + h * h).sqrt() - self.size[1]
            }
            Family::EllipticCylinder => self.elliptic::<2>(&(self.frame.tr_mul(&q))).0,
            Family::Ellipsoid => self.elliptic::<3>(&(self.frame.tr_mul(&q))).0,
        }
    }

    /// Second-order distance to an ellipse (D = 2) or ellipsoid (D = 3) from `q` in its frame: the
    /// near root of F - |g| d + h d2 = 0 along the gradient. Returns it with the unit gradient.
    #[inline]
    fn elliptic<const D: usize>(&self, q: &Vec3) -> (f64, Vec3) {
        let mut value = -1.0;
        let mut g = Vec3::zeros();
        for i in 0..D {
            let s = q[i] / (self.size[i] * self.size[i]);
            value += q[i] * s;
            g[i] = 2.0 * s;
        }
        let norm = g.norm().max(1e-300);
        let u = g / norm;
        let h: f64 = (0..D).map(|i| (u[i] / self.size[i]).powi(2)).sum();
        let disc = norm * norm - 4.0 * h * value;
        let d = if disc >= 0.0 { 2.0 * value / (norm + disc.sqrt()) } else { value / norm };
        (d, u)
    }

    /// Signed distance and normal at `x`.
    #[inline]
    pub fn offset(&self, x: &Vec3) -> Offset {
        let q = x - self.origin;
        match self.family {
            Family::Plane => Offset { distance: q.dot(&self.w()), normal: self.w() },
            Family::Sphere => {
                let r = q.norm().max(1e-300);
                Offset { distance: r - self.size[0], normal: q / r }
            }
            Family::Cylinder => {
                let (rho, radial, _) = self.cylindrical(&q);
                Offset { distance: rho - self.size[0], normal: radial }
            }
            Family::Cone => {
                let (rho, radial, h) = self.cylindrical(&q);
                let (sin, cos) = self.size[1].sin_cos();
                Offset {
                    distance: (rho - self.size[0]) * cos - h * sin,
                    normal: radial * cos - self.w() * sin,
                }
            }
            Family::Torus => {
                let (rho, radial, h) = self.cylindrical(&q);
                let t = ((rho - self.size[0]).powi(2) + h * h).sqrt().max(1e-300);
                let normal = (radial * (rho - self.size[0]) + self.w() * h) / t;
                Offset { distance: t - self.size[1], normal }
            }
            Family::EllipticCylinder => {
                let (distance, u) = self.elliptic::<2>(&self.frame.tr_mul(&q));
                Offset { distance, normal: self.frame * u }
            }
            Family::Ellipsoid => {
                let (distance, u) = self.elliptic::<3>(&self.frame.tr_mul(&q));
                Offset { distance, normal: self.frame * u }
            }
        }
    }

    /// Distance from the axis, unit radial direction and height along the axis of `q = x - origin`.
    #[inline]
    fn cylindrical(&self, q: &Vec3) -> (f64, Vec3, f64) {
        let w = self.w();
        let h = q.dot(&w);
        let radial = q - h * w;
        let rho = radial.norm().max(1e-300);
        (rho, radial / rho, h)
    }

    /// Signed distance at `x` and its derivative by the family's degrees of freedom, in the order
    /// translations along the frame, rotations about it, sizes (log semi-axes for the elliptic ones).
    ///
    /// One rule at the foot point f with normal n: translation by e gives -n.e, rotation by e about
    /// the origin -e.((f - origin) x n).
    #[inline]
    pub fn distance_jacobian(&self, x: &Vec3, j: &mut [f64; MAX_DOF]) -> f64 {
        let o = self.offset(x);
        let d = o.distance;
        let foot = x - o.normal * d;
        let n = match self.family {
            // The gradient at x turns on the way to the foot point.
            Family::EllipticCylinder | Family::Ellipsoid => self.offset(&foot).normal,
            _ => o.normal,
        };
        let [n, q] = [n, foot - self.origin].map(|v| self.frame.tr_mul(&v));
        let r = q.cross(&n);
        match self.family {
            Family::Plane => j[..3].copy_from_slice(&[-n.z, -r.x, -r.y]),
            Family::Sphere => j[..4].copy_from_slice(&[-n.x, -n.y, -n.z, -1.0]),
            Family::Cylinder => j[..5].copy_from_slice(&[-n.x, -n.y, -r.x, -r.y, -1.0]),
            Family::Cone => {
                let (sin, cos) = self.size[1].sin_cos();
                let rho = (q.x * q.x + q.y * q.y).sqrt();
                let by_angle = -(rho - self.size[0]) * sin - q.z * cos;
                j[..6].copy_from_slice(&[-n.x, -n.y, -r.x, -r.y, -cos, by_angle]);
            }
            Family::EllipticCylinder => {
                let [s0, s1] = self.log_axis_slopes::<2>(&q);
                j[..7].copy_from_slice(&[-n.x, -n.y, -r.x, -r.y, -r.z, s0, s1]);
            }
            Family::Torus => {
                let rho = (q.x * q.x + q.y * q.y).sqrt().max(1e-300);
                let by_major = -(n.x * q.x + n.y * q.y) / rho;
                j[..7].copy_from_slice(&[-n.x, -n.y, -n.z, -r.x, -r.y, by_major, -1.0]);
            }
            Family::Ellipsoid => {
                let s = self.log_axis_slopes::<3>(&q);
                j[..9].copy_from_slice(&[-n.x, -n.y, -n.z, -r.x, -r.y, -r.z, s[0], s[1], s[2]]);
            }
        }
        d
    }

    /// Derivative of the distance by the log of each semi-axis: -2 (q_i/a_i)2 / |grad F|.
    #[inline]
    fn log_axis_slopes<const D: usize>(&self, q: &Vec3) -> [f64; D] {
        let mut s = [0.0; D];
        let mut sq = 0.0;
        for i in 0..D {
            let t = q[i] / self.size[i];
            s[i] = -2.0 * t * t;
            sq += (2.0 * t / self.size[i]).powi(2);
        }
        let inverse = 1.0 / sq.sqrt().max(1e-300);
        s.map(|v| v * inverse)
    }

    /// The shape after a step `delta` of its degrees of freedom, in the order of
    /// [`distance_jacobian`](Self::distance_jacobian). `None` where a size leaves its range.
    pub fn stepped(&self, delta: &[f64]) -> Option<Self> {
        let (t, r, rest) = match self.family {
            Family::Plane => ([0.0, 0.0, delta[0]], [delta[1], delta[2], 0.0], 3),
            Family::Sphere => ([delta[0], delta[1], delta[2]], [0.0; 3], 3),
            Family::Cylinder | Family::Cone => {
                ([delta[0], delta[1], 0.0], [delta[2], delta[3], 0.0], 4)
            }
            Family::EllipticCylinder => {
                ([delta[0], delta[1], 0.0], [delta[2], delta[3], delta[4]], 5)
            }
            Family::Torus => ([delta[0], delta[1], delta[2]], [delta[3], delta[4], 0.0], 5),
            Family::Ellipsoid => {
                ([delta[0], delta[1], delta[2]], [delta[3], delta[4], delta[5]], 6)
            }
        };
        let mut s = *self;
        s.origin += self.frame * Vec3::from(t);
        let rotation = nalgebra::Rotation3::new(self.frame * Vec3::from(r));
        s.frame = orthonormal(&(rotation.matrix() * self.frame));
        for (size, d) in s.size.iter_mut().zip(&delta[rest..]) {
            match self.family {
                Family::EllipticCylinder | Family::Ellipsoid => *size *= d.clamp(-1.0, 1.0).exp(),
                _ => *size += d,
            }
        }
        s.is_proper().then_some(s)
    }

    /// Whether sizes are finite and in range.
    pub fn is_proper(&self) -> bool {
        let s = &self.size;
        let finite = self.origin.iter().chain(s).all(|v| v.is_finite());
        finite
            && match self.family {
                Family::Plane => true,
                Family::Sphere | Family::Cylinder => s[0] > 0.0,
                Family::Cone => s[1].abs() < 1.55,
                Family::EllipticCylinder => s[0] > 0.0 && s[1] > 0.0,
                Family::Torus => s[0] > 0.0 && s[1] > 0.0,
                Family::Ellipsoid => s[0] > 0.0 && s[1] > 0.0 && s[2] > 0.0,
            }
    }

    /// The same surface with its origin slid along the plane or the axis beside `centroid`.
    pub fn recentred(&self, centroid: &Vec3) -> Self {
        let mut s = *self;
        let w = self.w();
        let q = centroid - self.origin;
        match self.family {
            Family::Plane => s.origin += q - q.dot(&w) * w,
            Family::Cylinder | Family::EllipticCylinder => s.origin += q.dot(&w) * w,
            Family::Cone => {
                let h = q.dot(&w);
                s.origin += h * w;
                s.size[0] += h * self.size[1].tan();
            }
            Family::Sphere | Family::Torus | Family::Ellipsoid => {}
        }
        s
    }

    /// The shape moved by `offset`.
    pub fn translated(&self, offset: &Vec3) -> Self {
        Self { origin: self.origin + offset, ..*self }
    }

    /// The shape in engineering terms.
    pub fn surface(&self) -> Surface {
        let [u, v, w]: [Vec3; 3] = [0, 1, 2].map(|i| self.frame.column(i).into_owned());
        let s = &self.size;
        match self.family {
            Family::Plane => Surface::Plane(Plane { point: self.origin, normal: w }),
            Family::Sphere => Surface::Sphere(Sphere { center: self.origin, radius: s[0] }),
            Family::Cylinder => Surface::Cylinder(Cylinder {
                axis_point: self.origin,
                axis_direction: w,
                radius: s[0],
            }),
            Family::Cone => {
                let sign = s[1].signum();
                Surface::Cone(Cone {
                    apex: self.origin - w * (s[0] / s[1].tan()),
                    axis_direction: w * sign,
                    half_angle: s[1].abs(),
                })
            }
            Family::EllipticCylinder => {
                let (axes, dirs) =
                    if s[0] >= s[1] { ([s[0], s[1]], [u, v]) } else { ([s[1], s[0]], [v, -u]) };
                Surface::EllipticCylinder(EllipticCylinder {
                    axis_point: self.origin,
                    axis_direction: w,
                    semi_axes: axes,
                    semi_axis_directions: dirs,
                })
            }
            Family::Ellipsoid => {
                let d = [u, v, w];
                let mut order = [0, 1, 2];
                order.sort_by(|&a, &b| s[b].total_cmp(&s[a]));
                let third = d[order[0]].cross(&d[order[1]]);
                Surface::Ellipsoid(Ellipsoid {
                    center: self.origin,
                    semi_axes: order.map(|i| s[i]),
                    semi_axis_directions: [d[order[0]], d[order[1]], third],
                })
            }
            Family::Torus => Surface::Torus(Torus {
                center: self.origin,
                axis_direction: w,
                major_radius: s[0],
                minor_radius: s[1],
            }),
        }
    }

    /// The shape as ten coefficients, not scaled; `None` for tori, which are no quadrics.
    ///
    /// Of a cone they are made from its radius beside the points: the apex of a slender one is too far off.
    pub fn quadric(&self) -> Option<Quadric> {
        if self.family != Family::Cone {
            return self.surface().quadric();
        }
        let ([radius, half_angle, _], w) = (self.size, self.w());
        let slope = half_angle.tan();
        let e = Mat3::identity() - w * w.transpose() * (1.0 + slope * slope);
        let about_itself = Quadric::from_parts(&e, &(-2.0 * radius * slope * w), -radius * radius);
        Some(about_itself.moved_to(&-self.origin))
    }
}

impl From<&Surface> for Shape {
    /// A cone has its origin at the apex.
    fn from(surface: &Surface) -> Self {
        let framed = |family, origin, frame: [Vec3; 3], size| Self {
            family,
            origin,
            frame: Mat3::from_columns(&frame),
            size,
        };
        match surface {
            Surface::Plane(s) => Self::with_axis(Family::Plane, s.point, s.normal, [0.0; 3]),
            Surface::Sphere(s) => {
                Self::with_axis(Family::Sphere, s.center, Vec3::z(), [s.radius, 0.0, 0.0])
            }
            Surface::Cylinder(s) => {
                let size = [s.radius, 0.0, 0.0];
                Self::with_axis(Family::Cylinder, s.axis_point, s.axis_direction, size)
            }
            Surface::Cone(s) => {
                let size = [0.0, s.half_angle, 0.0];
                Self::with_axis(Family::Cone, s.apex, s.axis_direction, size)
            }
            Surface::EllipticCylinder(s) => {
                let ([a, b], [u, v]) = (s.semi_axes, s.semi_axis_directions);
                let frame = [u, v, s.axis_direction];
                framed(Family::EllipticCylinder, s.axis_point, frame, [a, b, 0.0])
            }
            Surface::Ellipsoid(s) => {
                framed(Family::Ellipsoid, s.center, s.semi_axis_directions, s.semi_axes)
            }
            Surface::Torus(s) => {
                let size = [s.major_radius, s.minor_radius, 0.0];
                Self::with_axis(Family::Torus, s.center, s.axis_direction, size)
            }
        }
    }
}

/// Gram-Schmidt on the columns, so that rounding does not add up over many steps.
fn orthonormal(m: &Mat3) -> Mat3 {
    let w = m.column(2).normalize();
    let u = m.column(0).into_owned();
    let u = (u - w * u.dot(&w)).normalize();
    Mat3::from_columns(&[u, w.cross(&u), w])
}

#[cfg(test)]
mod tests {
    use super::super::fits::shapes;
    use super::*;

    #[test]
    fn the_jacobian_is_the_derivative_of_the_distance() {
        for s in shapes() {
            for k in 0..20 {
                let t = k as f64 * 0.7;
                let far =
                    s.origin + s.frame * Vec3::new(7.0 * t.cos(), 7.0 * t.sin(), 1.0 + 0.1 * t);
                let near = far - s.offset(&far).normal * s.offset(&far).distance;
                let x = near - s.offset(&near).normal * s.offset(&near).distance;
                let mut j = [0.0; MAX_DOF];
                s.distance_jacobian(&x, &mut j);
                for i in 0..s.family.dof() {
                    let h = 1e-6;
                    let at = |h: f64| {
                        let mut d = [0.0; MAX_DOF];
                        d[i] = h;
                        s.stepped(&d).map_or(f64::NAN, |s| s.distance(&x))
                    };
                    let numeric = (at(h) - at(-h)) / (2.0 * h);
                    assert!(
                        (numeric - j[i]).abs() < 1e-4,
                        "{:?} {i}: {numeric} {}",
                        s.family,
                        j[i]
                    );
                }
            }
        }
    }

    #[test]
    fn engineering_terms_describe_the_same_surface() {
        for s in shapes() {
            let Some(quadric) = s.surface().quadric() else { continue };
            for k in 0..10 {
                let t = k as f64;
                let x = s.origin + s.frame * Vec3::new(5.0 * t.cos(), 5.0 * t.sin(), 2.0);
                let d = quadric.distance(&x);
                let own = s.distance(&x).abs();
                assert!((d - own).abs() < 0.02 * (1.0 + own), "{:?} {d} {own}", s.family);
                let d = s.quadric().unwrap().distance(&x);
                assert!((d - own).abs() < 0.02 * (1.0 + own), "{:?} {d} {own}", s.family);
            }
        }
    }

    #[test]
    fn a_shape_is_the_same_from_its_engineering_terms() {
        for s in shapes() {
            let back = Shape::from(&s.surface());
            for k in 0..20 {
                let t = k as f64 * 0.7;
                let x = s.origin + s.frame * Vec3::new(7.0 * t.cos(), 7.0 * t.sin(), 1.0 + 0.1 * t);
                assert!((s.distance(&x) - back.distance(&x)).abs() < 1e-9, "{:?}", s.family);
            }
        }
    }

    #[test]
    fn a_slender_cones_coefficients_keep_all_digits() {
        for half_angle in [1e-6, -1e-3, 0.4] {
            let origin = Vec3::new(0.3, -0.2, 0.1);
            let size = [0.02, half_angle, 0.0];
            let cone = Shape::with_axis(Family::Cone, origin, Vec3::new(0.1, 0.2, 1.0), size);
            let q = cone.quadric().unwrap();
            for k in 0..20 {
                let (turn, t) = (0.7 * k as f64, 0.01 * k as f64 - 0.1);
                let r = 0.02 + t * half_angle.tan();
                let x = origin + cone.frame * Vec3::new(r * turn.cos(), r * turn.sin(), t);
                assert!(
                    q.value(&x).abs() < 1e-14 * q.gradient(&x).norm().max(1e-2),
                    "{half_angle}"
                );
            }
        }
    }
}
