//! What the distances of a feature's points have in common.
//!
//! Noise that neighbours share shakes each parameter in its own way: a radius is a mean over all points, a direction a
//! difference of ends. So it is J'CJ that is told, J the derivatives of the distances by the open places and C their correlations, not
//! one factor for all.

use nalgebra::DMatrix;

use super::descend::Freedoms;
use super::noise::Foot;
use super::pose::{Pose, SLOTS};
use super::rows::Gauge;
use super::small::Square;
use crate::fit::Spread;
use crate::fit::blocks::blocks_of;
use crate::geometry::Vec3;

/// What the distances have in common: of a curve those along each of its two normals for themselves.
pub struct Together {
    rows: Vec<Spread>,
}

impl Together {
    /// That of `points` about a pose with J'J `jj` of its open places; `deviation` is that of a distance.
    pub fn of(pose: &Pose, points: &[Vec3], free: &Freedoms, jj: &Square, deviation: f64) -> Self {
        let feet: Vec<Foot> = points.iter().map(|x| Foot::of(pose, x)).collect();
        let gauge = Gauge::of(pose);
        let count = pose.kind.rows();
        let of_row = |row: usize| {
            let slope = |at: &Vec3| slope(&gauge, at, free, row);
            let information = if count == 1 { *jj } else { information(&feet, free, slope) };
            let p = free.count();
            let information = DMatrix::from_fn(p, p, |a, b| information[a][b]);
            let of_row = feet.iter().map(|foot| (foot.at, foot.distances[row])).collect();
            Spread::with(information, blocks_of(of_row, slope), deviation)
        };
        Self { rows: (0..count).map(of_row).collect() }
    }

    /// J'CJ.
    pub fn shaken(&self) -> DMatrix<f64> {
        let mut rows = self.rows.iter().map(Spread::shaken);
        let first = rows.next().unwrap_or_default();
        rows.fold(first, |sum, row| sum + row)
    }

    /// How many times more than independent distances do these shake a sum of them, weighed by `change` at their places; the
    /// distances are along the first normal.
    pub fn along(&self, deviation: f64, change: impl Fn(&Vec3) -> f64) -> f64 {
        self.rows.first().map_or(1.0, |row| row.inflation_along(deviation, 1.0, change))
    }
}

/// Derivatives of one of the distances of `x` by the open places.
pub fn slope(gauge: &Gauge, x: &Vec3, free: &Freedoms, row: usize) -> [f64; SLOTS] {
    let (mut out, mut at) = ([0.0; SLOTS], 0);
    gauge.rows(x, |_, slopes| {
        if at == row {
            for (a, &slot) in free.slots().iter().enumerate() {
                out[a] = slopes[slot];
            }
        }
        at += 1;
    });
    out
}

fn information(feet: &[Foot], free: &Freedoms, slope: impl Fn(&Vec3) -> [f64; SLOTS]) -> Square {
    let mut out = [[0.0; SLOTS]; SLOTS];
    for foot in feet {
        let j = slope(&foot.at);
        for (a, b) in (0..free.count()).flat_map(|a| (0..free.count()).map(move |b| (a, b))) {
            out[a][b] += j[a] * j[b];
        }
    }
    out
}
