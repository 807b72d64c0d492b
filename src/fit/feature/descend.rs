//! Least squares of one feature: Levenberg and Marquardt's steps, then Newton's to machine accuracy.

#![expect(clippy::needless_range_loop, reason = "triangles of small matrices read best by index")]

use super::pose::{Pose, SLOTS};
use super::rows::Gauge;
use super::small::{Square, solve};
use crate::geometry::Vec3;

/// The degrees of freedom that are left open, as places of a step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Freedoms {
    slots: [usize; SLOTS],
    count: usize,
}

impl Freedoms {
    /// Those of `slots`, at most nine.
    pub fn of(slots: impl Iterator<Item = usize>) -> Self {
        let mut out = Self { slots: [0; SLOTS], count: 0 };
        for slot in slots.take(SLOTS) {
            out.slots[out.count] = slot;
            out.count += 1;
        }
        out
    }

    /// The places, in rising order.
    pub fn slots(&self) -> &[usize] {
        &self.slots[..self.count]
    }

    /// How many there are.
    pub fn count(&self) -> usize {
        self.count
    }

    /// A whole step from its open places.
    pub fn step(&self, open: &[f64; SLOTS]) -> [f64; SLOTS] {
        let mut step = [0.0; SLOTS];
        for (k, &slot) in self.slots().iter().enumerate() {
            step[slot] = open[k];
        }
        step
    }
}

/// Sum of the squared distances, its half gradient J'r, and J'J.
#[derive(Clone, Copy, Debug)]
pub struct Normal {
    /// Sum of the squares.
    pub cost: f64,
    /// J'r.
    pub jr: [f64; SLOTS],
    /// J'J, the whole square.
    pub jj: Square,
}

/// The normal equations of `pose` over `points` in the freedoms.
pub fn normal(pose: &Pose, points: &[Vec3], free: &Freedoms) -> Normal {
    match free.count() {
        0..=3 => sums::<3>(pose, points, free),
        4 => sums::<4>(pose, points, free),
        5 => sums::<5>(pose, points, free),
        6 => sums::<6>(pose, points, free),
        7 => sums::<7>(pose, points, free),
        _ => sums::<SLOTS>(pose, points, free),
    }
}

/// [`normal`] of at most `P` freedoms: loops whose length is known are unrolled.
fn sums<const P: usize>(pose: &Pose, points: &[Vec3], free: &Freedoms) -> Normal {
    let gauge = Gauge::of(pose);
    let slots: [usize; P] = std::array::from_fn(|k| free.slots[k]);
    let (mut cost, mut jr, mut jj) = (0.0, [0.0; P], [[0.0; P]; P]);
    for x in points {
        gauge.rows(x, |d, row| {
            let j = slots.map(|slot| row[slot]);
            cost += d * d;
            for a in 0..P {
                jr[a] += j[a] * d;
                for b in 0..=a {
                    jj[a][b] += j[a] * j[b];
                }
            }
        });
    }
    let mut out = Normal { cost, jr: [0.0; SLOTS], jj: [[0.0; SLOTS]; SLOTS] };
    for a in 0..free.count() {
        out.jr[a] = jr[a];
        for b in 0..=a {
            (out.jj[a][b], out.jj[b][a]) = (jj[a][b], jj[a][b]);
        }
    }
    out
}

/// Sum of the squared distances and half its gradient, J'r.
fn gradient(pose: &Pose, points: &[Vec3], free: &Freedoms) -> (f64, [f64; SLOTS]) {
    let gauge = Gauge::of(pose);
    let (mut cost, mut all) = (0.0, [0.0; SLOTS]);
    for x in points {
        gauge.rows(x, |d, row| {
            cost += d * d;
            for k in 0..SLOTS {
                all[k] += row[k] * d;
            }
        });
    }
    let mut open = [0.0; SLOTS];
    for (k, &slot) in free.slots().iter().enumerate() {
        open[k] = all[slot];
    }
    (cost, open)
}

/// What the second derivatives of the distances add to J'J in the Hessian of half the sum of squares:
/// sum `weight`_k d2(d_k), by differences of J alone, so that what rounding spoils of it is small as the weights are.
pub fn curvature(pose: &Pose, points: &[Vec3], free: &Freedoms, weights: &[f64]) -> Square {
    /// The root of the rounding of one: one-sided differences are then right to about as much, which is ample.
    const STEP: f64 = 1e-7;
    let p = free.count();
    let mut out = [[0.0; SLOTS]; SLOTS];
    let sums = |pose: &Pose| {
        let gauge = Gauge::of(pose);
        let mut sum = [0.0; SLOTS];
        let mut weight = weights.iter();
        for x in points {
            gauge.rows(x, |_, row| {
                let w = weight.next().copied().unwrap_or(0.0);
                for k in 0..SLOTS {
                    sum[k] += w * row[k];
                }
            });
        }
        sum
    };
    let here = sums(pose);
    for b in 0..p {
        let mut open = [0.0; SLOTS];
        open[b] = STEP;
        let Some(moved) = pose.stepped(&free.step(&open)) else { return [[0.0; SLOTS]; SLOTS] };
        let there = sums(&moved);
        for (a, &slot) in free.slots().iter().enumerate() {
            out[a][b] = (there[slot] - here[slot]) / STEP;
        }
    }
    // Half the difference from the transpose is a multiple of the gradient, which is zero where it matters.
    for a in 0..p {
        for b in 0..a {
            let mean = 0.5 * (out[a][b] + out[b][a]);
            (out[a][b], out[b][a]) = (mean, mean);
        }
    }
    out
}

/// Signed distances, of curves two a point.
pub fn residuals(pose: &Pose, points: &[Vec3]) -> Vec<f64> {
    let gauge = Gauge::of(pose);
    let mut out = Vec::with_capacity(points.len());
    for x in points {
        gauge.rows(x, |d, _| out.push(d));
    }
    out
}

/// Where a descent came to.
#[derive(Clone, Copy, Debug)]
pub struct Descent {
    /// The pose.
    pub pose: Pose,
    /// Its sum of squares.
    pub cost: f64,
    /// Steps it took.
    pub steps: usize,
    /// Length of the last step, in units of the points' size.
    pub last_step: f64,
}

/// Damping of the first step, and beyond which no step will do.
const DAMPING: (f64, f64) = (1e-9, 1e12);

/// Levenberg and Marquardt's steps from `start` until one lowers the cost by less than the share `gain`, or after `most` of them.
pub fn descend(
    start: &Pose,
    points: &[Vec3],
    free: &Freedoms,
    most: usize,
    gain: f64,
) -> Option<Descent> {
    let centre = centroid(points);
    let mut pose = start.recentred(&centre);
    let mut here = normal(&pose, points, free);
    let mut damping = DAMPING.0;
    let mut last_step = f64::INFINITY;
    for steps in 1..=most {
        let next = solve(&here.jj, &here.jr, free.count(), damping)
            .and_then(|d| Some((d, pose.stepped(&free.step(&d.map(|v| -v)))?)));
        let better = next.and_then(|(d, next)| {
            let next = next.recentred(&centre);
            let there = normal(&next, points, free);
            (there.cost <= here.cost).then_some((d, next, there))
        });
        let Some((d, next, there)) = better else {
            damping = (damping * 10.0).max(1e-6);
            if damping > DAMPING.1 {
                return Some(Descent { pose, cost: here.cost, steps, last_step });
            }
            continue;
        };
        let gained = here.cost - there.cost;
        last_step = d.iter().map(|v| v * v).sum::<f64>().sqrt();
        let is_done = gained <= gain * here.cost || last_step < 1e-12;
        (pose, here) = (next, there);
        damping = (damping * 0.1).max(1e-15);
        if is_done {
            return Some(Descent { pose, cost: here.cost, steps, last_step });
        }
    }
    here.cost.is_finite().then_some(Descent { pose, cost: here.cost, steps: most, last_step })
}

/// Newton's steps from a pose near a minimum until they are as short as rounding: the Hessian of one place serves all of
/// them, while they shrink.
///
/// `None` where the Hessian is not positive: the pose is at no minimum.
pub fn polish(start: &Pose, points: &[Vec3], free: &Freedoms) -> Option<Descent> {
    let centre = centroid(points);
    let mut pose = start.recentred(&centre);
    let (mut steps, mut last) = (0, f64::INFINITY);
    let mut cost = f64::INFINITY;
    for round in 0..HESSIANS {
        let here = normal(&pose, points, free);
        let mut hessian = here.jj;
        // Small residuals hardly bend the sum of squares: it is then cheaper to take a step more.
        if round > 0 {
            let bend = curvature(&pose, points, free, &residuals(&pose, points));
            for a in 0..free.count() {
                for b in 0..free.count() {
                    hessian[a][b] += bend[a][b];
                }
            }
        }
        let (shrinks, rounding) = if round == 0 { (0.03, 1e-13) } else { (0.5, 1e-9) };
        let (mut g, mut reached) = (here.jr, false);
        cost = here.cost;
        for _ in 0..CHORDS {
            let d = solve(&hessian, &g, free.count(), 0.0)
                .or_else(|| solve(&here.jj, &g, free.count(), 0.0))?;
            let length = d.iter().map(|v| v * v).sum::<f64>().sqrt();
            if !length.is_finite() || (length >= shrinks * last && length < rounding) {
                // Rounding alone moves it now.
                reached = true;
                break;
            }
            if length > shrinks * last {
                break;
            }
            pose = pose.stepped(&free.step(&d.map(|v| -v)))?.recentred(&centre);
            (steps, last) = (steps + 1, length);
            if length < 1e-15 {
                reached = true;
                break;
            }
            (cost, g) = gradient(&pose, points, free);
        }
        if reached {
            break;
        }
        last = f64::INFINITY;
    }
    Some(Descent { pose, cost, steps, last_step: last })
}

/// Hessians of one polish, and steps with each: with a fresh one from within Newton's reach, and three or four steps, rounding is reached.
const HESSIANS: usize = 9;
const CHORDS: usize = 12;

fn centroid(points: &[Vec3]) -> Vec3 {
    points.iter().sum::<Vec3>() / points.len().max(1) as f64
}
