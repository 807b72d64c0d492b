//! Orthogonal-distance least squares by Levenberg and Marquardt.

pub use super::columns::Columns;
use super::linearised::{Evaluated, Loss, cost, linearise};
pub use super::normal::Normal;
use super::retraction::Moments;
use super::shape::Shape;
use crate::geometry::Vec3;

/// How a fit weighs residuals and when it stops.
#[derive(Clone, Copy, Debug)]
pub struct Options {
    /// Cauchy weights 1 / (1 + (r/c)2) with this c; plain least squares when absent.
    pub cauchy: Option<f64>,
    /// Largest number of accepted or refused steps.
    pub steps: usize,
    /// Stops when a step lowers the cost by less than this share.
    pub tolerance: f64,
}

/// A fitted shape.
#[derive(Clone, Copy, Debug)]
pub struct Fitted {
    /// The shape.
    pub shape: Shape,
    /// Weighted mean of the squared distances.
    pub mean_sq: f64,
}

/// Fits `start`'s family to `points` by orthogonal distances, from `start`.
///
/// `weights`, where given, holds one non-negative weight a point. Returns the best shape reached;
/// `None` for fewer points than degrees of freedom or a start that is not proper.
pub fn fit(start: &Shape, points: &[Vec3], weights: Option<&[f64]>, o: &Options) -> Option<Fitted> {
    if points.len() <= start.family.dof() {
        return None;
    }
    fit_columns(start, &Columns::of(points, weights), o)
}

/// [`fit`] to points in columns relative to their centroid.
pub fn fit_columns(start: &Shape, points: &Columns, o: &Options) -> Option<Fitted> {
    if points.count <= start.family.dof() || !start.is_proper() || points.total <= 0.0 {
        return None;
    }
    let loss = o.cauchy.map_or(Loss::Squares, |c| Loss::Cauchy(1.0 / (c * c)));
    let (shape, least) = descend(&start.translated(&-points.origin), points, loss, o);
    let mean_sq = least / points.total;
    mean_sq.is_finite().then(|| Fitted { shape: shape.translated(&points.origin), mean_sq })
}

/// Weighed sum of the squared distances.
pub fn squares(shape: &Shape, points: &Columns) -> f64 {
    cost(&shape.translated(&-points.origin), points, Loss::Squares)
}

/// Damping of the first steps: next to none. Shallow caps and short arcs say so much less about some combination of
/// the degrees of freedom than about each that any more would hold it fast.
const LEAST_DAMPING: f64 = 1e-12;
/// Damping once a step has failed, and beyond which no step will do.
const FIRST_DAMPING: f64 = 1e-3;
const MOST_DAMPING: f64 = 1e8;

/// Steps from `start` while the cost falls; the best shape and its cost. The points' centroid is zero.
fn descend(start: &Shape, points: &Columns, loss: Loss, o: &Options) -> (Shape, f64) {
    let mut shape = start.recentred(&Vec3::zeros());
    let mut here = linearise(&shape, points, loss);
    let moments = Moments(points.products());
    let mut damping = LEAST_DAMPING;
    for step in 1..=o.steps {
        let next =
            here.normal.damped_step(&shape, damping, &moments).map(|s| s.recentred(&Vec3::zeros()));
        // Most steps are accepted: cost and linearisation come from one pass, but for the last.
        let there = next.map(|next| {
            if step < o.steps {
                linearise(&next, points, loss)
            } else {
                let cost = cost(&next, points, loss);
                Evaluated { cost, ..here }
            }
        });
        if let (Some(next), Some(there)) = (next, there)
            && there.cost <= here.cost
        {
            let gain = (here.cost - there.cost) / here.cost.max(1e-300);
            (shape, here) = (next, there);
            damping = (damping * 0.1).max(LEAST_DAMPING);
            if gain < o.tolerance {
                break;
            }
        } else {
            damping = (damping * 8.0).max(FIRST_DAMPING);
            if damping > MOST_DAMPING {
                break;
            }
        }
    }
    (shape, here.cost)
}
