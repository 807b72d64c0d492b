//! Why points have no region.

use std::collections::BTreeMap;

use crate::fit::constant::constants;
use crate::geometry::Vec3;
use crate::segment::Monitor;
use crate::segment::objective::APART;
use crate::segment::prepare::candidates::K;
use crate::segment::prepare::noise::VOLUME;
use crate::segment::prepare::scene::Scene;
use crate::segment::union::Union;

constants! {
    /// Points looked at; with more, every n-th stands for the rest.
    SAMPLE: usize = 50_000, Effort("points looked at");
    /// Fewer points than this in one place are isolated.
    ISOLATED: usize = 10, Derived("what the word is to mean");
}

/// Why a point has no region.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Reason {
    /// It stands alone, fills a volume with others, or lies further from every surface than the tolerance.
    Outlier,
    /// Its patch has fewer points than a region may have.
    TooSmall,
    /// Its surface is a torus, a freeform or a quadric that was not asked for.
    NoQuadric,
    /// What its surface is was not looked at to the end: the work on the cloud had come to its bound.
    NotExamined,
    /// Its region is not among the `max_regions` largest.
    OverMaxRegions,
    /// A further copy of a point that another reason counts.
    Duplicate,
}

impl Reason {
    /// The name in results.
    pub fn name(self) -> &'static str {
        match self {
            Self::Outlier => "outlier",
            Self::TooSmall => "too_small",
            Self::NoQuadric => "no_quadric",
            Self::NotExamined => "not_examined",
            Self::OverMaxRegions => "over_max_regions",
            Self::Duplicate => "duplicate",
        }
    }
}

/// Counts `points` that no surface took, by reason. `spacing` is the cloud's, `min_points` the
/// smallest region's.
///
/// Points hang together within 2.5 spacings. A group of fewer than ten, or one that fills a volume, is
/// outliers; one below `min_points` is too small a patch; any other is a surface that is no quadric or, where not
/// everything was `examined`, may be any.
/// Of more than 50 000 points the counts are estimated from a sample.
pub fn explain(
    points: &[Vec3],
    spacing: f64,
    min_points: usize,
    examined: bool,
    monitor: &dyn Monitor,
) -> BTreeMap<Reason, usize> {
    let mut counts = BTreeMap::new();
    let stride = points.len().div_ceil(SAMPLE.get()).max(1);
    let sample: Vec<Vec3> = points.iter().step_by(stride).copied().collect();
    if sample.len() <= K {
        *counts.entry(Reason::Outlier).or_insert(0) += points.len();
        return counts;
    }
    let (m, n) = (sample.len(), points.len());
    let Ok(scene) = Scene::watched(sample, monitor) else { return counts };
    let mut seen = 0;
    for group in groups(&scene, APART.get() * spacing * (stride as f64).sqrt()) {
        if scene.cancelled() {
            break;
        }
        let reason = match judge(&scene, &group, group.len() * stride, min_points) {
            Reason::NoQuadric if !examined => Reason::NotExamined,
            reason => reason,
        };
        // Shares are cut from one running total, so that they add up to n.
        let (from, to) = (seen * n / m, (seen + group.len()) * n / m);
        seen += group.len();
        *counts.entry(reason).or_insert(0) += to - from;
    }
    counts
}

fn groups(scene: &Scene, reach: f64) -> Vec<Vec<u32>> {
    let mut union = Union::new(scene.len());
    for i in 0..scene.len() {
        for &j in scene.neighbours(i) {
            if (scene.points[i] - scene.points[j as usize]).norm() > reach {
                break;
            }
            union.join(i as u32, j);
        }
    }
    union.sets()
}

fn judge(scene: &Scene, group: &[u32], size: usize, min_points: usize) -> Reason {
    if size < ISOLATED.get() || scene.median_roughness(group.iter().copied()) > VOLUME.get() as f32
    {
        Reason::Outlier
    } else if size < min_points {
        Reason::TooSmall
    } else {
        Reason::NoQuadric
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::segment::Silent;
    use crate::segment::random::SplitMix64;

    fn uniform(random: &mut SplitMix64) -> f64 {
        random.below(1 << 30) as f64 / f64::from(1 << 30)
    }

    /// A square with unit spacing, `side` points wide, around `centre`.
    fn sheet(centre: f64, side: usize) -> Vec<Vec3> {
        let at = |k: usize| centre + k as f64 - side as f64 / 2.0;
        let wave = |i: usize, j: usize| 0.1 * ((i * 7 + j * 3) % 5) as f64;
        (0..side * side)
            .map(|k| Vec3::new(at(k / side), at(k % side), wave(k / side, k % side)))
            .collect()
    }

    #[test]
    fn sheets_patches_and_strays_have_their_own_reasons() {
        let mut points = sheet(0.0, 20);
        points.extend(sheet(100.0, 5));
        points.extend((0..7).map(|k| Vec3::new(300.0 + 50.0 * f64::from(k), 0.0, 9.0)));
        let counts = explain(&points, 1.0, 50, true, &Silent);
        let expected = [(Reason::Outlier, 7), (Reason::TooSmall, 25), (Reason::NoQuadric, 400)];
        assert_eq!(counts, expected.into());
        // Of sheets that were not looked at nobody knows.
        let counts = explain(&points, 1.0, 50, false, &Silent);
        let expected = [(Reason::Outlier, 7), (Reason::TooSmall, 25), (Reason::NotExamined, 400)];
        assert_eq!(counts, expected.into());
    }

    #[test]
    fn points_that_fill_a_volume_are_outliers() {
        let mut random = SplitMix64::new(1);
        let mut u = || 10.0 * uniform(&mut random);
        let points: Vec<Vec3> = (0..1000).map(|_| Vec3::new(u(), u(), u())).collect();
        assert_eq!(explain(&points, 1.0, 50, true, &Silent), [(Reason::Outlier, 1000)].into());
    }

    #[test]
    fn counts_add_up_for_more_points_than_are_looked_at() {
        for n in [SAMPLE.get() + 1, 3 * SAMPLE.get() - 7] {
            let mut random = SplitMix64::new(2);
            let side = (n as f64).sqrt();
            let mut u = || side * uniform(&mut random);
            let points: Vec<Vec3> = (0..n).map(|_| Vec3::new(u(), u(), 0.0)).collect();
            let counts = explain(&points, 1.0, 50, true, &Silent);
            assert_eq!(counts.values().sum::<usize>(), n);
            assert!(counts[&Reason::NoQuadric] > n * 9 / 10, "{counts:?}");
        }
    }

    #[test]
    fn a_handful_of_points_are_outliers_and_none_have_no_reason() {
        assert_eq!(
            explain(&[Vec3::zeros(); 3], 1.0, 50, true, &Silent),
            [(Reason::Outlier, 3)].into()
        );
        assert_eq!(explain(&[], 1.0, 50, true, &Silent).values().sum::<usize>(), 0);
    }
}
