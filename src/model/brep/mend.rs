//! Edges too short to have points beside them: two corners in which the same two regions lack an edge are its ends.

use std::collections::BTreeMap;

use super::arc::Arc;
use super::joint::{Joint, through};
use super::part::Part;
use crate::geometry::Vec3;

/// An edge that no points tell is at most this many spacings long.
const LONGEST: f64 = 16.0;

/// Adds the edges that close the lines around two regions at once. `odd` are the corners, each with a region, at which a line is
/// open. Returns those that still are.
pub fn mend(
    part: &Part,
    joints: &mut Vec<Joint>,
    arcs: &mut Vec<Arc>,
    places: &[Vec3],
    odd: Vec<(usize, usize)>,
) -> Vec<(usize, usize)> {
    let mut at: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    for (c, r) in odd {
        at.entry(c).or_default().push(r);
    }
    switch_on(joints, arcs, &mut at);
    let corners: Vec<usize> = at.keys().copied().collect();
    let mut pairs = Vec::new();
    for (k, &a) in corners.iter().enumerate() {
        for &b in &corners[k + 1..] {
            let length = (places[a] - places[b]).norm();
            let common: Vec<usize> =
                at[&a].iter().filter(|r| at[&b].contains(r)).copied().collect();
            if length > LONGEST * part.usual {
                continue;
            }
            for (i, &r) in common.iter().enumerate() {
                pairs.extend(
                    common[i + 1..].iter().map(|&s| (length, [r.min(s), r.max(s)], [a, b])),
                );
            }
        }
    }
    pairs.sort_by(|a, b| a.0.total_cmp(&b.0));
    for (_, pair, ends) in pairs {
        let open = ends.iter().all(|c| pair.iter().all(|r| at[c].contains(r)));
        if !open {
            continue;
        }
        let Some((joint, span)) = through(part, pair, ends.map(|c| places[c])) else { continue };
        joints.push(joint);
        let (corners, span) = if span[0] <= span[1] {
            (ends, span)
        } else {
            ([ends[1], ends[0]], [span[1], span[0]])
        };
        arcs.push(Arc {
            joint: joints.len() - 1,
            span,
            corners,
            score: 0.0,
            on: true,
            bounds: [true; 2],
        });
        for c in ends {
            at.entry(c).or_default().retain(|r| !pair.contains(r));
        }
    }
    at.into_iter().flat_map(|(c, rs)| rs.into_iter().map(move |r| (c, r))).collect()
}

/// Switches on stretches without points that close the lines of both regions at both ends.
fn switch_on(joints: &[Joint], arcs: &mut [Arc], at: &mut BTreeMap<usize, Vec<usize>>) {
    let mut off: Vec<usize> = (0..arcs.len()).filter(|&k| !arcs[k].on).collect();
    off.sort_by(|&a, &b| arcs[b].score.total_cmp(&arcs[a].score));
    for k in off {
        let (pair, ends) = (joints[arcs[k].joint].pair, arcs[k].corners);
        let lacks = |c: &usize| at.get(c).is_some_and(|open| pair.iter().all(|r| open.contains(r)));
        if ends[0] != ends[1] && ends.iter().all(lacks) {
            (arcs[k].on, arcs[k].bounds) = (true, [true; 2]);
            for c in ends {
                at.entry(c).or_default().retain(|r| !pair.contains(r));
            }
        }
    }
}
