//! The points that growth starts from.

use crate::fit::constant::constants;
use crate::segment::grow::walk::Walk;
use crate::segment::objective::{ACCEPT, FEW, SURE};
use crate::segment::prepare::scene::Scene;

constants! {
    /// Sine of the angle by which a chord may leave the tangent planes at its ends.
    CHORD: f64 = 0.3, Trial(0.3, 0.3);
    /// Cosine of the angle between the normals at its ends.
    TURN: f64 = 0.7, Trial(0.7, 0.7);
    /// Points of the largest start set: it sees curvature through the noise.
    LARGE: usize = 160, Effort("points of one start");
    /// Points of the middle one.
    MIDDLE: usize = 60, Effort("points of one start");
    /// Points of the smallest one: it fits into a small face or beside a joint.
    SMALL: usize = 30, Effort("points of one start");
}

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
    let slack = SURE.get() * sigma;
    let set = walk.run(scene, &[seed as u32], size, |from, to| {
        let Some(from) = from else { return true };
        let d = scene.points[to] - scene.points[from];
        match start {
            Start::Tangent => {
                let length = d.norm();
                scene.normals[from].dot(&d).abs() < CHORD.get() * length + slack
                    && scene.normals[to].dot(&d).abs() < CHORD.get() * length + slack
                    && (scene.normals[from].dot(&scene.normals[to]).abs() > TURN.get()
                        || length < ACCEPT.get() * sigma)
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
pub fn nearest() -> (Start, usize, usize) {
    (Start::Tangent, SMALL.get(), FEW.get())
}

/// Start sets, tried in turn at each seed, with the most and the least points of each: a large one sees curvature
/// through the noise, a small one fits into a small face or beside a joint.
pub fn starts() -> [(Start, usize, usize); 5] {
    [
        (Start::Tangent, LARGE.get(), FEW.get()),
        (Start::Tangent, MIDDLE.get(), FEW.get()),
        nearest(),
        (Start::Any, SMALL.get(), FEW.get()),
        (Start::Flat, FEW.get(), FEW.get() / 2),
    ]
}
