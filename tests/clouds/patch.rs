use std::f64::consts::TAU;

use conicoid::geometry::{
    Cone, Cylinder, Ellipsoid, Plane, Sphere, Surface, Vec3, perpendicular_frame,
};

use super::Random;

/// Noise-free points of one surface; no truth where it is no quadric.
#[derive(Clone, Debug)]
pub struct Patch {
    pub points: Vec<Vec3>,
    pub truth: Option<Surface>,
}

fn many(n: usize, mut one: impl FnMut() -> Vec3) -> Vec<Vec3> {
    (0..n).map(|_| one()).collect()
}

impl Patch {
    /// Points that belong to no quadric.
    pub fn other(points: Vec<Vec3>) -> Self {
        Self { points, truth: None }
    }

    /// The parallelogram at `corner` with sides `e1` and `e2`.
    pub fn plane(corner: Vec3, e1: Vec3, e2: Vec3, n: usize, random: &mut Random) -> Self {
        let points =
            many(n, || corner + random.uniform(0.0, 1.0) * e1 + random.uniform(0.0, 1.0) * e2);
        let normal = e1.cross(&e2).normalize();
        Self { points, truth: Some(Surface::Plane(Plane { point: corner, normal })) }
    }

    /// A cylinder from `base` along `length` (axis times length), over `angles`.
    pub fn cylinder(
        base: Vec3,
        length: Vec3,
        radius: f64,
        angles: [f64; 2],
        n: usize,
        random: &mut Random,
    ) -> Self {
        let axis_direction = length.normalize();
        let (u, v) = perpendicular_frame(&axis_direction);
        let points = many(n, || {
            let (sin, cos) = random.uniform(angles[0], angles[1]).sin_cos();
            base + radius * (cos * u + sin * v) + random.uniform(0.0, 1.0) * length
        });
        let truth = Cylinder { axis_point: base, axis_direction, radius };
        Self { points, truth: Some(Surface::Cylinder(truth)) }
    }

    /// The part of a sphere whose directions from the centre `keep` accepts.
    pub fn sphere(
        center: Vec3,
        radius: f64,
        keep: impl Fn(&Vec3) -> bool,
        n: usize,
        random: &mut Random,
    ) -> Self {
        let points = many(n, || center + radius * direction(&keep, random));
        Self { points, truth: Some(Surface::Sphere(Sphere { center, radius })) }
    }

    /// The part of an ellipsoid whose unit-sphere directions (in its own axes) `keep` accepts.
    pub fn ellipsoid(
        center: Vec3,
        axes: [Vec3; 3],
        semi_axes: [f64; 3],
        keep: impl Fn(&Vec3) -> bool,
        n: usize,
        random: &mut Random,
    ) -> Self {
        let inverse = Vec3::from(semi_axes).map(|a| 1.0 / a);
        // area element of the map from the unit sphere, for uniform density
        let stretch = |d: &Vec3| d.component_mul(&inverse).norm();
        let points = many(n, || {
            loop {
                let d = direction(&keep, random);
                if random.uniform(0.0, inverse.max()) < stretch(&d) {
                    let local = d.component_mul(&Vec3::from(semi_axes));
                    break center + local.x * axes[0] + local.y * axes[1] + local.z * axes[2];
                }
            }
        });
        let mut order = [0, 1, 2];
        order.sort_by(|&i, &j| semi_axes[j].total_cmp(&semi_axes[i]));
        let mut directions = order.map(|i| axes[i]);
        directions[2] = directions[0].cross(&directions[1]);
        let truth = Ellipsoid {
            center,
            semi_axes: order.map(|i| semi_axes[i]),
            semi_axis_directions: directions,
        };
        Self { points, truth: Some(Surface::Ellipsoid(truth)) }
    }

    /// A cone between two distances from the apex along its axis.
    pub fn cone(truth: Cone, heights: [f64; 2], n: usize, random: &mut Random) -> Self {
        let (u, v) = perpendicular_frame(&truth.axis_direction);
        let points = many(n, || {
            let h = random.uniform(heights[0].powi(2), heights[1].powi(2)).sqrt();
            let (sin, cos) = random.uniform(0.0, TAU).sin_cos();
            truth.apex + h * truth.axis_direction + h * truth.half_angle.tan() * (cos * u + sin * v)
        });
        Self { points, truth: Some(Surface::Cone(truth)) }
    }

    /// A torus about `axis`: `arc` is the directions from the centre where the sweep begins and a quarter
    /// turn later, `sweep` how far it goes.
    pub fn torus(
        center: Vec3,
        arc: [Vec3; 2],
        radii: [f64; 2],
        sweep: f64,
        n: usize,
        random: &mut Random,
    ) -> Self {
        let [major, minor] = radii;
        let axis = arc[0].cross(&arc[1]);
        let points = many(n, || {
            let tube = loop {
                let angle = random.uniform(0.0, TAU);
                if random.uniform(0.0, major + minor) < major + minor * angle.cos() {
                    break angle;
                }
            };
            let (sin, cos) = random.uniform(0.0, sweep).sin_cos();
            let radial = cos * arc[0] + sin * arc[1];
            center + (major + minor * tube.cos()) * radial + minor * tube.sin() * axis
        });
        Self::other(points)
    }
}

fn direction(keep: &impl Fn(&Vec3) -> bool, random: &mut Random) -> Vec3 {
    loop {
        let d = random.direction();
        if keep(&d) {
            return d;
        }
    }
}
