//! A shape prepared for measuring many points.

use multiversion::multiversion;

use super::kernels::{Cone, Cylinder, Elliptic, Kernel, Plane, Sphere, Torus};
use super::shape::{Family, Shape};
use crate::geometry::Vec3;

/// A shape with all that its distances need and that is the same for every point. What [`Shape::distance`]
/// gives, it gives within rounding.
#[derive(Clone, Copy, Debug)]
pub struct Ruler {
    shape: Shape,
    pub(super) placed: Placed,
    pub(super) kernel: Prepared,
}

/// The kernel of each family.
#[derive(Clone, Copy, Debug)]
pub(super) enum Prepared {
    Plane(Plane),
    Sphere(Sphere),
    Cylinder(Cylinder),
    Cone(Cone),
    EllipticCylinder(Elliptic<2>),
    Torus(Torus),
    Ellipsoid(Elliptic<3>),
}

/// From the points' frame to a shape's.
#[derive(Clone, Copy, Debug)]
pub(super) struct Placed {
    origin: [f64; 3],
    axes: [[f64; 3]; 3],
}

impl Placed {
    fn of(shape: &Shape) -> Self {
        let axes = [0, 1, 2].map(|i| shape.frame.column(i).into_owned().into());
        Self { origin: shape.origin.into(), axes }
    }

    #[inline(always)]
    pub(super) fn local(&self, x: f64, y: f64, z: f64) -> [f64; 3] {
        let [x, y, z] = [x - self.origin[0], y - self.origin[1], z - self.origin[2]];
        self.axes.map(|a| a[0] * x + a[1] * y + a[2] * z)
    }
}

/// Does the same for whatever kernel a ruler holds: `with_kernel!(ruler, |kernel| ...)`.
macro_rules! with_kernel {
    ($ruler:expr, |$kernel:ident| $body:expr) => {
        match &$ruler.kernel {
            Prepared::Plane($kernel) => $body,
            Prepared::Sphere($kernel) => $body,
            Prepared::Cylinder($kernel) => $body,
            Prepared::Cone($kernel) => $body,
            Prepared::EllipticCylinder($kernel) => $body,
            Prepared::Torus($kernel) => $body,
            Prepared::Ellipsoid($kernel) => $body,
        }
    };
}
pub(super) use with_kernel;

impl Ruler {
    /// The ruler of a shape.
    pub fn of(shape: &Shape) -> Self {
        let [a, b, _] = shape.size;
        let kernel = match shape.family {
            Family::Plane => Prepared::Plane(Plane),
            Family::Sphere => Prepared::Sphere(Sphere(a)),
            Family::Cylinder => Prepared::Cylinder(Cylinder(a)),
            Family::Cone => Prepared::Cone(Cone::of(shape)),
            Family::EllipticCylinder => Prepared::EllipticCylinder(Elliptic::of(shape)),
            Family::Torus => Prepared::Torus(Torus { major: a, minor: b }),
            Family::Ellipsoid => Prepared::Ellipsoid(Elliptic::of(shape)),
        };
        Self { shape: *shape, placed: Placed::of(shape), kernel }
    }

    /// Signed distance from `x`.
    #[inline]
    pub fn distance(&self, x: &Vec3) -> f64 {
        let q = self.placed.local(x.x, x.y, x.z);
        with_kernel!(self, |kernel| kernel.distance(q))
    }

    /// The shape that it measures from.
    pub fn shape(&self) -> &Shape {
        &self.shape
    }

    /// Signed distances from `points`, into as many places of `out`.
    pub fn distances(&self, points: &[Vec3], out: &mut [f64]) {
        distances(self, points, out);
    }

    /// Sum of min(d2 `inverse`, `cut`) over `points`.
    pub fn truncated(&self, points: &[Vec3], inverse: f64, cut: f64) -> f64 {
        let mut sum = 0.0;
        self.for_each(points, |d| sum += (d * d * inverse).min(cut));
        sum
    }

    /// Gives the distances from `points`, in turn, to `each`.
    pub fn for_each(&self, points: &[Vec3], mut each: impl FnMut(f64)) {
        let mut some = [0.0; 256];
        for points in points.chunks(some.len()) {
            let some = &mut some[..points.len()];
            self.distances(points, some);
            some.iter().for_each(|d| each(*d));
        }
    }
}

#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2"))]
fn distances(ruler: &Ruler, points: &[Vec3], out: &mut [f64]) {
    with_kernel!(ruler, |kernel| fill(kernel, &ruler.placed, points, out));
}

#[inline(always)]
fn fill<const P: usize>(
    kernel: &impl Kernel<P>,
    placed: &Placed,
    points: &[Vec3],
    out: &mut [f64],
) {
    for (d, p) in out.iter_mut().zip(points) {
        *d = kernel.distance(placed.local(p.x, p.y, p.z));
    }
}

#[cfg(test)]
mod tests {
    use super::super::fits::Random;
    use super::*;

    #[test]
    fn a_ruler_measures_what_the_shape_does() {
        let mut random = Random::new(4);
        let mut side = || random.uniform(-9.0, 9.0);
        let points: Vec<Vec3> = (0..300).map(|_| Vec3::new(side(), side(), side())).collect();
        let (o, w) = (Vec3::new(1.0, -2.0, 3.0), Vec3::new(0.2, 0.3, 1.0));
        for family in Family::ALL {
            let size = if family == Family::Cone { [4.0, -0.4, 0.0] } else { [6.0, 4.0, 5.0] };
            let shape = Shape::with_axis(family, o, w, size);
            let ruler = Ruler::of(&shape);
            let mut seen = Vec::new();
            ruler.for_each(&points, |d| seen.push(d));
            assert_eq!(seen.len(), points.len());
            for (x, d) in points.iter().zip(seen) {
                let expected = shape.distance(x);
                assert!((d - expected).abs() < 1e-12 * (1.0 + expected.abs()), "{family:?}");
                assert_eq!(d.to_bits(), ruler.distance(x).to_bits(), "{family:?}");
            }
        }
    }
}
