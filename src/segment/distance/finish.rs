//! The last fits: all points, plain least squares, soft labels at the boundaries.

use rayon::prelude::*;

use super::engine::Model;
use super::label::members;
use super::scene::Scene;
use crate::fit::least_squares::{Options, fit};
use crate::fit::{Family, Shape};
use crate::geometry::Vec3;

/// Fits every surface to all its points.
///
/// A point beside a boundary counts for each surface it may belong to, by the posterior share of that label
/// given its own and its neighbours' residuals: hard labels erode the ends of an arc, which carry
/// most of what is known about it.
pub fn finish(scene: &Scene, model: &mut Model, sigma: f64) {
    let inverse = 1.0 / (sigma * sigma);
    let weights = soft_labels(scene, model, sigma);
    let shapes: Vec<Shape> = model
        .shapes
        .par_iter()
        .zip(weights)
        .map(|(s, w)| {
            let (points, weights): (Vec<Vec3>, Vec<f64>) =
                w.into_iter().map(|(i, w)| (scene.points[i as usize], w)).unzip();
            simplest(s, &points, &weights, inverse)
        })
        .collect();
    model.shapes = shapes;
}

/// The shape fitted to weighted points, or a simpler family nested in its own where that one's
/// description length is less.
fn simplest(shape: &Shape, points: &[Vec3], weights: &[f64], inverse: f64) -> Shape {
    let o = Options { cauchy: None, steps: 6, tolerance: 1e-7 };
    let total: f64 = weights.iter().sum();
    let fitted = |s: &Shape, steps| {
        let f = fit(s, points, Some(weights), &Options { steps, ..o })?;
        let length = f.shape.family.description_length(total as usize);
        Some((f.mean_sq * total * inverse + length, f.shape))
    };
    let Some(mut best) = fitted(shape, o.steps) else { return *shape };
    for s in nested(&best.1) {
        if let Some(f) = fitted(&s, 15) {
            if f.0 < best.0 {
                best = f;
            }
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

/// For each region its points with their weights.
fn soft_labels(scene: &Scene, model: &Model, sigma: f64) -> Vec<Vec<(u32, f64)>> {
    let inverse = 1.0 / (sigma * sigma);
    let mut out: Vec<Vec<(u32, f64)>> = members(&model.labels, model.shapes.len())
        .into_iter()
        .map(|g| g.into_iter().map(|i| (i, 1.0)).collect())
        .collect();
    let shared: Vec<(u32, Vec<(i32, f64)>)> = (0..scene.len())
        .into_par_iter()
        .with_min_len(1024)
        .filter_map(|i| {
            let own = model.labels[i];
            let mut near = vec![own];
            for &j in scene.neighbours(i) {
                let l = model.labels[j as usize];
                if l >= 0 && !near.contains(&l) {
                    near.push(l);
                }
            }
            if own < 0 || near.len() < 2 {
                return None;
            }
            let energy: Vec<(i32, f64)> = near
                .iter()
                .filter_map(|&l| {
                    let s = &model.shapes[l as usize];
                    let r = |p: &Vec3| (s.distance(p).powi(2) * inverse).min(16.0);
                    if r(&scene.points[i]) >= 16.0 {
                        return None;
                    }
                    let around: f64 =
                        scene.neighbours(i).iter().map(|&j| r(&scene.points[j as usize])).sum();
                    Some((l, r(&scene.points[i]) + around))
                })
                .collect();
            let least = energy.iter().map(|e| e.1).fold(f64::INFINITY, f64::min);
            let share: Vec<(i32, f64)> =
                energy.iter().map(|&(l, e)| (l, (-0.5 * (e - least)).exp())).collect();
            let total: f64 = share.iter().map(|s| s.1).sum();
            let share: Vec<_> =
                share.into_iter().map(|(l, w)| (l, w / total)).filter(|s| s.1 > 0.01).collect();
            share.iter().any(|s| s.0 != own).then_some((i as u32, share))
        })
        .collect();
    let mut place = vec![u32::MAX; scene.len()];
    for g in &out {
        for (k, &(i, _)) in g.iter().enumerate() {
            place[i as usize] = k as u32;
        }
    }
    for (i, share) in shared {
        let own = model.labels[i as usize];
        out[own as usize][place[i as usize] as usize].1 = 0.0;
        for (l, w) in share {
            if l == own {
                out[own as usize][place[i as usize] as usize].1 = w;
            } else {
                out[l as usize].push((i, w));
            }
        }
    }
    out
}
