//! The last fits: all points, plain least squares, soft labels at the boundaries.

use rayon::prelude::*;

use super::engine::Model;
use super::label::{MOST, candidates, energies};
use super::scene::Scene;
use super::spread::{Labelled, Share, posterior};
use crate::fit::least_squares::{Normal, Options, fit};
use crate::fit::{Family, Shape};
use crate::geometry::Vec3;

/// Points of a region that its last iterated fit looks at; one step on all points follows.
const SAMPLE: usize = 20_000;
/// Points summed at once; fixed, so that the result does not depend on the number of threads.
const CHUNK: usize = 16_384;

/// Fits every surface to all its points.
///
/// A point beside a boundary counts for each surface it may belong to, by the posterior share of that label
/// given its own and its neighbours' residuals: hard labels erode the ends of an arc, which carry
/// most of what is known about it. The fit iterates on a sample, then takes one Gauss-Newton step
/// on all points, which is as good as iterating on all: the sample's fit is within a few sigmas over the
/// root of its size of the end, and the step squares that.
pub fn finish(points: &[Vec3], labelled: &Labelled, shapes: &mut [Shape], sigma: f64) {
    let inverse = 1.0 / (sigma * sigma);
    let samples = samples(points, labelled, shapes.len());
    shapes.par_iter_mut().zip(&samples).for_each(|(s, (points, weights, total))| {
        *s = simplest(s, points, weights, *total, inverse);
    });
    let sums = normal_equations(points, labelled, shapes);
    for ((s, n), (points, weights, _)) in shapes.iter_mut().zip(&sums).zip(&samples) {
        // What hardly shows in the points (the far axis of a short arc) can step far: a step that
        // fits the sample worse is none.
        let worse = |next: &Shape| {
            weighted_sq(next, points, weights) > 1.001 * weighted_sq(s, points, weights)
        };
        if let Some(next) = n.step(s, 3.0 * sigma).filter(|next| !worse(next)) {
            *s = next;
        }
    }
}

/// Weighted sum of squared distances.
fn weighted_sq(shape: &Shape, points: &[Vec3], weights: &[f64]) -> f64 {
    points.iter().zip(weights).map(|(p, w)| w * shape.distance(p).powi(2)).sum()
}

/// Each region's points and weights, thinned to the sample size, and its total weight.
fn samples(
    points: &[Vec3],
    labelled: &Labelled,
    regions: usize,
) -> Vec<(Vec<Vec3>, Vec<f64>, f64)> {
    let mut count = vec![0usize; regions];
    for &l in &labelled.labels {
        if l >= 0 {
            count[l as usize] += 1;
        }
    }
    let stride: Vec<usize> = count.iter().map(|c| c.div_ceil(SAMPLE).max(1)).collect();
    let mut seen = vec![0usize; regions];
    let mut out = vec![(Vec::new(), Vec::new(), 0.0); regions];
    let mut shares = labelled.shares.iter().peekable();
    let mut give = |l: i32, i: usize, w: f64| {
        let l = l as usize;
        out[l].2 += w;
        if seen[l].is_multiple_of(stride[l]) {
            out[l].0.push(points[i]);
            out[l].1.push(w);
        }
        seen[l] += 1;
    };
    for (i, &l) in labelled.labels.iter().enumerate() {
        if shares.peek().is_some_and(|s| s.0 as usize == i) {
            for &(l, w) in shares.next().map_or(&[][..], |s| &s.1) {
                give(l, i, w);
            }
        } else if l >= 0 {
            give(l, i, 1.0);
        }
    }
    out
}

/// The normal equations of every region over all points, in one pass.
fn normal_equations(points: &[Vec3], labelled: &Labelled, shapes: &[Shape]) -> Vec<Normal> {
    let parts: Vec<Vec<(i32, Normal)>> = labelled
        .labels
        .par_chunks(CHUNK)
        .enumerate()
        .map(|(c, labels)| {
            let first = c * CHUNK;
            let from = labelled.shares.partition_point(|s| (s.0 as usize) < first);
            let mut shares = labelled.shares[from..].iter().peekable();
            let mut sums: Vec<(i32, Normal)> = Vec::new();
            let mut give = |l: i32, p: &Vec3, w: f64| {
                let k = sums.iter().position(|s| s.0 == l).unwrap_or_else(|| {
                    sums.push((l, Normal::default()));
                    sums.len() - 1
                });
                sums[k].1.add(&shapes[l as usize], p, w);
            };
            for (k, &l) in labels.iter().enumerate() {
                let i = first + k;
                if shares.peek().is_some_and(|s| s.0 as usize == i) {
                    for &(l, w) in shares.next().map_or(&[][..], |s| &s.1) {
                        give(l, &points[i], w);
                    }
                } else if l >= 0 {
                    give(l, &points[i], 1.0);
                }
            }
            sums
        })
        .collect();
    let mut out = vec![Normal::default(); shapes.len()];
    for (l, n) in parts.into_iter().flatten() {
        out[l as usize].merge(&n);
    }
    out
}

/// The shape fitted to weighted points, or a simpler family nested in its own where that one's
/// description length is less. `total` is the weight of all points of which these are a sample.
fn simplest(shape: &Shape, points: &[Vec3], weights: &[f64], total: f64, inverse: f64) -> Shape {
    let o = Options { cauchy: None, steps: 6, tolerance: 1e-7 };
    let fitted = |s: &Shape, steps| {
        let f = fit(s, points, Some(weights), &Options { steps, ..o })?;
        let length = f.shape.family.description_length(total as usize);
        Some((f.mean_sq * total * inverse + length, f.shape))
    };
    let Some(mut best) = fitted(shape, o.steps) else { return *shape };
    for s in nested(&best.1) {
        if let Some(f) = fitted(&s, 15)
            && f.0 < best.0
        {
            best = f;
        }
    }
    best.1
}

/// Simpler shapes near this one, for a start.
fn nested(s: &Shape) -> Vec<Shape> {
    let [a, b, c] = s.size;
    match s.family {
        Family::Cone => vec![Shape { family: Family::Cylinder, size: [a.abs(), 0.0, 0.0], ..*s }],
        Family::EllipticCylinder => {
            vec![Shape { family: Family::Cylinder, size: [(a * b).sqrt(), 0.0, 0.0], ..*s }]
        }
        Family::Ellipsoid => {
            vec![Shape { family: Family::Sphere, size: [(a * b * c).cbrt(), 0.0, 0.0], ..*s }]
        }
        _ => Vec::new(),
    }
}

/// The shares of a scene's points beside boundaries.
pub fn shares(scene: &Scene, model: &Model, sigma: f64) -> Vec<Share> {
    let inverse = 1.0 / (sigma * sigma);
    (0..scene.len())
        .into_par_iter()
        .with_min_len(1024)
        .filter_map(|i| {
            let own = model.labels[i];
            let near = scene.neighbours(i);
            let label = |j: u32| model.labels[j as usize];
            let mut found = [0; MOST];
            let m = candidates(own, near.iter().map(|&j| label(j)), &mut found);
            if own < 0 || m < 2 {
                return None;
            }
            let shape = |l: i32| &model.shapes[l as usize];
            let (all, m) = energies(&scene.points, i, near, &found[..m], shape, label, inverse);
            let share = posterior(all[..m].iter().map(|e| (e.label, e.evidence)));
            share.iter().any(|s| s.0 != own).then_some((i as u32, share))
        })
        .collect()
}
