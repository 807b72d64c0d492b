//! A region's ten coefficients about the file's origin, and about one near its points.

use multiversion::multiversion;
use rayon::prelude::*;

use super::Extent;
use crate::geometry::{Quadric, Scale, Vec3};

/// Points summed at once; fixed, so that the result does not depend on the number of threads.
const CHUNK: usize = 4096;

/// The equations of one surface. See the fields of the same names of [`Region`](super::Region).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Equations {
    /// About the file's origin.
    pub coefficients: [f64; 10],
    /// How these are scaled.
    pub coefficients_scale: Scale,
    /// How far off these are, as a length.
    pub coefficients_error: Option<f64>,
    /// An origin near the points.
    pub local_origin: [f64; 3],
    /// About that one.
    pub local_coefficients: [f64; 10],
}

impl Equations {
    /// Of the surface that is `far` about the file's origin and `local(o)` about `o`, whose common factors mean
    /// nothing, and of its `n` points, which lie within `extent`; `point` gives each.
    pub fn of(
        far: &Quadric,
        local: impl FnOnce(&Vec3) -> Quadric,
        extent: &Extent,
        n: usize,
        point: impl Fn(usize) -> Vec3 + Sync,
    ) -> Self {
        let origin = origin_near(extent);
        let local = local(&origin);
        let (scaled, coefficients_scale) = far.scaled();
        let pair = Pair { far: scaled.0, local: local.0, origin: origin.into() };
        let starts: Vec<usize> = (0..n).step_by(CHUNK).collect();
        let parts: Vec<Tally> = starts
            .into_par_iter()
            .map(|from| Tally::of(&pair, (from..n.min(from + CHUNK)).map(&point)))
            .collect();
        let mut tally = Tally::default();
        parts.iter().for_each(|part| tally.merge(part));
        Self {
            coefficients: scaled.0,
            coefficients_scale,
            coefficients_error: tally.error(),
            local_origin: origin.into(),
            local_coefficients: tally.of_unit_slope(&local),
        }
    }
}

/// The middle of a region's box, rounded to a tenth of the power of ten that its longest side reaches: it lies
/// within a twentieth of that side of the middle, and is written with few digits that read back as it is.
fn origin_near(extent: &Extent) -> Vec3 {
    let (min, max) = (Vec3::from(extent.min), Vec3::from(extent.max));
    let middle = min + (max - min) / 2.0;
    let size = (max - min).max();
    if size > 0.0 { middle.map(|x| rounded(x, size.log10().floor() as i32 - 1)) } else { middle }
}

/// The multiple of ten to the power of `exponent` next to `x`, as the double that its decimal digits are read as.
fn rounded(x: f64, exponent: i32) -> f64 {
    let multiple = (x / 10f64.powi(exponent)).round();
    // Nought has no sign.
    format!("{multiple}e{exponent}").parse().map_or(x, |r: f64| r + 0.0)
}

/// One surface about both origins.
struct Pair {
    far: [f64; 10],
    local: [f64; 10],
    origin: [f64; 3],
}

/// Points measured at once.
const LANES: usize = 64;

/// Some points and what both equations say of them.
struct Lanes {
    points: [[f64; LANES]; 3],
    /// Distance by the local equation.
    distance: [f64; LANES],
    /// By how much that by the far one differs.
    off: [f64; LANES],
    /// Square of the local gradient.
    sq_slope: [f64; LANES],
}

/// The left-hand side of (1), term by term in its order as callers reckon it, and its gradient.
#[inline(always)]
fn at(a: &[f64; 10], x: f64, y: f64, z: f64) -> (f64, [f64; 3]) {
    let value = a[0] * (x * x)
        + a[1] * (y * y)
        + a[2] * (z * z)
        + a[3] * (x * y)
        + a[4] * (y * z)
        + a[5] * (x * z)
        + a[6] * x
        + a[7] * y
        + a[8] * z
        + a[9];
    let slope = [
        2.0 * a[0] * x + a[3] * y + a[5] * z + a[6],
        2.0 * a[1] * y + a[3] * x + a[4] * z + a[7],
        2.0 * a[2] * z + a[4] * y + a[5] * x + a[8],
    ];
    (value, slope)
}

#[inline(always)]
fn dot(a: &[f64; 3], b: &[f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2"))]
fn measure(pair: &Pair, lanes: &mut Lanes) {
    let (far, local, o) = (pair.far, pair.local, pair.origin);
    for k in 0..LANES {
        let [x, y, z] = [lanes.points[0][k], lanes.points[1][k], lanes.points[2][k]];
        let (far_value, far_slope) = at(&far, x, y, z);
        let (value, slope) = at(&local, x - o[0], y - o[1], z - o[2]);
        let sq_slope = dot(&slope, &slope);
        let distance = value / sq_slope.sqrt();
        let far_distance = far_value / dot(&far_slope, &far_slope).sqrt();
        // The two factors may differ in sign.
        let turned = if dot(&far_slope, &slope) < 0.0 { -far_distance } else { far_distance };
        lanes.distance[k] = distance;
        lanes.off[k] = (turned - distance).abs();
        lanes.sq_slope[k] = sq_slope;
    }
}

/// Sums over points.
#[derive(Default)]
struct Tally {
    n: usize,
    /// Of the local gradient.
    sum_sq: f64,
    /// Points at which the local equation tells a distance.
    measured: usize,
    /// Largest difference between the two distances; infinite where the far one is none.
    error: f64,
}

impl Tally {
    fn of(pair: &Pair, points: impl Iterator<Item = Vec3>) -> Self {
        let mut tally = Self::default();
        let none = [0.0; LANES];
        let mut lanes = Lanes { points: [none; 3], distance: none, off: none, sq_slope: none };
        let mut points = points.peekable();
        while points.peek().is_some() {
            let mut n = 0;
            for p in points.by_ref().take(LANES) {
                lanes.points.iter_mut().zip(p.iter()).for_each(|(lane, x)| lane[n] = *x);
                n += 1;
            }
            measure(pair, &mut lanes);
            tally.add(&lanes, n);
        }
        tally
    }

    /// Adds the first `n` of the points measured.
    fn add(&mut self, lanes: &Lanes, n: usize) {
        self.n += n;
        self.sum_sq += lanes.sq_slope[..n].iter().sum::<f64>();
        for (distance, off) in lanes.distance[..n].iter().zip(&lanes.off) {
            // At an apex, or on a plane that is counted twice, there is no first order.
            if distance.is_finite() {
                self.measured += 1;
                self.error = self.error.max(if off.is_finite() { *off } else { f64::INFINITY });
            }
        }
    }

    fn merge(&mut self, other: &Self) {
        self.n += other.n;
        self.sum_sq += other.sum_sq;
        self.measured += other.measured;
        self.error = self.error.max(other.error);
    }

    fn error(&self) -> Option<f64> {
        (self.measured > 0 && self.error.is_finite()).then_some(self.error)
    }

    /// The coefficients of `local` by such a factor that the root mean square of its gradient is one; of unit
    /// length where the gradient vanishes at all points.
    fn of_unit_slope(&self, local: &Quadric) -> [f64; 10] {
        let slope = (self.sum_sq / self.n.max(1) as f64).sqrt();
        let norm = local.0.iter().map(|a| a * a).sum::<f64>().sqrt();
        let factor = [slope, norm].into_iter().find(|f| f.is_normal()).unwrap_or(1.0);
        // As nought has no sign, none is written.
        local.0.map(|a| a / factor + 0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Plane, Sphere, Surface};

    fn extent(points: &[Vec3]) -> Extent {
        let min = points.iter().copied().reduce(|a, b| a.inf(&b)).unwrap();
        let max = points.iter().copied().reduce(|a, b| a.sup(&b)).unwrap();
        Extent { min: min.into(), max: max.into() }
    }

    /// Points `offset` away on a half sphere of radius `r` about the origin.
    fn half_sphere(r: f64, offset: &Vec3) -> Vec<Vec3> {
        let at = |k: usize| {
            let (turn, z) = (2.4 * k as f64, (k as f64 + 0.5) / 500.0);
            let s = (1.0 - z * z).sqrt();
            offset + r * Vec3::new(s * turn.cos(), s * turn.sin(), z)
        };
        (0..500).map(at).collect()
    }

    fn of_sphere(r: f64, offset: &Vec3) -> (Vec<Vec3>, Equations) {
        let points = half_sphere(r, offset);
        let about = |o: &Vec3| Surface::Sphere(Sphere { center: offset - o, radius: r }).quadric();
        let far = about(&Vec3::zeros());
        let e = Equations::of(&far, about, &extent(&points), points.len(), |k| points[k]);
        (points, e)
    }

    #[test]
    fn an_origin_has_few_digits_and_lies_near_the_middle() {
        let min = [499_999.98, 5_000_000.02, -0.004];
        let e = Extent { min, max: [500_000.02, 5_000_000.06, 0.0045] };
        let origin = origin_near(&e);
        assert_eq!(<[f64; 3]>::from(origin).map(|x| x.to_string()), ["500000", "5000000.04", "0"]);
        for size in [1e-50, 3e-7, 0.99, 1.0, 7e12, 1e50] {
            for middle in [0.0, size / 3.0, -123.456 * size, 1.1e4 * size] {
                let side = size / 2.0;
                let (min, max) = ([middle - side; 3], [middle + side; 3]);
                let o = origin_near(&Extent { min, max }).x;
                assert!((o - middle).abs() <= size * 0.0501, "{size:e} {middle:e}: {o:e}");
                let text = format!("{o:e}");
                assert_eq!(text.parse::<f64>().unwrap(), o);
                assert!(text.len() <= 14, "{text}");
            }
        }
    }

    #[test]
    fn the_local_value_is_about_the_distance_wherever_the_cloud_lies() {
        let mut first = None;
        for far in [0.0, 1e3, 1e7] {
            let (points, e) = of_sphere(0.02, &Vec3::new(far, 10.0 * far, -far));
            let q = Quadric(e.local_coefficients);
            for p in &points {
                let away = p + 1e-4 * (p - Vec3::new(far, 10.0 * far, -far)) / 0.02;
                let value = q.value(&(away - Vec3::from(e.local_origin)));
                assert!((value - 1e-4).abs() < 1e-6 + 4e-16 * 10.0 * far, "{far:e}: {value:e}");
            }
            let first = *first.get_or_insert(e.local_coefficients);
            let same = |(a, b): (&f64, &f64)| (a - b).abs() < 1e-6 + 1e-15 * 10.0 * far;
            assert!(first.iter().zip(&e.local_coefficients).all(same), "{far:e}");
        }
    }

    #[test]
    fn the_far_ones_say_how_far_off_they_are() {
        let near = of_sphere(0.02, &Vec3::zeros()).1.coefficients_error.unwrap();
        assert!(near < 1e-16, "{near:e}");
        // 4e14 times the double's rounding, over a gradient of 0.04.
        let offset = Vec3::new(5e5, 5e6, 100.0);
        let (points, e) = of_sphere(0.02, &offset);
        let q = Quadric(e.coefficients);
        let off =
            points.iter().map(|p| (q.value(p) / q.gradient(p).norm()).abs()).fold(0.0, f64::max);
        let told = e.coefficients_error.unwrap();
        // Both are rounding, of sums in unlike order.
        assert!(told > 1e-3 && told < 3.0 * off && off < 3.0 * told, "{told:e} {off:e}");
    }

    #[test]
    fn a_plane_is_its_unit_normal_and_its_distance() {
        let normal = Vec3::new(0.6, 0.0, 0.8);
        let at =
            |k: usize| Vec3::new(0.8 * (k % 20) as f64, (k / 20) as f64, -0.6 * (k % 20) as f64);
        let points: Vec<Vec3> = (0..400).map(at).collect();
        let about = |o: &Vec3| Surface::Plane(Plane { point: -o, normal }).quadric();
        let e = Equations::of(&about(&Vec3::zeros()), about, &extent(&points), 400, |k| points[k]);
        assert_eq!(e.coefficients_scale, Scale::Unit);
        assert!(e.coefficients_error.unwrap() < 1e-14);
        let expected = normal.dot(&Vec3::from(e.local_origin));
        let [a7, a8, a9, a10] = [6, 7, 8, 9].map(|k| e.local_coefficients[k]);
        assert!((Vec3::new(a7, a8, a9) - normal).norm() < 1e-15 && (a10 - expected).abs() < 1e-15);
    }

    #[test]
    fn where_no_gradient_is_there_is_no_error_and_the_length_is_one() {
        let twice = Quadric([0.0, 0.0, 4.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
        let points: Vec<Vec3> =
            (0..100).map(|k| Vec3::new((k % 10) as f64, (k / 10) as f64, 0.0)).collect();
        let e = Equations::of(&twice, |_| twice, &extent(&points), 100, |k| points[k]);
        assert_eq!(e.coefficients_error, None);
        assert_eq!(e.local_coefficients, [0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    }
}
