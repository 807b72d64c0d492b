//! What each parameter of the default method changes.

use std::f64::consts::TAU;

use conicoid::{
    geometry::{Quadric, Surface, SurfaceType, Vec3},
    segment::{Parameters, Segmentation, Silent, segment},
};

use super::support::truth::{Cloud, Patch, Random, smooth};

const SIGMA: f64 = 0.02;

/// Two squares of the plane z = 0, 30 apart, a cylinder along z (radius 5), one along x (radius 9) and a
/// sphere (radius 7), all apart, and three points 0.15 above the larger square.
fn bench() -> Cloud {
    let random = &mut Random::new(5);
    let at = Vec3::new;
    let (x, y, z) = (Vec3::x(), Vec3::y(), Vec3::z());
    let patches = vec![
        Patch::plane(at(0.0, 0.0, 0.0), 40.0 * x, 40.0 * y, 3200, random),
        Patch::plane(at(70.0, 0.0, 0.0), 20.0 * x, 40.0 * y, 1600, random),
        Patch::cylinder(at(20.0, 80.0, 5.0), 30.0 * z, 5.0, [0.0, TAU], 1800, random),
        Patch::cylinder(at(60.0, 80.0, 5.0), 30.0 * x, 9.0, [0.0, TAU], 3000, random),
        Patch::sphere(at(120.0, 20.0, 15.0), 7.0, |_| true, 1200, random),
        Patch::other(vec![at(10.0, 10.0, 0.15), at(20.0, 20.0, 0.15), at(30.0, 15.0, 0.15)]),
    ];
    Cloud::assemble("bench", patches, SIGMA, 0, random)
}

fn run(cloud: &Cloud, settings: &[(&str, &str)]) -> Segmentation {
    let mut parameters = Parameters::default();
    for (name, value) in settings {
        parameters.set(name, value).unwrap();
    }
    segment(&cloud.input(), &parameters, &Silent).unwrap()
}

fn types(found: &Segmentation) -> Vec<SurfaceType> {
    let mut types: Vec<_> = found.regions.iter().map(|r| r.surface_type).collect();
    types.sort_unstable();
    types
}

fn radii(found: &Segmentation) -> Vec<i64> {
    let radius = |s: &Surface| match s {
        Surface::Sphere(s) => Some(s.radius.round() as i64),
        Surface::Cylinder(s) => Some(s.radius.round() as i64),
        _ => None,
    };
    let mut radii: Vec<_> =
        found.regions.iter().filter_map(|r| r.surface.as_ref().and_then(radius)).collect();
    radii.sort_unstable();
    radii
}

const PLANE: SurfaceType = SurfaceType::Plane;
const SPHERE: SurfaceType = SurfaceType::Sphere;
const CYLINDER: SurfaceType = SurfaceType::Cylinder;

#[test]
fn without_parameters_every_surface_is_found_and_the_noise_told() {
    let found = run(&bench(), &[]);
    assert_eq!(types(&found), [PLANE, SPHERE, CYLINDER, CYLINDER]);
    let noise = found.parameters.noise_sigma.unwrap();
    assert!((noise / SIGMA - 1.0).abs() < 0.1, "{noise}");
    assert_eq!(found.parameters.tolerance, Some(4.0 * noise));
    assert_eq!(found.unassigned.reasons.values().sum::<usize>(), found.unassigned.count);
    assert!(found.unassigned.count < 20, "{:?}", found.unassigned);
    for region in &found.regions {
        assert!(region.neighbours.is_empty(), "{:?}", region.neighbours);
        assert!(region.evidence.unwrap().delta_bic > 5.0, "{:?}", region.evidence);
        assert!(region.uncertainty.is_some() && region.fit.max <= 4.2 * noise);
    }
}

#[test]
fn no_region_scatters_by_more_than_twice_the_noise_that_was_given() {
    let random = &mut Random::new(8);
    let plane = Patch::plane(Vec3::zeros(), 40.0 * Vec3::x(), 40.0 * Vec3::y(), 3000, random);
    let cloud = Cloud::assemble("plane", vec![plane], SIGMA, 0, random);
    for noise in [0.02, 0.011, 0.004] {
        let found = run(&cloud, &[("noise_sigma", &noise.to_string())]);
        let rms: Vec<f64> = found.regions.iter().map(|r| r.fit.rms).collect();
        assert!(rms.iter().all(|rms| *rms <= 2.0 * noise), "{noise}: {rms:?}");
        assert!(noise < SIGMA || rms.len() == 1, "{noise}: {rms:?}");
        assert_eq!(found.unassigned.reasons.values().sum::<usize>(), found.unassigned.count);
    }
    // A tolerance that allows more is what the caller means.
    let found = run(&cloud, &[("noise_sigma", "0.004"), ("tolerance", "0.08")]);
    assert_eq!(types(&found), [PLANE]);
}

#[test]
fn no_region_is_an_ellipse_longer_than_25_times_its_width() {
    let random = &mut Random::new(4);
    // Two faces that meet at an obtuse angle, sharp or rounded, and flat lenses.
    let mut clouds: Vec<Vec<Vec3>> = Vec::new();
    for (degrees, rounded) in
        [(150.0_f64, 0.0), (160.0, 0.5), (168.0, 0.0), (172.0, 2.0), (176.0, 0.0)]
    {
        let slope = ((180.0 - degrees) / 2.0).to_radians().tan();
        let mut at = |_| {
            let (x, y) = (random.uniform(-10.0, 10.0), random.uniform(0.0, 15.0));
            Vec3::new(x, y, -slope * f64::hypot(x, rounded) + 0.05 * random.normal())
        };
        clouds.push((0..3000).map(&mut at).collect());
    }
    for height in [0.15, 0.4] {
        let mut at = |k: usize| {
            let (r, turn) = (10.0 * random.uniform(0.0, 1.0_f64).sqrt(), random.uniform(0.0, TAU));
            let z = height
                * (1.0 - (r / 10.0).powi(2)).sqrt()
                * if k.is_multiple_of(2) { 1.0 } else { -1.0 };
            Vec3::new(r * turn.cos(), r * turn.sin(), z + 0.01 * random.normal())
        };
        clouds.push((0..3000).map(&mut at).collect());
    }
    for (k, points) in clouds.into_iter().enumerate() {
        let cloud = conicoid::geometry::PointCloud::from_points(points);
        for settings in
            [&[][..], &[("tolerance", "1")], &[("method", "rcond"), ("rcond_threshold", "1e-6")]]
        {
            let mut parameters = Parameters::default();
            settings.iter().for_each(|(name, value)| parameters.set(name, value).unwrap());
            for region in segment(&cloud, &parameters, &Silent).unwrap().regions {
                let axes = match &region.surface {
                    Some(Surface::EllipticCylinder(s)) => &s.semi_axes[..],
                    Some(Surface::Ellipsoid(s)) => &s.semi_axes[..],
                    _ => continue,
                };
                assert!(axes[0] <= 25.0 * axes[axes.len() - 1], "{k} {settings:?}: {axes:?}");
            }
        }
    }
}

#[test]
fn only_the_surfaces_asked_for_are_reported() {
    let found = run(&bench(), &[("surfaces", "sphere,cone")]);
    assert_eq!(types(&found), [SPHERE]);
    assert!(found.unassigned.reasons["no_quadric"] > 9500, "{:?}", found.unassigned);
    assert_eq!(found.unassigned.reasons.values().sum::<usize>(), found.unassigned.count);
}

#[test]
fn other_quadrics_are_found_where_they_are_asked_for() {
    for (name, surface_type) in [
        ("saddle", SurfaceType::HyperbolicParaboloid),
        ("hyperboloid", SurfaceType::HyperboloidOneSheet),
    ] {
        let cloud = smooth::make(name, 2).unwrap();
        assert_eq!(types(&run(&cloud, &[])), [], "{name}");
        let asked = run(&cloud, &[("surfaces", surface_type.name())]);
        assert_eq!(types(&asked), [surface_type]);
        let region = &asked.regions[0];
        assert!(region.point_count * 100 > 99 * cloud.points.len() && region.surface.is_none());
        assert!((region.fit.rms / cloud.sigma - 1.0).abs() < 0.05, "{}", region.fit.rms);
        let quadric = Quadric(region.coefficients.unwrap());
        let far = cloud.points.iter().filter(|p| quadric.distance(p) > 5.0 * cloud.sigma);
        assert_eq!(far.count(), 0);
    }
    let cone = run(&smooth::make("saddle", 2).unwrap(), &[("surfaces", "elliptic_cone")]);
    assert_eq!(types(&cone), []);
}

#[test]
fn a_quadric_of_another_type_may_touch_a_plane() {
    let random = &mut Random::new(6);
    // A square with a saddle beside it, whose edges meet.
    let mut at = |k: usize| {
        let (x, y) = (random.uniform(-10.0, 10.0), random.uniform(-10.0, 10.0));
        let noise = 0.01 * random.normal();
        if k.is_multiple_of(2) {
            Vec3::new(x, y, (x * x - y * y) / 20.0 + noise)
        } else {
            Vec3::new(20.0 + x, y, 5.0 + noise)
        }
    };
    let cloud = conicoid::geometry::PointCloud::from_points((0..8000).map(&mut at).collect());
    let mut parameters = Parameters::default();
    parameters.set("surfaces", "plane,hyperbolic_paraboloid").unwrap();
    let found = segment(&cloud, &parameters, &Silent).unwrap();
    assert_eq!(types(&found), [PLANE, SurfaceType::HyperbolicParaboloid]);
}

#[test]
fn radii_outside_the_range_are_left_out() {
    assert_eq!(radii(&run(&bench(), &[("min_radius", "6")])), [7, 9]);
    let found = run(&bench(), &[("max_radius", "8")]);
    assert_eq!(radii(&found), [5, 7]);
    assert!(types(&found).contains(&PLANE));
}

#[test]
fn axes_off_the_direction_are_left_out() {
    let found = run(&bench(), &[("axis_direction", "0,0.05,1"), ("axis_tolerance", "0.06")]);
    assert_eq!(radii(&found), [5, 7]);
    assert!(types(&found).contains(&PLANE));
    let strict = run(&bench(), &[("axis_direction", "0,0.05,1"), ("axis_tolerance", "0.04")]);
    assert_eq!(types(&strict), [SPHERE]);
}

#[test]
fn a_plane_in_two_places_is_one_region_unless_connectivity_parts_it() {
    let planes = |found: &Segmentation| types(found).iter().filter(|t| **t == PLANE).count();
    assert_eq!(planes(&run(&bench(), &[])), 1);
    assert_eq!(planes(&run(&bench(), &[("connectivity", "29")])), 2);
    assert_eq!(planes(&run(&bench(), &[("connectivity", "31")])), 1);
}

#[test]
fn without_merging_the_pieces_of_a_surface_stay_apart() {
    let found = run(&bench(), &[("merge", "false")]);
    assert_eq!(types(&found), [PLANE, PLANE, SPHERE, CYLINDER, CYLINDER]);
}

#[test]
fn refinement_brings_the_surfaces_nearer_to_the_truth() {
    // Surfaces with many points: only the last fits look at all of them.
    let random = &mut Random::new(6);
    let (x, y, z) = (Vec3::x(), Vec3::y(), Vec3::z());
    let patches = vec![
        Patch::plane(Vec3::zeros(), 60.0 * x, 60.0 * y, 50_000, random),
        Patch::cylinder(Vec3::new(120.0, 0.0, 0.0), 60.0 * z, 20.0, [0.0, 3.0], 50_000, random),
        Patch::sphere(Vec3::new(0.0, 120.0, 30.0), 25.0, |d| d.z > 0.0, 50_000, random),
    ];
    let cloud = Cloud::assemble("large", patches, SIGMA, 0, random);
    let wrong = |refine: &str| {
        let found = run(&cloud, &[("refine", refine)]);
        let count = |r: usize, t: usize| {
            let both = cloud.labels.iter().zip(&found.labels);
            both.filter(|(a, b)| **a == t as i32 && **b == r as i32).count()
        };
        // The distance of the truth's points from the best region's surface, over all of them.
        let mut sum = 0.0;
        for t in 0..cloud.surfaces.len() {
            let best = (0..found.regions.len()).max_by_key(|&r| count(r, t)).unwrap();
            let quadric = found.regions[best].surface.unwrap().quadric().unwrap();
            let truth = cloud.surfaces[t].surface.quadric().unwrap();
            let points = cloud.points.iter().zip(&cloud.labels).filter(|(_, l)| **l == t as i32);
            for (p, _) in points {
                // A point moved onto the true surface, to first order.
                let g = truth.gradient(p);
                let on = p - g * (truth.value(p) / g.norm_squared());
                sum += quadric.distance(&on).powi(2);
            }
        }
        (sum / cloud.points.len() as f64).sqrt()
    };
    let (refined, rough) = (wrong("true"), wrong("false"));
    assert!(refined < 0.8 * rough, "{refined} {rough}");
}

#[test]
fn the_search_stops_after_the_failures_allowed() {
    let failed = |most: &str| {
        let found =
            run(&smooth::make("chain3_outliers", 3).unwrap(), &[("max_failed_seeds", most)]);
        found.counters.failed_trials
    };
    let (few, many) = (failed("2"), failed("50"));
    assert!(few * 3 < many, "{few} {many}");
}

#[test]
fn small_regions_are_left_out_and_say_so() {
    let found = run(&bench(), &[("min_points", "1700")]);
    assert_eq!(radii(&found), [5, 9]);
    assert!((1190..1210).contains(&found.unassigned.reasons["too_small"]));
    assert_eq!(radii(&run(&bench(), &[("min_points", "1150")])), [5, 7, 9]);
}

#[test]
fn the_largest_regions_stay() {
    let found = run(&bench(), &[("max_regions", "2")]);
    assert_eq!(types(&found), [PLANE, CYLINDER]);
    assert_eq!(radii(&found), [9]);
    assert!(found.unassigned.reasons["over_max_regions"] > 2900);
    assert_eq!(run(&bench(), &[("max_regions", "3")]).regions.len(), 3);
}

#[test]
fn no_labelled_point_lies_further_than_the_tolerance() {
    let tolerance = 2.0 * SIGMA;
    let found = run(&bench(), &[("tolerance", &tolerance.to_string())]);
    assert_eq!(types(&found), [PLANE, SPHERE, CYLINDER, CYLINDER]);
    for region in &found.regions {
        assert!(region.fit.max <= tolerance);
        let share = region.fit.rejected as f64 / region.point_count as f64;
        assert!((0.02..0.08).contains(&share), "{share}");
    }
    assert_eq!(found.parameters.tolerance, Some(tolerance));
}

#[test]
fn a_wider_tolerance_or_a_larger_noise_takes_points_further_off() {
    let cloud = bench();
    let odd: Vec<usize> = (0..cloud.labels.len()).filter(|&i| cloud.labels[i] < 0).collect();
    let taken = |settings: &[(&str, &str)]| {
        let found = run(&cloud, settings);
        assert_eq!(types(&found), [PLANE, SPHERE, CYLINDER, CYLINDER], "{settings:?}");
        odd.iter().filter(|&&i| found.labels[i] >= 0).count()
    };
    assert_eq!(taken(&[]), 0);
    assert_eq!(taken(&[("tolerance", "0.25")]), 3);
    assert_eq!(taken(&[("noise_sigma", "0.06")]), 3);
}

#[test]
fn the_same_seed_gives_the_same_result_and_another_one_the_same_surfaces() {
    let first = run(&bench(), &[]);
    assert_eq!(first, run(&bench(), &[]));
    let other = run(&bench(), &[("seed", "12")]);
    assert_eq!((types(&other), radii(&other)), (types(&first), radii(&first)));
}

#[test]
fn every_cloud_that_gives_nothing_says_why() {
    let random = &mut Random::new(9);
    let mut u = |size: f64| random.uniform(0.0, size);
    let volume: Vec<Vec3> = (0..3000).map(|_| Vec3::new(u(9.0), u(9.0), u(9.0))).collect();
    let few: Vec<Vec3> = (0..12).map(|_| Vec3::new(u(9.0), u(9.0), u(9.0))).collect();
    let random = &mut Random::new(9);
    let torus = Patch::torus(Vec3::zeros(), [Vec3::x(), Vec3::y()], [20.0, 5.0], TAU, 4000, random);
    for (points, reason, settings) in [
        (volume, "outlier", vec![]),
        (few, "outlier", vec![("min_points", "10")]),
        (torus.points, "no_quadric", vec![("surfaces", "plane,sphere,cylinder,cone")]),
    ] {
        let cloud = Cloud::assemble("nothing", vec![Patch::other(points)], 0.01, 0, random);
        let found = run(&cloud, &settings);
        assert_eq!(found.regions.len(), 0, "{reason}");
        let share = found.unassigned.reasons[reason] as f64 / cloud.points.len() as f64;
        assert!(share > 0.9, "{:?}", found.unassigned);
        assert_eq!(found.unassigned.count, cloud.points.len());
    }
}
