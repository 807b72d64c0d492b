//! Whether points without a surface hold one.

use crate::fit::Family;
use crate::fit::constant::constants;
use crate::geometry::Vec3;
use crate::segment::family::{Families, MOST_RADIUS, Policy};
use crate::segment::grow::search::Search;
use crate::segment::grow::select::select;
use crate::segment::objective::ENOUGH;
use crate::segment::prepare::scene::Scene;
use crate::segment::{Monitor, Parameters};

constants! {
    /// Points looked at.
    LIMIT: usize = 60_000, Effort("points looked at");
    /// Seeds tried on them.
    SEEDS: usize = 64, Effort("seeds tried");
}

/// Points of one run.
const RUN: usize = 4096;

/// Runs of at most `limit` of `n` points, evenly along their order: in each they are as dense as they are.
fn runs(n: usize, limit: usize) -> impl Iterator<Item = std::ops::Range<usize>> {
    let count = if n <= limit { 1 } else { (limit / RUN).max(1) };
    let length = if n <= limit { n } else { limit.min(RUN) };
    (0..count).map(move |k| k * n / count).map(move |from| from..from + length)
}

/// Whether what a model leaves of a cloud holds a surface worth a region.
///
/// # Errors
/// `monitor` cancelled the work.
pub fn holds_surface(
    left: &[Vec3],
    sigma: f64,
    parameters: &Parameters,
    monitor: &dyn Monitor,
) -> Result<bool, crate::segment::SegmentError> {
    let taken = runs(left.len(), LIMIT.get()).flat_map(|run| left[run].iter().copied()).collect();
    let mut scene = Scene::watched(taken, monitor)?;
    scene.sharpen_normals(sigma);
    let extent = scene.points.iter().map(|p| p.norm()).fold(0.0, f64::max);
    let families = Families {
        common: 0.0,
        rougher: false,
        allowed: Family::ALL.to_vec(),
        sigma,
        max_radius: MOST_RADIUS.get() * extent,
        floor: sigma,
        strips: false,
        policy: Policy::of(parameters),
    };
    let trials = &mut (0, 0);
    let search = Search { most: SEEDS.get(), ..Search::new(&scene, &families, parameters.seed) };
    let found = search.run(trials, |_| false, monitor)?;
    // what passes over what is left would take
    let found = found.into_iter().filter(|h| h.sound).collect();
    let chosen = select(&scene, found, sigma, 0, ENOUGH.get()).0;
    monitor.check()?;
    Ok(!chosen.is_empty())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::fits::Random;
    use crate::segment::Silent;
    use crate::segment::fixtures::{SIGMA, ordered};

    #[test]
    fn runs_are_spread_over_all_and_within_them() {
        assert!(runs(100, 1000).eq(std::iter::once(0..100)));
        let some: Vec<_> = runs(100_000, 10_000).collect();
        assert_eq!(some, [0..4096, 50_000..54_096]);
    }

    #[test]
    fn small_bodies_in_a_large_cloud_are_seen() {
        // 70 points each: of one in four of them nothing could be told
        let random = &mut Random::new(4);
        let mut body = |_| {
            let centre = 100.0 * Vec3::new(random.normal(), random.normal(), random.normal());
            let mut at = || {
                let d = Vec3::new(random.normal(), random.normal(), random.normal()).normalize();
                centre + (0.5 + 0.1 * SIGMA * random.normal()) * d
            };
            (0..70).map(|_| at()).collect::<Vec<_>>()
        };
        let points: Vec<Vec3> = (0..2000).flat_map(&mut body).collect();
        let found = holds_surface(&ordered(&points), 0.1 * SIGMA, &Parameters::default(), &Silent);
        assert!(found.unwrap());
    }
}
