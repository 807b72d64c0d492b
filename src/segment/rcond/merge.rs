use super::{found::Found, surface::FittedSurface, watched::watched};
use crate::fit::constant::constants;
use crate::geometry::Vec3;
use crate::segment::Monitor;

constants! {
    /// The share of each region's points that must lie on the joint surface. The seed asks for all;
    /// a few leaked over a joint by the extraction must not keep two halves apart.
    ON_JOINT_SURFACE: f64 = 0.95, Trial(0.95, 0.95);
}

/// The seed's merging of over-segmented regions (section 3.2): two regions whose joint surface takes the
/// points of both become one. Pairs are tried until none merges; the earlier region stays.
pub(super) fn merge(found: &mut Found, points: &[Vec3], threshold: f64, monitor: &dyn Monitor) {
    let mut members = found.members(points);
    let mut first = 0;
    while first < found.surfaces.len() && !monitor.cancelled() {
        let partner = (first + 1..found.surfaces.len()).find_map(|second| {
            let pair = [&members[first], &members[second]];
            let surfaces = [&found.surfaces[first], &found.surfaces[second]];
            joint(surfaces, pair, threshold, monitor).map(|surface| (second, surface))
        });
        match partner {
            Some((second, surface)) => {
                found.surfaces[first] = surface;
                found.surfaces.remove(second);
                let moved = members.remove(second);
                members[first].extend(moved);
                found.relabel_merged(first, second);
                found.counters.merges += 1;
            }
            None => first += 1,
        }
    }
}

/// The common surface of two regions, where there is one. Their scatter matrices add, so only pairs
/// that may well belong together cost a pass over their points.
fn joint(
    surfaces: [&FittedSurface; 2],
    points: [&Vec<Vec3>; 2],
    threshold: f64,
    monitor: &dyn Monitor,
) -> Option<FittedSurface> {
    if monitor.cancelled() {
        return None;
    }
    let [a, b] = surfaces;
    let scatter = a.scatter + b.scatter.moved(&b.frame, &a.frame);
    let surface = FittedSurface::from_scatter(&scatter, &a.frame, a.first_two)?;
    let on_it = |points: &Vec<Vec3>| {
        let points_on = watched(points.iter(), monitor);
        let near = points_on.filter_map(|p| surface.residual_within(p, threshold)).count();
        near as f64 >= ON_JOINT_SURFACE.get() * points.len() as f64
    };
    (surface.mean_sq_residual() <= threshold * threshold && points.into_iter().all(on_it))
        .then_some(surface)
}
