//! Orthogonal-distance least squares by Levenberg and Marquardt.

#![expect(clippy::needless_range_loop, reason = "triangles of small matrices read best by index")]

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

/// Normal equations of one linearisation: lower triangle of J'WJ, J'Wr and the weight. Sums add.
#[derive(Clone, Copy, Debug, Default)]
pub struct Normal {
    jj: [[f64; MAX_DOF]; MAX_DOF],
    jr: [f64; MAX_DOF],
    weight: f64,
}

impl Normal {
    /// Adds one point with a weight.
    #[inline]
    pub fn add(&mut self, shape: &Shape, x: &Vec3, weight: f64) {
        let mut j = [0.0; MAX_DOF];
        let d = shape.distance_jacobian(x, &mut j);
        self.add_row(&j, d, weight, weight, shape.family.dof());
    }

    #[inline]
    fn add_row(&mut self, j: &[f64; MAX_DOF], d: f64, w: f64, given: f64, p: usize) {
        self.weight += given;
        for a in 0..p {
            let wj = w * j[a];
            self.jr[a] += wj * d;
            for b in 0..=a {
                self.jj[a][b] += wj * j[b];
            }
        }
    }

    /// Adds another sum over other points of the same shape.
    pub fn merge(&mut self, other: &Self) {
        for a in 0..MAX_DOF {
            self.jr[a] += other.jr[a];
            for b in 0..=a {
                self.jj[a][b] += other.jj[a][b];
            }
        }
        self.weight += other.weight;
    }

    /// The shape after one Gauss-Newton step; `None` where the points do not determine it or the step
    /// would move the surface by more than `limit` (root mean square over the points).
    pub fn step(&self, shape: &Shape, limit: f64) -> Option<Shape> {
        let p = shape.family.dof();
        let d = solve(&self.jj, &self.jr, p, 0.0)?;
        let moved: f64 = -(0..p).map(|a| d[a] * self.jr[a]).sum::<f64>() / self.weight;
        (moved >= 0.0 && moved.sqrt() < limit).then(|| shape.stepped(&d[..p])).flatten()
    }
}

#[inline]
fn robust_weight(d: f64, cauchy: Option<f64>) -> f64 {
    cauchy.map_or(1.0, |c| 1.0 / (1.0 + (d / c) * (d / c)))
}

fn robust_cost(d: f64, cauchy: Option<f64>) -> f64 {
    cauchy.map_or(d * d, |c| c * c * ((d / c) * (d / c)).ln_1p())
}

fn linearise(shape: &Shape, points: &[Vec3], weights: Option<&[f64]>, o: &Options) -> Normal {
    let p = shape.family.dof();
    let mut n = Normal::default();
    let mut j = [0.0; MAX_DOF];
    for (i, x) in points.iter().enumerate() {
        let given = weights.map_or(1.0, |w| w[i]);
        if given == 0.0 {
            continue;
        }
        let d = shape.distance_jacobian(x, &mut j);
        n.add_row(&j, d, robust_weight(d, o.cauchy) * given, given, p);
    }
    n
}

/// Sum of the robust costs. Cauchy's logarithms are taken of products of many factors at once: one
/// logarithm a point was a quarter of the whole run.
fn cost(shape: &Shape, points: &[Vec3], weights: Option<&[f64]>, o: &Options) -> f64 {
    match (weights, o.cauchy) {
        (None, Some(c)) => {
            let inverse = 1.0 / (c * c);
            let (mut log, mut product) = (0.0, 1.0);
            for x in points {
                let d = shape.distance(x);
                product *= 1.0 + d * d * inverse;
                if product > 1e100 {
                    log += product.ln();
                    product = 1.0;
                }
            }
            c * c * (log + product.ln())
        }
        _ => points
            .iter()
            .enumerate()
            .map(|(i, x)| weights.map_or(1.0, |w| w[i]) * robust_cost(shape.distance(x), o.cauchy))
            .sum(),
    }
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
    let mut least = cost(&shape, points, weights, o);
    let mut step = 0;
    'outer: while step < o.steps {
        loop {
            step += 1;
            let next =
                solve(&normal.jj, &normal.jr, p, damping).and_then(|d| shape.stepped(&d[..p]));
            if let Some(next) = next {
                let c = cost(&next, points, weights, o);
                if c <= least {
                    let gain = (least - c) / least.max(1e-300);
                    least = c;
                    shape = next.recentred(&centroid);
                    damping = (damping * 0.1).max(1e-12);
                    if gain < o.tolerance || step >= o.steps {
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
    let mean_sq = least / normal.weight.max(1e-300);
    mean_sq.is_finite().then_some(Fitted { shape, mean_sq })
}
