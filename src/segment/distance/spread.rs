//! From a sample's labels to every point's.
//!
//! Sample and cloud share one Morton order, so the points between two neighbours of the sample lie
//! beside them: their candidates are the labels around those two. Where one candidate is near, the point takes
//! it at once; only points near several surfaces look at their neighbours.

use std::num::NonZero;

use kiddo::{ImmutableKdTree, SquaredEuclidean};
use rayon::prelude::*;

use super::engine::Model;
use super::label::{ACCEPT, MOST, candidates, energies};
use super::scene::{K, Scene};
use crate::geometry::Vec3;

/// Points worked on at once; fixed, so that the result does not depend on the number of threads.
const CHUNK: usize = 4096;

/// What a point between surfaces counts for each of them.
pub type Share = (u32, Vec<(i32, f64)>);

/// Labels of all points, and the shares of those between surfaces.
pub struct Labelled {
    /// One label a point, -1 = none.
    pub labels: Vec<i32>,
    /// Points that count for more than one surface, ascending.
    pub shares: Vec<Share>,
}

/// Labels `points` (in Morton order) from the model of a sample of them; sample point k is point
/// k * points / sample.
pub fn spread(points: &[Vec3], scene: &Scene, model: &Model, sigma: f64) -> Labelled {
    let around = labels_around(scene, &model.labels);
    let m = scene.len();
    let inverse = 1.0 / (sigma * sigma);
    let mut labels = vec![-1; points.len()];
    // Per chunk: points near several surfaces, points near none, and which stretches of the sample they are in.
    let open: Vec<(Vec<u32>, Vec<u32>)> = labels
        .par_chunks_mut(CHUNK)
        .enumerate()
        .map(|(c, labels)| {
            let (mut several, mut none) = (Vec::new(), Vec::new());
            let mut candidates: Vec<i32> = Vec::new();
            let mut stretch = usize::MAX;
            for (k, label) in labels.iter_mut().enumerate() {
                let i = c * CHUNK + k;
                let q = (i * m / points.len()).min(m - 1);
                if q != stretch {
                    stretch = q;
                    candidates.clear();
                    for beside in &around[q.saturating_sub(1)..(q + 2).min(m)] {
                        for &l in beside {
                            if !candidates.contains(&l) {
                                candidates.push(l);
                            }
                        }
                    }
                }
                let mut near = 0;
                let mut best = (f64::INFINITY, -1);
                for &l in &candidates {
                    let r = model.shapes[l as usize].distance(&points[i]).powi(2) * inverse;
                    if r <= ACCEPT * ACCEPT {
                        near += 1;
                        if r < best.0 {
                            best = (r, l);
                        }
                    }
                }
                *label = best.1;
                match near {
                    0 => none.push(i as u32),
                    1 => {}
                    _ => several.push(i as u32),
                }
            }
            (several, none)
        })
        .collect();
    let several: Vec<u32> = open.iter().flat_map(|o| o.0.iter().copied()).collect();
    let none: Vec<u32> = open.iter().flat_map(|o| o.1.iter().copied()).collect();
    second_look(points, scene, model, &around, &none, &mut labels, inverse);
    let shares = settle_shared(points, model, &several, &mut labels, inverse);
    Labelled { labels, shares }
}

/// The distinct labels of each sample point and its neighbours.
fn labels_around(scene: &Scene, labels: &[i32]) -> Vec<Vec<i32>> {
    (0..scene.len())
        .into_par_iter()
        .with_min_len(1024)
        .map(|i| {
            let mut out = Vec::with_capacity(2);
            for l in scene.neighbours(i).iter().map(|&j| labels[j as usize]).chain([labels[i]]) {
                if l >= 0 && !out.contains(&l) {
                    out.push(l);
                }
            }
            out
        })
        .collect()
}

/// Points near none of their stretch's candidates look at those of the sample points nearest in space:
/// the curve jumps now and then.
fn second_look(
    points: &[Vec3],
    scene: &Scene,
    model: &Model,
    around: &[Vec<i32>],
    none: &[u32],
    labels: &mut [i32],
    inverse: f64,
) {
    let raw: Vec<[f64; 3]> = scene.points.iter().map(|p| (*p).into()).collect();
    let Ok(tree) = ImmutableKdTree::<f64, 3>::new_from_slice(&raw) else { return };
    let found: Vec<i32> = none
        .par_iter()
        .with_min_len(256)
        .map(|&i| {
            let p = &points[i as usize];
            let nearest =
                tree.query(&[p.x, p.y, p.z]).nearest_one::<SquaredEuclidean<f64>>().execute();
            let mut best = (ACCEPT * ACCEPT, -1);
            for &l in &around[nearest.item as usize] {
                let r = model.shapes[l as usize].distance(p).powi(2) * inverse;
                if r <= best.0 {
                    best = (r, l);
                }
            }
            best.1
        })
        .collect();
    for (&i, l) in none.iter().zip(found) {
        labels[i as usize] = l;
    }
}

/// Places the points near several surfaces by their own and their neighbours' evidence.
fn settle_shared(
    points: &[Vec3],
    model: &Model,
    several: &[u32],
    labels: &mut [i32],
    inverse: f64,
) -> Vec<Share> {
    if several.is_empty() {
        return Vec::new();
    }
    // Neighbours are looked for among the stretches of the order that hold such points, and some beyond.
    let mut beside = vec![false; points.len().div_ceil(REACH)];
    for &i in several {
        let b = i as usize / REACH;
        for b in b.saturating_sub(1)..(b + 2).min(beside.len()) {
            beside[b] = true;
        }
    }
    let pool: Vec<u32> = (0..points.len() as u32).filter(|&i| beside[i as usize / REACH]).collect();
    let raw: Vec<[f64; 3]> = pool.iter().map(|&i| points[i as usize].into()).collect();
    let Ok(tree) = ImmutableKdTree::<f64, 3>::new_from_slice(&raw) else { return Vec::new() };
    let k = NonZero::new(K + 1).unwrap_or(NonZero::<usize>::MIN);
    let frozen: &[i32] = labels;
    let placed: Vec<(i32, Vec<(i32, f64)>)> = several
        .par_iter()
        .with_min_len(128)
        .map(|&i| {
            let p = &points[i as usize];
            let near = tree.query(&[p.x, p.y, p.z]).nearest_n::<SquaredEuclidean<f64>>(k).execute();
            let near: Vec<u32> =
                near.iter().map(|f| pool[f.item as usize]).filter(|&j| j != i).take(K).collect();
            place(points, model, frozen, i, &near, inverse)
        })
        .collect();
    let mut shares = Vec::new();
    for (&i, (l, share)) in several.iter().zip(placed) {
        labels[i as usize] = l;
        if share.len() > 1 {
            shares.push((i, share));
        }
    }
    shares
}

/// Points of the order between two marks of where neighbours are looked for.
const REACH: usize = 64;

fn place(
    points: &[Vec3],
    model: &Model,
    labels: &[i32],
    i: u32,
    near: &[u32],
    inverse: f64,
) -> (i32, Vec<(i32, f64)>) {
    let own = labels[i as usize];
    let label = |j: u32| labels[j as usize];
    let mut found = [0; MOST];
    let m = candidates(own, near.iter().map(|&j| label(j)), &mut found);
    let shape = |l: i32| &model.shapes[l as usize];
    let (all, m) = energies(points, i as usize, near, &found[..m], shape, label, inverse);
    let best = all[..m].iter().min_by(|a, b| a.total().total_cmp(&b.total()));
    let share = posterior(all[..m].iter().map(|e| (e.label, e.evidence)));
    (best.map_or(own, |e| e.label), share)
}

/// Shares of the labels from their energies, those above 1 %.
pub fn posterior(energies: impl Iterator<Item = (i32, f64)> + Clone) -> Vec<(i32, f64)> {
    let least = energies.clone().map(|e| e.1).fold(f64::INFINITY, f64::min);
    let weighed: Vec<(i32, f64)> = energies.map(|(l, e)| (l, (-0.5 * (e - least)).exp())).collect();
    let total: f64 = weighed.iter().map(|w| w.1).sum();
    weighed.into_iter().map(|(l, w)| (l, w / total)).filter(|w| w.1 > 0.01).collect()
}
