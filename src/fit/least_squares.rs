//! Orthogonal-distance least squares by Levenberg and Marquardt.

pub use super::columns::Columns;
use super::constant::constants;
use super::linearised::{Evaluated, cost, linearise};
use super::loss::Loss;
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

/// [`fit`] to points without weights that is of use only where the squared distances, those of outliers not counted as
/// more than four of its sigmas, add up to at most `most`: it ends once its steps hardly lead there. What it then
/// returns is no worse than the start.
pub fn fit_below(start: &Shape, points: &[Vec3], o: &Options, most: f64) -> Option<Fitted> {
    if points.len() <= start.family.dof() {
        return None;
    }
    fit_columns_below(start, &Columns::of(points, None), o, most)
}

/// [`fit`] to points in columns relative to their centroid.
pub fn fit_columns(start: &Shape, points: &Columns, o: &Options) -> Option<Fitted> {
    fit_columns_below(start, points, o, f64::INFINITY)
}

fn fit_columns_below(start: &Shape, points: &Columns, o: &Options, most: f64) -> Option<Fitted> {
    if points.count <= start.family.dof() || !start.is_proper() || points.total <= 0.0 {
        return None;
    }
    let start = start.translated(&-points.origin);
    let near = o.cauchy.map_or(Approach::Near, |cut| approach(&start, points, cut));
    let (shape, least) = match near {
        Approach::Near => descend(&start, points, o, most),
        Approach::Nearer(shape) => descend(&shape, points, o, most),
        Approach::Far(shape, least) => (shape, least),
    };
    let mean_sq = least / points.total;
    mean_sq.is_finite().then(|| Fitted { shape: shape.translated(&points.origin), mean_sq })
}

/// Weighed sum of the squared distances.
pub fn squares(shape: &Shape, points: &Columns) -> f64 {
    cost(&shape.translated(&-points.origin), points, Loss::Squares)
}

/// Damping of the first steps: next to none. Shallow caps and short arcs say so much less about some combination of
/// the degrees of freedom than about each that any more would hold it fast.
pub(super) const LEAST_DAMPING: f64 = 1e-12;
/// Damping once a step has failed, and beyond which no step will do.
pub(super) const FIRST_DAMPING: f64 = 1e-3;
pub(super) const MOST_DAMPING: f64 = 1e8;

/// Cauchy's loss with this constant.
fn cauchy(cut: f64) -> Loss {
    Loss::Cauchy(1.0 / (cut * cut))
}

constants! {
    /// Residuals this many times Cauchy's constant say nothing about where their surface is.
    FAR: f64 = 10.0, Trial(10.0, 10.0);
    /// Factor by which the constant falls at least from one fit to the next.
    NARROWER: f64 = 0.25, Effort("fits on the way");
    /// Steps of each fit on the way.
    APPROACH: usize = 8, Effort("steps of one fit");
    /// Steps in a row after which a fit whose gains do not lead to what is wanted gives up.
    VAIN: usize = 2, Effort("steps of one fit");
    /// Residuals this many times Cauchy's constant are more than noise.
    BEYOND: f64 = 0.5, Trial(0.5, 0.5);
}

/// Where a fit goes on from.
enum Approach {
    /// The start: it is near, or nothing nearer was found.
    Near,
    /// A shape nearer to the points.
    Nearer(Shape),
    /// Nowhere: the shape that comes nearest to the points is far from most of them; with its cost.
    Far(Shape, f64),
}

/// A shape nearer to the points than a start far from them, by fits with a constant as wide as their residuals.
///
/// To Cauchy's loss residuals far beyond its constant are all outliers: it is least where the surface runs through a
/// few of the points, whichever they are, and holds a fit there. Where residuals do not get smaller with the constant
/// the points are none of such a surface's.
fn approach(start: &Shape, points: &Columns, cut: f64) -> Approach {
    let before = cost(start, points, cauchy(cut));
    let mut wide = cut * typical(before / points.total, cut);
    if wide < FAR.get() * cut {
        return Approach::Near;
    }
    let mut shape = *start;
    while wide > cut && wide.is_finite() {
        let options = Options { cauchy: Some(wide), steps: APPROACH.get(), tolerance: 0.1 };
        let (next, left) = descend(&shape, points, &options, f64::INFINITY);
        shape = next;
        let residual = typical(left / points.total, wide);
        if residual > FAR.get() {
            return Approach::Far(shape, cost(&shape, points, cauchy(cut)));
        }
        wide *= residual.min(NARROWER.get());
    }
    let nearer = cost(&shape, points, cauchy(cut)) < before;
    if nearer { Approach::Nearer(shape) } else { Approach::Near }
}

/// The residuals whose mean loss this is, over Cauchy's constant: their geometric mean where they are beyond it,
/// their root mean square within it.
fn typical(mean_loss: f64, cut: f64) -> f64 {
    (mean_loss / (cut * cut)).exp_m1().sqrt()
}

/// Damping below which it no longer holds a step back.
const FREE: f64 = 1e-9;

/// Steps from `start` while the cost falls; the best shape and its cost. The points' centroid is zero.
///
/// Where the last steps' gains, were all that are left like them, would leave more than `most` of the truncated squares,
/// it gives up.
fn descend(start: &Shape, points: &Columns, o: &Options, most: f64) -> (Shape, f64) {
    let loss = o.cauchy.map_or(Loss::Squares, cauchy);
    // Small steps far from the points are those of a valley that damping makes long.
    let far = |cost: f64| o.cauchy.is_some_and(|c| typical(cost / points.total, c) > BEYOND.get());
    let mut shape = start.recentred(&Vec3::zeros());
    let mut here = linearise(&shape, points, loss);
    let moments = Moments(points.products());
    let mut damping = LEAST_DAMPING;
    let mut vain = 0;
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
                if damping < FREE || !far(here.cost) {
                    break;
                }
                damping *= 1e-3;
            }
            let left = here.truncated * (1.0 - gain).powi((o.steps - step) as i32);
            vain = if left > most { vain + 1 } else { 0 };
            if vain == VAIN.get() {
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

#[cfg(test)]
mod tests {
    use super::super::fits::Random;
    use super::super::shape::Family;
    use super::*;

    #[test]
    fn a_fit_that_leads_nowhere_near_what_is_wanted_gives_up_and_others_are_the_same() {
        let mut random = Random::new(9);
        let sigma = 0.01;
        let shape = Shape::with_axis(Family::Cylinder, Vec3::zeros(), Vec3::z(), [5.0, 0.0, 0.0]);
        let start = Shape { size: [4.0, 0.0, 0.0], origin: Vec3::new(0.4, 0.0, 0.0), ..shape };
        let mut points = |bend: f64| -> Vec<Vec3> {
            let at = |_| {
                let (t, z) = (random.uniform(-1.0, 1.0), random.uniform(-3.0, 3.0));
                let r = 5.0 + bend * z * z + sigma * random.normal();
                Vec3::new(r * t.cos(), r * t.sin(), z)
            };
            (0..60).map(at).collect()
        };
        let options = Options { cauchy: Some(2.5 * sigma), steps: 14, tolerance: 1e-3 };
        let most = 2.0 * 55.0 * sigma * sigma;
        let (good, bad) = (points(0.0), points(0.05));
        let whole = fit(&start, &good, None, &options).unwrap();
        assert_eq!(fit_below(&start, &good, &options, most).unwrap().shape, whole.shape);
        let steps = |steps: usize| fit(&start, &bad, None, &Options { steps, ..options }).unwrap();
        let given_up = fit_below(&start, &bad, &options, most).unwrap();
        assert!(given_up.mean_sq <= steps(2).mean_sq && given_up.mean_sq > steps(14).mean_sq);
    }
}
