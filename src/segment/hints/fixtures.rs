//! Clouds that tests of hints share.

use crate::fit::fits::Random;
use crate::geometry::{PointCloud, Surface, SurfaceType, Vec3};
use crate::segment::{Hint, Parameters, Segmentation, Silent, segment};

/// Noise of the clouds.
pub const SIGMA: f64 = 0.01;

/// What is found in points with these hints.
pub fn found(points: &[Vec3], hints: &[Hint]) -> Segmentation {
    let cloud = PointCloud::from_points(points.to_vec());
    let parameters = Parameters { hints: hints.to_vec(), ..Parameters::default() };
    segment(&cloud, &parameters, &Silent).unwrap()
}

/// The hint about the surface at a point.
pub fn at(point: Vec3, surface_type: SurfaceType) -> Hint {
    let at = vec![point.into()];
    Hint { at, surface_type: Some(surface_type), ..Hint::default() }
}

/// An arc of `angle` of a tube of radius 10 about z, 20 long.
pub fn arc(n: usize, angle: f64, seed: u64) -> Vec<Vec3> {
    let random = &mut Random::new(seed);
    let mut point = || {
        let (t, r) = (random.uniform(-0.5, 0.5) * angle, 10.0 + SIGMA * random.normal());
        Vec3::new(r * t.cos(), r * t.sin(), random.uniform(-10.0, 10.0))
    };
    (0..n).map(|_| point()).collect()
}

/// Two faces of a box that meet at the edge x = 0, each 10 wide.
pub fn edge(n: usize) -> Vec<Vec3> {
    let random = &mut Random::new(5);
    let mut point = |k: usize| {
        let (u, v) = (random.uniform(0.0, 10.0), random.uniform(0.0, 10.0));
        let noise = SIGMA * random.normal();
        if k.is_multiple_of(2) { Vec3::new(-u, v, noise) } else { Vec3::new(noise, v, -u) }
    };
    (0..n).map(&mut point).collect()
}

/// The radius of a cylinder and its standard deviation.
pub fn radius(found: &Segmentation, region: usize) -> (f64, f64) {
    let Some(Surface::Cylinder(cylinder)) = found.regions[region].surface else {
        panic!("{:?}", found.regions[region].surface_type)
    };
    let deviation = found.regions[region].uncertainty.as_ref().unwrap()["radius"].as_f64();
    (cylinder.radius, deviation.unwrap())
}
