use serde::{Deserialize, Serialize};

use crate::fit::MAX_DOF;
use crate::fit::least_squares::Normal;
use crate::geometry::Vec3;
use crate::segment::report::tally::{Scatter, Tally};

/// What is summed over the points of one surface in a tile; sums over tiles add.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Sums {
    /// Its normal equations: J'WJ by rows, J'Wr and the weight.
    jj: [[f64; MAX_DOF]; MAX_DOF],
    jr: [f64; MAX_DOF],
    weight: f64,
    /// Its points, copies counted.
    pub count: usize,
    /// Its distinct points, their sum, the sum of their squared distances and the largest of these; their box, none where there
    /// are none.
    distinct: usize,
    sum: [f64; 3],
    squares: f64,
    largest: f64,
    bounds: Option<[[f64; 3]; 2]>,
    /// Distinct points that lie too far from it.
    pub rejected: usize,
    /// The same, copies counted.
    pub rejected_count: usize,
}

impl Sums {
    pub(super) fn of(normal: &Normal, tally: &Tally) -> Self {
        let (jj, jr, weight) = normal.parts();
        Self {
            jj,
            jr,
            weight,
            count: 0,
            distinct: tally.n,
            sum: tally.sum.into(),
            squares: tally.scatter.sum_sq,
            largest: tally.scatter.max,
            bounds: (tally.n > 0).then(|| [tally.low.into(), tally.high.into()]),
            rejected: 0,
            rejected_count: 0,
        }
    }

    pub(super) fn normal(&self) -> Normal {
        Normal::from_parts(self.jj, self.jr, self.weight)
    }

    pub(super) fn tally(&self) -> Tally {
        let mut tally = Tally {
            n: self.distinct,
            sum: self.sum.into(),
            scatter: Scatter { sum_sq: self.squares, max: self.largest },
            ..Tally::default()
        };
        if let Some([low, high]) = self.bounds {
            (tally.low, tally.high) = (Vec3::from(low), Vec3::from(high));
        }
        tally
    }

    /// Adds the sums over another tile.
    pub fn add(&mut self, other: &Self) {
        let (mut normal, mut tally) = (self.normal(), self.tally());
        normal.merge(&other.normal());
        tally.merge(&other.tally());
        *self = Self {
            count: self.count + other.count,
            rejected: self.rejected + other.rejected,
            rejected_count: self.rejected_count + other.rejected_count,
            ..Self::of(&normal, &tally)
        };
    }
}
