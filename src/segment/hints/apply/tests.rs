use crate::fit::fits::Random;
use crate::geometry::{Surface, SurfaceType, Vec3};
use crate::segment::hints::fixtures::{SIGMA, arc, at, edge, found, radius};
use crate::segment::{Extent, Hint, HintAction, Outcome, Segmentation};

#[test]
fn a_radius_that_is_known_is_the_regions_and_tells_its_axis_better() {
    let points = arc(2000, 0.5, 1);
    let told = Hint { radius: Some(10.0), ..at(Vec3::new(10.0, 0.0, 0.0), SurfaceType::Cylinder) };
    let (free, held) = (found(&points, &[]), found(&points, &[told]));
    let outcome = &held.hints[0];
    assert_eq!(
        (outcome.hint, outcome.outcome, &outcome.regions[..]),
        (0, Outcome::Applied, &[0][..])
    );
    assert!(outcome.misfit.unwrap() < 4.0, "{outcome:?}");
    assert!((outcome.scatter.unwrap() - 1.0).abs() < 0.15, "{outcome:?}");
    assert_eq!(radius(&held, 0), (10.0, 0.0));
    assert!(radius(&free, 0).1 > 0.0);
    let off = |found: &Segmentation| {
        let uncertainty = found.regions[0].uncertainty.as_ref().unwrap();
        let Some(Surface::Cylinder(c)) = found.regions[0].surface else { panic!() };
        (c.axis_point.x.abs(), uncertainty["axis_point"][0].as_f64().unwrap())
    };
    let ((x, deviation), (_, before)) = (off(&held), off(&free));
    assert!(x < 4.0 * deviation && 10.0 * deviation < before, "{x} {deviation} {before}");
}

#[test]
fn a_radius_that_the_points_deny_is_told_and_theirs_stays() {
    let points = arc(4000, 3.0, 2);
    let hint = at(Vec3::new(10.0, 0.0, 0.0), SurfaceType::Cylinder);
    let told = |radius, tolerance| Hint {
        radius: Some(radius),
        radius_tolerance: tolerance,
        ..hint.clone()
    };
    let wrong = found(&points, &[told(10.1, None)]);
    let outcome = &wrong.hints[0];
    assert_eq!((outcome.outcome, outcome.regions.len()), (Outcome::Contradicted, 1));
    let (r, deviation) = radius(&wrong, 0);
    assert!((r - 10.0).abs() < 4.0 * deviation, "{r} {deviation}");
    // by as many deviations as it is off
    let misfit = outcome.misfit.unwrap();
    assert!((misfit * deviation - (10.1 - r)).abs() < 0.1 * (10.1 - r), "{misfit} {deviation} {r}");
    assert!(outcome.message.contains("radius"), "{}", outcome.message);
    // what its tolerance covers is no contradiction, and the points' own radius stays
    let near = found(&points, &[told(10.1, Some(0.2))]);
    assert_eq!((near.hints[0].outcome, near.hints[0].misfit), (Outcome::Applied, Some(0.0)));
    assert_eq!(radius(&near, 0), (r, deviation));
}

#[test]
fn a_type_that_the_points_deny_leaves_the_region_as_it_was() {
    let points = arc(4000, 3.0, 3);
    let free = found(&points, &[]);
    for told in [SurfaceType::Plane, SurfaceType::Sphere] {
        let wrong = found(&points, &[at(Vec3::new(10.0, 0.0, 0.0), told)]);
        let outcome = &wrong.hints[0];
        assert_eq!(outcome.outcome, Outcome::Contradicted, "{told:?} {outcome:?}");
        assert_eq!((&wrong.regions, &wrong.labels), (&free.regions, &free.labels));
        assert_eq!(outcome.regions, [0]);
    }
}

#[test]
fn a_type_that_the_points_allow_takes_the_place_of_the_simpler_one() {
    let points = arc(4000, 3.0, 4);
    let told = SurfaceType::EllipticCylinder;
    let elliptic = found(&points, &[at(Vec3::new(10.0, 0.0, 0.0), told)]);
    assert_eq!(elliptic.hints[0].outcome, Outcome::Applied, "{:?}", elliptic.hints[0]);
    assert_eq!((elliptic.regions.len(), elliptic.regions[0].surface_type), (1, told));
    assert_eq!(elliptic.regions[0].point_count, points.len());
    // a cone with its apex further away than anything tells is none
    let cone = found(&points, &[at(Vec3::new(10.0, 0.0, 0.0), SurfaceType::Cone)]);
    assert_eq!(cone.hints[0].outcome, Outcome::Contradicted, "{:?}", cone.hints[0]);
    assert!(cone.hints[0].message.contains("tell no cone"), "{:?}", cone.hints[0]);
}

#[test]
fn a_direction_that_is_known_is_held_to_the_digit() {
    let points = edge(4000);
    let direction = [0.0, 0.0, -2.0];
    let at = vec![[-5.0, 5.0, 0.0]];
    let told = Hint { at, axis_direction: Some(direction), ..Hint::default() };
    let held = found(&points, std::slice::from_ref(&told));
    let id = held.hints[0].regions[0];
    assert_eq!(held.hints[0].outcome, Outcome::Applied, "{:?}", held.hints[0]);
    let Some(Surface::Plane(plane)) = held.regions[id].surface else { panic!() };
    assert_eq!(plane.normal.map(f64::abs), Vec3::z());
    let uncertainty = held.regions[id].uncertainty.as_ref().unwrap();
    assert_eq!(uncertainty["normal"].as_f64(), Some(0.0));
    let wrong = Hint { axis_direction: Some([0.0, 0.05, 1.0]), ..told };
    assert_eq!(found(&points, &[wrong]).hints[0].outcome, Outcome::Contradicted);
}

#[test]
fn a_region_is_split_where_somebody_points_at_both_sides_and_merged_again() {
    // a step of a noise's size, which the points hardly tell
    let random = &mut Random::new(6);
    let mut point = || {
        let (x, y) = (random.uniform(-10.0, 10.0), random.uniform(0.0, 10.0));
        Vec3::new(x, y, SIGMA * random.normal() + if x > 0.0 { 0.5 * SIGMA } else { 0.0 })
    };
    let points: Vec<Vec3> = (0..3000).map(|_| point()).collect();
    assert_eq!(found(&points, &[]).regions.len(), 1);
    let places = vec![[-5.0, 5.0, 0.0], [5.0, 5.0, 0.0]];
    let split = Hint { action: HintAction::Split, at: places.clone(), ..Hint::default() };
    let two = found(&points, std::slice::from_ref(&split));
    assert_eq!(two.hints[0].outcome, Outcome::Applied, "{:?}", two.hints[0]);
    assert_eq!((two.regions.len(), two.hints[0].regions.len()), (2, 2));
    let right = |p: &Vec3| p.x > 0.0;
    let side = two.labels[points.iter().position(|p| p.x > 9.0).unwrap()];
    let agree = points.iter().zip(&two.labels).filter(|(p, l)| right(p) == (**l == side)).count();
    assert!(agree > 2800, "{agree}");
    let merge = Hint { action: HintAction::Merge, at: places, ..Hint::default() };
    let one = found(&points, &[split, merge]);
    assert_eq!((one.regions.len(), one.hints[1].outcome), (1, Outcome::Applied), "{:?}", one.hints);
    assert!(one.labels.iter().filter(|l| **l == 0).count() > 2990);
}

#[test]
fn a_cylinder_that_stands_for_two_faces_is_split_into_planes() {
    // two strips that meet at a blunt angle, told to be one cylinder first
    let random = &mut Random::new(7);
    let mut point = || {
        let (x, y) = (random.uniform(-3.0, 3.0), random.uniform(0.0, 20.0));
        Vec3::new(x, y, 0.05 * x.abs() + SIGMA * random.normal())
    };
    let points: Vec<Vec3> = (0..4000).map(|_| point()).collect();
    let places = vec![[-2.0, 5.0, 0.1], [2.0, 5.0, 0.1]];
    let of = |action| Hint { action, at: places.clone(), ..Hint::default() };
    let told = found(&points, &[of(HintAction::Split)]);
    assert_eq!(told.regions.len(), 2, "{:?}", told.hints);
    for region in &told.regions {
        let Some(Surface::Plane(plane)) = region.surface else {
            panic!("{:?}", region.surface_type)
        };
        let slope = (plane.normal.x / plane.normal.z).abs();
        assert!((slope - 0.05).abs() < 2e-3, "{slope}");
    }
}

#[test]
fn faces_that_are_no_one_surface_are_not_merged() {
    let points = edge(4000);
    let at = vec![[-5.0, 5.0, 0.0], [0.0, 5.0, -5.0]];
    let merge = Hint { action: HintAction::Merge, at, ..Hint::default() };
    let (free, told) = (found(&points, &[]), found(&points, &[merge]));
    assert_eq!(free.regions.len(), 2);
    assert_eq!((&told.regions, &told.labels), (&free.regions, &free.labels));
    assert_eq!((told.hints[0].outcome, told.hints[0].regions.len()), (Outcome::Contradicted, 2));
}

#[test]
fn strips_that_were_taken_for_planes_are_one_cylinder_once_that_is_said() {
    // so far apart and so narrow that each says little of a radius
    let random = &mut Random::new(9);
    let mut points = Vec::new();
    for strip in 0..6 {
        for _ in 0..400 {
            let t = 0.5 * f64::from(strip) + random.uniform(-0.02, 0.02);
            let r = 10.0 + SIGMA * random.normal();
            points.push(Vec3::new(r * t.cos(), r * t.sin(), random.uniform(-10.0, 10.0)));
        }
    }
    let whole = Extent { min: [-20.0; 3], max: [20.0; 3] };
    let told = Hint {
        extent: Some(whole),
        surface_type: Some(SurfaceType::Cylinder),
        radius: Some(10.0),
        ..Hint::default()
    };
    let found = found(&points, &[told]);
    assert_eq!(found.hints[0].outcome, Outcome::Applied, "{:?}", found.hints[0]);
    assert_eq!((found.regions.len(), radius(&found, 0).0), (1, 10.0));
}
