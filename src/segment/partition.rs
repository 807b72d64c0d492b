//! A scene cut into regions: the surfaces found and the label of each point.

use std::collections::BTreeMap;

use rayon::prelude::*;

use crate::fit::{Ruler, Shape};
use crate::geometry::Vec3;
use crate::segment::label::changes::Changes;
use crate::segment::moves::memo::Memo;
use crate::segment::objective::unassigned;
use crate::segment::prepare::scene::Scene;

/// Points whose costs are summed at once.
const CHUNK: usize = 4096;

/// The surfaces found in a scene and the label of each of its points.
#[derive(Clone, Debug, Default)]
pub struct Partition {
    /// Surfaces; a label is an index here.
    pub shapes: Vec<Shape>,
    /// One label a point, -1 = none.
    pub labels: Vec<i32>,
    /// Which of the surfaces only compete for points; empty where none.
    pub spurious: Vec<bool>,
    /// Whether there may be rougher surfaces, or none, beside these.
    pub rougher: bool,
    /// Points of the surfaces with the fewest, where most have too few for the sample to be worth settling.
    pub thin: Option<usize>,
    /// Scatter that labels were given with where residuals of neighbours go together or finer surfaces were taken out;
    /// else nought.
    pub allowed: f64,
    /// Seeds tried, and how many of them failed.
    pub trials: (usize, usize),
    /// Regions joined to another.
    pub merges: usize,
    /// What has changed since labels last settled.
    pub changes: Changes,
    /// Moves that gained nothing.
    pub vain: Memo,
}

impl Partition {
    /// No surfaces in a scene of `points`, after the trials and merges of another partition of it.
    pub fn of_none(points: usize, before: Self) -> Self {
        let Self { trials, merges, .. } = before;
        Self { labels: vec![-1; points], trials, merges, ..Self::default() }
    }

    /// Whether a label is a surface's that is reported as one.
    pub fn is_surface(&self, label: i32) -> bool {
        label >= 0 && !self.spurious.get(label as usize).is_some_and(|s| *s)
    }

    /// Notes what has changed. Returns how many labels have.
    pub fn note(&mut self, scene: &Scene, sigma: f64) -> usize {
        if self.changes.is_other_noise(sigma) {
            self.vain.clear();
        }
        self.changes.note(scene, &self.shapes, &self.labels, sigma)
    }

    /// The length of the description of a scene by these surfaces and labels, in units of chi2: the squared distance of
    /// each labelled point in sigmas, the price of each that has no surface, and the parameters of each surface.
    pub fn energy(&self, scene: &Scene, sigma: f64) -> f64 {
        let inverse = 1.0 / (sigma * sigma);
        let rulers: Vec<Ruler> = self.shapes.iter().map(Ruler::of).collect();
        let cost = |(p, &l): (&Vec3, &i32)| match usize::try_from(l) {
            Ok(l) => (rulers[l].distance(p).powi(2) * inverse).min(unassigned()),
            Err(_) => unassigned(),
        };
        // in chunks of one size, so that the sum does not depend on the number of threads
        let chunks = scene.points.par_chunks(CHUNK).zip(self.labels.par_chunks(CHUNK));
        let sums: Vec<f64> = chunks.map(|(p, l)| p.iter().zip(l).map(cost).sum()).collect();
        let counts = members(&self.labels, self.shapes.len()).into_iter().map(|m| m.len().max(1));
        let lengths = self.shapes.iter().zip(counts).map(|(s, n)| s.family.description_length(n));
        sums.iter().sum::<f64>() + lengths.sum::<f64>()
    }
}

/// Drops regions below `min_points`, or whose points are mostly explained by others.
pub fn prune(model: &mut Partition, min_points: usize) -> bool {
    let mut count = vec![0usize; model.shapes.len()];
    for &l in &model.labels {
        if l >= 0 {
            count[l as usize] += 1;
        }
    }
    let keep: Vec<bool> = count.iter().map(|&c| c >= min_points).collect();
    retain(model, &keep)
}

/// Keeps the regions that `keep` says and renumbers labels. Returns whether any went.
pub fn retain(model: &mut Partition, keep: &[bool]) -> bool {
    if keep.iter().all(|k| *k) {
        return false;
    }
    let mut to = vec![-1i32; keep.len()];
    let mut next = 0;
    for (t, k) in to.iter_mut().zip(keep) {
        if *k {
            *t = next;
            next += 1;
        }
    }
    let mut it = keep.iter();
    model.shapes.retain(|_| *it.next().unwrap_or(&false));
    for l in &mut model.labels {
        if *l >= 0 {
            *l = to[*l as usize];
        }
    }
    model.changes.renumber(&to);
    true
}

/// Puts the new shapes in the place of the old ones. Returns how many there are.
pub fn put_in(shapes: &mut [Shape], next: Vec<Option<Shape>>) -> usize {
    let changed = next.iter().flatten().count();
    for (s, n) in shapes.iter_mut().zip(next) {
        *s = n.unwrap_or(*s);
    }
    changed
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

/// The same of the regions `wanted` alone.
pub fn members_of(labels: &[i32], wanted: &[bool]) -> Vec<Vec<u32>> {
    let mut out = vec![Vec::new(); wanted.len()];
    for (i, &l) in labels.iter().enumerate() {
        if l >= 0 && wanted[l as usize] {
            out[l as usize].push(i as u32);
        }
    }
    out
}

/// The regions that each one touches.
pub fn neighbours_of(
    touching: &BTreeMap<(usize, usize), usize>,
    regions: usize,
) -> Vec<Vec<usize>> {
    let mut out = vec![Vec::new(); regions];
    for &(a, b) in touching.keys() {
        out[a].push(b);
        out[b].push(a);
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Vec3;
    use crate::segment::fixtures::{partition, plane};

    fn planes(n: usize) -> Vec<Shape> {
        (0..n).map(|k| plane(k as f64 * Vec3::z(), Vec3::z())).collect()
    }

    #[test]
    fn what_stays_is_renumbered_in_its_order_and_what_goes_leaves_its_points() {
        let shapes = planes(4);
        let mut model = partition(shapes.clone(), vec![3, 0, 1, -1, 2, 3]);
        assert!(!retain(&mut model, &[true; 4]));
        assert!(retain(&mut model, &[false, true, false, true]));
        assert_eq!(model.shapes, [shapes[1], shapes[3]]);
        assert_eq!(model.labels, [1, -1, 0, -1, -1, 1]);
    }

    #[test]
    fn regions_with_too_few_points_go() {
        let mut model = partition(planes(3), vec![0, 0, 1, 1, 1, -1]);
        assert!(!prune(&mut partition(planes(2), vec![0, 0, 1, 1]), 2));
        assert!(prune(&mut model, 3));
        assert_eq!(
            (model.shapes, model.labels),
            (planes(2)[1..].to_vec(), vec![-1, -1, 0, 0, 0, -1])
        );
    }

    #[test]
    fn members_neighbours_and_new_surfaces_are_told_by_label() {
        let labels = [1, -1, 0, 1];
        assert_eq!(members(&labels, 3), [vec![2], vec![0, 3], vec![]]);
        assert_eq!(members_of(&labels, &[false, true, true]), [vec![], vec![0, 3], vec![]]);
        let touching = BTreeMap::from([((0, 2), 5), ((1, 2), 1)]);
        assert_eq!(neighbours_of(&touching, 3), [vec![2], vec![2], vec![0, 1]]);
        let (mut shapes, other) = (planes(2), planes(3)[2]);
        assert_eq!(put_in(&mut shapes, vec![None, Some(other)]), 1);
        assert_eq!(shapes, [planes(1)[0], other]);
    }
}
