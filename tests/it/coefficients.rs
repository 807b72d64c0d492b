//! The ten coefficients about the file's origin and about one near the points.

use std::f64::consts::TAU;

use conicoid::{
    geometry::{PointCloud, Quadric, Surface, Vec3},
    segment::{Parameters, Region, Segmentation, Silent, segment},
};

use super::support::truth::Random;

const RADIUS: f64 = 0.02;
const SIGMA: f64 = 6e-5;

/// A pipe of 2 cm radius, `offset` away from the origin.
fn pipe(offset: &Vec3) -> PointCloud {
    let random = &mut Random::new(11);
    let axis = Vec3::new(0.3, -0.2, 1.0).normalize();
    let u = axis.cross(&Vec3::x()).normalize();
    let v = axis.cross(&u);
    let mut at = |_| {
        let (turn, along) = (random.uniform(0.0, TAU), random.uniform(-0.3, 0.3));
        let r = RADIUS + SIGMA * random.normal();
        offset + along * axis + r * (turn.cos() * u + turn.sin() * v)
    };
    PointCloud::from_points((0..4000).map(&mut at).collect())
}

fn found(cloud: &PointCloud, settings: &[(&str, &str)]) -> Segmentation {
    let mut parameters = Parameters::default();
    for (name, value) in settings {
        parameters.set(name, value).unwrap();
    }
    segment(cloud, &parameters, &Silent).unwrap()
}

/// Root mean square of a distance over a region's points moved by `origin`.
fn rms(
    cloud: &PointCloud,
    result: &Segmentation,
    id: usize,
    distance: impl Fn(&Vec3) -> f64,
    origin: &Vec3,
) -> f64 {
    let own = cloud.points.iter().zip(&result.labels).filter(|(_, l)| **l == id as i32);
    let all: Vec<f64> = own.map(|(p, _)| distance(&(p - origin)).powi(2)).collect();
    (all.iter().sum::<f64>() / all.len() as f64).sqrt()
}

/// The same by the local and by the far coefficients, each by its own measure of distance.
fn both(
    cloud: &PointCloud,
    result: &Segmentation,
    region: &Region,
    distance: fn(&Quadric, &Vec3) -> f64,
) -> [f64; 2] {
    let local = Quadric(region.local_coefficients.unwrap());
    let far = Quadric(region.coefficients.unwrap());
    let origin = region.local_origin.into();
    [
        rms(cloud, result, region.id, |x| distance(&local, x), &origin),
        rms(cloud, result, region.id, |x| distance(&far, x), &Vec3::zeros()),
    ]
}

/// |Q| / |grad Q|.
fn first_order(quadric: &Quadric, x: &Vec3) -> f64 {
    quadric.value(x) / quadric.gradient(x).norm()
}

#[test]
fn local_coefficients_tell_distances_as_the_parameters_do_however_far_the_cloud_lies() {
    let mut first: Option<[f64; 10]> = None;
    for offset in [
        Vec3::zeros(),
        Vec3::new(1e3, -2e3, 50.0),
        Vec3::new(5e5, 5e6, 100.0),
        Vec3::new(1e7, -1e7, 1e7),
    ] {
        let cloud = pipe(&offset);
        let result = found(&cloud, &[]);
        let [region] = &result.regions[..] else { panic!("{} regions", result.regions.len()) };
        let Some(Surface::Cylinder(c)) = region.surface else { panic!("{region:?}") };
        let distance = |p: &Vec3| (p - c.axis_point).cross(&c.axis_direction).norm() - c.radius;
        let own = cloud.points.iter().zip(&result.labels).filter(|(_, l)| **l == 0);
        let (sum, n) = own.fold((0.0, 0), |(s, n), (p, _)| (s + distance(p).powi(2), n + 1));
        let by_parameters = (sum / f64::from(n)).sqrt();
        let [local, far] = both(&cloud, &result, region, first_order);
        assert!((local / by_parameters - 1.0).abs() < 0.01, "{offset}: {local} {by_parameters}");
        let error = region.coefficients_error.unwrap();
        assert!(far < by_parameters * 1.01 + error, "{offset}: {far} {error}");
        if offset.x > 1e4 {
            assert!(far > 100.0 * local && error > far, "{offset}: {far} {error}");
        } else if offset.x == 0.0 {
            assert!(error < 1e-13, "{error:e}");
        }
        // The same surface wherever it lies: offsets are whole steps of the local origin.
        let first = *first.get_or_insert(region.local_coefficients.unwrap());
        for (a, b) in first.iter().zip(&region.local_coefficients.unwrap()) {
            assert!((a - b).abs() < 1e-4, "{offset}: {a} {b}");
        }
        let near = Vec3::from(region.local_origin) - offset;
        assert!(near.norm() < 0.1, "{near}");
        assert!(region.local_origin.iter().all(|x| x.to_string().len() <= 12));
    }
}

#[test]
fn every_region_of_either_method_has_local_coefficients_of_its_own_fit() {
    let random = &mut Random::new(3);
    // A sphere whose surface passes through the origin, above a plane that does.
    let mut points: Vec<Vec3> = (0..3000)
        .map(|_| {
            let d = Vec3::new(random.normal(), random.normal(), random.normal()).normalize();
            Vec3::new(0.0, 0.0, 5.0) + (5.0 + 0.002 * random.normal()) * d
        })
        .collect();
    points.extend((0..3000).map(|_| {
        let (x, y) = (random.uniform(-20.0, 20.0), random.uniform(-20.0, 20.0));
        Vec3::new(x, y, 0.002 * random.normal())
    }));
    let cloud = PointCloud::from_points(points);
    let rcond =
        [("method", "rcond"), ("rcond_threshold", "1e-9"), ("algebraic_threshold", "0.002")];
    let mut seen = 0;
    for settings in [&[][..], &rcond] {
        let result = found(&cloud, settings);
        for region in &result.regions {
            let [local, far] = both(&cloud, &result, region, Quadric::distance);
            assert!((local / region.fit.rms - 1.0).abs() < 0.01, "{local} {:?}", region.fit);
            assert!((far / local - 1.0).abs() < 1e-6, "{far} {local}");
            assert!(region.coefficients_error.unwrap() < 1e-12, "{region:?}");
            seen += 1;
        }
    }
    assert!(seen >= 3, "{seen}");
}
