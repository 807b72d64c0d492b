//! Starts of tori.

use super::kasa::{cylinder, kasa};
use super::kind::FeatureType;
use super::pose::Pose;
use super::rows::Gauge;
use crate::geometry::{Vec3, perpendicular_frame};

/// Distances of the centre from the middle of the points that are tried, in units of their size, for pieces of which
/// Kasa's circle tells nothing because the tube is nearly as wide as the piece is long.
const FAR: [f64; 4] = [0.7, 1.5, 3.0, 6.0];
/// Directions in which they are tried.
const SIDES: usize = 8;
/// Root mean square distance of a start, in the points' size, from which on it needs no other.
const NEAR: f64 = 0.05;

/// Tori about each of `axes`: where the axis passes is tried at Kasa's circle of the points seen along it and at their middle, and
/// if none of these comes near, further off; their distances from the axis and heights then give the tube's circle. A short piece
/// is nearly a cylinder: bent ones are tried too.
pub fn tori(points: &[Vec3], axes: &[Vec3]) -> Vec<Pose> {
    let mut found = Vec::new();
    for w in axes {
        let (u, v) = perpendicular_frame(w);
        let flat: Vec<[f64; 3]> = points.iter().map(|p| [p.dot(&u), p.dot(&v), p.dot(w)]).collect();
        let circle = kasa(flat.iter().map(|q| [q[0], q[1]])).map(|c| c.0);
        for c in circle.into_iter().chain([[0.0; 2]]) {
            found.extend(about(&flat, c, [&u, &v, w]));
        }
    }
    let rms = |pose: &Pose| {
        let gauge = Gauge::of(pose);
        let sum: f64 = points.iter().map(|x| gauge.distance(x).powi(2)).sum();
        (sum / points.len() as f64).sqrt()
    };
    let best = found.iter().map(rms).fold(f64::INFINITY, f64::min);
    if best > NEAR {
        // Every other direction will do: the fit turns the axis.
        for w in axes.iter().step_by(2) {
            let (u, v) = perpendicular_frame(w);
            let flat: Vec<[f64; 3]> =
                points.iter().map(|p| [p.dot(&u), p.dot(&v), p.dot(w)]).collect();
            for side in 0..SIDES {
                let (sin, cos) = (std::f64::consts::TAU * side as f64 / SIDES as f64).sin_cos();
                for far in FAR {
                    found.extend(about(&flat, [far * cos, far * sin], [&u, &v, w]));
                }
            }
        }
    }
    // Few points of a short tube may lie near a ball with a dent, so near that nothing further is tried above.
    found.extend(bent(points, axes));
    found
}

/// The nearest of the cylinders about `axes`, bent to all sides.
fn bent(points: &[Vec3], axes: &[Vec3]) -> Vec<Pose> {
    let cost = |tube: &Pose| {
        let gauge = Gauge::of(tube);
        points.iter().map(|x| gauge.distance(x).powi(2)).sum::<f64>()
    };
    let tubes = axes.iter().filter_map(|w| cylinder(points, w));
    let Some(tube) = tubes.min_by(|a, b| cost(a).total_cmp(&cost(b))) else { return Vec::new() };
    let middle = points.iter().sum::<Vec3>() / points.len() as f64;
    let tube = tube.recentred(&middle);
    let mut found = Vec::new();
    for side in 0..SIDES {
        let (sin, cos) = (std::f64::consts::TAU * side as f64 / SIDES as f64).sin_cos();
        let out = tube.frame.column(0) * cos + tube.frame.column(1) * sin;
        let axis = tube.w().cross(&out);
        let torus = |far: f64| {
            let size = [far, tube.size[0], 0.0];
            Pose::with_axis(FeatureType::Torus, tube.origin + out * far, axis, size)
        };
        found.extend(FAR.map(torus));
    }
    found
}

/// The torus whose axis passes through `c`.
fn about(flat: &[[f64; 3]], c: [f64; 2], [u, v, w]: [&Vec3; 3]) -> Option<Pose> {
    let section = flat.iter().map(|q| {
        let (x, y) = (q[0] - c[0], q[1] - c[1]);
        [(x * x + y * y).sqrt(), q[2]]
    });
    let (middle, tube) = kasa(section)?;
    let origin = u * c[0] + v * c[1] + w * middle[1];
    let pose = Pose::with_axis(FeatureType::Torus, origin, *w, [middle[0], tube, 0.0]);
    pose.is_proper().then_some(pose)
}

#[cfg(test)]
mod tests {
    use super::super::fixed::Fixed;
    use super::super::gauss::{Local, least};
    use super::*;
    use crate::fit::fits::Random;

    /// A tube as long as it is wide: one in ten was taken for a ball with a dent.
    #[test]
    fn a_short_piece_of_a_torus_is_found_from_any_side() {
        let mut random = Random::new(5);
        for round in 0..60 {
            let axis = Vec3::new(random.normal(), random.normal(), random.normal());
            let turn = Pose::with_axis(FeatureType::Torus, Vec3::zeros(), axis, [0.0; 3]).frame;
            let point = |_| {
                let (angle, t) =
                    (random.uniform(-0.26, 0.26), random.uniform(0.0, std::f64::consts::TAU));
                let tube = 3.0 + 0.005 * random.normal();
                let rho = 10.0 + tube * t.cos();
                turn * Vec3::new(rho * angle.cos(), rho * angle.sin(), tube * t.sin())
            };
            let points: Vec<Vec3> = (0..400).map(point).collect();
            let local = Local::of(&points).unwrap();
            let found = least(FeatureType::Torus, &local.points, &Fixed::default()).unwrap();
            let rms = (found.cost / 400.0).sqrt() * local.scale;
            assert!(rms < 0.01, "{round}: {rms} {:?}", found.pose);
        }
    }
}
