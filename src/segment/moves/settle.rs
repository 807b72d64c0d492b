//! Labels and surfaces in turn.

use rayon::prelude::*;

use crate::fit::constant::constants;
use crate::fit::least_squares::{Options, fit};
use crate::fit::{Ruler, Shape};
use crate::geometry::Vec3;
use crate::segment::label::relabel::relabel;
use crate::segment::objective::ACCEPT;
use crate::segment::partition::{Partition, members_of};
use crate::segment::prepare::scene::Scene;
use crate::segment::prepare::take::take_same;

constants! {
    /// Points of a region that a fit looks at.
    SAMPLE: usize = 8000, Effort("points of one fit");
    /// Sweeps of one relabelling.
    SWEEPS: usize = 12, Effort("sweeps of one relabelling");
    /// One label in so many that changes is none: a few points beside borders.
    STILL: usize = 2000, Effort("changes that are not followed up");
    /// Sigmas within which a surface that is fitted anew is the same: hardly a label depends on so little.
    SAME: f64 = 0.02, Effort("changes that are not followed up");
    /// Points that tell whether it is.
    LOOK: usize = 64, Effort("points of one look");
    /// Steps of a fit.
    STEPS: usize = 8, Effort("steps of one fit");
}

/// Relabels and refits until few labels change. What neither labels nor surfaces have changed beside since the last
/// time is not looked at.
pub fn settle(scene: &Scene, model: &mut Partition, sigma: f64, rounds: usize) {
    for _ in 0..rounds {
        if scene.cancelled() {
            return;
        }
        model.note(scene, sigma);
        let open = model.changes.take_open();
        relabel(scene, &model.shapes, &mut model.labels, sigma, SWEEPS.get(), &open);
        let turned = model.note(scene, sigma);
        refit(scene, model, sigma);
        if turned * STILL.get() <= scene.len() {
            break;
        }
    }
    model.note(scene, sigma);
}

/// Fits the surfaces of the regions that have changed.
fn refit(scene: &Scene, model: &mut Partition, sigma: f64) {
    let changed = model.changes.take_changed();
    let groups = members_of(&model.labels, &changed);
    model.shapes.par_iter_mut().zip(&groups).filter(|(_, g)| !g.is_empty()).for_each(|(s, g)| {
        if scene.cancelled() {
            return;
        }
        let points = take_same(scene, g, SAMPLE.get());
        let options =
            Options { cauchy: Some(ACCEPT.get() * sigma), steps: STEPS.get(), tolerance: 1e-6 };
        if let Some(f) = fit(s, &points, None, &options)
            && is_another(s, &f.shape, &points, sigma)
        {
            *s = f.shape;
        }
    });
}

/// Whether two surfaces differ where some points lie.
pub fn is_another(a: &Shape, b: &Shape, points: &[Vec3], sigma: f64) -> bool {
    let [a, b] = [a, b].map(Ruler::of);
    points
        .iter()
        .step_by(points.len().div_ceil(LOOK.get()).max(1))
        .any(|p| (a.distance(p) - b.distance(p)).abs() > SAME.get() * sigma)
}
