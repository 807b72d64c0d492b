//! How far a feature that few points hold may lie from that of the same points without noise.
//!
//! Let no point's noise be beyond c (see [`Noise`]). It moves each of the functions whose largest is least by at most c; so
//! it moves the largest, for every pose, and the least that this can be by at most c: a bound b is known to c. The pose
//! without noise, whose bound is at most b + c, leaves no noisy point beyond b + 2c. All poses that do are, to first order about
//! the one found, a polytope, and the furthest that a parameter goes in it is a linear program.

use super::descend::{Freedoms, normal};
use super::exactness::{Exactness, Parameter};
use super::exchange::{Bound, Piece, exchange_within};
use super::kind::FeatureType;
use super::noise::Noise;
use super::pose::{Pose, SLOTS};
use super::rows::Gauge;
use super::small::{Square, solve};
use super::student::coverage_factor;
use super::terms::{Nature, changes, terms};
use super::zone::{Aim, Held, Program};
use crate::geometry::Vec3;

/// What is known beside the points.
pub struct Known {
    /// How far noise reaches, in the points' unit.
    pub noise: Noise,
    /// Covariance of the places of a step that the association leaves as least squares has them, zero elsewhere.
    pub others: Square,
    /// Standard uncertainty, in the points' unit, of what all points have in common.
    pub type_b: f64,
    /// The coverage.
    pub coverage: f64,
    /// The length of the points' unit.
    pub scale: f64,
}

/// The covariance that `others` of [`Known`] is, of a pose whose association opens the places `free`: that of white noise of
/// deviation `s`.
///
/// Of a circle, whose plane is that of least squares, the places along its normal and the two turns.
pub fn left_to_least_squares(pose: &Pose, points: &[Vec3], free: &Freedoms, s: f64) -> Square {
    let mut out = [[0.0; SLOTS]; SLOTS];
    let is_left = |slot: &usize| *slot < 6 && !free.slots().contains(slot);
    let left = Freedoms::of(pose.kind.slots().iter().copied().filter(is_left));
    let sums = normal(pose, points, &left);
    for (a, &slot) in left.slots().iter().enumerate() {
        let mut unit = [0.0; SLOTS];
        unit[a] = s * s;
        // a singular one was refused before
        let Some(column) = solve(&sums.jj, &unit, left.count(), 0.0) else { continue };
        for (b, &other) in left.slots().iter().enumerate() {
            out[other][slot] = column[b];
        }
    }
    out
}

/// How exactly the extreme feature `held` of local `points` is known: half widths that hold for all of its parameters together with at least the coverage.
pub fn exactness(held: &Held, program: &Program, known: &Known) -> Exactness {
    let Known { noise, scale, .. } = *known;
    let k = coverage_factor(known.coverage, noise.freedom);
    let points = program.points;
    let sq_size = points.iter().map(Vec3::norm_squared).sum::<f64>() / points.len() as f64;
    let mut polytope = Polytope::of(held, program, noise.reach);
    let all = changes(&held.pose);
    let (mut parameters, mut at) = (vec![], 0);
    for term in terms(&held.pose) {
        let from = at;
        at += term.values.len();
        let mut width = |row: usize| {
            if term.nature == Nature::Size && program.aim != Aim::Zone {
                // the radius is the bound itself
                return Some(noise.reach);
            }
            let of = |slot: usize| all[(row, slot)];
            let pairs = (0..SLOTS).flat_map(|a| (0..SLOTS).map(move |b| (a, b)));
            let beside: f64 = pairs.map(|(a, b)| of(a) * of(b) * known.others[a][b]).sum();
            let slopes: Vec<f64> = program.free.slots().iter().map(|&slot| of(slot)).collect();
            Some(polytope.half_width(&slopes)? + k * beside.max(0.0).sqrt())
        };
        let widths: Option<Vec<f64>> = (from..at).map(&mut width).collect();
        let is_length = matches!(term.nature, Nature::Point | Nature::Size);
        let unit = if is_length { scale } else { 1.0 };
        let common = if is_length { known.type_b } else { known.type_b / sq_size.sqrt() };
        let widths = widths.map(|w| match term.nature {
            // of each direction its angle's
            Nature::Direction => {
                w.chunks(3).map(|c| c.iter().map(|v| v * v).sum::<f64>().sqrt()).collect()
            }
            _ => w,
        });
        let is_told = |widths: &Vec<f64>| match term.nature {
            Nature::Point => widths.iter().all(|u| u.is_finite()),
            Nature::Direction => widths.iter().all(|u| *u < 1.0),
            _ => widths.iter().zip(&term.values).all(|(u, v)| *u < v.abs()),
        };
        // A bound that tells nothing is left out: it is one to first order, and the parameter no less known for it.
        let Some(widths) = widths.filter(is_told) else { continue };
        let expanded: Vec<f64> = widths.iter().map(|u| u.hypot(k * common) * unit).collect();
        parameters.push(Parameter {
            name: term.name,
            values: term.values.iter().map(|v| v * unit).collect(),
            standard: expanded.iter().map(|u| u / k).collect(),
            expanded,
        });
    }
    Exactness {
        parameters,
        covariance_of: Vec::new(),
        covariance: Vec::new(),
        s: noise.deviation * scale,
        n_eff: points.len() as f64,
        freedom: noise.freedom,
        k,
    }
}

/// The steps that leave no point further out than noise allows: those with a'x <= 1 for all `rows` a.
struct Polytope {
    rows: Vec<[f64; SLOTS]>,
    p: usize,
    /// Rows that programs begin with: those that held one before.
    chosen: Vec<usize>,
}

impl Polytope {
    fn new(rows: Vec<[f64; SLOTS]>, p: usize) -> Self {
        // odd, as rows may be of two sides in turn
        let stride = rows.len().div_ceil(FIRST) | 1;
        let chosen = (0..rows.len()).step_by(stride).collect();
        Self { rows, p, chosen }
    }

    fn of(held: &Held, program: &Program, reach: f64) -> Self {
        let limit = held.bound + 2.0 * reach;
        let mut rows = Vec::new();
        let mut add = |value: f64, slope: &[f64; SLOTS]| {
            // at a contact it is twice the reach; rounding alone makes it less anywhere
            let room = (limit - value).max(reach);
            rows.push(slope.map(|v| v / room));
        };
        let (p, mut pose) = (program.free.count(), held.pose);
        match pose.kind {
            FeatureType::Line => {
                in_tube(&pose, program, &mut add);
                return Self::new(rows, p);
            }
            // its zone is between cylinders
            FeatureType::Circle => pose.kind = FeatureType::Cylinder,
            _ => {}
        }
        for piece in program.pieces(&pose) {
            add(piece.value, &piece.slope);
            if program.aim == Aim::Zone {
                add(-piece.value, &piece.slope.map(|v| -v));
            }
        }
        Self::new(rows, p)
    }

    /// The furthest that g'x goes either way, infinite where it goes on without end; `None` where rounding brings it to no end.
    fn half_width(&mut self, g: &[f64]) -> Option<f64> {
        let pivot = (0..self.p).max_by(|&a, &b| g[a].abs().total_cmp(&g[b].abs()))?;
        let size = g[pivot].abs();
        if size < 1e-14 {
            return Some(0.0);
        }
        let g: Vec<f64> = g.iter().map(|v| v / size).collect();
        let there = self.furthest(&g, pivot, 1.0)?;
        Some(size * there.max(self.furthest(&g, pivot, -1.0)?))
    }

    /// The largest `side` times g'x: one over the least that the largest of a'x can be where that is 1, which takes the unknown
    /// `pivot` out. Few of many rows hold it: it is looked for among some, to which come those that stand out.
    fn furthest(&mut self, g: &[f64], pivot: usize, side: f64) -> Option<f64> {
        let scale = self.rows.iter().flatten().fold(0.0_f64, |m, v| m.max(v.abs()));
        let others: Vec<usize> = (0..self.p).filter(|&j| j != pivot).collect();
        let piece = |a: &[f64; SLOTS]| {
            let by = a[pivot] / g[pivot] / scale;
            let mut slope = [0.0; SLOTS];
            for (place, &j) in others.iter().enumerate() {
                slope[place] = a[j] / scale - by * g[j];
            }
            Piece { value: side * by, slope }
        };
        // a round adds rows that were not there, so there are no more rounds than rows
        for _ in 0..=self.rows.len() {
            let some: Vec<Piece> = self.chosen.iter().map(|&i| piece(&self.rows[i])).collect();
            let (bound, x, is_held) = self.least(&some, g, pivot, side)?;
            let most = scale * (bound + 2.0 * SLACK * (1.0 + bound.abs()));
            let height = |a: &[f64; SLOTS]| (0..self.p).map(|k| a[k] * x[k]).sum::<f64>();
            let heights = self.rows.iter().map(height).enumerate();
            let mut over: Vec<(usize, f64)> = heights.filter(|(_, h)| *h > most).collect();
            if over.is_empty() {
                let is_free = !is_held || bound <= 0.0;
                return Some(if is_free { f64::INFINITY } else { 1.0 / (bound * scale) });
            }
            over.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
            self.chosen.extend(over.iter().take(FURTHER).map(|o| o.0));
            self.chosen.sort_unstable();
            self.chosen.dedup();
        }
        None
    }

    /// The least that the largest of `pieces` can be, where, and whether they hold it there.
    fn least(
        &self,
        pieces: &[Piece],
        g: &[f64],
        pivot: usize,
        side: f64,
    ) -> Option<(f64, [f64; SLOTS], bool)> {
        let (mut x, mut is_held) = ([0.0; SLOTS], true);
        let mut bound = pieces.iter().map(|piece| piece.value).fold(f64::NEG_INFINITY, f64::max);
        if self.p > 1 {
            let found = exchange_within(pieces, self.p - 1, false, FAR, SLACK)?;
            let holds = |(bound, multiplier): &(Bound, f64)| {
                *multiplier < 1e-12 || matches!(bound, Bound::Piece { .. })
            };
            is_held = found.basis.iter().all(holds);
            let others = (0..self.p).filter(|&j| j != pivot);
            others.zip(found.step).for_each(|(j, step)| x[j] = step);
            bound = found.bound;
        }
        let rest: f64 = (0..self.p).map(|j| g[j] * x[j]).sum();
        x[pivot] = (side - rest) / g[pivot];
        Some((bound, x, is_held))
    }
}

/// Sides of a polygon about the tube of a line: at its corners it is wider than the tube by 8 %.
const SIDES: usize = 8;

/// The distances of points from a line by each side of a polygon, and their derivatives: near the axis a point's distance bends too much
/// for its own.
fn in_tube(pose: &Pose, program: &Program, add: &mut impl FnMut(f64, &[f64; SLOTS])) {
    let gauge = Gauge::of(pose);
    for x in program.points {
        let (mut values, mut slopes, mut row) = ([0.0; 2], [[0.0; SLOTS]; 2], 0);
        gauge.rows(x, |d, slope| {
            values[row] = d;
            for (k, &slot) in program.free.slots().iter().enumerate() {
                slopes[row][k] = slope[slot];
            }
            row += 1;
        });
        for side in 0..SIDES {
            let (sin, cos) = (std::f64::consts::TAU * side as f64 / SIDES as f64).sin_cos();
            let slope = std::array::from_fn(|k| cos * slopes[0][k] + sin * slopes[1][k]);
            add(cos * values[0] + sin * values[1], &slope);
        }
    }
}

/// Unknowns go this far, in units of what they are solved for, before a parameter counts as free.
const FAR: f64 = 1e4;
/// How exactly a half width is asked for; what it is of is a bound.
const SLACK: f64 = 1e-7;
/// Rows that the first program begins with, and how many of those that lie beyond it are added in one round.
const FIRST: usize = 60;
const FURTHER: usize = 20;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::fits::Random;

    #[test]
    fn the_furthest_place_of_a_box_and_of_a_random_polytope_is_found() {
        let unit = |k: usize, v: f64| std::array::from_fn(|j| if j == k { v } else { 0.0 });
        let rows = vec![unit(0, 0.5), unit(0, -0.5), unit(1, 2.0), unit(1, -2.0)];
        let mut both = Polytope::new(rows, 2);
        assert!((both.half_width(&[3.0, 1.0]).unwrap() - 6.5).abs() < 1e-9);
        let rows = vec![unit(1, 2.0), unit(1, -2.0)];
        assert_eq!(Polytope::new(rows, 2).half_width(&[1.0, 0.0]), Some(f64::INFINITY));
        let mut random = Random::new(4);
        for p in 1..7 {
            let rows: Vec<[f64; SLOTS]> =
                (0..300).map(|_| std::array::from_fn(|_| random.normal())).collect();
            let g: Vec<f64> = (0..p).map(|_| random.normal()).collect();
            let mut polytope = Polytope::new(rows, p);
            let width = polytope.half_width(&g).unwrap();
            let mut best = 0.0_f64;
            for _ in 0..20_000 {
                let x: Vec<f64> = (0..p).map(|_| random.normal()).collect();
                let dot = |a: &[f64]| a.iter().zip(&x).map(|(a, x)| a * x).sum::<f64>();
                let top = polytope.rows.iter().map(|a| dot(&a[..p])).fold(0.0, f64::max);
                best = best.max(dot(&g).abs() / top);
            }
            assert!(best <= width * (1.0 + 1e-9), "{p}: {best} {width}");
            assert!(best > 0.5 * width, "{p}: {best} {width}");
        }
    }
}
