//! Placing boundaries: every point takes the label with the least energy.

use rayon::prelude::*;

use crate::fit::{Ruler, Shape};
use crate::geometry::Vec3;
use crate::segment::label::blocks::BLOCK;
use crate::segment::label::energy::Energies;
use crate::segment::label::labelling::Labelling;
use crate::segment::objective::unassigned;
use crate::segment::prepare::scene::Scene;

/// The labels of a scene.
pub struct SceneLabels<'a> {
    /// Its points and their neighbours.
    pub scene: &'a Scene<'a>,
    /// The surfaces.
    pub rulers: &'a [Ruler],
    /// One label a point.
    pub labels: &'a [i32],
    /// 1 / sigma2.
    pub inverse: f64,
}

impl Labelling for SceneLabels<'_> {
    fn point(&self, i: u32) -> &Vec3 {
        &self.scene.points[i as usize]
    }

    fn neighbours(&self, i: u32) -> &[u32] {
        self.scene.neighbours(i as usize)
    }

    fn label(&self, i: u32) -> i32 {
        self.labels[i as usize]
    }

    fn ruler(&self, label: i32) -> &Ruler {
        &self.rulers[label as usize]
    }

    fn inverse(&self) -> f64 {
        self.inverse
    }
}

/// Points looked at between two looks at whether the work was cancelled.
const WATCHED: u32 = 256;

/// Relabels points beside a boundary until none changes, at most `sweeps` times. Returns the changes
/// of the last sweep.
///
/// Most points lie inside a region, where there is nothing to choose: one look at those of the `open` blocks finds
/// the others.
pub fn relabel(
    scene: &Scene,
    shapes: &[Shape],
    labels: &mut [i32],
    sigma: f64,
    sweeps: usize,
    open: &[usize],
) -> usize {
    let inverse = 1.0 / (sigma * sigma);
    let n = scene.len();
    let rulers: Vec<Ruler> = shapes.iter().map(Ruler::of).collect();
    let frozen: &[i32] = labels;
    let of = &SceneLabels { scene, rulers: &rulers, labels: frozen, inverse };
    let mut active: Vec<u32> = open
        .par_iter()
        .with_min_len(8)
        .flat_map_iter(|&b| {
            let cancelled = scene.cancelled();
            let block = (b * BLOCK) as u32..n.min((b + 1) * BLOCK) as u32;
            block.filter(move |&i| !cancelled && best_label(of, i) != frozen[i as usize])
        })
        .collect();
    let mut queued = vec![false; n];
    let mut changed = 0;
    for _ in 0..sweeps {
        changed = 0;
        let mut next = Vec::new();
        for (k, &i) in (0u32..).zip(&active) {
            if k % WATCHED == 0 && scene.cancelled() {
                return 0;
            }
            queued[i as usize] = false;
            let best = best_label(&SceneLabels { scene, rulers: &rulers, labels, inverse }, i);
            if best != labels[i as usize] {
                labels[i as usize] = best;
                changed += 1;
                next.push(i);
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

/// The label with the least energy at a point; -1 where none lies within reach.
pub fn best_label(of: &impl Labelling, i: u32) -> i32 {
    let own = of.label(i);
    // Most points lie inside a region, with one candidate.
    let near = of.neighbours(i).iter();
    if own >= 0 && !near.fold(false, |any, &j| any | (of.label(j) != own)) {
        return if of.sq(own, i) <= unassigned() { own } else { -1 };
    }
    Energies::at(of, i).best()
}
