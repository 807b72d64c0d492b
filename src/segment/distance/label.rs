//! Placing boundaries: every point takes the label with the least energy.

use super::scene::Scene;
use crate::fit::Shape;

/// A point further than this many sigmas from every candidate stays unassigned.
pub const ACCEPT: f64 = 4.0;
/// Cost of each neighbour with another label.
const DISAGREEMENT: f64 = 0.3;
/// A neighbour's evidence against a label is cut here.
const CUT: f64 = 16.0;

/// Energy of label `l` at point `i`: its own r2/sigma2, its neighbours' evidence about that surface,
/// and a little for each neighbour with another label. The neighbours' evidence is what places a
/// smooth joint better than the point alone can. `None` where the point is too far.
fn energy(
    scene: &Scene,
    shapes: &[Shape],
    labels: &[i32],
    i: usize,
    l: i32,
    inverse: f64,
) -> Option<f64> {
    let shape = &shapes[l as usize];
    let own = shape.distance(&scene.points[i]).powi(2) * inverse;
    if own > ACCEPT * ACCEPT {
        return None;
    }
    let mut e = own;
    for &j in scene.neighbours(i) {
        e += (shape.distance(&scene.points[j as usize]).powi(2) * inverse).min(CUT);
        if labels[j as usize] != l {
            e += DISAGREEMENT;
        }
    }
    Some(e)
}

/// Relabels points beside a boundary until few change, at most `sweeps` times. Returns the changes
/// of the last sweep.
pub fn relabel(
    scene: &Scene,
    shapes: &[Shape],
    labels: &mut [i32],
    sigma: f64,
    sweeps: usize,
) -> usize {
    let inverse = 1.0 / (sigma * sigma);
    let n = scene.len();
    let mut active: Vec<u32> = (0..n as u32).collect();
    let mut queued = vec![false; n];
    let mut changed = 0;
    for _ in 0..sweeps {
        changed = 0;
        let mut next = Vec::new();
        for &i in &active {
            let i = i as usize;
            queued[i] = false;
            let best = best_label(scene, shapes, labels, i, inverse);
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

fn best_label(scene: &Scene, shapes: &[Shape], labels: &[i32], i: usize, inverse: f64) -> i32 {
    let own = labels[i];
    let mut candidates = [0i32; 17];
    let mut m = 0;
    if own >= 0 {
        candidates[0] = own;
        m = 1;
    }
    for &j in scene.neighbours(i) {
        let l = labels[j as usize];
        if l >= 0 && !candidates[..m].contains(&l) {
            candidates[m] = l;
            m += 1;
        }
    }
    if m == 1 && own >= 0 {
        let r = shapes[own as usize].distance(&scene.points[i]).powi(2) * inverse;
        return if r <= ACCEPT * ACCEPT { own } else { -1 };
    }
    let mut best = (f64::INFINITY, -1);
    for &l in &candidates[..m] {
        if let Some(e) = energy(scene, shapes, labels, i, l, inverse)
            && e < best.0
        {
            best = (e, l);
        }
    }
    best.1
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
