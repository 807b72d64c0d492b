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
    let m = left.len().min(LIMIT.get());
    let taken = (0..m).map(|k| left[k * left.len() / m]).collect();
    let mut scene = Scene::watched(taken, monitor)?;
    scene.sharpen_normals(sigma);
    let extent = scene.points.iter().map(|p| p.norm()).fold(0.0, f64::max);
    let families = Families {
        common: 0.0,
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
