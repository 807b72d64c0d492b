//! The curves along which regions meet, told by points of both that lie beside each other.

use rayon::prelude::*;

use super::curve::{Curve, LEAST_SINE, meet};
use super::part::Part;
use super::sheet::Sheet;
use super::smooth::across;
use crate::fit::constant::constants;
use crate::geometry::Vec3;

constants! {
    /// Points of two regions within this many spacings are neighbours.
    NEIGHBOURS: f64 = 2.5, Trial(2.5, 2.5);
    /// Neighbouring pairs of two regions that are looked at, at most.
    MOST_PAIRS: usize = 2000, Effort("work of the boundary representation");
    /// The sine of the angle between two surfaces below which they may run into each other smoothly: 6 degrees.
    SMOOTH_SINE: f64 = 0.1, Trial(0.1, 0.1);
    /// Pairs that tell a curve, at least.
    LEAST_PAIRS: usize = 2, Effort("work of the boundary representation");
    /// A curve goes on this many times as far from the points as the joint does: to the corner in which it ends.
    pub LONGER: f64 = 2.0, Trial(2.0, 2.0);
    /// A closed curve shorter than this many spacings is where surfaces graze each other.
    DOT: f64 = 4.0, Trial(4.0, 4.0);
    /// Step along a curve in spacings.
    STEP: f64 = 1.0, Trial(1.0, 1.0);
}

/// A curve along which two regions may meet.
pub struct Joint {
    /// The regions, the smaller first.
    pub pair: [usize; 2],
    /// The curve, somewhat longer than the joint.
    pub curve: Curve,
    /// Places, by length along it, at which points of both lie beside each other.
    pub votes: Vec<f64>,
    /// Whether the surfaces run into each other smoothly.
    pub smooth: bool,
}

/// Middles between neighbouring points of two regions, by the regions.
fn borders(part: &Part) -> Vec<([usize; 2], Vec<Vec3>)> {
    let radius = NEIGHBOURS.get() * part.usual;
    let found = part.near.entries().par_iter().with_min_len(1024).flat_map_iter(|(p, label)| {
        let mut nearest: Vec<(u32, f64, Vec3)> = Vec::new();
        part.near.within(p, radius, |sq, q, l| {
            if l != *label {
                match nearest.iter_mut().find(|n| n.0 == l) {
                    Some(n) if n.1 > sq => (n.1, n.2) = (sq, *q),
                    Some(_) => {}
                    None => nearest.push((l, sq, *q)),
                }
            }
            true
        });
        let own = *label;
        nearest
            .into_iter()
            .map(move |(l, _, q)| ([own.min(l) as usize, own.max(l) as usize], (p + q) / 2.0))
    });
    let mut all: Vec<([usize; 2], Vec3)> = found.collect();
    all.sort_by_key(|a| a.0);
    let group = |run: &[([usize; 2], Vec3)]| {
        let stride = run.len().div_ceil(MOST_PAIRS.get()).max(1);
        (run[0].0, run.iter().step_by(stride).map(|r| r.1).collect())
    };
    all.chunk_by(|a, b| a.0 == b.0).map(group).collect()
}

/// All curves along which regions may meet.
pub fn joints(part: &Part) -> Vec<Joint> {
    borders(part)
        .into_par_iter()
        .flat_map_iter(|(pair, middles)| of_pair(part, pair, &middles))
        .collect()
}

fn of_pair(part: &Part, pair: [usize; 2], middles: &[Vec3]) -> Vec<Joint> {
    let [Some(a), Some(b)] = pair.map(|r| part.sheets[r].as_ref()) else { return Vec::new() };
    let reach = part.reach(pair);
    let mut left: Vec<Vec3> = middles.to_vec();
    let mut out = Vec::new();
    let mut tries = 0;
    while left.len() >= LEAST_PAIRS.get() && tries < 200 {
        tries += 1;
        let seed = left[left.len() / 2];
        let Some((sheets, start, smooth)) = meeting(part, pair, a, b, &seed, reach) else {
            left.swap_remove(left.len() / 2);
            continue;
        };
        let beside =
            |x: &Vec3| pair.iter().all(|&r| part.near.has(x, LONGER.get() * reach, r as u32));
        let step = STEP.get() * part.usual.max(1e-12);
        let Some(curve) = Curve::through(&sheets[0], &sheets[1], start, step, beside) else {
            left.swap_remove(left.len() / 2);
            continue;
        };
        let near = |x: &Vec3| {
            let (t, off) = curve.locate(x);
            (off <= reach).then_some(t)
        };
        let before = left.len();
        let (mut votes, mut rest) = (Vec::new(), Vec::new());
        for x in left {
            match near(&x) {
                Some(t) if smooth || touch(part, pair, &curve.at(t), reach) => votes.push(t),
                Some(_) => {}
                None => rest.push(x),
            }
        }
        left = rest;
        let told = before - left.len();
        if told == 0 {
            let middle = left.len() / 2;
            left.swap_remove(middle);
        }
        let is_dot = curve.closed && curve.length() < DOT.get() * part.usual;
        if told >= LEAST_PAIRS.get() && !is_dot {
            votes.sort_by(f64::total_cmp);
            out.push(Joint { pair, curve, votes, smooth });
        }
    }
    out
}

/// Whether points of both regions are nearer to a place than any of a third: over a narrow chamfer its neighbours' points are
/// beside each other, and its own between them.
fn touch(part: &Part, pair: [usize; 2], x: &Vec3, reach: f64) -> bool {
    let mut nearest = [f64::INFINITY; 3];
    part.near.within(x, reach, |sq, _, l| {
        let k = pair.iter().position(|r| *r == l as usize).unwrap_or(2);
        nearest[k] = nearest[k].min(sq);
        true
    });
    nearest[2] >= nearest[0].max(nearest[1])
}

/// The two sheets whose intersection is the joint next to `seed`, a place on it, and whether the surfaces touch there.
fn meeting(
    part: &Part,
    pair: [usize; 2],
    a: &Sheet,
    b: &Sheet,
    seed: &Vec3,
    reach: f64,
) -> Option<([Sheet; 2], Vec3, bool)> {
    let told = part.smooth.contains_key(&pair);
    let sine = |x: &Vec3| a.normal(x).cross(&b.normal(x)).norm();
    let crossing = meet(a, b, seed).filter(|x| (x - seed).norm() <= reach);
    let sharp = crossing
        .filter(|x| sine(x) > if told { 2.0 * SMOOTH_SINE.get() } else { SMOOTH_SINE.get() });
    if let Some(x) = sharp {
        return Some(([*a, *b], x, false));
    }
    let touching = across(a, b, seed).and_then(|[f, g]| {
        let x = meet(&f, &g, seed).filter(|x| (x - seed).norm() <= reach)?;
        // How far the surfaces miss each other there: their noise, or what a spacing's step makes of the angle.
        let gap = a.value(&x).abs().max(b.value(&x).abs());
        let most = (6.0 * part.noise).max(0.1 * part.usual);
        (gap <= most && sine(&x) < SMOOTH_SINE.get()).then_some(([f, g], x, true))
    });
    touching.or_else(|| {
        crossing.filter(|x| sine(x) > 2.0 * LEAST_SINE.get()).map(|x| ([*a, *b], x, false))
    })
}

/// The joint of two regions through two places, and where these are along its curve.
pub fn through(part: &Part, pair: [usize; 2], ends: [Vec3; 2]) -> Option<(Joint, [f64; 2])> {
    let [a, b] = [part.sheets[pair[0]].as_ref()?, part.sheets[pair[1]].as_ref()?];
    let length = (ends[1] - ends[0]).norm();
    let middle = (ends[0] + ends[1]) / 2.0;
    let (sheets, start, smooth) = meeting(part, pair, a, b, &middle, length + part.usual)?;
    let around = |x: &Vec3| (x - middle).norm() < length + part.usual;
    let curve = Curve::through(&sheets[0], &sheets[1], start, 0.2 * length.max(1e-12), around)?;
    let at = ends.map(|x| curve.locate(&x));
    let near = 0.5 * part.usual;
    if at.iter().any(|a| a.1 > near) || curve.closed {
        return None;
    }
    Some((Joint { pair, curve, votes: Vec::new(), smooth }, at.map(|a| a.0)))
}
