use super::*;
use crate::fit::least_squares::{Options, fit};
use crate::segment::random::SplitMix64;

struct Noise(SplitMix64);

impl Noise {
    fn uniform(&mut self, from: f64, to: f64) -> f64 {
        from + (to - from) * self.0.below(1 << 40) as f64 / (1_u64 << 40) as f64
    }

    fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.uniform(-0.5, 0.5)).sum()
    }
}

/// `n` points within `arc` of a cylinder's section, 20 long, with noise along the normal.
fn arc(radius: f64, arc: f64, n: usize, sigma: f64, noise: &mut Noise) -> Vec<Vec3> {
    let mut point = || {
        let a = noise.uniform(-arc / 2.0, arc / 2.0);
        let r = radius + sigma * noise.normal();
        Vec3::new(r * a.cos(), r * a.sin(), noise.uniform(-10.0, 10.0))
    };
    (0..n).map(|_| point()).collect()
}

fn fitted(start: &Shape, points: &[Vec3]) -> Shape {
    let options = Options { cauchy: None, steps: 40, tolerance: 1e-10 };
    fit(start, points, None, &options).unwrap().shape
}

fn deviation_of_radius(shape: &Shape, points: &[Vec3], sigma: f64) -> f64 {
    let json = Uncertainty::of(shape, points, 1.0, sigma).unwrap().to_json();
    json["radius"].as_f64().unwrap()
}

#[test]
fn the_radius_of_an_arc_is_known_as_theory_says() {
    // sd(R) = k sigma / sqrt(N); k of a circle's arc, the axis' direction being known as well.
    for (degrees, k) in [(360.0, 1.0), (180.0, 2.3), (90.0, 10.0), (60.0, 24.0), (30.0, 97.0)] {
        let (n, sigma) = (4000, 0.01);
        let mut noise = Noise(SplitMix64::new(7));
        let points = arc(10.0, f64::to_radians(degrees), n, sigma, &mut noise);
        let truth = Shape::with_axis(Family::Cylinder, Vec3::zeros(), Vec3::z(), [10.0, 0.0, 0.0]);
        let ratio = deviation_of_radius(&truth, &points, sigma) / (sigma / (n as f64).sqrt());
        assert!((ratio / k - 1.0).abs() < 0.06, "{degrees}: {ratio} for {k}");
    }
}

#[test]
fn repeated_fits_scatter_as_the_deviation_says() {
    for degrees in [360.0, 90.0, 60.0_f64] {
        let (sigma, rounds) = (0.01, 300);
        let mut noise = Noise(SplitMix64::new(11));
        let truth = Shape::with_axis(Family::Cylinder, Vec3::zeros(), Vec3::z(), [10.0, 0.0, 0.0]);
        let (mut sum, mut squares, mut told) = (0.0, 0.0, 0.0);
        for _ in 0..rounds {
            let points = arc(10.0, degrees.to_radians(), 400, sigma, &mut noise);
            let found = fitted(&truth, &points);
            let error = found.size[0] - 10.0;
            sum += error;
            squares += error * error;
            told += deviation_of_radius(&found, &points, sigma) / f64::from(rounds);
        }
        let mean = sum / f64::from(rounds);
        let spread = (squares / f64::from(rounds) - mean * mean).sqrt();
        assert!((spread / told - 1.0).abs() < 0.15, "{degrees}: {spread} for {told}");
        assert!(mean.abs() < 4.0 * told / f64::from(rounds).sqrt(), "{degrees}: bias {mean}");
    }
}

/// Every component of the engineering parameters.
fn components(shape: &Shape) -> Vec<f64> {
    fn flatten(value: &Value, into: &mut Vec<f64>) {
        match value {
            Value::Array(items) => items.iter().for_each(|v| flatten(v, into)),
            other => into.extend(other.as_f64()),
        }
    }
    let surface = serde_json::to_value(shape.surface()).unwrap();
    let mut out = Vec::new();
    for (name, _) in names(shape.family) {
        flatten(&surface[name], &mut out);
    }
    out
}

fn shapes() -> Vec<Shape> {
    let (o, w) = (Vec3::new(1.0, -2.0, 3.0), Vec3::new(0.2, 0.3, 1.0));
    [
        (Family::Plane, [0.0; 3]),
        (Family::Sphere, [5.0, 0.0, 0.0]),
        (Family::Cylinder, [4.0, 0.0, 0.0]),
        (Family::Cone, [4.0, 0.4, 0.0]),
        (Family::Cone, [4.0, -0.4, 0.0]),
        (Family::EllipticCylinder, [6.0, 4.0, 0.0]),
        (Family::EllipticCylinder, [4.0, 6.0, 0.0]),
        (Family::Ellipsoid, [6.0, 5.0, 4.0]),
        (Family::Ellipsoid, [6.0, 4.0, 5.0]),
        (Family::Ellipsoid, [4.0, 6.0, 5.0]),
        (Family::Torus, [6.0, 2.0, 0.0]),
    ]
    .map(|(f, s)| Shape::with_axis(f, o, w, s))
    .to_vec()
}

#[test]
fn motions_are_the_derivatives_of_the_engineering_parameters() {
    for shape in shapes() {
        for (k, motion) in motions(&shape).iter().enumerate() {
            let at = |h: f64| {
                let mut delta = vec![0.0; shape.family.dof()];
                delta[k] = h;
                components(&shape.stepped(&delta).unwrap())
            };
            let (after, before) = (at(1e-6), at(-1e-6));
            for (i, slope) in motion.parameters(&shape).iter().enumerate() {
                let numeric = (after[i] - before[i]) / 2e-6;
                assert!((numeric - slope).abs() < 1e-4, "{shape:?} {k} {i}: {numeric} {slope}");
            }
        }
    }
}

#[test]
fn every_parameter_has_its_deviation_and_rows_in_the_covariance() {
    let mut noise = Noise(SplitMix64::new(3));
    for shape in shapes() {
        let mut d = || noise.uniform(-4.0, 4.0);
        let points: Vec<Vec3> = (0..500)
            .map(|_| shape.origin + Vec3::new(d(), d(), d()))
            .map(|p| p - shape.offset(&p).normal * shape.offset(&p).distance)
            .collect();
        let json = Uncertainty::of(&shape, &points, 1.0, 0.01).unwrap().to_json();
        let rows = json["covariance"].as_array().unwrap();
        assert_eq!(rows.len(), components(&shape).len());
        assert!(rows.iter().all(|r| r.as_array().unwrap().len() == rows.len()));
        assert_eq!(json["identifiable"], true, "{json}");
        let surface = serde_json::to_value(shape.surface()).unwrap();
        for name in surface.as_object().unwrap().keys().filter(|name| *name != "type") {
            let deviation = &json[name.as_str()];
            let numbers = deviation.as_array().cloned().unwrap_or(vec![deviation.clone()]);
            assert!(numbers.iter().all(|n| n.as_f64().unwrap() < 0.1), "{name}: {deviation}");
        }
    }
}

#[test]
fn a_radius_that_a_short_arc_cannot_tell_is_said_to_be_unknown() {
    let mut noise = Noise(SplitMix64::new(5));
    let points = arc(10.0, 10_f64.to_radians(), 300, 0.08, &mut noise);
    let truth = Shape::with_axis(Family::Cylinder, Vec3::zeros(), Vec3::z(), [10.0, 0.0, 0.0]);
    let json = Uncertainty::of(&truth, &points, 1.0, 0.08).unwrap().to_json();
    assert_eq!(json["identifiable"], false);
    assert_eq!(json["not_identifiable"], json!(["radius"]));
    assert!(json["radius"].as_f64().unwrap() > 2.0);
}

#[test]
fn what_the_points_do_not_determine_has_a_large_and_finite_deviation() {
    let shape = Shape::with_axis(Family::Sphere, Vec3::zeros(), Vec3::z(), [5.0, 0.0, 0.0]);
    let points = vec![Vec3::new(5.0, 0.0, 0.0); 100];
    let deviation = deviation_of_radius(&shape, &points, 0.01);
    assert!(deviation.is_finite() && deviation > 100.0, "{deviation}");
    assert!(Uncertainty::of(&shape, &points[..4], 1.0, 0.01).is_none());
}
