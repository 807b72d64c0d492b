//! Whether growth ends with the same points wherever in them it starts.

use rayon::prelude::*;

use crate::fit::constant::constants;
use crate::fit::{Ruler, Shape};
use crate::segment::family::Families;
use crate::segment::grow::hypothesis::{Hypothesis, grow};
use crate::segment::grow::search::MIN_SUPPORT;
use crate::segment::grow::walk::Walk;
use crate::segment::judge::parabola::is_parabolic;
use crate::segment::objective::{MOST, SURE};
use crate::segment::prepare::scene::Scene;

constants! {
    /// Growths from elsewhere in a set of points that tell whether it is a surface's.
    REGROWN: usize = 5, Effort("growths of one set");
    /// How many of them must end up the same.
    ALIKE: usize = 3, Trial(3.0, 3.0);
}

/// The hypotheses, those sound that are the same wherever they start.
pub fn judged(scene: &Scene, families: &Families, mut found: Vec<Hypothesis>) -> Vec<Hypothesis> {
    found.par_iter_mut().for_each_init(
        || Walk::new(scene.len()),
        |walk, h| h.sound = is_stable(scene, walk, families, &h.shape, &h.support),
    );
    found
}

/// The hypotheses, those sound as well whose residuals are correlated by more than is common but which are the same
/// wherever they start: how much neighbours have in common differs from surface to surface.
pub fn rescued(scene: &Scene, families: &Families, mut found: Vec<Hypothesis>) -> Vec<Hypothesis> {
    if families.common > 0.0 {
        let open = found.par_iter_mut().filter(|h| !h.sound && !is_parabolic(&h.shape));
        open.for_each_init(
            || Walk::new(scene.len()),
            |walk, h| h.sound = is_stable(scene, walk, families, &h.shape, &h.support),
        );
    }
    found
}

/// Whether growth from elsewhere in each of some sets of points ends elsewhere.
pub fn unstable(
    scene: &Scene,
    families: &Families,
    shapes: &[Shape],
    sets: &[Vec<u32>],
) -> Vec<bool> {
    let walk = || Walk::new(scene.len());
    let of = |walk: &mut Walk, (shape, set): (&Shape, &Vec<u32>)| {
        !is_stable(scene, walk, families, shape, set)
    };
    shapes.par_iter().zip(sets).map_init(walk, of).collect()
}

/// Whether most growths from elsewhere in a surface's points end up with it: with those of the points that hang together
/// around where they start and lie near it, whatever labels these have.
fn is_stable(
    scene: &Scene,
    walk: &mut Walk,
    families: &Families,
    shape: &Shape,
    points: &[u32],
) -> bool {
    if points.len() < REGROWN.get() {
        return false;
    }
    let (ruler, reach) = (Ruler::of(shape), SURE.get() * families.sigma);
    let (mut alike, mut other) = (0, 0);
    for k in 0..REGROWN.get() {
        if scene.cancelled() || alike == ALIKE.get() || other > REGROWN.get() - ALIKE.get() {
            break;
        }
        let seed = points[(2 * k + 1) * points.len() / (2 * REGROWN.get())];
        let grown = grow(scene, walk, families, seed as usize, MIN_SUPPORT.get());
        let mut own = walk.near(scene, (&[seed], 0), usize::MAX, &ruler, reach).to_vec();
        own.sort_unstable();
        if grown.is_some_and(|h| common_share(&own, &h.support) > MOST.get()) {
            alike += 1;
        } else {
            other += 1;
        }
    }
    alike == ALIKE.get()
}

/// Points in both of two sets over those in either; `sorted` rises.
fn common_share(sorted: &[u32], other: &[u32]) -> f64 {
    let common = other.iter().filter(|i| sorted.binary_search(i).is_ok()).count();
    common as f64 / (sorted.len() + other.len() - common) as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Vec3;
    use crate::segment::fixtures;
    use crate::segment::random::SplitMix64;

    #[test]
    fn a_surface_is_stable_whatever_its_labels_are_and_a_plane_through_a_wave_is_not() {
        let random = &mut SplitMix64::new(3);
        let mut unit = || random.below(1 << 30) as f64 / f64::from(1 << 30);
        let mut face = |x: f64, wave: f64| -> Vec<Vec3> {
            let mut at = || {
                let (u, v, off) = (10.0 * unit(), 10.0 * unit(), 0.01 * unit());
                Vec3::new(x + u, v, off + wave * (0.9 * u).sin() * (0.9 * v).cos())
            };
            (0..2400).map(|_| at()).collect()
        };
        // A face, another of which only one half has the label, and a wave of which a plane has what lies near it.
        let points: Vec<Vec3> =
            [face(0.0, 0.0), face(30.0, 0.0), face(60.0, 0.5)].into_iter().flatten().collect();
        let sigma = 0.003;
        let set = |on: &dyn Fn(&Vec3) -> bool| -> Vec<u32> {
            (0..points.len() as u32).filter(|&i| on(&points[i as usize])).collect()
        };
        let sets = [
            set(&|p| p.x < 20.0),
            set(&|p| (30.0..35.0).contains(&p.x)),
            set(&|p| p.x > 60.0 && p.z.abs() < 3.0 * sigma),
        ];
        let families = Families { sigma, floor: sigma, max_radius: 1e3, ..fixtures::families() };
        let shapes = [fixtures::plane(Vec3::zeros(), Vec3::z()); 3];
        let scene = Scene::new(points.clone());
        assert_eq!(unstable(&scene, &families, &shapes, &sets), [false, false, true]);
    }

    #[test]
    fn the_common_share_is_that_of_both_in_either() {
        assert_eq!(common_share(&[1, 2, 3, 4], &[4, 3, 9, 8]), 2.0 / 6.0);
        assert_eq!(common_share(&[1, 2], &[2, 1]), 1.0);
    }
}
