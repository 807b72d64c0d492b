//! Every family tried on a few points, and those that come near on more.

use crate::geometry::Vec3;

/// Points that every family is first tried on where all are wanted.
pub const SCREEN: usize = 250;

/// Points that a start is made from where the first family that explains all will do.
pub const START: usize = 160;

/// Points that a start is first fitted to, and the reduced chi2 of these few beyond which a family is out where
/// the first that explains all will do.
pub const GLANCE: usize = 80;

pub const HOPELESS: f64 = 3.0;

/// A family comes near the best where its chi2 is below this many times that one's and this much a point; on the
/// few points of a glance, below twice that.
pub const NEARBY: f64 = 1.5;

pub const SLACK: f64 = 0.4;

/// Difference in chi2 of two fits of one family that are the same, and how many unlike ones are followed up.
pub const SAME: f64 = 0.1;

pub const PROMISING: usize = 2;

/// A gain in BIC that is not worth growing on for.
pub const LITTLE: f64 = 4.0;

/// At most `m` of some values, evenly.
pub fn thinned(all: &[Vec3], m: usize) -> Vec<Vec3> {
    let (n, m) = (all.len(), m.min(all.len()));
    (0..m).map(|k| all[k * n / m]).collect()
}
