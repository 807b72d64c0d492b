//! Where three surfaces meet on the curves of their joints.

use std::collections::BTreeMap;

use rayon::prelude::*;

use super::curve::meet_three;
use super::joint::{Joint, LONGER};
use super::part::Part;
use super::sheet::Sheet;
use crate::fit::constant::constants;
use crate::geometry::Vec3;

constants! {
    /// Corners nearer to each other than this share of the spacing are one: the points cannot tell them apart.
    APART: f64 = 1.0 / 3.0, Trial(1.0 / 3.0, 1.0 / 3.0);
}

/// A place on a joint's curve where a third surface cuts it.
#[derive(Clone, Copy, Debug)]
pub struct Cut {
    /// Length along the curve.
    pub at: f64,
    /// The corner there.
    pub corner: usize,
}

/// The cuts of each joint in order, and the corners' places.
pub fn corners(part: &Part, joints: &[Joint]) -> (Vec<Vec<Cut>>, Vec<Vec3>) {
    let mut of_pair: BTreeMap<[usize; 2], Vec<usize>> = BTreeMap::new();
    for (k, joint) in joints.iter().enumerate() {
        if joint.smooth {
            of_pair.entry(joint.pair).or_default().push(k);
        }
    }
    let found: Vec<Vec<(f64, Vec3)>> =
        joints.par_iter().map(|joint| of_joint(part, joints, &of_pair, joint)).collect();
    let places: Vec<Vec3> = found.iter().flatten().map(|f| f.1).collect();
    let (group, middles) = clusters(&places, APART.get() * part.usual);
    let mut next = 0;
    let cuts = found.iter().zip(joints).map(|(found, joint)| {
        let mut cuts: Vec<Cut> = found
            .iter()
            .map(|(at, _)| {
                next += 1;
                Cut { at: *at, corner: group[next - 1] }
            })
            .collect();
        cuts.sort_by(|a, b| a.at.total_cmp(&b.at));
        // One corner that several surfaces tell is one cut.
        let near = 3.0 * APART.get() * part.usual;
        cuts.dedup_by(|b, a| a.corner == b.corner && b.at - a.at < near);
        if joint.curve.closed && cuts.len() > 1 {
            let (first, last) = (cuts[0], cuts[cuts.len() - 1]);
            if first.corner == last.corner && first.at + joint.curve.length() - last.at < near {
                cuts.pop();
            }
        }
        cuts
    });
    (cuts.collect(), middles)
}

/// Lengths and places at which a joint's curve crosses the surfaces of other regions that have points there.
fn of_joint(
    part: &Part,
    joints: &[Joint],
    smooth: &BTreeMap<[usize; 2], Vec<usize>>,
    joint: &Joint,
) -> Vec<(f64, Vec3)> {
    let curve = &joint.curve;
    let n = curve.points.len();
    let reach = part.reach(joint.pair);
    let beside: Vec<Vec<u32>> = curve
        .points
        .iter()
        .map(|x| {
            let mut labels = Vec::new();
            part.near.within(x, LONGER.get() * reach, |_, _, l| {
                if !joint.pair.contains(&(l as usize)) && !labels.contains(&l) {
                    labels.push(l);
                }
                true
            });
            labels
        })
        .collect();
    let mut out = Vec::new();
    for k in 0..curve.lengths.len() - 1 {
        let j = (k + 1) % n;
        let mut labels = beside[k].clone();
        labels.extend(beside[j].iter().filter(|l| !beside[k].contains(l)));
        labels.sort_unstable();
        for l in labels {
            let (a, b) = (curve.points[k], curve.points[j]);
            let Some(sheet) = cutting(part, joints, smooth, joint.pair, l as usize, [&a, &b])
            else {
                continue;
            };
            let (va, vb) = (sheet.value(&a), sheet.value(&b));
            if (va > 0.0) == (vb > 0.0) {
                continue;
            }
            out.extend(root(joint, &sheet, k, va));
        }
    }
    out
}

/// The sheet whose sign tells on which side of a third region a step of a joint's curve begins and ends: its surface, or, where it
/// runs smoothly into one of the two, the sheet across that joint which the curve crosses most steeply.
fn cutting(
    part: &Part,
    joints: &[Joint],
    smooth: &BTreeMap<[usize; 2], Vec<usize>>,
    pair: [usize; 2],
    third: usize,
    step: [&Vec3; 2],
) -> Option<Sheet> {
    let own = part.sheets[third].as_ref()?;
    let x = step[0];
    let along = step[1] - x;
    let across = pair
        .iter()
        .filter_map(|&r| smooth.get(&[r.min(third), r.max(third)]))
        .flatten()
        .map(|&k| &joints[k])
        .filter(|joint| joint.curve.locate(x).1 < 3.0 * part.reach(joint.pair))
        .map(|joint| (joint.curve.sheets[1].normal(x).dot(&along).abs(), joint.curve.sheets[1]));
    let steepest = across.max_by(|a, b| a.0.total_cmp(&b.0));
    Some(steepest.map_or(*own, |(_, sheet)| sheet))
}

/// Where a joint's curve crosses a sheet between its points `k` and the next; `first` is the sheet's value at `k`.
fn root(joint: &Joint, sheet: &Sheet, k: usize, first: f64) -> Option<(f64, Vec3)> {
    let curve = &joint.curve;
    let (mut low, mut high) = (curve.lengths[k], curve.lengths[k + 1]);
    let span = high - low;
    for _ in 0..12 {
        let middle = (low + high) / 2.0;
        if (sheet.value(&curve.at(middle)) > 0.0) == (first > 0.0) {
            low = middle
        } else {
            high = middle
        }
    }
    let x = curve.at((low + high) / 2.0);
    let exact = meet_three([&curve.sheets[0], &curve.sheets[1], sheet], &x)
        .filter(|y| (y - x).norm() < 0.1 * span);
    Some(((low + high) / 2.0, exact.unwrap_or(x)))
}

/// Groups of places chained by steps of at most `apart`: the group of each, and the groups' means.
pub fn clusters(places: &[Vec3], apart: f64) -> (Vec<usize>, Vec<Vec3>) {
    let near = super::near::Near::of(
        places.iter().enumerate().map(|(k, p)| (*p, k as u32)),
        apart.max(1e-300),
    );
    let mut group = vec![usize::MAX; places.len()];
    let mut middles = Vec::new();
    for first in 0..places.len() {
        if group[first] != usize::MAX {
            continue;
        }
        let id = middles.len();
        let (mut open, mut sum, mut count) = (vec![first], Vec3::zeros(), 0.0);
        group[first] = id;
        while let Some(k) = open.pop() {
            sum += places[k];
            count += 1.0;
            near.within(&places[k], apart, |_, _, l| {
                if group[l as usize] == usize::MAX {
                    group[l as usize] = id;
                    open.push(l as usize);
                }
                true
            });
        }
        middles.push(sum / count);
    }
    (group, middles)
}
