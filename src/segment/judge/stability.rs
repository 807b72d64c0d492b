//! Whether growth ends with the same points wherever in them it starts.

use rayon::prelude::*;

use crate::segment::family::Families;
use crate::segment::grow::hypothesis::{Hypothesis, grow};
use crate::segment::grow::search::MIN_SUPPORT;
use crate::segment::grow::walk::Walk;
use crate::segment::judge::whiteness::{CHANCE, far_correlation};
use crate::segment::partition::{Partition, members};
use crate::segment::prepare::scene::Scene;

/// Growths from elsewhere in a set of points that tell whether it is a surface's.
const REGROWN: usize = 5;

/// How many of them must end up the same.
const ALIKE: usize = 3;

/// Correlation with further neighbours beyond which residuals have a form.
const FORM: f64 = 0.07;

/// Common share of two supports that are the same.
const SAME: f64 = 0.75;

/// The hypotheses, those sound that are the same wherever they start.
pub fn judged(scene: &Scene, families: &Families, mut found: Vec<Hypothesis>) -> Vec<Hypothesis> {
    found.par_iter_mut().for_each_init(
        || Walk::new(scene.len()),
        |walk, h| h.sound = is_stable(scene, walk, families, &h.support),
    );
    found
}

/// The regions of a scene with form errors that are no surfaces: growth from elsewhere in them ends
/// elsewhere, and their residuals go together over more than the nearest neighbours, as those of noise do not whose
/// rows or averages make growth stop early. They keep their points from flowing to their neighbours, and are not
/// reported.
pub fn spurious(scene: &Scene, families: &Families, model: &Partition) -> Vec<bool> {
    let labels = &model.labels;
    let regions = members(labels, model.shapes.len());
    let all = regions.par_iter().zip(&model.shapes).enumerate();
    all.map_init(
        || Walk::new(scene.len()),
        |walk, (l, (region, shape))| {
            let inside = |j: u32| labels[j as usize] == l as i32;
            let chance = CHANCE / (region.len().max(1) as f64).sqrt();
            !is_stable(scene, walk, families, region)
                && far_correlation(scene, shape, region, families.sigma, inside) > FORM + chance
        },
    )
    .collect()
}

/// Whether most growths from elsewhere in a set of points end up with the same points.
fn is_stable(scene: &Scene, walk: &mut Walk, families: &Families, points: &[u32]) -> bool {
    if points.len() < REGROWN || scene.cancelled() {
        return false;
    }
    let mut own = points.to_vec();
    own.sort_unstable();
    let (mut alike, mut other) = (0, 0);
    for k in 0..REGROWN {
        let seed = points[(2 * k + 1) * points.len() / (2 * REGROWN)] as usize;
        let grown = grow(scene, walk, families, seed, MIN_SUPPORT);
        if grown.is_some_and(|h| common_share(&own, &h.support) > SAME) {
            alike += 1;
        } else {
            other += 1;
        }
        if alike == ALIKE || other > REGROWN - ALIKE {
            break;
        }
    }
    alike == ALIKE
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
    use crate::segment::fixtures::{self, plane};
    use crate::segment::random::SplitMix64;

    #[test]
    fn a_whole_face_is_a_surface_and_half_of_one_is_not() {
        let random = &mut SplitMix64::new(3);
        let mut unit = || random.below(1 << 30) as f64 / f64::from(1 << 30);
        // two faces with a gap between them; of the second only one half has a region
        let mut points: Vec<Vec3> =
            (0..1200).map(|_| Vec3::new(10.0 * unit(), 10.0 * unit(), 0.01 * unit())).collect();
        points.extend(
            (0..1200).map(|_| Vec3::new(30.0 + 10.0 * unit(), 10.0 * unit(), 0.01 * unit())),
        );
        let side = |p: &Vec3| match p.x {
            x if x < 20.0 => 0,
            x if x < 35.0 => 1,
            _ => -1,
        };
        let labels: Vec<i32> = points.iter().map(side).collect();
        let sigma = 0.003;
        let families = Families { sigma, floor: sigma, max_radius: 1e3, ..fixtures::families() };
        let model = |tilt: f64| {
            let shapes = [Vec3::z(), Vec3::new(tilt, 0.0, 1.0).normalize()];
            let shapes = shapes.map(|w| plane(Vec3::new(32.5, 0.0, 0.005), w)).to_vec();
            fixtures::partition(shapes, labels.clone())
        };
        let scene = Scene::new(points);
        assert_eq!(spurious(&scene, &families, &model(0.01)), [false, true]);
        // What noise leaves of a part of a face is no form.
        assert_eq!(spurious(&scene, &families, &model(0.0)), [false, false]);
    }

    #[test]
    fn the_common_share_is_that_of_both_in_either() {
        assert_eq!(common_share(&[1, 2, 3, 4], &[4, 3, 9, 8]), 2.0 / 6.0);
        assert_eq!(common_share(&[1, 2], &[2, 1]), 1.0);
    }
}
