use crate::fit::fits::Random;
use crate::geometry::{PointCloud, SurfaceType, Vec3};
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
