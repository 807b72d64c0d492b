//! Scenes and surfaces that tests of the method share.

use crate::fit::fits::Random;
use crate::fit::{Family, Shape};
use crate::geometry::Vec3;
use crate::segment::family::{Families, Policy};
use crate::segment::partition::Partition;
use crate::segment::prepare::morton::morton_order;
use crate::segment::prepare::scene::Scene;
use crate::segment::{Parameters, Silent};

/// Noise of the scenes.
pub const SIGMA: f64 = 0.01;

/// Points in the order that scenes have.
pub fn ordered(points: &[Vec3]) -> Vec<Vec3> {
    let order = morton_order(points, &Silent).unwrap();
    order.iter().map(|&i| points[i as usize]).collect()
}

/// A smooth field of variance one, with a correlation length of one.
pub fn smooth(random: &mut Random) -> impl Fn(&Vec3) -> f64 + use<> {
    let waves: Vec<(Vec3, f64)> = (0..200)
        .map(|_| {
            let k = Vec3::new(random.normal(), random.normal(), random.normal());
            (k, random.uniform(0.0, std::f64::consts::TAU))
        })
        .collect();
    move |p| waves.iter().map(|(k, at)| (k.dot(p) + at).cos()).sum::<f64>() / 10.0
}

/// A scene of `n` points of the sheet z = height(x), x in -10..10 and y in 0..10, with noise along z.
pub fn sheet(n: usize, height: impl Fn(f64) -> f64) -> Scene<'static> {
    let mut random = Random::new(7);
    let mut point = || {
        let (x, y) = (random.uniform(-10.0, 10.0), random.uniform(0.0, 10.0));
        Vec3::new(x, y, height(x) + SIGMA * random.normal())
    };
    Scene::new(ordered(&(0..n).map(|_| point()).collect::<Vec<_>>()))
}

/// The plane through a point.
pub fn plane(point: Vec3, normal: Vec3) -> Shape {
    Shape::with_axis(Family::Plane, point, normal, [0.0; 3])
}

/// The floor z = 0 up to x = 0, and the plane that rises from there by `slope`; each point's true label.
pub fn roof(n: usize, slope: f64) -> (Scene<'static>, Vec<Shape>, Vec<i32>) {
    let scene = sheet(n, |x| slope * x.max(0.0));
    let shapes = [Vec3::z(), Vec3::new(-slope, 0.0, 1.0)].map(|w| plane(Vec3::zeros(), w));
    let labels = scene.points.iter().map(|p| i32::from(p.x > 0.0)).collect();
    (scene, shapes.to_vec(), labels)
}

/// The floor up to x = 0, and a cylinder of that radius into which it runs smoothly; each point's true label.
pub fn ramp(n: usize, radius: f64) -> (Scene<'static>, Vec<Shape>, Vec<i32>) {
    let scene = sheet(n, |x| radius - (radius * radius - x.max(0.0).powi(2)).sqrt());
    let axis = Vec3::new(0.0, 0.0, radius);
    let cylinder = Shape::with_axis(Family::Cylinder, axis, Vec3::y(), [radius, 0.0, 0.0]);
    let labels = scene.points.iter().map(|p| i32::from(p.x > 0.0)).collect();
    (scene, vec![plane(Vec3::zeros(), Vec3::z()), cylinder], labels)
}

/// Surfaces and labels as a partition of a scene.
pub fn partition(shapes: Vec<Shape>, labels: Vec<i32>) -> Partition {
    Partition { shapes, labels, ..Partition::default() }
}

/// All families at the scenes' noise, with the default policy.
pub fn families() -> Families {
    Families {
        common: 0.0,
        rougher: false,
        allowed: Family::ALL.to_vec(),
        sigma: SIGMA,
        floor: SIGMA,
        max_radius: 1e4,
        strips: true,
        policy: Policy::of(&Parameters::default()),
    }
}
