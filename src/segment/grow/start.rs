//! The points that growth starts from.

use crate::segment::grow::walk::Walk;
use crate::segment::prepare::scene::Scene;

/// Which connected points a start set takes.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Start {
    /// Those whose chords lie in the tangent planes.
    Tangent,
    /// Those near the seed's own tangent plane: of narrow strips side by side, whose other normals are
    /// those of both together, one.
    Flat,
    /// Any: strips a point or two wide have no tangent planes.
    Any,
}

/// The start set of a seed at noise `sigma`.
pub fn start_set(
    scene: &Scene,
    walk: &mut Walk,
    seed: usize,
    start: Start,
    size: usize,
    sigma: f64,
) -> Vec<u32> {
    let slack = 3.0 * sigma;
    let set = walk.run(scene, &[seed as u32], size, |from, to| {
        let Some(from) = from else { return true };
        let d = scene.points[to] - scene.points[from];
        match start {
            Start::Tangent => {
                let length = d.norm();
                scene.normals[from].dot(&d).abs() < 0.3 * length + slack
                    && scene.normals[to].dot(&d).abs() < 0.3 * length + slack
                    && (scene.normals[from].dot(&scene.normals[to]).abs() > 0.7
                        || length < 4.0 * sigma)
            }
            Start::Flat => {
                let d = scene.points[to] - scene.points[seed];
                scene.normals[seed].dot(&d).abs() < slack
            }
            Start::Any => true,
        }
    });
    set[..set.len().min(size)].to_vec()
}

/// The least of those that lie in tangent planes.
pub const NEAREST: (Start, usize, usize) = (Start::Tangent, 30, 24);
/// Start sets, tried in turn at each seed, with the most and the least points of each: a large one sees curvature
/// through the noise, a small one fits into a small face or beside a joint.
pub const STARTS: [(Start, usize, usize); 5] = [
    (Start::Tangent, 160, 24),
    (Start::Tangent, 60, 24),
    NEAREST,
    (Start::Any, 30, 24),
    (Start::Flat, 24, 12),
];
