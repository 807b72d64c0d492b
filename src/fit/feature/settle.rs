//! Newton's steps to where points hold an extreme feature, and whether they do.

use nalgebra::{DMatrix, DVector};

use super::descend::curvature;
use super::exchange::{Bound, Piece};
use super::pose::{Pose, SLOTS};
use super::rows::Gauge;
use super::ties::{self, MANY, TIE};
use super::zone::{Aim, Contact, Held, Program};
use crate::geometry::Vec3;

/// Newton's steps of one settling, and the longest of them.
const NEWTON: usize = 12;
const FAR: f64 = 0.5;

impl Program<'_> {
    /// The minimum that the points of a basis hold, or all those that are as far out as any.
    pub fn held_by(&self, pose: &Pose, pieces: &[Piece], basis: &[(Bound, f64)]) -> Option<Held> {
        let bound = self.bound(pieces);
        let holders = self.holders(basis, 1e-12);
        self.settled(pose, &holders, bound, false).or_else(|| {
            // Of points at one distance a basis names any, and these may hold less than all do.
            let tied = self.tied(pieces, bound);
            let is_some = (2..=MANY).contains(&tied.len());
            is_some.then(|| self.settled(pose, &tied, bound, false)).flatten().or_else(|| {
                let is_many = tied.len() > holders.len();
                let weak = is_many.then(|| self.holders(basis, f64::NEG_INFINITY))?;
                self.settled(pose, &weak, bound, true)
            })
        })
    }

    /// The points of a basis whose multipliers are above `least`.
    fn holders(&self, basis: &[(Bound, f64)], least: f64) -> Vec<Contact> {
        let piece = |(bound, multiplier): &(Bound, f64)| match *bound {
            Bound::Piece { index, sign } if *multiplier > least => {
                Some(Contact { index, side: sign, multiplier: *multiplier })
            }
            _ => None,
        };
        basis.iter().filter_map(piece).collect()
    }

    /// The points whose functions are as large as the largest, all with the same multiplier.
    fn tied(&self, pieces: &[Piece], bound: f64) -> Vec<Contact> {
        let all = pieces.iter().enumerate().filter(|(_, p)| self.height(p) > bound - TIE);
        let mut tied: Vec<Contact> = all
            .map(|(index, p)| {
                let is_below = self.aim == Aim::Zone && p.value < 0.0;
                Contact { index, side: if is_below { -1.0 } else { 1.0 }, multiplier: 1.0 }
            })
            .collect();
        let share = 1.0 / tied.len() as f64;
        tied.iter_mut().for_each(|contact| contact.multiplier = share);
        tied
    }

    /// The minimum that `holders` hold, if they do; `by_ties`: with points beside them that stop what they do not.
    fn settled(&self, start: &Pose, holders: &[Contact], most: f64, by_ties: bool) -> Option<Held> {
        let mut holders = holders.to_vec();
        // Whoever has to pull is let go, and the rest tried again.
        while !holders.is_empty() {
            let (pose, multipliers, bound) = self.newton(start, &holders)?;
            let weakest =
                (0..holders.len()).min_by(|&a, &b| multipliers[a].total_cmp(&multipliers[b]))?;
            if multipliers[weakest] < -1e-10 {
                holders.remove(weakest);
                continue;
            }
            for (holder, m) in holders.iter_mut().zip(multipliers.iter()) {
                holder.multiplier = m.max(0.0);
            }
            let pieces = self.pieces(&pose);
            let is_least = bound <= most + 1e-13
                && self.bound(&pieces) <= bound + 1e-13 * (1.0 + bound.abs())
                && self.is_minimum(&pose, &holders, by_ties.then_some(&pieces));
            return is_least.then(|| self.held(pose, bound, holders));
        }
        None
    }

    fn held(&self, mut pose: Pose, bound: f64, contacts: Vec<Contact>) -> Held {
        let slopes = self.slopes(&pose, &contacts);
        let mut sum = [0.0; SLOTS];
        for (contact, piece) in contacts.iter().zip(&slopes) {
            for (sum, slope) in sum.iter_mut().zip(&piece.slope) {
                *sum += contact.multiplier * contact.side * slope;
            }
        }
        if self.aim != Aim::Zone {
            pose.size[0] = bound.abs();
        }
        let stationarity = sum.iter().map(|s| s * s).sum::<f64>().sqrt();
        Held { pose, bound, contacts, stationarity }
    }

    fn slopes(&self, pose: &Pose, holders: &[Contact]) -> Vec<Piece> {
        let gauge = Gauge::of(pose);
        let mut out = Vec::with_capacity(holders.len());
        for holder in holders {
            gauge.rows(&self.points[holder.index], |d, row| out.push(self.piece(pose, d, row)));
        }
        out
    }

    /// Second derivatives of the sum of multiplier times function.
    fn hessian(&self, pose: &Pose, holders: &[Contact], multipliers: &[f64]) -> DMatrix<f64> {
        let points: Vec<Vec3> = holders.iter().map(|h| self.points[h.index]).collect();
        let sign = if self.aim == Aim::Inscribed { -1.0 } else { 1.0 };
        let weights: Vec<f64> =
            holders.iter().zip(multipliers).map(|(h, m)| sign * h.side * m).collect();
        let square = curvature(pose, &points, &self.free, &weights);
        let p = self.free.count();
        DMatrix::from_fn(p, p, |a, b| square[a][b])
    }

    /// Newton's steps to where the holders' functions are equal and their gradients balance: pose, multipliers and bound.
    fn newton(&self, start: &Pose, holders: &[Contact]) -> Option<(Pose, Vec<f64>, f64)> {
        let (p, m) = (self.free.count(), holders.len());
        let mut pose = *start;
        let mut multipliers: Vec<f64> = holders.iter().map(|h| h.multiplier).collect();
        let first = self.slopes(&pose, holders);
        let mut bound =
            first.iter().zip(holders).map(|(f, h)| h.side * f.value).sum::<f64>() / m as f64;
        let mut last = f64::INFINITY;
        for _ in 0..NEWTON {
            let pieces = self.slopes(&pose, holders);
            let hessian = self.hessian(&pose, holders, &multipliers);
            let mut a = DMatrix::zeros(p + 1 + m, p + 1 + m);
            let mut b = DVector::zeros(p + 1 + m);
            a.view_mut((0, 0), (p, p)).copy_from(&hessian);
            b[p] = multipliers.iter().sum::<f64>() - 1.0;
            for (i, (piece, holder)) in pieces.iter().zip(holders).enumerate() {
                let row = p + 1 + i;
                for k in 0..p {
                    let slope = holder.side * piece.slope[k];
                    (a[(row, k)], a[(k, row)]) = (slope, slope);
                    b[k] -= multipliers[i] * slope;
                }
                (a[(row, p)], a[(p, row)]) = (-1.0, -1.0);
                b[row] = bound - holder.side * piece.value;
            }
            let x = solved(a, &b)?;
            let mut open = [0.0; SLOTS];
            open[..p].copy_from_slice(&x.as_slice()[..p]);
            let length = open.iter().map(|v| v * v).sum::<f64>().sqrt();
            if length.is_nan() || length >= FAR {
                return None;
            }
            pose = pose.stepped(&self.free.step(&open))?;
            bound += x[p];
            for i in 0..m {
                multipliers[i] += x[p + 1 + i];
            }
            if length < 1e-14 || (length < 1e-11 && length >= 0.5 * last) {
                return Some((pose, multipliers, bound));
            }
            last = length;
        }
        None
    }

    /// Whether no step that leaves the holders' functions as they are to first order lowers them to second, or one of the
    /// other `pieces` stops it.
    fn is_minimum(&self, pose: &Pose, holders: &[Contact], pieces: Option<&[Piece]>) -> bool {
        // One without a multiplier stops steps to its own side alone.
        let least = if pieces.is_some() { 1e-9 } else { f64::NEG_INFINITY };
        let strong: Vec<_> = holders.iter().copied().filter(|h| h.multiplier > least).collect();
        let slopes = self.slopes(pose, &strong);
        let rows = DMatrix::from_fn(strong.len(), self.free.count(), |i, k| {
            strong[i].side * slopes[i].slope[k]
        });
        let Some(open) = ties::open(&rows) else { return true };
        let multipliers: Vec<f64> = strong.iter().map(|h| h.multiplier).collect();
        let inner = open.transpose() * self.hessian(pose, &strong, &multipliers) * &open;
        if inner.symmetric_eigen().eigenvalues.min() > -1e-7 {
            return true;
        }
        let Some(pieces) = pieces else { return false };
        let tied = self.tied(pieces, self.bound(pieces));
        let slope = |h: &Contact| pieces[h.index].slope.map(|v| h.side * v);
        ties::is_stopped(&tied.iter().map(slope).collect::<Vec<_>>(), &open)
    }
}

/// Solution of symmetric equations; of least length where they are singular, as with more holders than it takes.
fn solved(a: DMatrix<f64>, b: &DVector<f64>) -> Option<DVector<f64>> {
    let lu = a.clone().full_piv_lu();
    let diagonal = lu.u().diagonal().map(f64::abs);
    if diagonal.min() > 1e-12 * diagonal.max() {
        return lu.solve(b);
    }
    a.svd(true, true).solve(b, 1e-11).ok()
}
