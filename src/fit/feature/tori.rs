//! Starts of tori.

use super::kasa::kasa;
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
/// if none of these comes near, further off; their distances from the axis and heights then give the tube's circle.
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
