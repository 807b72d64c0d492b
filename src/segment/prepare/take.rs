//! Some of the points of a region, taken evenly.

use crate::geometry::Vec3;
use crate::segment::objective::{FEW, PART};
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
    let set = if core.len() >= FEW.get() && core.len() as f64 > PART.get() * group.len() as f64 {
        &core
    } else {
        group
    };
    take_with_normals(scene, set, limit)
}

/// What [`take`] does, and the normals there.
pub fn take_with_normals(scene: &Scene, members: &[u32], limit: usize) -> (Vec<Vec3>, Vec<Vec3>) {
    let m = members.len().min(limit);
    let normals = (0..m).map(|k| scene.normals[members[k * members.len() / m] as usize]);
    (take(scene, members, limit), normals.collect())
}

/// Points of `members`, at most `limit` of them: those whose places in the scene are multiples of a power of two, so
/// that a region which wins or loses a few points has nearly the same ones.
pub fn take_same(scene: &Scene, members: &[u32], limit: usize) -> Vec<Vec3> {
    let step = members.len().div_ceil(limit.max(1)).next_power_of_two() as u32;
    let taken = members.iter().filter(|i| i.is_multiple_of(step));
    taken.map(|&i| scene.points[i as usize]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_region_that_loses_a_point_keeps_the_points_taken() {
        let points = (0..5000).map(|k| Vec3::new(f64::from(k), 0.0, 0.0)).collect();
        let scene = Scene::new(points);
        let all: Vec<u32> = (0..5000).collect();
        let taken = take_same(&scene, &all, 1000);
        assert!((500..=1000).contains(&taken.len()), "{}", taken.len());
        let fewer: Vec<u32> = all.iter().copied().filter(|i| *i != 1).collect();
        assert_eq!(take_same(&scene, &fewer, 1000), taken);
        assert_eq!(take_same(&scene, &all[..7], 1000).len(), 7);
        assert!(take_same(&scene, &[], 1000).is_empty());
    }
}
