//! Points that lie on no surface, surfaces of few points, and thick ones.

use std::f64::consts::TAU;

use conicoid::{
    geometry::{PointCloud, SurfaceType, Vec3},
    segment::{Parameters, Segmentation, Silent, segment},
};

use super::support::truth::Random;

const PLANE: SurfaceType = SurfaceType::Plane;
const SPHERE: SurfaceType = SurfaceType::Sphere;

fn run(points: Vec<Vec3>, settings: &[(&str, &str)]) -> Segmentation {
    let mut parameters = Parameters::default();
    for (name, value) in settings {
        parameters.set(name, value).unwrap();
    }
    segment(&PointCloud::from_points(points), &parameters, &Silent).unwrap()
}

fn found(s: &Segmentation) -> Vec<(SurfaceType, usize)> {
    s.regions.iter().map(|r| (r.surface_type, r.point_count)).collect()
}

fn heap(random: &mut Random, n: usize) -> Vec<Vec3> {
    let mut at = |_| Vec3::from_fn(|_, _| random.uniform(-1.0, 1.0));
    (0..n).map(&mut at).collect()
}

fn sheet(random: &mut Random, n: usize, side: f64, sigma: f64) -> Vec<Vec3> {
    let mut at = |_| {
        let (x, y) = (random.uniform(0.0, side), random.uniform(0.0, side));
        Vec3::new(x, y, sigma * random.normal())
    };
    (0..n).map(&mut at).collect()
}

fn ball(random: &mut Random, n: usize, radius: f64, sigma: f64) -> Vec<Vec3> {
    (0..n).map(|_| random.direction() * (radius + sigma * random.normal())).collect()
}

#[test]
fn a_small_heap_of_points_holds_no_plane() {
    let random = &mut Random::new(1);
    for n in [60, 100, 200, 300, 500] {
        assert_eq!(found(&run(heap(random, n), &[])), [], "{n}");
        let round = (0..n).map(|_| random.normal3()).collect();
        assert_eq!(found(&run(round, &[])), [], "{n}");
    }
}

#[test]
fn lines_and_wires_are_no_quadrics() {
    let random = &mut Random::new(2);
    for sigma in [0.0, 0.01] {
        let line = |k: i32| Vec3::new(1.0, 2.0, 3.0) * (0.02 * f64::from(k));
        let wire = |k: i32| {
            let t = 0.05 * f64::from(k);
            Vec3::new(t, 10.0 * (0.3 * t).sin(), 4.0 * (0.2 * t).cos())
        };
        let points: [Vec<Vec3>; 2] = [(0..500).map(line).collect(), (0..2000).map(wire).collect()];
        for points in points {
            let n = points.len();
            let scattered = points.into_iter().map(|p| p + sigma * random.normal3()).collect();
            let s = run(scattered, &[]);
            assert_eq!(found(&s), [], "{sigma}");
            assert!(s.unassigned.reasons["no_quadric"] > n * 9 / 10, "{:?}", s.unassigned);
        }
    }
}

#[test]
fn scan_lines_far_apart_are_a_surface() {
    let random = &mut Random::new(3);
    for apart in [3.0, 5.0] {
        let at = |k: i32| Vec3::new(f64::from(k % 150), apart * f64::from(k / 150), 0.0);
        let points = (0..4500).map(|k| at(k) + 0.05 * random.normal3()).collect();
        let s = run(points, &[]);
        assert!(matches!(found(&s)[..], [(PLANE, n)] if n > 4490), "{apart}: {:?}", found(&s));
    }
}

#[test]
fn a_small_clean_surface_is_found_where_regions_may_be_small() {
    let few = [("min_points", "10")];
    let at = |k: i32| Vec3::new(f64::from(k % 6), f64::from(k / 6), 0.0);
    assert_eq!(found(&run((0..36).map(at).collect(), &few)), [(PLANE, 36)]);
    let random = &mut Random::new(4);
    for _ in 0..5 {
        assert_eq!(found(&run(ball(random, 30, 1.0, 1e-3), &few)), [(SPHERE, 30)]);
    }
    for n in [12, 20, 30, 40, 60, 100, 300] {
        assert_eq!(found(&run(heap(random, n), &few)), [], "{n}");
    }
}

#[test]
fn no_region_has_points_beyond_the_tolerance_reported() {
    let random = &mut Random::new(5);
    let mut points = sheet(random, 4000, 20.0, 0.02);
    points.extend(ball(random, 4000, 6.0, 0.02).iter().map(|p| p + Vec3::new(10.0, 40.0, 5.0)));
    for given in ["0.012", "0.016", "0.02", "0.03"] {
        let s = run(points.clone(), &[("noise_sigma", given)]);
        let sigma: f64 = given.parse().unwrap();
        assert_eq!(s.parameters.noise_sigma, Some(sigma));
        // What exceeds a given noise is taken for form error, and the tolerance says how much.
        let tolerance = s.parameters.tolerance.unwrap();
        assert!(tolerance >= 4.0 * sigma && tolerance <= 16.0 * sigma, "{given}: {tolerance}");
        assert!(!s.regions.is_empty());
        assert!(s.regions.iter().all(|r| r.fit.max <= tolerance), "{given}");
    }
    let s = run(points, &[]);
    assert!(s.regions.iter().all(|r| Some(r.fit.max) <= s.parameters.tolerance));
}

#[test]
fn a_surface_scanned_denser_than_its_noise_is_found() {
    let random = &mut Random::new(6);
    let (n, side) = (12_000, 100.0);
    let spacing = side / f64::from(n).sqrt();
    let s = run(sheet(random, n as usize, side, 1.3 * spacing), &[]);
    assert!(matches!(found(&s)[..], [(PLANE, n)] if n > 11_900), "{:?}", found(&s));
    let noise = s.parameters.noise_sigma.unwrap() / (1.3 * spacing);
    assert!((0.85..1.1).contains(&noise), "{noise}");
    let spacing = (2.0 * TAU / f64::from(n)).sqrt() * 20.0;
    let s = run(ball(random, n as usize, 20.0, 1.4 * spacing), &[]);
    assert!(matches!(found(&s)[..], [(SPHERE, n)] if n > 11_900), "{:?}", found(&s));
    assert_eq!(found(&run(heap(random, 20_000), &[])), []);
}

#[test]
fn a_parabola_is_not_cut_into_ellipses() {
    for seed in 0..3 {
        let random = &mut Random::new(seed);
        let mut at = |_| {
            let (x, y) = (random.uniform(-35.0, 35.0), random.uniform(0.0, 60.0));
            Vec3::new(x, y, x * x / 40.0) + 0.01 * random.normal3()
        };
        let s = run((0..12_000).map(&mut at).collect(), &[]);
        assert_eq!(found(&s), [], "{seed}");
        assert!(s.unassigned.reasons["no_quadric"] > 11_000);
    }
}
