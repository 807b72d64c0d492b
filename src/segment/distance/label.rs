//! Placing boundaries: every point takes the label with the least energy.

use rayon::prelude::*;

use super::scene::{K, Scene};
use crate::fit::{Ruler, Shape};
use crate::geometry::Vec3;

/// A point further than this many sigmas from every candidate stays unassigned.
pub const ACCEPT: f64 = 4.0;
/// Cost of each neighbour with another label.
const DISAGREEMENT: f64 = 0.3;
/// A neighbour says at most this much for one label against another across a smooth joint.
const SMOOTH_CUT: f64 = 16.0;
/// And this much across a sharp edge: a point past it says that it lies there itself, not that its
/// neighbour does.
const SHARP_CUT: f64 = 1.0;
/// Most labels met at one point: its own and its neighbours'.
pub const MOST: usize = K + 1;

/// What a label costs at a point.
#[derive(Clone, Copy, Debug, Default)]
pub struct Energy {
    /// The label.
    pub label: i32,
    /// Its own r2/sigma2 and its neighbours' evidence about that surface.
    pub evidence: f64,
    /// A little for each neighbour with another label.
    pub against: f64,
}

impl Energy {
    /// All of it.
    pub fn total(&self) -> f64 {
        self.evidence + self.against
    }
}

/// Distinct labels of a point and its neighbours, the point's own first.
pub fn candidates(own: i32, near: impl Iterator<Item = i32>, out: &mut [i32; MOST]) -> usize {
    let mut m = 0;
    for l in std::iter::once(own).chain(near) {
        if l >= 0 && !out[..m].contains(&l) {
            out[m] = l;
            m += 1;
        }
    }
    m
}

/// Energies at a point of the candidate labels that lie within reach of it.
///
/// The neighbours' evidence is what places a smooth joint better than the point alone can: there each
/// tells the surfaces apart a little, and together they tell much.
pub fn energies<'s>(
    points: &[Vec3],
    i: usize,
    near: &[u32],
    candidates: &[i32],
    ruler: impl Fn(i32) -> &'s Ruler,
    label: impl Fn(u32) -> i32,
    inverse: f64,
) -> ([Energy; MOST], usize) {
    let mut out = [Energy::default(); MOST];
    let mut sq = [[0.0; K]; MOST];
    let mut least = [f64::INFINITY; K];
    let mut own = [0.0; MOST];
    let mut beside = [Vec3::zeros(); K];
    let around = &mut beside[..near.len()];
    around.iter_mut().zip(near).for_each(|(p, &j)| *p = points[j as usize]);
    for (c, &l) in candidates.iter().enumerate() {
        let r = ruler(l);
        own[c] = r.distance(&points[i]).powi(2) * inverse;
        r.distances(around, &mut sq[c]);
        for (sq, least) in sq[c][..near.len()].iter_mut().zip(&mut least) {
            *sq = sq.powi(2) * inverse;
            *least = least.min(*sq);
        }
    }
    let sharp = is_sharp(points, i, near, candidates, &own, &ruler, inverse);
    let cut = if sharp { SHARP_CUT } else { SMOOTH_CUT };
    let mut m = 0;
    for (c, &l) in candidates.iter().enumerate() {
        if own[c] > ACCEPT * ACCEPT {
            continue;
        }
        let around: f64 = (0..near.len()).map(|k| (sq[c][k] - least[k]).min(cut)).sum();
        let others = near.iter().filter(|&&j| label(j) != l).count();
        out[m] =
            Energy { label: l, evidence: own[c] + around, against: DISAGREEMENT * others as f64 };
        m += 1;
    }
    (out, m)
}

/// Whether the two nearest candidate surfaces meet at an edge that single neighbours see: past it they
/// part by more than the noise within the neighbourhood.
fn is_sharp<'s>(
    points: &[Vec3],
    i: usize,
    near: &[u32],
    candidates: &[i32],
    own: &[f64; MOST],
    ruler: &impl Fn(i32) -> &'s Ruler,
    inverse: f64,
) -> bool {
    let mut order: [usize; MOST] = std::array::from_fn(|c| c);
    let m = candidates.len();
    if m < 2 {
        return false;
    }
    order[..m].sort_by(|&a, &b| own[a].total_cmp(&own[b]));
    let Some(middle) = near.get(near.len() / 2) else { return false };
    let sq_reach = (points[*middle as usize] - points[i]).norm_squared();
    let [a, b] = [0, 1].map(|k| ruler(candidates[order[k]]).shape().offset(&points[i]).normal);
    a.cross(&b).norm_squared() * sq_reach * inverse > ACCEPT * ACCEPT
}

/// Relabels points beside a boundary until none changes, at most `sweeps` times. Returns the changes
/// of the last sweep.
///
/// Most points lie inside a region, where there is nothing to choose: one look at all of them finds the others.
pub fn relabel(
    scene: &Scene,
    shapes: &[Shape],
    labels: &mut [i32],
    sigma: f64,
    sweeps: usize,
) -> usize {
    let inverse = 1.0 / (sigma * sigma);
    let n = scene.len();
    let rulers: Vec<Ruler> = shapes.iter().map(Ruler::of).collect();
    let frozen: &[i32] = labels;
    let mut active: Vec<u32> = (0..n as u32)
        .into_par_iter()
        .with_min_len(4096)
        .filter(|&i| best_label(scene, &rulers, frozen, i as usize, inverse) != frozen[i as usize])
        .collect();
    let mut queued = vec![false; n];
    let mut changed = 0;
    for _ in 0..sweeps {
        changed = 0;
        let mut next = Vec::new();
        for &i in &active {
            let i = i as usize;
            queued[i] = false;
            let best = best_label(scene, &rulers, labels, i, inverse);
            if best != labels[i] {
                labels[i] = best;
                changed += 1;
                next.push(i as u32);
            }
        }
        if changed == 0 {
            break;
        }
        active.clear();
        for &i in &next {
            for &j in scene.neighbours(i as usize).iter().chain([&i]) {
                if !queued[j as usize] {
                    queued[j as usize] = true;
                    active.push(j);
                }
            }
        }
        active.sort_unstable();
    }
    changed
}

fn best_label(scene: &Scene, rulers: &[Ruler], labels: &[i32], i: usize, inverse: f64) -> i32 {
    let near = scene.neighbours(i);
    let label = |j: u32| labels[j as usize];
    let own = labels[i];
    // Most points lie inside a region, with one candidate.
    if own >= 0 && !near.iter().fold(false, |any, &j| any | (label(j) != own)) {
        let sq = rulers[own as usize].distance(&scene.points[i]).powi(2) * inverse;
        return if sq <= ACCEPT * ACCEPT { own } else { -1 };
    }
    let mut found = [0; MOST];
    let m = candidates(own, near.iter().map(|&j| label(j)), &mut found);
    best_of(&scene.points, i, near, &found[..m], |l| &rulers[l as usize], label, inverse)
}

/// The candidate with the least energy; -1 where none lies within reach.
pub fn best_of<'s>(
    points: &[Vec3],
    i: usize,
    near: &[u32],
    candidates: &[i32],
    ruler: impl Fn(i32) -> &'s Ruler,
    label: impl Fn(u32) -> i32,
    inverse: f64,
) -> i32 {
    if let [only] = *candidates {
        let sq = ruler(only).distance(&points[i]).powi(2) * inverse;
        return if sq <= ACCEPT * ACCEPT { only } else { -1 };
    }
    let (all, m) = energies(points, i, near, candidates, ruler, label, inverse);
    all[..m].iter().min_by(|a, b| a.total().total_cmp(&b.total())).map_or(-1, |e| e.label)
}

/// Points of each label, in scene order.
pub fn members(labels: &[i32], regions: usize) -> Vec<Vec<u32>> {
    let mut out = vec![Vec::new(); regions];
    for (i, &l) in labels.iter().enumerate() {
        if l >= 0 {
            out[l as usize].push(i as u32);
        }
    }
    out
}
