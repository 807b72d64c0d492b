//! Starts and fits of every family on noisy patches, against the truth and the Cramer-Rao bound.

use super::least_squares::{Options, fit};
use super::local_quadric::{LocalQuadric, LocalQuadrics};
use super::starts::{self, Patch};
use super::{Family, Shape};
use crate::geometry::Vec3;

/// Reproducible random numbers (SplitMix64).
pub struct Random(u64);

impl Random {
    pub fn new(seed: u64) -> Self {
        Self(seed)
    }

    pub fn uniform(&mut self, from: f64, to: f64) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        from + (to - from) * ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Box and Muller's normal number.
    pub fn normal(&mut self) -> f64 {
        let radius = (-2.0 * (1.0 - self.uniform(0.0, 1.0)).ln()).sqrt();
        radius * self.uniform(0.0, std::f64::consts::TAU).cos()
    }

    fn vector(&mut self) -> Vec3 {
        Vec3::new(self.normal(), self.normal(), self.normal())
    }
}

/// A shape of each family, all at one tilted place.
pub fn shapes() -> Vec<Shape> {
    let (o, w) = (Vec3::new(1.0, -2.0, 3.0), Vec3::new(0.2, 0.3, 1.0));
    [
        (Family::Plane, [0.0; 3]),
        (Family::Sphere, [5.0, 0.0, 0.0]),
        (Family::Cylinder, [4.0, 0.0, 0.0]),
        (Family::Cone, [4.0, 0.4, 0.0]),
        (Family::EllipticCylinder, [6.0, 4.0, 0.0]),
        (Family::Torus, [9.0, 3.0, 0.0]),
        (Family::Ellipsoid, [6.0, 4.0, 5.0]),
    ]
    .map(|(family, size)| Shape::with_axis(family, o, w, size))
    .to_vec()
}

const SIGMA: f64 = 0.02;

/// Whether a place in the shape's frame is seen.
type Seen = fn(&Vec3) -> bool;

/// Every family, each with the part of it that is seen.
fn patches() -> Vec<(Shape, Seen)> {
    let (origin, w) = (Vec3::new(30.0, -20.0, 10.0), Vec3::new(0.3, -0.5, 0.8));
    let shape = |family, size| Shape::with_axis(family, origin, w, size);
    let upright = |q: &Vec3| q.z.abs() < 10.0;
    let arc = |q: &Vec3| q.z.abs() < 10.0 && q.x > -2.0;
    vec![
        (shape(Family::Plane, [0.0; 3]), upright),
        (shape(Family::Sphere, [10.0, 0.0, 0.0]), |q| q.z > 4.0),
        (shape(Family::Cylinder, [10.0, 0.0, 0.0]), arc),
        (shape(Family::Cone, [10.0, 0.4, 0.0]), arc),
        (shape(Family::Cone, [10.0, -0.3, 0.0]), arc),
        (shape(Family::EllipticCylinder, [12.0, 7.0, 0.0]), arc),
        (shape(Family::Torus, [14.0, 4.0, 0.0]), |q| q.x > -2.0),
        (shape(Family::Ellipsoid, [12.0, 9.0, 6.0]), |q| q.z > -1.0),
    ]
}

/// `n` exact points of the patch.
fn exact(shape: &Shape, seen: Seen, n: usize, random: &mut Random) -> Vec<Vec3> {
    let mut out = Vec::new();
    while out.len() < n {
        let mut side = || random.uniform(-18.0, 18.0);
        let mut x = shape.origin + Vec3::new(side(), side(), side());
        for _ in 0..30 {
            let o = shape.offset(&x);
            x -= o.normal * o.distance;
        }
        let local = shape.frame.tr_mul(&(x - shape.origin));
        if seen(&local) && shape.distance(&x).abs() < 1e-9 {
            out.push(x);
        }
    }
    out
}

/// The points with noise in every coordinate, and rough unsigned normals.
fn noisy(shape: &Shape, exact: &[Vec3], random: &mut Random) -> (Vec<Vec3>, Vec<Vec3>) {
    let points = exact.iter().map(|x| x + SIGMA * random.vector()).collect();
    let mut normal = |x: &Vec3| {
        let sign = if random.uniform(0.0, 1.0) < 0.5 { -1.0 } else { 1.0 };
        (shape.offset(x).normal * sign + 0.03 * random.vector()).normalize()
    };
    (points, exact.iter().map(&mut normal).collect())
}

/// The starts of a family.
fn cold(family: Family, patch: &Patch<'_>) -> Vec<Shape> {
    let points = patch.points;
    let quadrics = LocalQuadrics::of(points);
    let axes = starts::cylinder_axes(patch, quadrics.taubin());
    let specific = quadrics.specific();
    let both = [quadrics.taubin(), specific.as_ref()];
    let ellipsoids = both.map(|q| q.and_then(LocalQuadric::ellipsoid));
    match family {
        Family::Plane => starts::plane(points).into_iter().collect(),
        Family::Sphere => starts::sphere(points).into_iter().collect(),
        Family::Cylinder => axes.iter().filter_map(|w| starts::cylinder(points, w)).collect(),
        Family::Cone => starts::cone(patch).into_iter().collect(),
        Family::EllipticCylinder => {
            axes.iter().filter_map(|w| starts::elliptic_cylinder(points, w)).collect()
        }
        Family::Torus => starts::torus(patch).into_iter().collect(),
        Family::Ellipsoid => ellipsoids.into_iter().flatten().collect(),
    }
}

/// Largest radius; of a cone, whose radius depends on the place, the angle.
fn size_of(shape: &Shape) -> f64 {
    if shape.family == Family::Cone { shape.size[1].abs() } else { shape.max_radius() }
}

fn best_fit(family: Family, patch: &Patch<'_>) -> Shape {
    let options = Options { cauchy: None, steps: 100, tolerance: 1e-12 };
    let fits = cold(family, patch).into_iter().filter_map(|s| {
        assert_eq!(s.family, family);
        fit(&s, patch.points, None, &options)
    });
    fits.min_by(|a, b| a.mean_sq.total_cmp(&b.mean_sq)).unwrap().shape
}

#[test]
fn starts_on_exact_points_lie_on_the_surface() {
    for (shape, seen) in patches() {
        let random = &mut Random::new(3);
        let points = exact(&shape, seen, 300, random);
        let normals: Vec<Vec3> = points.iter().map(|x| shape.offset(x).normal).collect();
        let patch = Patch { points: &points, normals: &normals };
        let worst = |s: &Shape| points.iter().map(|x| s.distance(x).abs()).fold(0.0, f64::max);
        let best = cold(shape.family, &patch).iter().map(worst).fold(f64::INFINITY, f64::min);
        // A cone's start takes its angle from the points' mean ruling, which a partial cone tilts.
        let limit = if shape.family == Family::Cone { 1.5 } else { 1e-5 };
        assert!(best < limit, "{:?}: {best}", shape.family);
    }
}

#[test]
fn fits_from_cold_starts_reach_the_bound_of_cramer_and_rao_without_bias() {
    // The squared distances of the exact points from the fit add up to sigma2 times the degrees of freedom,
    // on average, where the fit has neither bias nor more spread than the bound.
    for (shape, seen) in patches() {
        let (rounds, n) = (60, 500);
        let p = shape.family.dof() as f64;
        let (mut sum, mut mean) = (0.0, 0.0);
        for round in 0..rounds {
            let random = &mut Random::new(100 + round);
            let truth = exact(&shape, seen, n, random);
            let (points, normals) = noisy(&shape, &truth, random);
            let found = best_fit(shape.family, &Patch { points: &points, normals: &normals });
            let sq: f64 = truth.iter().map(|x| found.distance(x).powi(2)).sum();
            sum += sq / (SIGMA * SIGMA) / rounds as f64;
            mean += (size_of(&found) - size_of(&shape)) / rounds as f64;
        }
        let chance = 4.0 * (2.0 * p / rounds as f64).sqrt();
        assert!((sum - p).abs() < chance + 0.02 * p, "{:?}: {sum} for {p}", shape.family);
        assert!(mean.abs() < 0.02, "{:?}: bias {mean}", shape.family);
    }
}

#[test]
fn a_robust_fit_is_hardly_moved_by_outliers() {
    for (shape, seen) in patches() {
        let random = &mut Random::new(8);
        let truth = exact(&shape, seen, 600, random);
        let (mut points, _) = noisy(&shape, &truth, random);
        for x in points.iter_mut().step_by(6) {
            *x += 0.6 * random.vector();
        }
        let worst = |cauchy| {
            let options = Options { cauchy, steps: 60, tolerance: 1e-10 };
            let found = fit(&shape, &points, None, &options).unwrap().shape;
            truth.iter().map(|x| found.distance(x).abs()).fold(0.0, f64::max)
        };
        let (robust, plain) = (worst(Some(2.5 * SIGMA)), worst(None));
        assert!(
            robust < 0.6 * plain && robust < 2.0 * SIGMA,
            "{:?}: {robust} {plain}",
            shape.family
        );
    }
}

#[test]
fn weights_of_zero_take_points_out_and_others_count_as_often() {
    let (shape, seen) = patches()[2];
    let random = &mut Random::new(4);
    let (mut points, _) = noisy(&shape, &exact(&shape, seen, 200, random), random);
    let options = Options { cauchy: None, steps: 50, tolerance: 1e-14 };
    let twice: Vec<Vec3> = points.iter().chain(&points[..50]).copied().collect();
    let expected = fit(&shape, &twice, None, &options).unwrap().shape;
    let mut weights = vec![1.0; 200];
    weights[..50].fill(2.0);
    points.extend([Vec3::zeros(); 20]);
    weights.extend([0.0; 20]);
    let found = fit(&shape, &points, Some(&weights), &options).unwrap().shape;
    assert!((found.size[0] - expected.size[0]).abs() < 1e-7);
    assert!(found.w().cross(&expected.w()).norm() < 1e-8);
}

#[test]
fn too_few_points_or_an_improper_start_give_no_fit() {
    let sphere = Shape::with_axis(Family::Sphere, Vec3::zeros(), Vec3::z(), [1.0, 0.0, 0.0]);
    let options = Options { cauchy: None, steps: 10, tolerance: 1e-6 };
    let points = [Vec3::x(), Vec3::y(), Vec3::z(), -Vec3::x(), -Vec3::y()];
    assert!(fit(&sphere, &points[..4], None, &options).is_none());
    assert!(fit(&sphere, &points, Some(&[0.0; 5]), &options).is_none());
    assert!(fit(&sphere, &points, None, &options).is_some());
    let improper = Shape { size: [-1.0, 0.0, 0.0], ..sphere };
    assert!(fit(&improper, &points, None, &options).is_none());
}

#[test]
fn a_robust_fit_to_exact_points_is_not_held_by_a_few_of_them() {
    // Starts are far off beside a constant as small as what rounding leaves.
    let cut = 1e-7;
    for (shape, seen) in patches() {
        let random = &mut Random::new(12);
        let points = exact(&shape, seen, 200, random);
        let normals: Vec<Vec3> = points
            .iter()
            .map(|x| (shape.offset(x).normal + 0.03 * random.vector()).normalize())
            .collect();
        let patch = Patch { points: &points, normals: &normals };
        let options = Options { cauchy: Some(cut), steps: 14, tolerance: 1e-3 };
        let worst = |s: &Shape| points.iter().map(|x| s.distance(x).abs()).fold(0.0, f64::max);
        let best = cold(shape.family, &patch)
            .iter()
            .filter_map(|s| fit(s, &points, None, &options))
            .map(|f| worst(&f.shape))
            .fold(f64::INFINITY, f64::min);
        assert!(best < cut, "{:?}: {best}", shape.family);
    }
}

#[test]
fn a_line_seen_along_it_has_no_circle() {
    let points: Vec<Vec3> = (0..40).map(|k| Vec3::new(1.0, 2.0, f64::from(k))).collect();
    assert!(starts::cylinder(&points, &Vec3::z()).is_none());
    assert!(starts::sphere(&[Vec3::new(1.0, 2.0, 3.0); 9]).is_none());
}
