use super::pair::{LANES, Lanes, Pair, measure};
use crate::geometry::{Quadric, Vec3};

/// Sums over points.
#[derive(Default)]
pub(super) struct Tally {
    n: usize,
    /// Of the local gradient.
    sum_sq: f64,
    /// Points at which the local equation tells a distance.
    measured: usize,
    /// Largest difference between the two distances; infinite where the far one is none.
    error: f64,
}

impl Tally {
    /// Over `points`.
    pub(super) fn of(pair: &Pair, points: impl Iterator<Item = Vec3>) -> Self {
        let mut tally = Self::default();
        let none = [0.0; LANES];
        let mut lanes = Lanes { points: [none; 3], distance: none, off: none, sq_slope: none };
        let mut points = points.peekable();
        while points.peek().is_some() {
            let mut n = 0;
            for p in points.by_ref().take(LANES) {
                lanes.points.iter_mut().zip(p.iter()).for_each(|(lane, x)| lane[n] = *x);
                n += 1;
            }
            measure(pair, &mut lanes);
            tally.add(&lanes, n);
        }
        tally
    }

    /// Adds the first `n` of the points measured.
    fn add(&mut self, lanes: &Lanes, n: usize) {
        self.n += n;
        self.sum_sq += lanes.sq_slope[..n].iter().sum::<f64>();
        for (distance, off) in lanes.distance[..n].iter().zip(&lanes.off) {
            // At an apex, or on a plane that is counted twice, there is no first order.
            if distance.is_finite() {
                self.measured += 1;
                self.error = self.error.max(if off.is_finite() { *off } else { f64::INFINITY });
            }
        }
    }

    /// Adds the sums over other points.
    pub(super) fn merge(&mut self, other: &Self) {
        self.n += other.n;
        self.sum_sq += other.sum_sq;
        self.measured += other.measured;
        self.error = self.error.max(other.error);
    }

    /// The largest difference between the two distances; `None` where there is none, or no end to it.
    pub(super) fn error(&self) -> Option<f64> {
        (self.measured > 0 && self.error.is_finite()).then_some(self.error)
    }

    /// The coefficients of `local` by such a factor that the root mean square of its gradient is one; of unit
    /// length where the gradient vanishes at all points.
    pub(super) fn of_unit_slope(&self, local: &Quadric) -> [f64; 10] {
        let slope = (self.sum_sq / self.n.max(1) as f64).sqrt();
        let norm = local.0.iter().map(|a| a * a).sum::<f64>().sqrt();
        let factor = [slope, norm].into_iter().find(|f| f.is_normal()).unwrap_or(1.0);
        // As nought has no sign, none is written.
        local.0.map(|a| a / factor + 0.0)
    }
}
