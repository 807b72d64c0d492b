//! Minimum zones, minimum circumscribed and maximum inscribed features.
//!
//! Each is the pose whose largest of smooth functions of the points is least: of the distances' magnitudes, of the distances from centre or
//! axis, of their negatives. Linear programs within a trust region find which points hold it, Newton's steps on the
//! conditions of Karush, Kuhn and Tucker then find the pose to machine accuracy, with second derivatives, as fewer
//! points than unknowns may hold it (R. H. Byrd et al., *An algorithm for nonlinear optimization using linear
//! programming and equality constrained subproblems*, Math. Program. 100 (2004)).

use nalgebra::{DMatrix, DVector};

use super::descend::{Freedoms, curvature};
use super::exchange::{Bound, Piece, exchange};
use super::kind::FeatureType;
use super::pose::{Pose, SLOTS};
use super::rows::Gauge;
use crate::geometry::Vec3;

/// What is to be least.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Aim {
    /// The largest magnitude of the distances.
    Zone,
    /// The largest distance from the centre or the axis.
    Circumscribed,
    /// The negative of the smallest distance from the centre or the axis.
    Inscribed,
}

/// A point that holds the feature.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contact {
    /// Its place among the points.
    pub index: usize,
    /// 1 where it is outside or holds from outside, -1 inside.
    pub side: f64,
    /// Its multiplier, >= 0. They sum to 1.
    pub multiplier: f64,
}

/// A feature of the least largest function, and the proof of it.
#[derive(Clone, Debug, PartialEq)]
pub struct Held {
    /// The pose; of circumscribed and inscribed features with their radius.
    pub pose: Pose,
    /// The least bound: half the zone's width, the radius, or its negative.
    pub bound: f64,
    /// The points that hold it.
    pub contacts: Vec<Contact>,
    /// Length of the sum of multiplier times side times derivative of the distance over the contacts: zero where no step lowers the bound
    /// to first order.
    pub stationarity: f64,
}

/// A program over points: the pose's open places and what is to be least.
#[derive(Clone, Copy, Debug)]
pub struct Program<'a> {
    /// The points, of about unit size.
    pub points: &'a [Vec3],
    /// The open places; the radius of circumscribed and inscribed features is none.
    pub free: Freedoms,
    /// What is to be least.
    pub aim: Aim,
}

/// Steps of one search.
const STEPS: usize = 80;

impl Program<'_> {
    fn pieces(&self, pose: &Pose) -> Vec<Piece> {
        let gauge = Gauge::of(pose);
        let mut out = Vec::with_capacity(self.points.len());
        for x in self.points {
            gauge.rows(x, |d, row| out.push(self.piece(pose, d, row)));
        }
        out
    }

    fn piece(&self, pose: &Pose, d: f64, row: &[f64; SLOTS]) -> Piece {
        let (sign, value) = match self.aim {
            Aim::Zone => (1.0, d),
            Aim::Circumscribed => (1.0, d + pose.size[0]),
            Aim::Inscribed => (-1.0, -(d + pose.size[0])),
        };
        let mut slope = [0.0; SLOTS];
        for (k, &slot) in self.free.slots().iter().enumerate() {
            slope[k] = sign * row[slot];
        }
        Piece { value, slope }
    }

    fn height(&self, piece: &Piece) -> f64 {
        if self.aim == Aim::Zone { piece.value.abs() } else { piece.value }
    }

    /// What is to be least, of each point.
    pub fn heights(&self, pose: &Pose) -> Vec<f64> {
        self.pieces(pose).iter().map(|piece| self.height(piece)).collect()
    }

    fn bound(&self, pieces: &[Piece]) -> f64 {
        pieces.iter().map(|p| self.height(p)).fold(f64::NEG_INFINITY, f64::max)
    }

    /// The minimum that a search from `start` leads to; `None` where none is reached, as where the bound falls without end.
    pub fn search(&self, start: &Pose) -> Option<Held> {
        let mut pose = *start;
        let mut pieces = self.pieces(&pose);
        let mut bound = self.bound(&pieces);
        let mut reach = 0.1;
        for _ in 0..STEPS {
            let both = self.aim == Aim::Zone;
            let found = exchange(&pieces, self.free.count(), both, reach)?;
            let holders = self.holders(&found.basis);
            if let Some(held) = self.settled(&pose, &holders, bound) {
                return Some(held);
            }
            let expected = bound - found.bound;
            let next = pose.stepped(&self.free.step(&found.step));
            let next = next.map(|next| (next, self.pieces(&next)));
            let there = next.as_ref().map_or(f64::INFINITY, |n| self.bound(&n.1));
            let length = found.step.iter().fold(0.0_f64, |m, s| m.max(s.abs()));
            if there < bound - 0.1 * expected
                && let Some((next, next_pieces)) = next
            {
                if there < bound - 0.7 * expected && length > 0.99 * reach {
                    reach *= 2.0;
                }
                (pose, pieces, bound) = (next, next_pieces, there);
            } else {
                reach = 0.3 * reach.min(length);
            }
            let is_lost = pose.origin.norm() >= LOST || reach < 1e-15;
            if is_lost {
                return None;
            }
        }
        None
    }

    /// The points of a basis with their multipliers.
    fn holders(&self, basis: &[(Bound, f64)]) -> Vec<Contact> {
        let piece = |(bound, multiplier): &(Bound, f64)| match *bound {
            Bound::Piece { index, sign } if *multiplier > 1e-12 => {
                Some(Contact { index, side: sign, multiplier: *multiplier })
            }
            _ => None,
        };
        basis.iter().filter_map(piece).collect()
    }

    /// The minimum that `holders` hold, if they do.
    fn settled(&self, start: &Pose, holders: &[Contact], most: f64) -> Option<Held> {
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
            let is_least = bound <= most + 1e-13
                && self.bound(&self.pieces(&pose)) <= bound + 1e-13 * (1.0 + bound.abs())
                && self.is_minimum(&pose, &holders);
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

    /// Whether no step that leaves the holders' functions as they are to first order lowers them to second.
    fn is_minimum(&self, pose: &Pose, holders: &[Contact]) -> bool {
        let p = self.free.count();
        let pieces = self.slopes(pose, holders);
        let rows = DMatrix::from_fn(holders.len(), p, |i, k| holders[i].side * pieces[i].slope[k]);
        let e = (rows.transpose() * &rows).symmetric_eigen();
        let top = e.eigenvalues.max();
        let open: Vec<_> = (0..p).filter(|&k| e.eigenvalues[k] < 1e-12 * top).collect();
        if open.is_empty() {
            return true;
        }
        let multipliers: Vec<f64> = holders.iter().map(|h| h.multiplier).collect();
        let basis = DMatrix::from_fn(p, open.len(), |row, k| e.eigenvectors[(row, open[k])]);
        let inner = basis.transpose() * self.hessian(pose, holders, &multipliers) * &basis;
        inner.symmetric_eigen().eigenvalues.min() > -1e-7
    }
}

/// Newton's steps of one settling, and the longest of them.
const NEWTON: usize = 12;
const FAR: f64 = 0.5;
/// A centre this far from the points, in their size, has left them.
const LOST: f64 = 1e3;

/// Solution of symmetric equations; of least length where they are singular, as with more holders than it takes.
fn solved(a: DMatrix<f64>, b: &DVector<f64>) -> Option<DVector<f64>> {
    let lu = a.clone().full_piv_lu();
    let diagonal = lu.u().diagonal().map(f64::abs);
    if diagonal.min() > 1e-12 * diagonal.max() {
        return lu.solve(b);
    }
    a.svd(true, true).solve(b, 1e-11).ok()
}

/// The open places of an association.
pub fn places(kind: FeatureType, aim: Aim) -> Freedoms {
    let is_radius = |slot: &usize| *slot == 6 && aim != Aim::Zone;
    Freedoms::of(kind.slots().iter().copied().filter(|slot| !is_radius(slot)))
}
