//! Distances and their derivatives in a shape's own frame, one family at a time.
//!
//! [`Shape::distance_jacobian`](super::Shape::distance_jacobian) is the same for any family and reads more
//! easily; here everything that is the same for all points is worked out before, and what is left of a point is
//! a few operations without a branch, which the compiler does for several points at once.

#![expect(clippy::needless_range_loop, reason = "formulas over axes read best by index")]

use super::shape::Shape;

/// A surface of one family with `P` degrees of freedom, at the origin of its own frame.
pub trait Kernel<const P: usize> {
    /// Signed distance of a place in the frame.
    fn distance(&self, q: [f64; 3]) -> f64;

    /// Signed distance and its derivatives, in the order of [`Shape::distance_jacobian`].
    fn row(&self, q: [f64; 3]) -> (f64, [f64; P]);
}

/// Below this a length counts as this, so that it can divide.
const TINY: f64 = 1e-300;

/// The plane z = 0.
#[derive(Clone, Copy, Debug)]
pub struct Plane;

impl Kernel<3> for Plane {
    #[inline(always)]
    fn distance(&self, q: [f64; 3]) -> f64 {
        q[2]
    }

    #[inline(always)]
    fn row(&self, [x, y, z]: [f64; 3]) -> (f64, [f64; 3]) {
        (z, [-1.0, -y, x])
    }
}

/// A sphere of this radius.
#[derive(Clone, Copy, Debug)]
pub struct Sphere(pub f64);

impl Kernel<4> for Sphere {
    #[inline(always)]
    fn distance(&self, [x, y, z]: [f64; 3]) -> f64 {
        (x * x + y * y + z * z).sqrt() - self.0
    }

    #[inline(always)]
    fn row(&self, [x, y, z]: [f64; 3]) -> (f64, [f64; 4]) {
        let r = (x * x + y * y + z * z).sqrt().max(TINY);
        let inverse = -1.0 / r;
        (r - self.0, [x * inverse, y * inverse, z * inverse, -1.0])
    }
}

/// A cylinder of this radius along z.
#[derive(Clone, Copy, Debug)]
pub struct Cylinder(pub f64);

impl Kernel<5> for Cylinder {
    #[inline(always)]
    fn distance(&self, [x, y, _]: [f64; 3]) -> f64 {
        (x * x + y * y).sqrt() - self.0
    }

    #[inline(always)]
    fn row(&self, [x, y, z]: [f64; 3]) -> (f64, [f64; 5]) {
        let rho = (x * x + y * y).sqrt().max(TINY);
        let inverse = 1.0 / rho;
        let (nx, ny) = (x * inverse, y * inverse);
        (rho - self.0, [-nx, -ny, z * ny, -z * nx, -1.0])
    }
}

/// A cone about z.
#[derive(Clone, Copy, Debug)]
pub struct Cone {
    radius: f64,
    sin: f64,
    cos: f64,
}

impl Cone {
    /// The cone of a shape.
    pub fn of(shape: &Shape) -> Self {
        let (sin, cos) = shape.size[1].sin_cos();
        Self { radius: shape.size[0], sin, cos }
    }
}

impl Kernel<6> for Cone {
    #[inline(always)]
    fn distance(&self, [x, y, z]: [f64; 3]) -> f64 {
        ((x * x + y * y).sqrt() - self.radius) * self.cos - z * self.sin
    }

    #[inline(always)]
    fn row(&self, [x, y, z]: [f64; 3]) -> (f64, [f64; 6]) {
        let Self { radius, sin, cos } = *self;
        let rho = (x * x + y * y).sqrt().max(TINY);
        let inverse = 1.0 / rho;
        let (cx, cy) = (x * inverse, y * inverse);
        let d = (rho - radius) * cos - z * sin;
        // The foot point: distance from the axis (negative beyond it) and height.
        let (foot, height) = (rho - d * cos, z + d * sin);
        let turn = foot * sin + height * cos;
        let by_angle = -(foot.abs() - radius) * sin - height * cos;
        (d, [-cx * cos, -cy * cos, cy * turn, -cx * turn, -cos, by_angle])
    }
}

/// A torus about z.
#[derive(Clone, Copy, Debug)]
pub struct Torus {
    /// Radius of the circle that the tube follows.
    pub major: f64,
    /// Radius of the tube.
    pub minor: f64,
}

impl Kernel<7> for Torus {
    #[inline(always)]
    fn distance(&self, [x, y, z]: [f64; 3]) -> f64 {
        let s = (x * x + y * y).sqrt() - self.major;
        (s * s + z * z).sqrt() - self.minor
    }

    #[inline(always)]
    fn row(&self, [x, y, z]: [f64; 3]) -> (f64, [f64; 7]) {
        let rho = (x * x + y * y).sqrt().max(TINY);
        let inverse = 1.0 / rho;
        let (cx, cy) = (x * inverse, y * inverse);
        let s = rho - self.major;
        let tube = (s * s + z * z).sqrt().max(TINY);
        let inverse = 1.0 / tube;
        let (out, up) = (s * inverse, z * inverse);
        let d = tube - self.minor;
        let (foot, height) = (rho - out * d, z - up * d);
        let turn = height * out - foot * up;
        let by_major = if foot < 0.0 { out } else { -out };
        (d, [-cx * out, -cy * out, -up, cy * turn, -cx * turn, by_major, -1.0])
    }
}

/// An ellipse along z (D = 2) or an ellipsoid (D = 3).
#[derive(Clone, Copy, Debug)]
pub struct Elliptic<const D: usize> {
    /// 1 / semi-axis.
    inverse: [f64; D],
    /// 1 / semi-axis squared.
    inverse_sq: [f64; D],
}

/// What an elliptic kernel knows of a place: distance and unit gradient.
struct Near<const D: usize> {
    d: f64,
    n: [f64; D],
}

impl<const D: usize> Elliptic<D> {
    /// That of a shape.
    pub fn of(shape: &Shape) -> Self {
        let inverse = std::array::from_fn(|i| 1.0 / shape.size[i]);
        Self { inverse, inverse_sq: inverse.map(|v: f64| v * v) }
    }

    /// The near root of F - |g| d + h d2 = 0 along the gradient: see [`Shape::distance`].
    #[inline(always)]
    fn near(&self, q: [f64; 3]) -> Near<D> {
        let mut value = -1.0;
        let mut g = [0.0; D];
        let mut sq = 0.0;
        for i in 0..D {
            let s = q[i] * self.inverse_sq[i];
            value += q[i] * s;
            g[i] = 2.0 * s;
            sq += g[i] * g[i];
        }
        let norm = sq.sqrt().max(TINY);
        let inverse = 1.0 / norm;
        let mut h = 0.0;
        for i in 0..D {
            g[i] *= inverse;
            let t = g[i] * self.inverse[i];
            h += t * t;
        }
        let disc = norm * norm - 4.0 * h * value;
        let root = disc.max(0.0).sqrt();
        let near = 2.0 * value / (norm + root);
        Near { d: if disc >= 0.0 { near } else { value * inverse }, n: g }
    }

    /// At a foot point: the normal there, and the derivative of the distance by the log of each semi-axis,
    /// -2 (q_i/a_i)2 / |grad F|.
    ///
    /// The normal at the point itself would be off by its distance over the radius of curvature: little, but it goes
    /// with the residual, and along what the points hardly tell such errors outweigh all else.
    #[inline(always)]
    fn at_foot(&self, foot: [f64; D]) -> ([f64; D], [f64; D]) {
        let mut s = [0.0; D];
        let mut n = [0.0; D];
        let mut sq = 0.0;
        for i in 0..D {
            n[i] = foot[i] * self.inverse_sq[i];
            s[i] = -foot[i] * n[i];
            sq += n[i] * n[i];
        }
        let inverse = 1.0 / sq.sqrt().max(TINY);
        (n.map(|v| v * inverse), s.map(|v| v * inverse))
    }
}

impl Kernel<7> for Elliptic<2> {
    #[inline(always)]
    fn distance(&self, q: [f64; 3]) -> f64 {
        self.near(q).d
    }

    #[inline(always)]
    fn row(&self, q: [f64; 3]) -> (f64, [f64; 7]) {
        let Near { d, n } = self.near(q);
        let foot = [q[0] - n[0] * d, q[1] - n[1] * d];
        let (n, [s0, s1]) = self.at_foot(foot);
        let spin = foot[1] * n[0] - foot[0] * n[1];
        (d, [-n[0], -n[1], q[2] * n[1], -q[2] * n[0], spin, s0, s1])
    }
}

impl Kernel<9> for Elliptic<3> {
    #[inline(always)]
    fn distance(&self, q: [f64; 3]) -> f64 {
        self.near(q).d
    }

    #[inline(always)]
    fn row(&self, q: [f64; 3]) -> (f64, [f64; 9]) {
        let Near { d, n } = self.near(q);
        let f = [q[0] - n[0] * d, q[1] - n[1] * d, q[2] - n[2] * d];
        let (n, [s0, s1, s2]) = self.at_foot(f);
        let turn =
            [f[2] * n[1] - f[1] * n[2], f[0] * n[2] - f[2] * n[0], f[1] * n[0] - f[0] * n[1]];
        (d, [-n[0], -n[1], -n[2], turn[0], turn[1], turn[2], s0, s1, s2])
    }
}
