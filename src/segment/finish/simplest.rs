//! The simplest family that explains a region.

use std::f64::consts::FRAC_1_SQRT_2;

use crate::fit::constant::constants;
use crate::fit::least_squares::{Columns, Fitted, Options, fit, fit_columns};
use crate::fit::{Family, Shape, Spread};
use crate::geometry::{Mat3, Vec3};
use crate::segment::Monitor;
use crate::segment::objective::{DOUBT, GOOD, SOUND};

constants! {
    /// Points that tell a simpler family to be hopeless.
    pub FEW: usize = 500, Effort("points of one look");
    /// Points of a region that the correlation of its residuals is judged by.
    INFLATION_SAMPLE: usize = 6_000, Effort("points of one look");
    /// Residuals that shake the parameters this many times more than noise would show a form error.
    DOUBLE: f64 = 2.0, Trial(2.0, 2.0);
    /// Steps of the last fit of a surface.
    STEPS: usize = 6, Effort("steps of one fit");
    /// Steps of a fit of another family.
    COLD_STEPS: usize = 15, Effort("steps of one fit");
}

/// The shape fitted to weighted points, or a simpler family nested in its own where that one's
/// description length is less. `total` is the weight of all points of which these are a sample.
///
/// Where residuals are correlated, a form error lets a richer family gain that many times more than noise
/// would: the gain is divided by it.
pub fn simplest(
    shape: &Shape,
    points: &Columns,
    total: f64,
    sigma: f64,
    monitor: &dyn Monitor,
) -> Shape {
    let o = Options { cauchy: None, steps: STEPS.get(), tolerance: 1e-7 };
    let fitted = |s: &Shape, steps| {
        (!monitor.cancelled()).then(|| fit_columns(s, points, &Options { steps, ..o }))?
    };
    let Some(f) = fitted(shape, o.steps) else { return *shape };
    let few = points.thinned(FEW.get());
    let floor = f.mean_sq.max(sigma * sigma);
    let hopeless = |s: &Shape| {
        let options = Options { cauchy: None, steps: COLD_STEPS.get(), tolerance: 1e-3 };
        fit(s, &few, None, &options).is_none_or(|f| f.mean_sq > SOUND.get() * floor)
    };
    let mut simpler = nested(&f.shape, &points.origin());
    simpler.retain(|s| !hopeless(s));
    if simpler.is_empty() {
        return f.shape;
    }
    let sample = points.thinned(INFLATION_SAMPLE.get());
    let share = (total / sample.len().max(1) as f64).max(1.0);
    let spread = Spread::of(&f.shape, &sample);
    let inflation = spread.inflation(sigma, share);
    // What the richest saves over this one, in units of what such a change may save by chance, and its description.
    let length = |g: &Fitted| {
        let change = |p: &Vec3| g.shape.distance(p) - f.shape.distance(p);
        let saved = (g.mean_sq - f.mean_sq) * total / (sigma * sigma);
        let length = saved / spread.inflation_along(sigma, share, change)
            + g.shape.family.description_length(total as usize);
        if g.shape.family == Family::Plane { length - DOUBT.get() } else { length }
    };
    // How much of a form error is the family's is not for it to say.
    let within_form = |f: &Fitted, best: &Fitted| {
        inflation > DOUBLE.get() && f.mean_sq < GOOD.get() * best.mean_sq.max(sigma * sigma)
    };
    let mut best = (length(&f), f);
    let bent = |s: &Shape| is_straightened(shape, s) && inflation <= DOUBLE.get();
    for s in simpler.into_iter().filter(|s| !bent(s)) {
        if let Some(f) = fitted(&s, COLD_STEPS.get()) {
            let length = length(&f);
            if length < best.0 || within_form(&f, &best.1) {
                best = (length, f);
            }
        }
    }
    best.1.shape
}

/// Simpler shapes near this one where its points lie, for a start.
fn nested(s: &Shape, centroid: &Vec3) -> Vec<Shape> {
    let [a, b, c] = s.size;
    let o = s.offset(centroid);
    let plane = || {
        let foot = centroid - o.normal * o.distance;
        Shape::with_axis(Family::Plane, foot, o.normal, [0.0; 3])
    };
    let round = |family, radius| Shape { family, size: [radius, 0.0, 0.0], ..*s };
    match s.family {
        Family::Cylinder | Family::Sphere => vec![plane()],
        Family::Cone => vec![round(Family::Cylinder, a.abs()), plane()],
        Family::EllipticCylinder => vec![round(Family::Cylinder, (a * b).sqrt()), plane()],
        Family::Ellipsoid => {
            let mut simpler = stretched(s, centroid);
            simpler.push(round(Family::Sphere, (a * b * c).cbrt()));
            simpler
        }
        // A tube whose axis hardly bends, a sheet; a neck or a barrel that hardly narrows.
        Family::Torus => {
            let simpler = [straightened(s, centroid), plane()];
            about_axis(s, centroid).into_iter().chain(simpler).collect()
        }
        Family::Plane => Vec::new(),
    }
}

/// Whether a shape is what a form error alone bends to the other: a cylinder to an ellipsoid or a torus, a plane to a
/// torus.
fn is_straightened(bent: &Shape, straight: &Shape) -> bool {
    match bent.family {
        Family::Torus => straight.family != Family::Cone,
        Family::Ellipsoid => straight.family != Family::Sphere,
        _ => false,
    }
}

/// The cylinders, elliptic and round, along the longest axis of an ellipsoid where its points lie.
fn stretched(s: &Shape, centroid: &Vec3) -> Vec<Shape> {
    let mut order = [0, 1, 2];
    order.sort_by(|&i, &j| s.size[i].total_cmp(&s.size[j]));
    let [i, j, k] = order;
    let axis = |i: usize| s.frame.column(i).into_owned();
    let height = axis(k).dot(&(centroid - s.origin));
    let narrowing = (1.0 - (height / s.size[k]).powi(2)).max(0.0).sqrt();
    let [a, b] = [i, j].map(|i| s.size[i] * narrowing);
    let elliptic = Shape {
        family: Family::EllipticCylinder,
        origin: s.origin + axis(k) * height,
        frame: Mat3::from_columns(&[axis(i), axis(k).cross(&axis(i)), axis(k)]),
        size: [a, b, 0.0],
    };
    let radius = (a * b).sqrt();
    vec![elliptic, Shape { family: Family::Cylinder, size: [radius, 0.0, 0.0], ..elliptic }]
}

/// The cone about a torus's axis that touches it where its points lie. None where it is flat there.
fn about_axis(s: &Shape, centroid: &Vec3) -> Option<Shape> {
    let (q, w, o) = (centroid - s.origin, s.w(), s.offset(centroid));
    let height = q.dot(&w);
    let radial = (q - w * height).normalize();
    let (out, up) = (o.normal.dot(&radial), o.normal.dot(&w));
    let radius = (q - o.normal * o.distance).dot(&radial);
    if out.abs() < FRAC_1_SQRT_2 || radius <= 0.0 {
        return None;
    }
    let size = [radius, (-up / out).atan(), 0.0];
    let origin = s.origin + w * (height - o.distance * up);
    Some(Shape { family: Family::Cone, origin, size, ..*s })
}

/// The cylinder along a torus's tube where its points lie.
fn straightened(s: &Shape, centroid: &Vec3) -> Shape {
    let q = centroid - s.origin;
    let w = s.w();
    let radial = (q - w * q.dot(&w)).normalize();
    let middle = s.origin + radial * s.size[0];
    Shape::with_axis(Family::Cylinder, middle, w.cross(&radial), [s.size[1], 0.0, 0.0])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::segment::Silent;

    #[test]
    fn a_long_ellipsoid_is_as_wide_as_its_cylinder_where_its_points_lie() {
        let ellipsoid = Shape {
            family: Family::Ellipsoid,
            origin: Vec3::new(1.0, 2.0, 3.0),
            frame: Mat3::identity(),
            size: [1000.0, 10.0, 10.0],
        };
        let centroid = ellipsoid.origin + Vec3::new(600.0, 8.0, 0.0);
        let simpler = nested(&ellipsoid, &centroid);
        let families: Vec<Family> = simpler.iter().map(|s| s.family).collect();
        assert_eq!(families, [Family::EllipticCylinder, Family::Cylinder, Family::Sphere]);
        for s in &simpler[..2] {
            assert!((s.size[0] - 8.0).abs() < 1e-12, "{s:?}");
            assert!(s.distance(&centroid).abs() < 1e-9, "{s:?}");
            assert!(s.w().cross(&Vec3::x()).norm() < 1e-12, "{s:?}");
        }
    }

    #[test]
    fn a_neck_or_a_barrel_has_the_cone_that_touches_it() {
        for (size, at) in [([30.0, 20.0, 0.0], 12.0), ([10.0, 500.0, 0.0], 510.0)] {
            let torus = Shape::with_axis(Family::Torus, Vec3::new(1.0, 2.0, 3.0), Vec3::z(), size);
            let centroid = torus.origin + Vec3::new(at, 0.0, 3.0);
            let cone = about_axis(&torus, &centroid).unwrap();
            let (own, other) = (cone.offset(&centroid), torus.offset(&centroid));
            assert!((own.distance.abs() - other.distance.abs()).abs() < 1e-9, "{own:?} {other:?}");
            assert!(own.normal.cross(&other.normal).norm() < 1e-9, "{own:?} {other:?}");
        }
        let rim = Shape::with_axis(Family::Torus, Vec3::zeros(), Vec3::z(), [30.0, 2.0, 0.0]);
        assert!(about_axis(&rim, &Vec3::new(30.1, 0.0, 2.0)).is_none());
    }

    #[test]
    fn a_strip_is_curved_only_where_that_saves_more_than_leaked_points_would() {
        const SIGMA: f64 = 0.02;
        let (columns, rows, width) = (90, 6, 1.4);
        let n = columns * rows;
        // What a cylinder of this radius saves in chi2 over a plane is n / sigma2 times the variance of x2 / (2 R).
        let strip = |saved: f64| {
            let x = |k: usize| width * (k as f64 / (rows - 1) as f64 - 0.5);
            let sq: Vec<f64> = (0..rows).map(|k| x(k).powi(2)).collect();
            let mean = sq.iter().sum::<f64>() / rows as f64;
            let variance = sq.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / rows as f64;
            let radius = (n as f64 * variance / (4.0 * saved * SIGMA * SIGMA)).sqrt();
            let z = |x: f64| (radius * radius - x * x).sqrt() - radius;
            let points: Vec<Vec3> =
                (0..n).map(|k| Vec3::new(x(k % rows), (k / rows) as f64, z(x(k % rows)))).collect();
            let origin = Vec3::new(0.0, 0.0, -radius);
            let size = [radius, 0.0, 0.0];
            let shape = Shape::with_axis(Family::Cylinder, origin, Vec3::y(), size);
            simplest(&shape, &Columns::of(&points, None), n as f64, SIGMA, &Silent).family
        };
        let length = |f: Family| f.description_length(n);
        let dearer = length(Family::Cylinder) - length(Family::Plane);
        assert_eq!(strip(dearer + 0.5 * DOUBT.get()), Family::Plane);
        assert_eq!(strip(dearer + 2.0 * DOUBT.get()), Family::Cylinder);
    }
}
