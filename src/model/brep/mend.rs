//! Edges too short to have points beside them: two corners in which the same two regions lack an edge are its ends.

use std::collections::BTreeMap;

use super::arc::Arc;
use super::joint::{Joint, through};
use super::part::Part;
use crate::fit::constant::constants;
use crate::geometry::Vec3;

constants! {
    /// An edge that no points tell is at most this many spacings long.
    LONGEST: f64 = 16.0, Trial(16.0, 16.0);
    /// Two corners nearer than this many spacings at which the same lines end are one: four surfaces meet there in two corners by
    /// the error of their fits.
    ONE: f64 = 1.5, Trial(1.5, 1.5);
}

/// The regions that lack an edge in a corner.
type Open = BTreeMap<usize, Vec<usize>>;

/// Closes lines around two regions at once: by stretches without points, by joining corners, by edges that no points told.
/// `odd` are the corners, each with a region, at which a line is open. Returns those that still are.
pub fn mend(
    part: &Part,
    joints: &mut Vec<Joint>,
    arcs: &mut Vec<Arc>,
    places: &mut [Vec3],
    odd: Vec<(usize, usize)>,
) -> Vec<(usize, usize)> {
    let mut open = Open::new();
    for (c, r) in odd {
        open.entry(c).or_default().push(r);
    }
    join(part, arcs, &mut open, places);
    switch_on(joints, arcs, &mut open);
    connect(part, joints, arcs, &mut open, places);
    open.into_iter().flat_map(|(c, rs)| rs.into_iter().map(move |r| (c, r))).collect()
}

/// Pairs of open corners at most so far apart, the nearest first.
fn near_pairs(open: &Open, places: &[Vec3], most: f64) -> Vec<(f64, [usize; 2])> {
    let corners: Vec<usize> = open.keys().copied().filter(|c| !open[c].is_empty()).collect();
    let mut pairs = Vec::new();
    for (k, &a) in corners.iter().enumerate() {
        for &b in &corners[k + 1..] {
            let length = (places[a] - places[b]).norm();
            if length <= most {
                pairs.push((length, [a, b]));
            }
        }
    }
    pairs.sort_by(|a, b| a.0.total_cmp(&b.0));
    pairs
}

/// Makes one of two corners beside each other that lack edges of the same regions.
fn join(part: &Part, arcs: &mut [Arc], open: &mut Open, places: &mut [Vec3]) {
    for (_, [a, b]) in near_pairs(open, places, ONE.get() * part.usual) {
        if open[&a].is_empty() || open[&a] != open[&b] {
            continue;
        }
        for arc in arcs.iter_mut() {
            arc.corners.iter_mut().filter(|c| **c == b).for_each(|c| *c = a);
            // What lay between them is no edge.
            arc.on &= arc.corners != [a, a];
        }
        places[a] = (places[a] + places[b]) / 2.0;
        open.insert(a, Vec::new());
        open.insert(b, Vec::new());
    }
}

/// Adds edges between corners in which the same two regions lack one.
fn connect(
    part: &Part,
    joints: &mut Vec<Joint>,
    arcs: &mut Vec<Arc>,
    open: &mut Open,
    places: &[Vec3],
) {
    for (_, ends) in near_pairs(open, places, LONGEST.get() * part.usual) {
        let common: Vec<usize> =
            open[&ends[0]].iter().filter(|r| open[&ends[1]].contains(r)).copied().collect();
        let pairs = common
            .iter()
            .enumerate()
            .flat_map(|(i, &r)| common[i + 1..].iter().map(move |&s| [r, s]));
        for pair in pairs {
            let pair = [pair[0].min(pair[1]), pair[0].max(pair[1])];
            if !ends.iter().all(|c| pair.iter().all(|r| open[c].contains(r))) {
                continue;
            }
            let Some((joint, span)) = through(part, pair, ends.map(|c| places[c])) else {
                continue;
            };
            joints.push(joint);
            let turned = span[0] > span[1];
            let (corners, span) =
                if turned { ([ends[1], ends[0]], [span[1], span[0]]) } else { (ends, span) };
            let joint = joints.len() - 1;
            arcs.push(Arc { joint, span, corners, score: 0.0, on: true, bounds: [true; 2] });
            for c in ends {
                open.entry(c).or_default().retain(|r| !pair.contains(r));
            }
        }
    }
}

/// Switches on stretches without points that close the lines of both regions at both ends.
fn switch_on(joints: &[Joint], arcs: &mut [Arc], open: &mut Open) {
    let mut off: Vec<usize> = (0..arcs.len()).filter(|&k| !arcs[k].on).collect();
    off.sort_by(|&a, &b| arcs[b].score.total_cmp(&arcs[a].score));
    for k in off {
        let (pair, ends) = (joints[arcs[k].joint].pair, arcs[k].corners);
        let lacks =
            |c: &usize| open.get(c).is_some_and(|lack| pair.iter().all(|r| lack.contains(r)));
        if ends[0] != ends[1] && ends.iter().all(lacks) {
            (arcs[k].on, arcs[k].bounds) = (true, [true; 2]);
            for c in ends {
                open.entry(c).or_default().retain(|r| !pair.contains(r));
            }
        }
    }
}
