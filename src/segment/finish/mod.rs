//! The last fits: all points, plain least squares, soft labels at the boundaries.

pub mod others;
pub mod simplest;

use crate::fit::constant::constants;
use std::ops::Range;

use rayon::prelude::*;

use crate::fit::Shape;
use crate::fit::least_squares::{Columns, Normal, squares};
use crate::geometry::Vec3;
use crate::segment::Monitor;
use crate::segment::finish::simplest::simplest;
use crate::segment::label::shares::Labelled;
use crate::segment::objective::SURE;
use crate::segment::partition::Partition;

constants! {
    /// Points of a region that its last iterated fit looks at; one step on all points follows.
    SAMPLE: usize = 8_000, Effort("points of one fit");
    /// Rise of the sample's chi2 for each degree of freedom that a step on all points may bring.
    WORSE: f64 = 10.0, Trial(10.0, 10.0);
}

/// Points summed at once; fixed, so that the result does not depend on the number of threads.
const CHUNK: usize = 4096;

/// Fits every surface to all its points.
///
/// A point beside a boundary counts for each surface it may belong to, by the posterior share of that label
/// given its own and its neighbours' residuals: hard labels erode the ends of an arc, which carry
/// most of what is known about it. The fit iterates on a sample, then takes one Gauss-Newton step
/// on all points, which is as good as iterating on all: the sample's fit is within a few sigmas over the
/// root of its size of the end, and the step squares that.
pub fn finish(
    points: &[Vec3],
    labelled: &Labelled,
    model: &mut Partition,
    sigma: f64,
    monitor: &dyn Monitor,
) {
    let shapes = &mut model.shapes[..];
    let mut samples = samples(points, labelled, shapes.len());
    shapes.par_iter_mut().zip(&mut samples).for_each(|(s, (points, total))| {
        points.fill_up();
        points.centre();
        *s = simplest(s, points, *total, sigma, monitor);
    });
    if monitor.cancelled() {
        return;
    }
    let sums = normal_equations(points, labelled, shapes, monitor);
    for ((s, n), (sample, _)) in shapes.iter_mut().zip(&sums).zip(&samples) {
        if monitor.cancelled() {
            return;
        }
        step(s, n, sample, sigma);
    }
}

/// Fits every surface, which was fitted to the labelled points, to those that they were taken from: one step by the
/// `sums` over all of these.
pub fn finish_by(
    points: &[Vec3],
    labelled: &Labelled,
    shapes: &mut [Shape],
    sums: &[Normal],
    sigmas: &[f64],
) {
    let mut samples = samples(points, labelled, shapes.len());
    for (((s, n), (sample, _)), sigma) in shapes.iter_mut().zip(sums).zip(&mut samples).zip(sigmas)
    {
        sample.fill_up();
        sample.centre();
        step(s, n, sample, *sigma);
    }
}

/// One step of a surface by the sums over all its points, of which `sample` holds some.
fn step(s: &mut Shape, n: &Normal, sample: &Columns, sigma: f64) {
    // What hardly shows in the points (the far axis of a short arc) can step far: a step that
    // fits the sample worse than chance has it is none. From the sample's best to that of all points its chi2
    // rises by about one for each degree of freedom.
    let chance = WORSE.get() * s.family.dof() as f64 / sample.total().max(1.0);
    let worse = |next: &Shape| squares(next, sample) > (1.0 + chance) * squares(s, sample);
    if let Some(next) = n.step(s, SURE.get() * sigma, sample).filter(|next| !worse(next)) {
        *s = next;
    }
}

/// Each region's points and weights, thinned to the sample size, and its total weight.
fn samples(points: &[Vec3], labelled: &Labelled, regions: usize) -> Vec<(Columns, f64)> {
    let all = 0..labelled.labels.len();
    let mut count = vec![0usize; regions];
    for run in labelled.labels.chunk_by(|a, b| a == b) {
        if run[0] >= 0 {
            count[run[0] as usize] += run.len();
        }
    }
    let stride: Vec<usize> = count.iter().map(|c| c.div_ceil(SAMPLE.get()).max(1)).collect();
    let mut seen = vec![0usize; regions];
    let mut out = vec![(Columns::default(), 0.0); regions];
    for ((columns, _), (n, stride)) in out.iter_mut().zip(count.iter().zip(&stride)) {
        columns.reserve(n.div_ceil(*stride));
    }
    walk(labelled, all, |l, places, w| {
        let (columns, total) = &mut out[l];
        let first = seen[l].next_multiple_of(stride[l]) - seen[l];
        seen[l] += places.len();
        *total += w * places.len() as f64;
        columns.extend_thinned(points, places.start + first..places.end, stride[l], w);
    });
    out
}

/// Gives the labelled points of `range` to `give`, in order: region, places and the weight they have in
/// it. Points of one region that follow on each other come at once.
fn walk(labelled: &Labelled, range: Range<usize>, mut give: impl FnMut(usize, Range<usize>, f64)) {
    let from = labelled.shares.partition_point(|s| (s.0 as usize) < range.start);
    let mut shares = labelled.shares[from..].iter().peekable();
    let mut i = range.start;
    while i < range.end {
        let stop = shares.peek().map_or(range.end, |s| (s.0 as usize).min(range.end));
        for run in labelled.labels[i..stop].chunk_by(|a, b| a == b) {
            if run[0] >= 0 {
                give(run[0] as usize, i..i + run.len(), 1.0);
            }
            i += run.len();
        }
        if i < range.end {
            for &(l, w) in shares.next().map_or(&[][..], |s| &s.1) {
                give(l as usize, i..i + 1, w);
            }
            i += 1;
        }
    }
}

/// The normal equations of every region over all points, in one pass.
pub fn normal_equations(
    points: &[Vec3],
    labelled: &Labelled,
    shapes: &[Shape],
    monitor: &dyn Monitor,
) -> Vec<Normal> {
    let parts: Vec<Vec<(usize, Normal)>> = labelled
        .labels
        .par_chunks(CHUNK)
        .enumerate()
        .map(|(c, labels)| {
            if monitor.cancelled() {
                return Vec::new();
            }
            let range = c * CHUNK..c * CHUNK + labels.len();
            let by_region = by_region(points, labelled, range);
            by_region.into_iter().map(|(l, c)| (l, Normal::of(&shapes[l], &c))).collect()
        })
        .collect();
    let mut out = vec![Normal::default(); shapes.len()];
    for (l, n) in parts.into_iter().flatten() {
        out[l].merge(&n);
    }
    out
}

/// The points of a range by region, each with its share.
fn by_region(points: &[Vec3], labelled: &Labelled, range: Range<usize>) -> Vec<(usize, Columns)> {
    let mut out: Vec<(usize, Columns)> = Vec::new();
    walk(labelled, range, |l, places, w| {
        let k = out.iter().position(|(k, _)| *k == l).unwrap_or(out.len());
        if k == out.len() {
            out.push((l, Columns::default()));
        }
        out[k].1.extend(&points[places], w);
    });
    out.iter_mut().for_each(|(_, columns)| columns.fill_up());
    out
}
