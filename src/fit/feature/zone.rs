//! Minimum zones, minimum circumscribed and maximum inscribed features.
//!
//! Each is the pose whose largest of smooth functions of the points is least: of the distances' magnitudes, of the distances from centre or
//! axis, of their negatives. Linear programs within a trust region find which points hold it, Newton's steps on the
//! conditions of Karush, Kuhn and Tucker then find the pose to machine accuracy, with second derivatives, as fewer
//! points than unknowns may hold it (R. H. Byrd et al., *An algorithm for nonlinear optimization using linear
//! programming and equality constrained subproblems*, Math. Program. 100 (2004)).

use super::descend::Freedoms;
use super::exchange::{Piece, exchange};
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
    /// Each point's function at a pose.
    pub fn pieces(&self, pose: &Pose) -> Vec<Piece> {
        let gauge = Gauge::of(pose);
        let mut out = Vec::with_capacity(self.points.len());
        for x in self.points {
            gauge.rows(x, |d, row| out.push(self.piece(pose, d, row)));
        }
        out
    }

    /// A point's function, `d` being its distance and `row` the derivatives of that.
    pub fn piece(&self, pose: &Pose, d: f64, row: &[f64; SLOTS]) -> Piece {
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

    /// What is to be least, of one function.
    pub fn height(&self, piece: &Piece) -> f64 {
        if self.aim == Aim::Zone { piece.value.abs() } else { piece.value }
    }

    /// What is to be least, of each point.
    pub fn heights(&self, pose: &Pose) -> Vec<f64> {
        self.pieces(pose).iter().map(|piece| self.height(piece)).collect()
    }

    /// The largest of the functions.
    pub fn bound(&self, pieces: &[Piece]) -> f64 {
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
            if let Some(held) = self.held_by(&pose, &pieces, &found.basis) {
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
}

/// A centre this far from the points, in their size, has left them.
const LOST: f64 = 1e3;

/// The open places of an association.
pub fn places(kind: FeatureType, aim: Aim) -> Freedoms {
    let is_radius = |slot: &usize| *slot == 6 && aim != Aim::Zone;
    Freedoms::of(kind.slots().iter().copied().filter(|slot| !is_radius(slot)))
}
