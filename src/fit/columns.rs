//! Points in columns: vector units take several at once.

use std::ops::Range;

use crate::geometry::{Mat3, Vec3};

/// Columns are filled up to a multiple of this many points; sums are kept in as many parts, so that they
/// come out the same whatever the width of the machine's vector units.
pub const LANES: usize = 8;

/// Points relative to an origin, coordinate by coordinate, each with a weight that is not negative.
///
/// Once all points are in, [`Self::fill_up`] makes the columns as long as the next multiple of [`LANES`], with
/// copies of the last point of weight 0.
#[derive(Clone, Debug, Default)]
pub struct Columns {
    pub(super) x: Vec<f64>,
    pub(super) y: Vec<f64>,
    pub(super) z: Vec<f64>,
    pub(super) weight: Vec<f64>,
    /// What the coordinates are relative to.
    pub(super) origin: Vec3,
    /// Number of points, without those that fill up.
    pub(super) count: usize,
    /// Sum of the weights.
    pub(super) total: f64,
    /// Whether any point's weight is not 1.
    pub(super) uneven: bool,
}

impl Columns {
    /// `points` relative to their centroid, with their weights or, without any, 1 each.
    pub fn of(points: &[Vec3], weights: Option<&[f64]>) -> Self {
        let mut out = Self::default();
        out.extend(points, 1.0);
        if let Some(w) = weights {
            out.weight.copy_from_slice(w);
            out.total = w.iter().sum();
            out.uneven = true;
        }
        out.fill_up();
        out.centre();
        out
    }

    /// What the coordinates are relative to: after [`Self::centre`] the points' mean.
    pub fn origin(&self) -> Vec3 {
        self.origin
    }

    /// Sum of the weights.
    pub fn total(&self) -> f64 {
        self.total
    }

    /// At most about `limit` of the points, evenly, those of little weight left out.
    pub fn thinned(&self, limit: usize) -> Vec<Vec3> {
        let stride = self.count.div_ceil(limit).max(1);
        let whole = (0..self.count).step_by(stride).filter(|&i| self.weight[i] > 0.5);
        whole.map(|i| self.origin + Vec3::new(self.x[i], self.y[i], self.z[i])).collect()
    }

    /// Takes all points out; the columns' memory is used again.
    pub fn clear(&mut self) {
        for column in [&mut self.x, &mut self.y, &mut self.z, &mut self.weight] {
            column.clear();
        }
        (self.origin, self.count, self.total, self.uneven) = (Vec3::zeros(), 0, 0.0, false);
    }

    /// Room for so many more points.
    pub fn reserve(&mut self, points: usize) {
        for column in [&mut self.x, &mut self.y, &mut self.z, &mut self.weight] {
            column.reserve(points + LANES);
        }
    }

    /// Adds points, each with this weight.
    pub fn extend(&mut self, points: &[Vec3], weight: f64) {
        self.reserve(points.len());
        for (k, column) in [&mut self.x, &mut self.y, &mut self.z].into_iter().enumerate() {
            column.extend(points.iter().map(|p| p[k]));
        }
        self.weigh(weight);
    }

    /// Adds every `stride`-th point of a range, each with this weight.
    pub fn extend_thinned(
        &mut self,
        points: &[Vec3],
        range: Range<usize>,
        stride: usize,
        weight: f64,
    ) {
        for i in range.step_by(stride) {
            self.x.push(points[i].x);
            self.y.push(points[i].y);
            self.z.push(points[i].z);
        }
        self.weigh(weight);
    }

    /// Gives the points that were just added their weight.
    fn weigh(&mut self, weight: f64) {
        let added = self.x.len() - self.weight.len();
        self.weight.resize(self.x.len(), weight);
        self.count += added;
        self.total += weight * added as f64;
        self.uneven |= weight != 1.0;
    }

    /// Fills the columns up to whole lanes.
    pub fn fill_up(&mut self) {
        let room = self.x.len().next_multiple_of(LANES);
        for column in [&mut self.x, &mut self.y, &mut self.z] {
            column.resize(room, column.last().copied().unwrap_or(0.0));
        }
        self.weight.resize(room, 0.0);
    }

    /// Weighed mean products of the coordinates.
    pub fn products(&self) -> Mat3 {
        let mean = |a: &[f64], b: &[f64]| {
            let mut parts = [0.0; LANES];
            let lanes = a.chunks_exact(LANES).zip(b.chunks_exact(LANES));
            for ((a, b), w) in lanes.zip(self.weight.chunks_exact(LANES)) {
                for k in 0..LANES {
                    parts[k] += w[k] * a[k] * b[k];
                }
            }
            parts.iter().sum::<f64>() / self.total
        };
        let Self { x, y, z, .. } = self;
        let (xy, yz, xz) = (mean(x, y), mean(y, z), mean(x, z));
        Mat3::new(mean(x, x), xy, xz, xy, mean(y, y), yz, xz, yz, mean(z, z))
    }

    /// Moves the origin to the points' weighed mean.
    pub fn centre(&mut self) {
        let weight = &self.weight;
        let move_one = |column: &mut [f64]| {
            let sum: f64 = column.iter().zip(weight).map(|(x, w)| x * w).sum();
            let mean = sum / self.total;
            column.iter_mut().for_each(|x| *x -= mean);
            mean
        };
        let [x, y, z] = [&mut self.x, &mut self.y, &mut self.z].map(|c| move_one(c));
        self.origin += Vec3::new(x, y, z);
    }
}
