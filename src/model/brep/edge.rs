//! Edges, vertices and the lines around faces that they make.

use std::collections::BTreeMap;

use super::arc::Arc;
use super::curve::Curve;
use super::joint::Joint;
use super::part::Part;
use super::sheet::Sheet;
use crate::fit::constant::constants;
use crate::geometry::Vec3;

constants! {
    /// Places along an edge at which the points beside it are asked on which side a face lies.
    ASKED: usize = 24, Effort("work of the boundary representation");
    /// So many points beside an edge tell it.
    TOLD: usize = 6, Effort("work of the boundary representation");
}

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

/// Marks vertices and edges of a region's own until they have their place among all.
pub const OWN: usize = 1 << 40;

/// Edges that all regions share, and those of one region, counted from [`OWN`] on.
#[derive(Clone, Copy)]
pub struct Edges<'a> {
    /// The shared ones.
    pub shared: &'a [Edge],
    /// The region's own.
    pub own: &'a [Edge],
}

impl<'a> Edges<'a> {
    /// Edges of which none is a region's own.
    pub fn all(shared: &'a [Edge]) -> Self {
        Self { shared, own: &[] }
    }

    /// The edge of that number.
    pub fn get(&self, k: usize) -> &'a Edge {
        if k >= OWN { &self.own[k - OWN] } else { &self.shared[k] }
    }
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
        let step = (self.span[1] - self.span[0]) / ASKED.get() as f64;
        // Points beside the edge, and those beyond its ends too.
        let (mut beside, mut around) = ([0usize; 2], [0usize; 2]);
        for k in 0..ASKED.get() {
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
        let told = if beside[0] + beside[1] < TOLD.get() { around } else { beside };
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
