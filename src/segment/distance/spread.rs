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
use super::nearest::{Runs, Search};
use super::scene::{K, Scene};
use crate::fit::Ruler;
use crate::geometry::Vec3;
use crate::segment::{Cancelled, Monitor};

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
///
/// # Errors
/// `monitor` cancelled the work.
pub fn spread(
    points: &[Vec3],
    scene: &Scene,
    model: &Model,
    sigma: f64,
    monitor: &dyn Monitor,
) -> Result<Labelled, Cancelled> {
    let around = Around::of(scene, &model.labels);
    let rulers: Vec<Ruler> = model.shapes.iter().map(Ruler::of).collect();
    let inverse = 1.0 / (sigma * sigma);
    let mut labels = vec![-1; points.len()];
    let open: Vec<Open> = labels
        .par_chunks_mut(CHUNK)
        .enumerate()
        .map(|(c, labels)| {
            if monitor.cancelled() {
                return Open::default();
            }
            let mut nearest = Nearest { rulers: &rulers, inverse, first: c * CHUNK, labels };
            nearest.label(points, &around)
        })
        .collect();
    monitor.check()?;
    let several: Vec<u32> = open.iter().flat_map(|o| o.several.iter().copied()).collect();
    let none: Vec<u32> = open.iter().flat_map(|o| o.none.iter().copied()).collect();
    second_look(points, scene, &rulers, &around, &none, &mut labels, inverse);
    monitor.check()?;
    let shares = if model.form_error {
        let sample = (scene, &model.labels[..]);
        settle_by_sample(points, sample, &rulers, &several, &mut labels, inverse, monitor)
    } else {
        settle_shared(points, &rulers, &several, &mut labels, inverse, monitor)
    };
    monitor.check()?;
    Ok(Labelled { labels, shares })
}

/// Points of a chunk that are near several surfaces, and those near none.
#[derive(Default)]
struct Open {
    several: Vec<u32>,
    none: Vec<u32>,
}

/// Labels of a chunk of points by the nearest surface.
struct Nearest<'a> {
    rulers: &'a [Ruler],
    inverse: f64,
    /// The place of the chunk's first point.
    first: usize,
    labels: &'a mut [i32],
}

impl Nearest<'_> {
    /// Labels the chunk, one stretch between two points of the sample after the other.
    fn label(&mut self, points: &[Vec3], around: &Around) -> Open {
        let (n, m) = (points.len(), around.len());
        let (mut from, end) = (self.first, self.first + self.labels.len());
        let mut open = Open::default();
        let mut candidates = Vec::new();
        let mut scratch = Scratch::default();
        while from < end {
            let q = (from * m / n).min(m - 1);
            let to = if q + 1 < m { ((q + 1) * n).div_ceil(m).min(end) } else { end };
            around.beside(q, &mut candidates);
            self.label_stretch(&points[from..to], from, &candidates, &mut scratch, &mut open);
            from = to;
        }
        open
    }

    fn label_stretch(
        &mut self,
        points: &[Vec3],
        from: usize,
        candidates: &[i32],
        scratch: &mut Scratch,
        open: &mut Open,
    ) {
        let n = points.len();
        let labels = &mut self.labels[from - self.first..][..n];
        let (d, best, near) = scratch.cleared(n);
        for &l in candidates {
            self.rulers[l as usize].distances(points, d);
            for k in 0..n {
                let sq = d[k] * d[k] * self.inverse;
                let within = sq <= ACCEPT * ACCEPT;
                near[k] += u32::from(within);
                if within && sq < best[k] {
                    best[k] = sq;
                    labels[k] = l;
                }
            }
        }
        for (i, near) in (from as u32..).zip(near) {
            match near {
                0 => open.none.push(i),
                1 => {}
                _ => open.several.push(i),
            }
        }
    }
}

/// Memory for one stretch, used again for the next.
#[derive(Default)]
struct Scratch {
    distances: Vec<f64>,
    best: Vec<f64>,
    near: Vec<u32>,
}

impl Scratch {
    fn cleared(&mut self, n: usize) -> (&mut [f64], &mut [f64], &mut [u32]) {
        self.distances.resize(n.max(self.distances.len()), 0.0);
        self.best.clear();
        self.best.resize(n, f64::INFINITY);
        self.near.clear();
        self.near.resize(n, 0);
        (&mut self.distances[..n], &mut self.best, &mut self.near)
    }
}

/// The distinct labels of each sample point and its neighbours.
struct Around {
    /// Where each point's labels end.
    ends: Vec<u32>,
    labels: Vec<i32>,
}

impl Around {
    fn of(scene: &Scene, labels: &[i32]) -> Self {
        let starts: Vec<usize> = (0..scene.len()).step_by(CHUNK).collect();
        let parts: Vec<Self> = starts
            .into_par_iter()
            .map(|from| {
                let mut part = Self { ends: Vec::new(), labels: Vec::new() };
                for i in from..scene.len().min(from + CHUNK) {
                    let start = part.labels.len();
                    let near = scene.neighbours(i).iter().map(|&j| labels[j as usize]);
                    near.chain([labels[i]]).for_each(|l| add_label(&mut part.labels, start, l));
                    part.ends.push(part.labels.len() as u32);
                }
                part
            })
            .collect();
        let mut out = Self { ends: Vec::with_capacity(scene.len()), labels: Vec::new() };
        for part in parts {
            let before = out.labels.len() as u32;
            out.ends.extend(part.ends.into_iter().map(|e| e + before));
            out.labels.extend(part.labels);
        }
        out
    }

    fn len(&self) -> usize {
        self.ends.len()
    }

    fn at(&self, i: usize) -> &[i32] {
        let start = if i == 0 { 0 } else { self.ends[i - 1] };
        &self.labels[start as usize..self.ends[i] as usize]
    }

    /// The labels around point `q` of the sample and the two beside it in the order.
    fn beside(&self, q: usize, into: &mut Vec<i32>) {
        into.clear();
        for i in q.saturating_sub(1)..(q + 2).min(self.len()) {
            self.at(i).iter().for_each(|&l| add_label(into, 0, l));
        }
    }
}

/// Adds a label that is not yet among those from `start` on.
fn add_label(labels: &mut Vec<i32>, start: usize, l: i32) {
    if l >= 0 && !labels[start..].contains(&l) {
        labels.push(l);
    }
}

/// The sample's points by where they lie; `None` of none.
fn tree(scene: &Scene) -> Option<ImmutableKdTree<f64, 3>> {
    let raw: Vec<[f64; 3]> = scene.points.iter().map(|p| (*p).into()).collect();
    ImmutableKdTree::new_from_slice(&raw).ok()
}

/// Points near none of their stretch's candidates look at those of the sample points nearest in space:
/// the curve jumps now and then.
fn second_look(
    points: &[Vec3],
    scene: &Scene,
    rulers: &[Ruler],
    around: &Around,
    none: &[u32],
    labels: &mut [i32],
    inverse: f64,
) {
    if none.is_empty() {
        return;
    }
    let Some(tree) = tree(scene) else { return };
    let found: Vec<i32> = none
        .par_iter()
        .with_min_len(256)
        .map(|&i| {
            let p = &points[i as usize];
            let nearest =
                tree.query(&[p.x, p.y, p.z]).nearest_one::<SquaredEuclidean<f64>>().execute();
            let mut best = (ACCEPT * ACCEPT, -1);
            for &l in around.at(nearest.item as usize) {
                let r = rulers[l as usize].distance(p).powi(2) * inverse;
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
    rulers: &[Ruler],
    several: &[u32],
    labels: &mut [i32],
    inverse: f64,
    monitor: &dyn Monitor,
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
    let own: Vec<Vec3> = pool.iter().map(|&i| points[i as usize]).collect();
    let runs = Runs::of(&own);
    let frozen: &[i32] = labels;
    let watched = || (!monitor.cancelled()).then(Search::default);
    let placed: Vec<(i32, Vec<(i32, f64)>)> = several
        .par_iter()
        .with_min_len(128)
        .with_max_len(WATCHED)
        .map_init(watched, |search, &i| {
            let Some(search) = search else { return (-1, Vec::new()) };
            let at = pool.partition_point(|&j| j < i);
            let near = runs.nearest(at, search).0.map(|k| pool.get(k as usize).copied());
            let near: Vec<u32> = near.into_iter().flatten().collect();
            place(points, rulers, frozen, i, &near, inverse)
        })
        .collect();
    put(several, placed, labels)
}

/// Places the points near several surfaces by their own evidence and that of the sample's around them: with a
/// form error the nearest points all tell the same.
fn settle_by_sample(
    points: &[Vec3],
    (scene, sample): (&Scene, &[i32]),
    rulers: &[Ruler],
    several: &[u32],
    labels: &mut [i32],
    inverse: f64,
    monitor: &dyn Monitor,
) -> Vec<Share> {
    let (Some(tree), Some(k)) = (tree(scene), NonZero::new(K)) else { return Vec::new() };
    let (n, m) = (points.len(), scene.len());
    for (k, &l) in sample.iter().enumerate() {
        labels[super::place(k, m, n)] = l;
    }
    let frozen: &[i32] = labels;
    let watched = || (!monitor.cancelled()).then_some(&tree);
    let placed: Vec<(i32, Vec<(i32, f64)>)> = several
        .par_iter()
        .with_min_len(128)
        .with_max_len(WATCHED)
        .map_init(watched, |tree, &i| {
            let Some(tree) = tree else { return (-1, Vec::new()) };
            let p = &points[i as usize];
            let found =
                tree.query(&[p.x, p.y, p.z]).nearest_n::<SquaredEuclidean<f64>>(k).execute();
            let place_of = |k: usize| super::place(k, m, n) as u32;
            let near: Vec<u32> = found.iter().map(|f| place_of(f.item as usize)).collect();
            place(points, rulers, frozen, i, &near, inverse)
        })
        .collect();
    put(several, placed, labels)
}

/// Gives points their labels. Returns those that count for several surfaces.
fn put(several: &[u32], placed: Vec<(i32, Vec<(i32, f64)>)>, labels: &mut [i32]) -> Vec<Share> {
    let mut shares = Vec::new();
    for (&i, (l, share)) in several.iter().zip(placed) {
        labels[i as usize] = l;
        if share.len() > 1 {
            shares.push((i, share));
        }
    }
    shares
}

/// Points between surfaces that are placed between two looks at whether the work was cancelled.
const WATCHED: usize = 1024;

/// Points of the order between two marks of where neighbours are looked for.
const REACH: usize = 64;

fn place(
    points: &[Vec3],
    rulers: &[Ruler],
    labels: &[i32],
    i: u32,
    near: &[u32],
    inverse: f64,
) -> (i32, Vec<(i32, f64)>) {
    let own = labels[i as usize];
    let label = |j: u32| labels[j as usize];
    let mut found = [0; MOST];
    let m = candidates(own, near.iter().map(|&j| label(j)), &mut found);
    let ruler = |l: i32| &rulers[l as usize];
    let (all, m) = energies(points, i as usize, near, &found[..m], ruler, label, inverse);
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
