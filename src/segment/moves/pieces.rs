//! The pieces of a region over which its surface turns steadily.

use crate::fit::Shape;
use crate::fit::constant::constants;
use crate::geometry::Vec3;
use crate::segment::objective::{FEW, HALF};
use crate::segment::prepare::scene::Scene;
use crate::segment::union::Union;

constants! {
    /// Points of a piece that a plane is fitted to, and of one that mostly shows its curvature.
    pub SAMPLE: usize = 1000, Effort("points of one fit");
    /// Normals of a surface at neighbouring points of one piece of it turn less than this (cosine).
    pub SMOOTH: f64 = 0.98, Trial(0.98, 0.98);
}

/// A surface, mostly a plane, and its points.
pub type Piece = (Shape, Vec<u32>);

/// The pieces of a region that are large enough to judge, where there are several and they hold most of it.
pub fn large_pieces(scene: &Scene, shape: &Shape, group: &[u32]) -> Option<Vec<Vec<u32>>> {
    let mut pieces = smooth_pieces(scene, shape, group);
    pieces.retain(|p| p.len() >= FEW.get());
    let held: usize = pieces.iter().map(Vec::len).sum();
    (pieces.len() >= 2 && held as f64 >= HALF.get() * group.len() as f64).then_some(pieces)
}

/// The pieces of a region over which its surface's normal turns steadily, larger ones first.
fn smooth_pieces(scene: &Scene, shape: &Shape, group: &[u32]) -> Vec<Vec<u32>> {
    let normals: Vec<Vec3> =
        group.iter().map(|&i| shape.offset(&scene.points[i as usize]).normal).collect();
    let mut union = Union::new(group.len());
    for (k, &i) in group.iter().enumerate() {
        for j in scene.neighbours(i as usize) {
            // members rise
            if let Ok(other) = group.binary_search(j)
                && normals[k].dot(&normals[other]) > SMOOTH.get()
            {
                union.join(k as u32, other as u32);
            }
        }
    }
    let places = |set: Vec<u32>| set.into_iter().map(|k| group[k as usize]).collect();
    union.sets().into_iter().map(places).collect()
}
