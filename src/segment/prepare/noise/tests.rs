use super::*;
use crate::fit::fits::Random;
use crate::segment::Silent;
use crate::segment::fixtures::ordered;

/// A place on a ball of radius 60, 60 by 60 long and wide, from its parameters.
fn on_ball(x: f64, y: f64) -> Vec3 {
    Vec3::new(x, y, (60.0_f64.powi(2) - x * x - y * y).sqrt())
}

/// Estimate over truth of points turned out of the axes.
fn ratio(points: Vec<Vec3>, truth: f64) -> f64 {
    let turn = nalgebra::Rotation3::from_euler_angles(0.3, 0.5, 0.9);
    let points: Vec<Vec3> = points.into_iter().map(|p| turn * p).collect();
    estimate(&ordered(&points), &[0.0; 3], &Silent).sigma / truth
}

/// A cap of the ball with white noise along its normals.
fn cap(n: usize, sigma: f64) -> Vec<Vec3> {
    let mut random = Random::new(4);
    let mut at = || {
        let p = on_ball(random.uniform(-30.0, 30.0), random.uniform(-30.0, 30.0));
        p + p.normalize() * sigma * random.normal()
    };
    (0..n).map(|_| at()).collect()
}

#[test]
fn white_noise_is_known_within_three_percent() {
    for n in [5_000, 20_000, 60_000] {
        for sigma in [1e-3, 0.01, 0.1] {
            // Curvature shows above the least noise.
            let most = if sigma < 0.01 { 0.10 } else { 0.03 };
            let ratio = ratio(cap(n, sigma), sigma);
            assert!((ratio - 1.0).abs() < most, "{n} {sigma}: {ratio}");
        }
    }
}

#[test]
fn points_closer_than_the_noise_do_not_hide_it() {
    // spacing 0.27, and a third of the noise
    let ratio = ratio(cap(50_000, 0.8), 0.8);
    assert!((0.7..1.3).contains(&ratio), "{ratio}");
}

#[test]
fn rows_wide_apart_tell_the_noise_and_not_their_rounding() {
    let mut random = Random::new(5);
    let mut points = Vec::new();
    for row in 0..60 {
        for k in 0..600 {
            let p = on_ball(0.1 * f64::from(k) - 30.0, f64::from(row) - 30.0);
            // along the ray: the row's plane keeps its points
            points.push(p + Vec3::new(0.0, 0.0, 0.02 * random.normal()));
        }
    }
    let ratio = ratio(points, 0.02 * 0.87);
    assert!((0.85..1.25).contains(&ratio), "{ratio}");
}

#[test]
fn depths_in_whole_steps_scatter_by_the_step() {
    let mut random = Random::new(6);
    // steep enough that a neighbourhood sees several steps, as of a depth camera
    let mut at = || {
        let (x, y) = (random.uniform(0.0, 150.0), random.uniform(0.0, 150.0));
        Vec3::new(x, y, (0.6 * x + 0.2 * y).round())
    };
    // along the normal
    let truth = (1.0 / 12.0_f64).sqrt() / (1.0_f64 + 0.4).sqrt();
    let ratio = ratio((0..20_000).map(|_| at()).collect(), truth);
    assert!((0.8..1.2).contains(&ratio), "{ratio}");
}

#[test]
fn noise_is_never_below_the_steps_of_the_coordinates() {
    // A plane of a voxel grid is exact.
    let points: Vec<Vec3> = (0..10_000)
        .map(|k| Vec3::new((k % 100) as f64, (k / 100) as f64, ((k % 100) / 2) as f64))
        .collect();
    let sigma = estimate(&ordered(&points), &[0.0; 3], &Silent).sigma;
    assert!((0.2..0.4).contains(&sigma), "{sigma}");
}

#[test]
fn the_sides_of_a_thin_wall_do_not_count_as_noise() {
    for sigma in [0.0, 0.03] {
        let mut random = Random::new(7);
        // Both sides are nearer to each other than the points of one: half of a neighbourhood is the other's.
        let mut at = |k: usize| {
            let (x, y) = (random.uniform(0.0, 180.0), random.uniform(0.0, 180.0));
            Vec3::new(x, y, (k % 2) as f64 * 2.0 + sigma * random.normal())
        };
        let points: Vec<Vec3> = (0..8000).map(&mut at).collect();
        let found = ratio(points, 1.0);
        assert!((0.9 * sigma..1.15 * sigma + 1e-9).contains(&found), "{sigma}: {found}");
    }
}

#[test]
fn a_few_touch_points_on_one_surface_tell_its_noise() {
    let mut random = Random::new(8);
    for n in [24, 48] {
        let mut at = || {
            let out = Vec3::new(random.normal(), random.normal(), random.normal()).normalize();
            (25.0 + 0.002 * random.normal()) * out
        };
        let ratio = ratio((0..n).map(|_| at()).collect(), 0.002);
        assert!((0.5..2.0).contains(&ratio), "{n}: {ratio}");
    }
}

#[test]
fn a_filled_volume_is_told_from_a_thick_sheet() {
    let mut random = Random::new(9);
    let mut unit = || random.uniform(0.0, 1.0);
    let filled: Vec<Vec3> = (0..8000).map(|_| Vec3::new(unit(), unit(), unit())).collect();
    assert!(estimate(&ordered(&filled), &[0.0; 3], &Silent).fills_volume);
    assert!(!estimate(&ordered(&cap(50_000, 0.8)), &[0.0; 3], &Silent).fills_volume);
}

#[test]
fn a_cloud_spans_two_directions_once_its_rows_are_as_sparse_as_wide_apart() {
    let points: Vec<Vec3> =
        (0..30_000).map(|k| Vec3::new((k % 1000) as f64 * 0.05, (k / 1000) as f64, 0.0)).collect();
    let even = estimate(&ordered(&points), &[0.0; 3], &Silent).even.unwrap();
    // At a half to a whole of the rows' spacing.
    assert!((1_000..4_000).contains(&even.len()), "{}", even.len());
    assert_eq!(estimate(&ordered(&cap(9_000, 0.01)), &[0.0; 3], &Silent).even, None);
}

#[test]
fn thin_bodies_close_together_do_not_bend_the_noise() {
    // balls of 60 points each, of which a patch is nearly half, and tubes as thin
    let mut random = Random::new(6);
    let (mut balls, mut tubes) = (Vec::new(), Vec::new());
    for _ in 0..400 {
        let centre = 40.0 * Vec3::new(random.normal(), random.normal(), random.normal());
        for _ in 0..60 {
            let d = Vec3::new(random.normal(), random.normal(), random.normal()).normalize();
            balls.push(centre + (0.5 + 0.002 * random.normal()) * d);
        }
    }
    for _ in 0..40 {
        let (x, y) = (random.uniform(0.0, 100.0), random.uniform(0.0, 100.0));
        for _ in 0..1500 {
            let (turn, r) =
                (random.uniform(0.0, std::f64::consts::TAU), 1.0 + 0.01 * random.normal());
            tubes.push(Vec3::new(
                x + r * turn.cos(),
                y + r * turn.sin(),
                random.uniform(0.0, 100.0),
            ));
        }
    }
    // The half of a patch bends as well: that much above the truth surfaces are still found.
    let (balls, tubes) = (ratio(balls, 0.002), ratio(tubes, 0.01));
    assert!((0.7..6.0).contains(&balls) && (0.7..6.0).contains(&tubes), "{balls} {tubes}");
}
