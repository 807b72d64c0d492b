//! Points that lie on a surface's continuation, away from its region: outliers that happen to.

use rayon::prelude::*;

use crate::fit::constant::constants;
use crate::segment::prepare::scene::Scene;

constants! {
    /// Which of a point's neighbours of its own label tells how close they lie.
    NTH: usize = 3, Trial(3.0, 3.0);
    /// How many times further off than those of its neighbours a stray's are. Even points seldom come to twice.
    FAR: f64 = 3.0, Trial(3.0, 3.0);
}

/// The labelled points whose neighbours of the same label lie several times further off than these do from each
/// other (as Breunig and others' local outlier factor compares reaches).
pub fn strays(scene: &Scene, labels: &[i32]) -> Vec<u32> {
    let alike = |i: u32| {
        let own = labels[i as usize];
        scene.neighbours(i as usize).iter().copied().filter(move |&j| labels[j as usize] == own)
    };
    let reach = |i: u32| {
        let last = scene.neighbours(i as usize).last().copied();
        let to = alike(i).nth(NTH.get() - 1).or(last);
        to.map_or(0.0, |j| (scene.points[j as usize] - scene.points[i as usize]).norm())
    };
    (0..scene.len() as u32)
        .into_par_iter()
        .with_min_len(4096)
        .filter(|&i| {
            if labels[i as usize] < 0 {
                return false;
            }
            // Most points have close neighbours: one of them tells.
            let own = reach(i);
            let mut of_others = alike(i).map(reach);
            match of_others.next() {
                Some(first) if own <= FAR.get() * first => false,
                Some(first) => {
                    let mut all: Vec<f64> = of_others.chain([first]).collect();
                    let middle = all.len() / 2;
                    own > FAR.get() * *all.select_nth_unstable_by(middle, f64::total_cmp).1
                }
                None => true,
            }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Vec3;

    #[test]
    fn a_point_far_off_the_patch_strays_and_those_of_its_sparse_rim_do_not() {
        // A grid whose spacing grows steadily from 1 to 3.
        let at = |k: usize| (0..k).map(|j| 1.0 + j as f64 / 15.0).sum::<f64>();
        let mut points: Vec<Vec3> =
            (0..900).map(|k| Vec3::new(at(k % 30), at(k / 30), 0.0)).collect();
        let far = Vec3::new(at(29) + 15.0, at(15), 0.0);
        points.push(far);
        let scene = Scene::new(points);
        let found = strays(&scene, &vec![0; scene.len()]);
        let found: Vec<Vec3> = found.iter().map(|&i| scene.points[i as usize]).collect();
        assert_eq!(found, [far]);
    }

    #[test]
    fn a_strip_one_point_wide_between_others_is_no_stray() {
        let points: Vec<Vec3> =
            (0..900).map(|k| Vec3::new((k % 30) as f64, (k / 30) as f64, 0.0)).collect();
        let scene = Scene::new(points);
        let labels: Vec<i32> =
            scene.points.iter().map(|p| if p.x == 15.0 { 1 } else { 0 }).collect();
        assert!(strays(&scene, &labels).is_empty());
    }
}
