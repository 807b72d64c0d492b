use crate::fit::fits::Random;
use crate::geometry::{PointCloud, SurfaceType, Vec3, perpendicular_frame};
use crate::segment::{Parameters, Silent, segment};

/// A quarter of a tube of radius 10 and length 20 in nine rows round it, points in them sixteen times closer together
/// than the rows.
fn rows(seed: u64) -> PointCloud {
    let random = &mut Random::new(seed);
    let mut at = |k: usize| {
        let angle = std::f64::consts::FRAC_PI_2 * random.uniform(0.0, 1.0);
        let radius = 10.0 + 0.02 * random.normal();
        Vec3::new(radius * angle.cos(), radius * angle.sin(), (k % 9) as f64 * 2.2)
    };
    PointCloud::from_points((0..999).map(&mut at).collect())
}

#[test]
fn a_surface_is_found_however_much_closer_points_are_along_rows_than_across() {
    for seed in 0..5 {
        let found = segment(&rows(seed), &Parameters::default(), &Silent).unwrap();
        let types: Vec<SurfaceType> = found.regions.iter().map(|r| r.surface_type).collect();
        assert_eq!(types, [SurfaceType::Cylinder], "{seed}");
        assert!(found.regions[0].point_count > 980, "{seed}: {}", found.regions[0].point_count);
    }
}

/// Twelve rings of a tube of radii `a` and `b` of its first half, and `second` times these of the other, three radii apart,
/// each in a plane `slant` degrees from square.
fn rings([a, b]: [f64; 2], second: f64, slant: f64) -> PointCloud {
    let random = &mut Random::new(6);
    let axis = Vec3::new(0.3, -0.5, 0.8).normalize();
    let (u, v) = perpendicular_frame(&axis);
    let mut at = |k: usize| {
        let (ring, angle) = (k / 400, std::f64::consts::TAU * (k % 400) as f64 / 400.0);
        let more = if ring < 6 { 1.0 } else { second };
        let noise = |random: &mut Random| 0.003 * random.normal();
        let x = more * a * angle.cos() + noise(random);
        let y = more * b * angle.sin() + noise(random);
        let height = 15.0 * ring as f64 + slant.to_radians().tan() * x;
        u * x + v * y + axis * height
    };
    PointCloud::from_points((0..4800).map(&mut at).collect())
}

#[test]
fn rings_round_a_tube_are_its_surface_however_far_they_are_apart() {
    let types = |cloud: &PointCloud| {
        let found = segment(cloud, &Parameters::default(), &Silent).unwrap();
        let of = |r: &crate::segment::Region| (r.surface_type, r.point_count * 100 / 4800);
        found.regions.iter().map(of).collect::<Vec<_>>()
    };
    let (round, oval) = (SurfaceType::Cylinder, SurfaceType::EllipticCylinder);
    let whole = |surface: SurfaceType, found: Vec<(SurfaceType, usize)>| {
        assert!(found.len() == 1 && found[0].0 == surface && found[0].1 >= 98, "{found:?}");
    };
    whole(round, types(&rings([5.0, 5.0], 1.0, 0.0)));
    whole(round, types(&rings([5.0, 5.0], 1.0, 20.0)));
    whole(oval, types(&rings([5.3, 4.9], 1.0, 0.0)));
    let stepped = types(&rings([5.0, 5.0], 0.96, 0.0));
    assert!(stepped.len() == 2 && stepped.iter().all(|r| *r == (round, 50)), "{stepped:?}");
}
