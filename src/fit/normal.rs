//! Normal equations of one linearisation, and the step they lead to.

#![expect(clippy::needless_range_loop, reason = "triangles of small matrices read best by index")]

use super::columns::Columns;
use super::retraction::{Moments, retracted};
use super::shape::{MAX_DOF, Shape};
#[cfg(test)]
use crate::geometry::Vec3;

/// Normal equations of one linearisation: lower triangle of J'WJ, J'Wr and the weight. Sums add.
#[derive(Clone, Copy, Debug, Default)]
pub struct Normal {
    pub(super) jj: [[f64; MAX_DOF]; MAX_DOF],
    pub(super) jr: [f64; MAX_DOF],
    pub(super) weight: f64,
}

impl Normal {
    /// The lower triangle of J'WJ, J'Wr and the weight.
    pub fn parts(&self) -> ([[f64; MAX_DOF]; MAX_DOF], [f64; MAX_DOF], f64) {
        (self.jj, self.jr, self.weight)
    }

    /// From those.
    pub fn from_parts(jj: [[f64; MAX_DOF]; MAX_DOF], jr: [f64; MAX_DOF], weight: f64) -> Self {
        Self { jj, jr, weight }
    }

    /// Adds one point with a weight: what `linearise` does for many.
    #[cfg(test)]
    pub(super) fn add(&mut self, shape: &Shape, x: &Vec3, weight: f64) {
        let mut j = [0.0; MAX_DOF];
        let d = shape.distance_jacobian(x, &mut j);
        self.weight += weight;
        for a in 0..shape.family.dof() {
            let wj = weight * j[a];
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
    /// would move the surface by more than `limit` (root mean square over the points). `sample` holds some of
    /// the points.
    pub fn step(&self, shape: &Shape, limit: f64, sample: &Columns) -> Option<Shape> {
        let p = shape.family.dof();
        let d = self.solve(p, 0.0)?;
        let moved: f64 = -(0..p).map(|a| d[a] * self.jr[a]).sum::<f64>() / self.weight;
        if !(moved >= 0.0 && moved.sqrt() < limit) {
            return None;
        }
        let origin = sample.origin();
        let moments = Moments(sample.products());
        let next = retracted(&shape.translated(&-origin), &d[..p], &moments)?;
        Some(next.translated(&origin))
    }

    /// The shape after a step with Levenberg and Marquardt's damping.
    pub(super) fn damped_step(
        &self,
        shape: &Shape,
        damping: f64,
        moments: &Moments,
    ) -> Option<Shape> {
        let p = shape.family.dof();
        self.solve(p, damping).and_then(|d| retracted(shape, &d[..p], moments))
    }

    /// Solves (A + damping diag A) x = -b for the lower triangle of A; `None` where not positive definite.
    fn solve(&self, p: usize, damping: f64) -> Option<[f64; MAX_DOF]> {
        match p {
            3 => self.solve_of::<3>(damping),
            4 => self.solve_of::<4>(damping),
            5 => self.solve_of::<5>(damping),
            6 => self.solve_of::<6>(damping),
            7 => self.solve_of::<7>(damping),
            _ => self.solve_of::<MAX_DOF>(damping),
        }
    }

    /// [`solve`](Self::solve) of `P` unknowns by A = LDL'.
    fn solve_of<const P: usize>(&self, damping: f64) -> Option<[f64; MAX_DOF]> {
        let mut a: [[f64; P]; P] = std::array::from_fn(|i| std::array::from_fn(|j| self.jj[i][j]));
        let mut x: [f64; P] = std::array::from_fn(|i| -self.jr[i]);
        let top = (0..P).map(|i| a[i][i]).fold(0.0, f64::max);
        let mut inverse = [0.0; P];
        for i in 0..P {
            a[i][i] += damping * a[i][i] + 1e-14 * top;
        }
        for k in 0..P {
            let d = a[k][k];
            if d <= 0.0 || !d.is_finite() {
                return None;
            }
            inverse[k] = 1.0 / d;
            for i in k + 1..P {
                let factor = a[i][k] * inverse[k];
                for j in k + 1..=i {
                    a[i][j] -= factor * a[j][k];
                }
                x[i] -= factor * x[k];
            }
        }
        // The columns of the triangle still hold L times D.
        for k in (0..P).rev() {
            let mut s = x[k];
            for i in k + 1..P {
                s -= a[i][k] * x[i];
            }
            x[k] = s * inverse[k];
        }
        let mut out = [0.0; MAX_DOF];
        out[..P].copy_from_slice(&x);
        Some(out)
    }
}
