//! Errors beside the uncertainties that are told, where those once were wrong.

use std::f64::consts::TAU;

use super::assess::{Feature, assess};
use super::{Asked, Association, FeatureType, Fixed};
use crate::fit::fits::Random;
use crate::geometry::Vec3;

fn fitted(kind: FeatureType, points: &[Vec3]) -> Option<Feature> {
    let asked = Asked {
        kind: Some(kind),
        association: Association::Gaussian,
        fixed: Fixed::default(),
        outliers: None,
        type_b: 0.0,
        coverage: 0.9545,
    };
    assess(points, &asked).ok()
}

/// Root mean square of `error` over that of the standard uncertainties of the parameter of that name.
fn ratio(
    kind: FeatureType,
    name: &str,
    points: impl Fn(&mut Random) -> Vec<Vec3>,
    error: impl Fn(&[f64]) -> f64,
) -> f64 {
    let (mut errors, mut told) = (0.0, 0.0);
    for seed in 0..60 {
        let found = fitted(kind, &points(&mut Random::new(seed + 900))).unwrap();
        let exactness = found.exactness.unwrap();
        let parameter = exactness.parameters.iter().find(|p| p.name == name).unwrap();
        errors += error(&parameter.values).powi(2);
        told += parameter.standard.iter().map(|u| u * u).sum::<f64>();
    }
    (errors / told).sqrt()
}

/// A smooth field of unit variance that goes together over `length`.
fn field(length: f64, random: &mut Random) -> impl Fn(&Vec3) -> f64 + use<> {
    let waves: Vec<(Vec3, f64)> = (0..120)
        .map(|_| {
            let wave = Vec3::new(random.normal(), random.normal(), random.normal());
            (wave / length, random.uniform(0.0, TAU))
        })
        .collect();
    move |x| {
        let sum: f64 = waves.iter().map(|(wave, phase)| (wave.dot(x) + phase).cos()).sum();
        sum * (2.0 / 120.0_f64).sqrt()
    }
}

/// Points at random angles of `arc` and heights of 20, moved along the normals that `place` tells with them by white noise of deviation
/// `noise` and as much that goes together over 1.5.
fn together(
    arc: f64,
    noise: f64,
    place: impl Fn(f64, f64) -> (Vec3, Vec<Vec3>),
) -> impl Fn(&mut Random) -> Vec<Vec3> {
    move |random| {
        let fields = [field(1.5, random), field(1.5, random)];
        let point = |_| {
            let angle = arc.to_radians() * random.uniform(-0.5, 0.5);
            let (at, normals) = place(angle, random.uniform(-10.0, 10.0));
            normals.iter().zip(&fields).fold(at, |sum, (normal, field)| {
                sum + normal * (noise * (field(&at) + random.normal()))
            })
        };
        (0..1000).map(point).collect()
    }
}

fn radial(angle: f64) -> Vec3 {
    Vec3::new(angle.cos(), angle.sin(), 0.0)
}

#[test]
fn noise_that_neighbours_share_is_counted_in_for_curves_too() {
    let circle = |angle, _| (radial(angle) * 10.0, vec![radial(angle), Vec3::z()]);
    let of_radius = |v: &[f64]| v[0] - 10.0;
    let found = ratio(FeatureType::Circle, "radius", together(360.0, 0.02, circle), of_radius);
    assert!((0.65..1.3).contains(&found), "circle: {found}");
    let of_normal = |v: &[f64]| v[0].hypot(v[1]);
    let found = ratio(FeatureType::Circle, "normal", together(360.0, 0.02, circle), of_normal);
    assert!((0.65..1.3).contains(&found), "circle: {found}");
    let line = |_, height| (Vec3::z() * height, vec![Vec3::x(), Vec3::y()]);
    let found = ratio(FeatureType::Line, "direction", together(360.0, 0.02, line), of_normal);
    assert!((0.65..1.3).contains(&found), "line: {found}");
}

/// Once a quarter of a cylinder had its shared noise taken for lobes, and was known four times better than told.
#[test]
fn noise_that_neighbours_share_is_no_lobes_and_shakes_each_parameter_in_its_way() {
    let tube = |angle, height| (radial(angle) * 10.0 + Vec3::z() * height, vec![radial(angle)]);
    for (name, error) in [
        ("radius", (|v: &[f64]| v[0] - 10.0) as fn(&[f64]) -> f64),
        ("axis_direction", |v: &[f64]| v[0].hypot(v[1])),
    ] {
        let found = ratio(FeatureType::Cylinder, name, together(90.0, 0.02, tube), error);
        assert!((0.6..1.4).contains(&found), "{name}: {found}");
    }
}

/// On so short an arc the points' scatter in the plane is as wide as the arc is high, and no lever of the heights.
#[test]
fn the_normal_of_a_short_arc_is_as_exact_as_told() {
    let points = |random: &mut Random| {
        let point = |_| {
            let angle = random.uniform(-0.26, 0.26);
            radial(angle) * (10.0 + 0.1 * random.normal()) + Vec3::z() * (0.1 * random.normal())
        };
        (0..1000).map(point).collect::<Vec<_>>()
    };
    let of_normal = |v: &[f64]| v[0].hypot(v[1]);
    let found = ratio(FeatureType::Circle, "normal", points, of_normal);
    assert!((0.75..1.25).contains(&found), "{found}");
}

/// A piece of an elliptic cylinder, 10 and 6, with white noise and three lobes.
fn ellipse(arc: f64, noise: f64, lobes: f64, random: &mut Random) -> Vec<Vec3> {
    let phase = random.uniform(0.0, TAU);
    let point = |_| {
        let t = random.uniform(-0.5, 0.5) * arc.to_radians();
        let normal = Vec3::new(t.cos() / 10.0, t.sin() / 6.0, 0.0).normalize();
        let at = Vec3::new(10.0 * t.cos(), 6.0 * t.sin(), random.uniform(0.0, 20.0));
        at + normal * (noise * random.normal() + lobes * (3.0 * t + phase).cos())
    };
    (0..1000).map(point).collect()
}

#[test]
fn a_place_that_hangs_on_untold_sizes_is_untold_too() {
    let mut seen = 0;
    for seed in 0..30 {
        let points = ellipse(60.0, 0.1, 0.0, &mut Random::new(seed));
        let Some(found) = fitted(FeatureType::EllipticCylinder, &points) else { continue };
        assert!(found.unknown.contains(&"semi_axes"), "{seed}: {:?}", found.unknown);
        seen += usize::from(found.unknown.contains(&"axis_point"));
        let told = found.exactness.unwrap().parameters;
        assert!(told.iter().all(|p| !found.unknown.contains(&p.name)), "{seed}");
    }
    assert!(seen >= 25, "{seen}");
}

#[test]
fn lobes_of_an_ellipse_are_counted_in_and_noise_is_none() {
    for lobes in [0.0, 0.1] {
        let points = |random: &mut Random| ellipse(360.0, 0.02, lobes, random);
        let off = |v: &[f64]| (v[0] - 10.0).hypot(v[1] - 6.0);
        let found = ratio(FeatureType::EllipticCylinder, "semi_axes", points, off);
        assert!((0.75..1.25).contains(&found), "{lobes}: {found}");
    }
    let points = |random: &mut Random| ellipse(90.0, 0.02, 0.0, random);
    let off = |v: &[f64]| (v[0] - 10.0).hypot(v[1] - 6.0);
    let found = ratio(FeatureType::EllipticCylinder, "semi_axes", points, off);
    assert!((0.7..1.3).contains(&found), "{found}");
}

/// Of a line with noise of deviation 1 two ways, a cylinder of radius 1.25 is nearer to the points than the line: 0.66, so that it is 1.9
/// of what it leaves wide.
#[test]
fn a_body_thinner_than_its_noise_tells_nothing() {
    for seed in 0..5 {
        let random = &mut Random::new(seed + 40);
        let mut noise = || 0.1 * random.normal();
        let point = |k: usize| Vec3::new(noise(), noise(), k as f64 * 0.001);
        let points: Vec<Vec3> = (0..20_000).map(point).collect();
        let found = fitted(FeatureType::Cylinder, &points).unwrap();
        assert!((found.pose.size[0] - 0.125).abs() < 0.01, "{:?}", found.pose.size);
        assert!(found.exactness.unwrap().parameters.is_empty(), "{seed}");
        assert_eq!(found.unknown, ["axis_point", "axis_direction", "radius"]);
    }
}
