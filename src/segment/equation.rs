//! A region's ten coefficients about the file's origin, and about one near its points.

mod pair;
mod tally;

use rayon::prelude::*;

use super::Extent;
use crate::geometry::{Quadric, Scale, Vec3};
use pair::Pair;
use tally::Tally;

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
pub fn origin_near(extent: &Extent) -> Vec3 {
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
        let about =
            |o: &Vec3| Surface::Sphere(Sphere { center: offset - o, radius: r }).quadric().unwrap();
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
        let about = |o: &Vec3| Surface::Plane(Plane { point: -o, normal }).quadric().unwrap();
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
