//! Sums over the points of each region.

use rayon::prelude::*;

use crate::fit::{Ruler, Shape};
use crate::geometry::Vec3;
use crate::segment::prepare::place::place;
use crate::segment::{Extent, Fit, Monitor};

/// Points worked on at once; fixed, so that the result does not depend on the number of threads.
pub const CHUNK: usize = 4096;

/// Sums over the points of one region.
pub struct Tally {
    pub n: usize,
    pub sum: Vec3,
    pub low: Vec3,
    pub high: Vec3,
    pub scatter: Scatter,
}

impl Default for Tally {
    fn default() -> Self {
        let (low, high) = (Vec3::repeat(f64::INFINITY), Vec3::repeat(f64::NEG_INFINITY));
        Self { n: 0, sum: Vec3::zeros(), low, high, scatter: Scatter::default() }
    }
}

impl Tally {
    pub fn add(&mut self, points: &[Vec3], ruler: &Ruler) {
        self.n += points.len();
        for p in points {
            self.sum += p;
            self.low = self.low.inf(p);
            self.high = self.high.sup(p);
        }
        ruler.for_each(points, |d| self.scatter.add(d));
    }

    pub fn merge(&mut self, other: &Self) {
        self.n += other.n;
        self.sum += other.sum;
        self.low = self.low.inf(&other.low);
        self.high = self.high.sup(&other.high);
        self.scatter.merge(&other.scatter);
    }

    pub fn extent(&self, centre: &Vec3) -> Option<Extent> {
        let corner = |p: Vec3| (p + centre).into();
        (self.n > 0).then(|| Extent { min: corner(self.low), max: corner(self.high) })
    }
}

/// Sums over the points of every region, in one pass.
pub fn tallies(
    points: &[Vec3],
    labels: &[i32],
    shapes: &[Shape],
    monitor: &dyn Monitor,
) -> Vec<Tally> {
    let rulers: Vec<Ruler> = shapes.iter().map(Ruler::of).collect();
    let parts: Vec<Vec<(usize, Tally)>> = labels
        .par_chunks(CHUNK)
        .zip(points.par_chunks(CHUNK))
        .map(|(labels, points)| {
            let mut sums: Vec<(usize, Tally)> = Vec::new();
            if monitor.cancelled() {
                return sums;
            }
            let mut from = 0;
            for run in labels.chunk_by(|a, b| a == b) {
                let own = &points[from..from + run.len()];
                from += run.len();
                let Ok(l) = usize::try_from(run[0]) else { continue };
                // Labels beyond these are of quadrics that have no shape here.
                let Some(ruler) = rulers.get(l) else { continue };
                let k = sums.iter().position(|s| s.0 == l).unwrap_or(sums.len());
                if k == sums.len() {
                    sums.push((l, Tally::default()));
                }
                sums[k].1.add(own, ruler);
            }
            sums
        })
        .collect();
    let mut out: Vec<Tally> = shapes.iter().map(|_| Tally::default()).collect();
    for (l, tally) in parts.into_iter().flatten() {
        out[l].merge(&tally);
    }
    out
}

/// At most `limit` of a region's points, evenly.
pub fn sample(points: &[Vec3], members: &[u32], limit: usize) -> Vec<Vec3> {
    let m = members.len().min(limit);
    (0..m).map(|k| points[members[place(k, m, members.len())] as usize]).collect()
}

/// Sums over distances.
#[derive(Default)]
pub struct Scatter {
    pub sum_sq: f64,
    pub max: f64,
}

impl Scatter {
    pub fn add(&mut self, d: f64) {
        self.sum_sq += d * d;
        self.max = self.max.max(d.abs());
    }

    pub fn merge(&mut self, other: &Self) {
        self.sum_sq += other.sum_sq;
        self.max = self.max.max(other.max);
    }

    pub fn fit(&self, used: usize, rejected: usize) -> Fit {
        let rms = (self.sum_sq / used.max(1) as f64).sqrt();
        Fit { rms, noise: rms, max: self.max, used, rejected }
    }
}

pub fn extent_of(points: &[Vec3], centre: &Vec3) -> Option<Extent> {
    let min = points.iter().copied().reduce(|a, b| a.inf(&b))? + centre;
    let max = points.iter().copied().reduce(|a, b| a.sup(&b))? + centre;
    Some(Extent { min: min.into(), max: max.into() })
}
