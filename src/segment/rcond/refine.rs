use rayon::prelude::*;

use super::{found::Found, surface::FittedSurface, watched::watched};
use crate::fit::constant::constants;
use crate::geometry::{Quadric, Vec3};
use crate::segment::{Monitor, Parameters};

/// Points labelled between two looks at whether the work was cancelled; there may be thousands of surfaces.
const WATCHED: usize = 64;
constants! {
    /// After so many rounds labels that still change are taken as they are.
    MAX_ROUNDS: usize = 20, Effort("rounds of labels and fits");
    /// Labels are settled when at most one point in this many changes.
    SETTLED: usize = 1000, Effort("changes that are not followed up");
    /// How far beyond its extracted points, as a share of their extent, a region may gain points.
    REACH: f64 = 0.1, Trial(0.1, 0.1);
}

/// Settles the points that several surfaces accept. Extraction gives them to whichever region came
/// first, so the first region of two that join smoothly reaches over the joint, by far more
/// than the noise: the threshold is some tens of sigma.
///
/// Each point goes to the nearest of the surfaces that accept it (|x.a| <= t), the surfaces are
/// fitted anew, and so on until next to no label changes. Regions left with fewer than `min_points` are
/// dropped and their points settled again.
pub(super) fn refine(
    found: &mut Found,
    points: &[Vec3],
    parameters: &Parameters,
    monitor: &dyn Monitor,
) {
    for _ in 0..MAX_ROUNDS.get() {
        let labels = nearest_surfaces(found, points, parameters.algebraic_threshold, monitor);
        if monitor.cancelled() {
            return;
        }
        let changed = labels.iter().zip(&found.labels).filter(|(new, old)| new != old).count();
        found.labels = labels;
        let dropped = refit(found, points, parameters.min_points, monitor);
        if changed * SETTLED.get() <= points.len() && !dropped {
            break;
        }
    }
}

/// A surface with the box its points may lie in.
struct Reach {
    min: Vec3,
    max: Vec3,
    surface: FittedSurface,
    local: Quadric,
}

impl Reach {
    fn of(surface: &FittedSurface, points: &[Vec3]) -> Self {
        let min = points.iter().copied().reduce(|a, b| a.inf(&b)).unwrap_or_default();
        let max = points.iter().copied().reduce(|a, b| a.sup(&b)).unwrap_or_default();
        let margin = Vec3::repeat(REACH.get() * (max - min).norm());
        let local = surface.frame.local_quadric(&surface.quadric);
        Self { min: min - margin, max: max + margin, surface: *surface, local }
    }

    /// Distance of a point that the surface accepts.
    fn distance(&self, x: &Vec3, threshold: f64) -> Option<f64> {
        let inside = (0..3).all(|k| x[k] >= self.min[k] && x[k] <= self.max[k]);
        (inside && self.surface.residual_within(x, threshold).is_some()).then(|| {
            let frame = &self.surface.frame;
            frame.scale * self.local.distance(&frame.local_from_world(x))
        })
    }
}

fn nearest_surfaces(
    found: &Found,
    points: &[Vec3],
    threshold: f64,
    monitor: &dyn Monitor,
) -> Vec<i32> {
    let members = found.members(points);
    let reaches: Vec<_> =
        found.surfaces.iter().zip(&members).map(|(s, m)| Reach::of(s, m)).collect();
    let nearest = |x: &Vec3| {
        reaches
            .iter()
            .zip(0..)
            .filter_map(|(reach, label)| Some((reach.distance(x, threshold)?, label)))
            .min_by(|a, b| a.0.total_cmp(&b.0))
            .map_or(-1, |(_, label)| label)
    };
    let watched = || monitor.cancelled();
    let labels = points.par_iter().with_max_len(WATCHED);
    labels.map_init(watched, |stop, x| if *stop { -1 } else { nearest(x) }).collect()
}

/// Fits every surface to its points; true where a region was dropped.
fn refit(found: &mut Found, points: &[Vec3], min_points: usize, monitor: &dyn Monitor) -> bool {
    let members = found.members(points);
    let fitted: Vec<_> = found
        .surfaces
        .iter()
        .zip(&members)
        .map(|(surface, members)| {
            let enough = members.len() >= min_points && !monitor.cancelled();
            enough
                .then(|| {
                    let points = watched(members.iter().copied(), monitor);
                    FittedSurface::refined(points, surface.first_two)
                })
                .flatten()
        })
        .collect();
    found.keep(fitted)
}
