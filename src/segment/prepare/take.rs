//! Some of the points of a region, taken evenly.

use crate::geometry::Vec3;
use crate::segment::prepare::scene::Scene;

/// Points of `members`, at most about `limit` of them, evenly along the scene's order.
pub fn take(scene: &Scene, members: &[u32], limit: usize) -> Vec<Vec3> {
    let m = members.len().min(limit);
    (0..m).map(|k| scene.points[members[k * members.len() / m] as usize]).collect()
}

/// Points and normals of a region's core, where all neighbours carry its label, at most about `limit`; of the
/// whole region where the core is but a small part of it.
pub fn take_core(
    scene: &Scene,
    labels: &[i32],
    group: &[u32],
    label: i32,
    limit: usize,
) -> (Vec<Vec3>, Vec<Vec3>) {
    let inside =
        |i: &u32| scene.neighbours(*i as usize).iter().all(|&j| labels[j as usize] == label);
    let core: Vec<u32> = group.iter().copied().filter(inside).collect();
    let set = if core.len() >= 60 && core.len() * 3 > group.len() { &core } else { group };
    take_with_normals(scene, set, limit)
}

/// What [`take`] does, and the normals there.
pub fn take_with_normals(scene: &Scene, members: &[u32], limit: usize) -> (Vec<Vec3>, Vec<Vec3>) {
    let m = members.len().min(limit);
    let normals = (0..m).map(|k| scene.normals[members[k * members.len() / m] as usize]);
    (take(scene, members, limit), normals.collect())
}
