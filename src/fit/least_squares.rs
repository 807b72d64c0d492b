//! Orthogonal-distance least squares by Levenberg and Marquardt.

use super::shape::{MAX_DOF, Shape};
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

/// Normal equations of one linearisation: lower triangle of J'WJ, J'Wr, cost and weight.
struct Normal {
    jj: [[f64; MAX_DOF]; MAX_DOF],
    jr: [f64; MAX_DOF],
    cost: f64,
    weight: f64,
}

#[inline]
fn robust(d: f64, cauchy: Option<f64>) -> (f64, f64) {
    match cauchy {
        None => (1.0, d * d),
        Some(c) => {
            let t = (d / c) * (d / c);
            (1.0 / (1.0 + t), c * c * t.ln_1p())
        }
    }
}

fn linearise(shape: &Shape, points: &[Vec3], weights: Option<&[f64]>, o: &Options) -> Normal {
    let p = shape.family.dof();
    let mut n =
        Normal { jj: [[0.0; MAX_DOF]; MAX_DOF], jr: [0.0; MAX_DOF], cost: 0.0, weight: 0.0 };
    let mut j = [0.0; MAX_DOF];
    for (i, x) in points.iter().enumerate() {
        let given = weights.map_or(1.0, |w| w[i]);
        if given == 0.0 {
            continue;
        }
        let d = shape.distance_jacobian(x, &mut j);
        let (w, rho) = robust(d, o.cauchy);
        let w = w * given;
        n.cost += given * rho;
        n.weight += given;
        for a in 0..p {
            let wj = w * j[a];
            n.jr[a] += wj * d;
            for b in 0..=a {
                n.jj[a][b] += wj * j[b];
            }
        }
    }
    n
}

fn cost(shape: &Shape, points: &[Vec3], weights: Option<&[f64]>, o: &Options) -> f64 {
    points
        .iter()
        .enumerate()
        .map(|(i, x)| weights.map_or(1.0, |w| w[i]) * robust(shape.distance(x), o.cauchy).1)
        .sum()
}

/// Solves (A + damping diag A) x = -b for the lower triangle of A by Cholesky; `None` where not
/// positive definite.
fn solve(
    a: &[[f64; MAX_DOF]; MAX_DOF],
    b: &[f64; MAX_DOF],
    p: usize,
    damping: f64,
) -> Option<[f64; MAX_DOF]> {
    let mut l = [[0.0; MAX_DOF]; MAX_DOF];
    let top = (0..p).map(|i| a[i][i]).fold(0.0, f64::max);
    for i in 0..p {
        for j in 0..=i {
            let mut s = a[i][j];
            if i == j {
                s += damping * a[i][i] + 1e-14 * top;
            }
            for k in 0..j {
                s -= l[i][k] * l[j][k];
            }
            if i == j {
                if s <= 0.0 || !s.is_finite() {
                    return None;
                }
                l[i][i] = s.sqrt();
            } else {
                l[i][j] = s / l[j][j];
            }
        }
    }
    let mut x = [0.0; MAX_DOF];
    for i in 0..p {
        let s: f64 = (0..i).map(|k| l[i][k] * x[k]).sum();
        x[i] = (-b[i] - s) / l[i][i];
    }
    for i in (0..p).rev() {
        let s: f64 = (i + 1..p).map(|k| l[k][i] * x[k]).sum();
        x[i] = (x[i] - s) / l[i][i];
    }
    Some(x)
}

/// Fits `start`'s family to `points` by orthogonal distances, from `start`.
///
/// `weights`, where given, holds one non-negative weight a point. Returns the best shape reached;
/// `None` for fewer points than degrees of freedom or a start that is not proper.
pub fn fit(start: &Shape, points: &[Vec3], weights: Option<&[f64]>, o: &Options) -> Option<Fitted> {
    let p = start.family.dof();
    if points.len() <= p || !start.is_proper() {
        return None;
    }
    let total = weights.map_or(points.len() as f64, |w| w.iter().sum());
    if total <= 0.0 {
        return None;
    }
    let centroid = points
        .iter()
        .enumerate()
        .fold(Vec3::zeros(), |s, (i, x)| s + x * weights.map_or(1.0, |w| w[i]))
        / total;
    let mut shape = start.recentred(&centroid);
    let mut damping = 1e-3;
    let mut normal = linearise(&shape, points, weights, o);
    let mut step = 0;
    'outer: while step < o.steps {
        loop {
            step += 1;
            let next =
                solve(&normal.jj, &normal.jr, p, damping).and_then(|d| shape.stepped(&d[..p]));
            if let Some(next) = next {
                let c = cost(&next, points, weights, o);
                if c <= normal.cost {
                    let gain = (normal.cost - c) / normal.cost.max(1e-300);
                    shape = next.recentred(&centroid);
                    damping = (damping * 0.1).max(1e-12);
                    if gain < o.tolerance || step >= o.steps {
                        normal.cost = c;
                        break 'outer;
                    }
                    normal = linearise(&shape, points, weights, o);
                    continue 'outer;
                }
            }
            damping *= 8.0;
            if damping > 1e8 || step >= o.steps {
                break 'outer;
            }
        }
    }
    let mean_sq = normal.cost / normal.weight.max(1e-300);
    mean_sq.is_finite().then_some(Fitted { shape, mean_sq })
}

/// Covariance of the degrees of freedom, sigma2 (J'WJ)^-1, in the order of
/// [`Shape::distance_jacobian`]. `None` where the points do not determine them all.
pub fn covariance(shape: &Shape, points: &[Vec3], sigma: f64) -> Option<nalgebra::DMatrix<f64>> {
    let p = shape.family.dof();
    let n = linearise(shape, points, None, &Options { cauchy: None, steps: 0, tolerance: 0.0 });
    let full = nalgebra::DMatrix::from_fn(p, p, |a, b| n.jj[a.max(b)][a.min(b)]);
    let inverse = full.cholesky()?.inverse();
    inverse.iter().all(|v| v.is_finite()).then(|| inverse * (sigma * sigma))
}
