//! Edges, vertices and the lines around faces that they make.

use std::collections::BTreeMap;

use super::arc::Arc;
use super::curve::Curve;
use super::joint::Joint;
use super::part::Part;
use super::sheet::{Sheet, Uv};
use crate::geometry::Vec3;

/// Places along an edge at which the points beside it are asked on which side a face lies.
const ASKED: usize = 24;

/// So many points beside an edge tell it.
const TOLD: usize = 6;

/// A piece of a curve between two vertices.
#[derive(Clone, Debug)]
pub struct Edge {
    /// The curve.
    pub curve: Curve,
    /// Where it begins and ends along the curve.
    pub span: [f64; 2],
    /// The vertices at its ends; the same for a closed one.
    pub ends: [usize; 2],
    /// The regions that it may bound: two, or one where nothing lies beyond.
    pub regions: Vec<usize>,
}

/// An edge as part of the line around a face, and whether it runs along it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Use {
    /// The edge.
    pub edge: usize,
    /// Whether the line goes the way of the curve; the face lies on its left, seen from outside.
    pub forward: bool,
}

impl Edge {
    /// Whether it is a whole closed curve.
    pub fn is_closed(&self) -> bool {
        self.ends[0] == self.ends[1]
    }

    /// Its points in order.
    pub fn points(&self) -> Vec<Vec3> {
        self.curve.between(self.span[0], self.span[1])
    }

    /// On which side of it the points of a region lie: whether a line along the curve has them on its left, seen from
    /// outside of `sheet`.
    pub fn has_left(&self, part: &Part, region: usize, sheet: &Sheet) -> bool {
        let radius = part.reach([self.regions[0], *self.regions.last().unwrap_or(&0)]);
        let step = (self.span[1] - self.span[0]) / ASKED as f64;
        // Points beside the edge, and those beyond its ends too.
        let (mut beside, mut around) = ([0usize; 2], [0usize; 2]);
        for k in 0..ASKED {
            let t = self.span[0] + step * (k as f64 + 0.5);
            let (x, along) = (self.curve.at(t), self.curve.tangent(t));
            let left = sheet.normal(&x).cross(&along);
            part.near.within(&x, radius, |sq, p, l| {
                if l as usize == region {
                    let d = p - x;
                    let (side, on) = (usize::from(d.dot(&left) > 0.0), d.dot(&along).abs());
                    beside[side] += usize::from(on < 0.5 * step);
                    around[side] += usize::from(on * on < 0.5 * sq);
                }
                true
            });
        }
        let told = if beside[0] + beside[1] < TOLD { around } else { beside };
        told[1] > told[0]
    }

    /// The vertex at which a use of it begins (0) or ends (1).
    pub fn end(&self, forward: bool, k: usize) -> usize {
        self.ends[if forward { k } else { 1 - k }]
    }

    /// Unit direction in which a use of it leaves its first vertex, or arrives at its last.
    pub fn direction(&self, forward: bool, arriving: bool) -> Vec3 {
        let at_end = forward == arriving;
        let t = self.span[usize::from(at_end)];
        // A little inside: at a corner the surfaces may touch.
        let step = 1e-3 * (self.span[1] - self.span[0]) * if at_end { -1.0 } else { 1.0 };
        let d = self.curve.tangent(t + step);
        if forward { d } else { -d }
    }
}

/// The edges of the stretches that are on; those that follow each other with nothing between are one.
pub fn edges(joints: &[Joint], arcs: &[Arc]) -> Vec<Edge> {
    let mut degree: BTreeMap<usize, usize> = BTreeMap::new();
    for arc in arcs.iter().filter(|a| a.on) {
        arc.corners.iter().for_each(|c| *degree.entry(*c).or_insert(0) += 1);
    }
    let mut out = Vec::new();
    let mut from = 0;
    while from < arcs.len() {
        let joint = arcs[from].joint;
        let to =
            arcs[from..].iter().position(|a| a.joint != joint).map_or(arcs.len(), |k| from + k);
        let mut own: Vec<Arc> = arcs[from..to].iter().filter(|a| a.on).copied().collect();
        own.sort_by(|a, b| a.span[0].total_cmp(&b.span[0]));
        out.extend(joined(&own, &joints[joint], &degree));
        from = to;
    }
    out
}

fn joined(arcs: &[Arc], joint: &Joint, degree: &BTreeMap<usize, usize>) -> Vec<Edge> {
    let mut runs: Vec<Arc> = Vec::new();
    let passes = |c: usize| degree.get(&c) == Some(&2);
    for arc in arcs {
        match runs.last_mut() {
            Some(last)
                if last.corners[1] == arc.corners[0]
                    && passes(arc.corners[0])
                    && last.bounds == arc.bounds
                    && last.corners[0] != last.corners[1] =>
            {
                last.span[1] = arc.span[1];
                last.corners[1] = arc.corners[1];
            }
            _ => runs.push(*arc),
        }
    }
    // Over the first point of a closed curve.
    if runs.len() > 1 && joint.curve.closed {
        let (first, last) = (runs[0], runs[runs.len() - 1]);
        if last.corners[1] == first.corners[0]
            && passes(first.corners[0])
            && first.bounds == last.bounds
        {
            let total = joint.curve.length();
            runs.pop();
            runs[0].span = [last.span[0], first.span[1] + total];
            runs[0].corners = [last.corners[0], first.corners[1]];
        }
    }
    let edge = |run: &Arc| Edge {
        curve: joint.curve.clone(),
        span: run.span,
        ends: run.corners,
        regions: joint.pair.into_iter().zip(run.bounds).filter(|b| b.1).map(|b| b.0).collect(),
    };
    runs.iter().map(edge).collect()
}

/// A chain of uses: closed, or with a free end at either side.
#[derive(Clone, Debug)]
pub struct Chain {
    /// The uses in order.
    pub uses: Vec<Use>,
    /// Whether the last is followed by the first.
    pub closed: bool,
}

/// The chains that edges make around a region's faces, which lie on the left of each.
pub fn chains(part: &Part, edges: &[Edge], region: usize, sheet: &Sheet) -> Vec<Chain> {
    let own = edges.iter().enumerate().filter(|(_, e)| e.regions.contains(&region));
    let mut uses: Vec<Use> =
        own.map(|(k, e)| Use { edge: k, forward: e.has_left(part, region, sheet) }).collect();
    let mut out = Vec::new();
    // Those that close by themselves.
    uses.retain(|u| {
        let closed = edges[u.edge].is_closed();
        if closed {
            out.push(Chain { uses: vec![*u], closed: true });
        }
        !closed
    });
    let start = |u: &Use| edges[u.edge].end(u.forward, 0);
    let end = |u: &Use| edges[u.edge].end(u.forward, 1);
    let mut next: Vec<Option<usize>> = vec![None; uses.len()];
    let mut has_before = vec![false; uses.len()];
    for (k, u) in uses.iter().enumerate() {
        let arriving = edges[u.edge].direction(u.forward, true);
        let candidates = (0..uses.len()).filter(|&j| j != k && start(&uses[j]) == end(u));
        let turn = |j: usize| {
            let v = &uses[j];
            let leaving = edges[v.edge].direction(v.forward, false);
            let place = edges[u.edge].curve.at(edges[u.edge].span[usize::from(u.forward)]);
            let normal = sheet.normal(&place);
            let back = -arriving;
            // Clockwise from the way back to the way on.
            (-normal.dot(&back.cross(&leaving)))
                .atan2(back.dot(&leaving))
                .rem_euclid(std::f64::consts::TAU)
        };
        let mut sorted: Vec<(f64, usize)> = candidates.map(|j| (turn(j), j)).collect();
        sorted.sort_by(|a, b| a.0.total_cmp(&b.0));
        if let Some((_, j)) = sorted.into_iter().find(|(_, j)| !has_before[*j]) {
            next[k] = Some(j);
            has_before[j] = true;
        }
    }
    let mut seen = vec![false; uses.len()];
    let firsts = (0..uses.len()).filter(|&k| !has_before[k]).chain(0..uses.len());
    for first in firsts {
        let (mut chain, mut at) = (Vec::new(), Some(first));
        while let Some(k) = at.filter(|k| !seen[*k]) {
            seen[k] = true;
            chain.push(uses[k]);
            at = next[k];
        }
        if !chain.is_empty() {
            let closed = at == Some(first);
            out.push(Chain { uses: chain, closed });
        }
    }
    out
}

/// The places of a closed line of uses in a chart, unrolled, and how often it goes around each parameter.
pub fn in_chart(edges: &[Edge], uses: &[Use], sheet: &Sheet) -> (Vec<Uv>, [i32; 2]) {
    let mut places: Vec<Uv> = Vec::new();
    for u in uses {
        let mut points = edges[u.edge].points();
        if !u.forward {
            points.reverse();
        }
        points.pop();
        for p in points {
            let c = sheet.chart(&p);
            let c = places.last().map_or(c, |near| sheet.beside(c, near));
            places.push(c);
        }
    }
    let mut turns = [0; 2];
    if let (Some(first), Some(last)) = (places.first(), places.last()) {
        let back = sheet.beside(*first, last);
        for k in 0..2 {
            if sheet.angular()[k] {
                let period = std::f64::consts::TAU * sheet.scale[k];
                turns[k] = ((back[k] - first[k]) / period).round() as i32;
            }
        }
    }
    (places, turns)
}
