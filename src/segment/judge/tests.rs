use crate::fit::fits::Random;
use crate::geometry::Vec3;
use crate::segment::fixtures::SIGMA;
use crate::segment::judge::across::{breadth, main_direction};
use crate::segment::judge::one_quadric::one_quadric;

/// `n` points along a parabola of that `bend`, 10 long, turned by `turn`, with so much scatter across.
fn stripe(n: usize, bend: f64, turn: f64, across: f64) -> Vec<[f64; 2]> {
    let mut random = Random::new(2);
    let (sin, cos) = turn.sin_cos();
    let mut point = || {
        let t = random.uniform(-5.0, 5.0);
        let s = bend * t * t + across * random.normal();
        [t * cos - s * sin, t * sin + s * cos]
    };
    (0..n).map(|_| point()).collect()
}

#[test]
fn the_breadth_of_a_stripe_is_its_scatter_about_its_own_curve() {
    for bend in [0.0, 0.1] {
        for turn in [0.0, 0.7, -1.2] {
            let flat = stripe(2000, bend, turn, 0.05);
            let (cos, sin) = main_direction(&flat);
            assert!((cos * turn.sin() - sin * turn.cos()).abs() < 0.05, "{bend} {turn}");
            let found = breadth(&flat, cos, sin, 3.0);
            // Three standard deviations of one from 2000 points.
            assert!((found / 0.05 - 1.0).abs() < 0.05, "{bend} {turn}: {found}");
        }
    }
}

#[test]
fn points_of_two_places_have_the_breadth_of_their_scatter() {
    let flat: Vec<[f64; 2]> =
        (0..100).map(|k| [f64::from(k % 2), 0.1 * f64::from(k / 2 % 2)]).collect();
    let found = breadth(&flat, 1.0, 0.0, 1.0);
    assert!(found.is_finite() && (found - 0.05).abs() < 0.002, "{found}");
}

#[test]
fn points_of_one_saddle_are_one_quadric_and_those_of_two_are_not() {
    let mut random = Random::new(6);
    let mut points = |kink: f64| -> Vec<Vec3> {
        let mut point = || {
            let (x, y) = (random.uniform(-4.0, 4.0), random.uniform(-4.0, 4.0));
            let z = 0.1 * (x * x - y * y) + kink * x.max(0.0).powi(3);
            Vec3::new(x, y, z + SIGMA * random.normal())
        };
        (0..600).map(|_| point()).collect()
    };
    let one = points(0.0);
    let quadric = one_quadric(&one, SIGMA).unwrap();
    // Ten coefficients from 600 points: known to 0.13 sigma in the mean.
    let sq = |x: f64, y: f64| quadric.distance(&Vec3::new(x, y, 0.1 * (x * x - y * y))).powi(2);
    let mean: f64 = one.iter().map(|p| sq(p.x, p.y)).sum::<f64>() / 600.0;
    assert!(mean.sqrt() < 0.15 * SIGMA, "{mean}");
    assert!(one_quadric(&points(0.01), SIGMA).is_none());
    assert!(one_quadric(&one, SIGMA / 2.0).is_none());
}
