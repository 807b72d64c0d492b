//! Which stretches of the joints' curves are edges.
//!
//! Corners part each curve into stretches. Points of both regions beside each other speak for a stretch, their absence
//! against it; and every face is bounded by closed lines, so an even number of its edges meets in each corner. Stretches too
//! short for the points to tell are decided by that.

use super::corner::Cut;
use super::joint::Joint;
use super::part::Part;
use crate::fit::constant::constants;
use crate::geometry::Vec3;

constants! {
    /// Stretches shorter than this many spacings are hardly told by points.
    SHORT: f64 = 2.0, Trial(2.0, 2.0);
    /// A free end lies where points stop, if they go on for this many spacings.
    TAIL: f64 = 3.0, Trial(3.0, 3.0);
    /// Spacings on either side of a stretch within which a region's points tell whether it goes on.
    BESIDE: f64 = 2.0, Trial(2.0, 2.0);
    /// It does where the fewer are more than this share of the others.
    BOTH: f64 = 0.4, Trial(0.4, 0.4);
    /// So many points tell it.
    LEAST: f64 = 10.0, Trial(10.0, 10.0);
}

/// A stretch of a joint's curve.
#[derive(Clone, Copy, Debug)]
pub struct Arc {
    /// The joint.
    pub joint: usize,
    /// Where it begins and ends along the curve; the end of one that goes over a closed curve's first point is larger than
    /// its length.
    pub span: [f64; 2],
    /// The corners at its ends.
    pub corners: [usize; 2],
    /// What speaks for it, in spacings; negative where more speaks against it.
    pub score: f64,
    /// Whether it is an edge.
    pub on: bool,
    /// Which of the two regions it bounds; the other goes on beyond, as a plate may under a boss.
    pub bounds: [bool; 2],
}

impl Arc {
    /// The regions that it bounds.
    pub fn bounded<'a>(&'a self, joints: &'a [Joint]) -> impl Iterator<Item = usize> + 'a {
        joints[self.joint].pair.into_iter().zip(self.bounds).filter(|b| b.1).map(|b| b.0)
    }
}

/// All stretches with their scores, and how many corners there are now: free ends are further ones.
pub fn arcs(part: &Part, joints: &[Joint], cuts: &[Vec<Cut>], places: &mut Vec<Vec3>) -> Vec<Arc> {
    let mut out = Vec::new();
    for (k, (joint, cuts)) in joints.iter().zip(cuts).enumerate() {
        let total = joint.curve.length();
        let mut free = |at: f64| {
            places.push(joint.curve.at(at));
            places.len() - 1
        };
        let mut add = |span: [f64; 2], corners: [usize; 2]| {
            let (score, bounds) = score(part, joint, span);
            out.push(Arc { joint: k, span, corners, score, on: score > 0.0, bounds });
        };
        match (joint.curve.closed, cuts.first(), cuts.last()) {
            (true, None, _) => {
                let corner = free(0.0);
                add([0.0, total], [corner; 2]);
            }
            (true, Some(first), Some(last)) => {
                cuts.windows(2).for_each(|c| add([c[0].at, c[1].at], [c[0].corner, c[1].corner]));
                add([last.at, first.at + total], [last.corner, first.corner]);
            }
            (false, Some(first), Some(last)) => {
                cuts.windows(2).for_each(|c| add([c[0].at, c[1].at], [c[0].corner, c[1].corner]));
                if let Some(end) = tail(part, joint, first.at, -1.0) {
                    let corner = free(end);
                    add([end, first.at], [corner, first.corner]);
                }
                if let Some(end) = tail(part, joint, last.at, 1.0) {
                    let corner = free(end);
                    add([last.at, end], [last.corner, corner]);
                }
            }
            _ => {
                let (Some(&from), Some(&to)) = (joint.votes.first(), joint.votes.last()) else {
                    continue;
                };
                if to - from > 2.0 * TAIL.get() * part.usual {
                    let (from, to) =
                        (last_point(part, joint, from, -1.0), last_point(part, joint, to, 1.0));
                    let ends = [free(from), free(to)];
                    add([from, to], ends);
                }
            }
        }
    }
    out
}

/// Where the votes beyond an open curve's outermost cut end, if they go far.
fn tail(part: &Part, joint: &Joint, from: f64, sign: f64) -> Option<f64> {
    let beyond = joint.votes.iter().filter(|t| (*t - from) * sign > 0.0);
    let end = beyond.map(|t| t * sign).fold(f64::NEG_INFINITY, f64::max) * sign;
    let length = (end - from) * sign;
    let least = TAIL.get() * part.usual + part.smooth.get(&joint.pair).copied().unwrap_or(0.0);
    let goes_on = length.is_finite()
        && length > least
        && score(part, joint, [from.min(end), from.max(end)]).0 > 0.0;
    goes_on.then(|| last_point(part, joint, end, sign))
}

/// How far points of either region beside a curve go on from its last vote: those of both together end half a spacing short.
fn last_point(part: &Part, joint: &Joint, end: f64, sign: f64) -> f64 {
    let x = joint.curve.at(end);
    let along = joint.curve.tangent(end) * sign;
    let radius = 2.0 * part.usual;
    let (mut furthest, mut count) = (0.0f64, 0.0);
    part.near.within(&x, radius, |_, p, l| {
        let on = (p - x).dot(&along);
        if joint.pair.contains(&(l as usize)) && (p - x - along * on).norm() < part.usual {
            furthest = furthest.max(on);
            count += 1.0;
        }
        true
    });
    // Points that come one by one leave their mean distance beyond the last.
    if count > 0.0 {
        furthest += (radius + furthest) / count;
    }
    (end + sign * furthest).clamp(0.0, joint.curve.length())
}

/// Spacings along a stretch with neighbouring points of both regions, less those without; and which regions it bounds.
fn score(part: &Part, joint: &Joint, span: [f64; 2]) -> (f64, [bool; 2]) {
    let length = span[1] - span[0];
    let spacing = part.spacing[joint.pair[0]].max(part.spacing[joint.pair[1]]).max(part.usual);
    let bins = ((length / spacing).floor() as usize).clamp(1, 10_000);
    let mut hit = vec![false; bins];
    let total = joint.curve.length();
    for &t in &joint.votes {
        for t in [t, t + total] {
            let at = (t - span[0]) / length;
            if (0.0..1.0).contains(&at) {
                hit[(at * bins as f64) as usize] = true;
            }
            if !joint.curve.closed {
                break;
            }
        }
    }
    let hits = hit.iter().filter(|h| **h).count() as f64;
    let score = hits - 1.5 * (bins as f64 - hits);
    let sure = (length / (SHORT.get() * spacing)).min(1.0);
    let bounds = joint.pair.map(|r| joint.smooth || !goes_on(part, joint, span, r));
    match bounds {
        [false, false] => (-score.abs() * sure, [true; 2]),
        _ => (score * sure, bounds),
    }
}

/// Whether a region's points lie on both sides of a stretch alike: then it goes on beyond, and is not bounded there.
fn goes_on(part: &Part, joint: &Joint, span: [f64; 2], region: usize) -> bool {
    let Some(sheet) = part.sheets[region].as_ref() else { return false };
    let radius = BESIDE.get() * part.spacing[region];
    let places = ((span[1] - span[0]) / radius).ceil().clamp(3.0, 40.0) as usize;
    let step = (span[1] - span[0]) / places as f64;
    let mut sides = [0.0f64; 2];
    for k in 0..places {
        let t = span[0] + (span[1] - span[0]) * (k as f64 + 0.5) / places as f64;
        let (x, along) = (joint.curve.at(t), joint.curve.tangent(t));
        let left = sheet.normal(&x).cross(&along);
        part.near.within(&x, radius, |_, p, l| {
            let off = (p - x).dot(&left);
            // Beside this stretch, and not on the edge itself, where noise decides.
            let beside = (p - x).dot(&along).abs() < 0.5 * step;
            if l as usize == region && beside && off.abs() > 3.0 * part.noise {
                sides[usize::from(off > 0.0)] += 1.0;
            }
            true
        });
    }
    sides[0].min(sides[1]) > BOTH.get() * sides[0].max(sides[1])
        && sides[0] + sides[1] > LEAST.get()
}
