//! From a sample's labels to every point's.
//!
//! Sample and cloud share one Morton order, so the points between two neighbours of the sample lie
//! beside them: their candidates are the labels around those two. Where one candidate is near, the point takes
//! it at once; only points near several surfaces look at their neighbours.

use std::num::NonZero;

use kiddo::{ImmutableKdTree, SquaredEuclidean};
use rayon::prelude::*;

use super::engine::Model;
use super::label::{ACCEPT, Energies, Labelling};
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
    monitor.check()?;
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
    // With a form error the nearest points all tell the same: those of the sample are asked.
    let near = if model.form_error {
        for (k, &l) in model.labels.iter().enumerate() {
            labels[super::place(k, scene.len(), points.len())] = l;
        }
        nearest_of_sample(points, scene, &several, monitor)
    } else {
        nearest(points, &several, monitor)
    };
    let between =
        Between { points, rulers: &rulers, labels: &labels, several: &several, near, inverse };
    let placed = between.placed(monitor);
    monitor.check()?;
    let mut shares = Vec::new();
    for (&i, (l, share)) in several.iter().zip(placed) {
        labels[i as usize] = l;
        if share.len() > 1 {
            shares.push((i, share));
        }
    }
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
                if scene.cancelled() {
                    return Self { ends: Vec::new(), labels: Vec::new() };
                }
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
        .with_max_len(WATCHED)
        .map_init(
            || scene.cancelled(),
            |cancelled, &i| {
                if *cancelled {
                    return -1;
                }
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
            },
        )
        .collect();
    for (&i, l) in none.iter().zip(found) {
        labels[i as usize] = l;
    }
}

/// Points between surfaces, and the neighbours that they are placed by.
struct Between<'a> {
    points: &'a [Vec3],
    rulers: &'a [Ruler],
    /// The points' labels before.
    labels: &'a [i32],
    /// The points to place, ascending.
    several: &'a [u32],
    /// The neighbours of each.
    near: Vec<Near>,
    inverse: f64,
}

/// A point's nearest neighbours, nearest first.
#[derive(Clone, Copy, Default)]
struct Near {
    places: [u32; K],
    len: usize,
}

impl FromIterator<u32> for Near {
    fn from_iter<I: IntoIterator<Item = u32>>(places: I) -> Self {
        let mut out = Self::default();
        for (to, place) in out.places.iter_mut().zip(places) {
            *to = place;
            out.len += 1;
        }
        out
    }
}

impl Labelling for Between<'_> {
    fn point(&self, i: u32) -> &Vec3 {
        &self.points[i as usize]
    }

    /// None of a point that is near one surface alone: there is nothing to ask around it.
    fn neighbours(&self, i: u32) -> &[u32] {
        let near = self.several.binary_search(&i).ok().and_then(|k| self.near.get(k));
        near.map_or(&[], |near| &near.places[..near.len])
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

impl Between<'_> {
    /// Each point's best label and its shares of several.
    fn placed(&self, monitor: &dyn Monitor) -> Vec<(i32, Vec<(i32, f64)>)> {
        self.several
            .par_iter()
            .with_min_len(128)
            .with_max_len(WATCHED)
            .map_init(
                || monitor.cancelled(),
                |cancelled, &i| {
                    if *cancelled {
                        return (-1, Vec::new());
                    }
                    let energies = Energies::at(self, i);
                    (energies.best(), posterior(&energies))
                },
            )
            .collect()
    }
}

/// The neighbours of points between surfaces, among all points.
fn nearest(points: &[Vec3], several: &[u32], monitor: &dyn Monitor) -> Vec<Near> {
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
    let watched = || (!monitor.cancelled()).then(Search::default);
    several
        .par_iter()
        .with_min_len(128)
        .with_max_len(WATCHED)
        .map_init(watched, |search, &i| {
            let Some(search) = search else { return Near::default() };
            let at = pool.partition_point(|&j| j < i);
            let near = runs.nearest(at, search).0;
            near.iter().filter_map(|&k| pool.get(k as usize).copied()).collect()
        })
        .collect()
}

/// The neighbours of points between surfaces among those of the sample.
fn nearest_of_sample(
    points: &[Vec3],
    scene: &Scene,
    several: &[u32],
    monitor: &dyn Monitor,
) -> Vec<Near> {
    let (Some(tree), Some(k)) = (tree(scene), NonZero::new(K)) else { return Vec::new() };
    let place_of = |k: u32| super::place(k as usize, scene.len(), points.len()) as u32;
    let watched = || (!monitor.cancelled()).then_some(&tree);
    several
        .par_iter()
        .with_min_len(128)
        .with_max_len(WATCHED)
        .map_init(watched, |tree, &i| {
            let Some(tree) = tree else { return Near::default() };
            let p = &points[i as usize];
            let found =
                tree.query(&[p.x, p.y, p.z]).nearest_n::<SquaredEuclidean<f64>>(k).execute();
            found.iter().map(|f| place_of(f.item)).collect()
        })
        .collect()
}

/// Points between surfaces that are placed between two looks at whether the work was cancelled.
const WATCHED: usize = 1024;

/// Points of the order between two marks of where neighbours are looked for.
const REACH: usize = 64;

/// Shares of the labels from their energies, those above 1 %.
pub fn posterior(energies: &Energies) -> Vec<(i32, f64)> {
    let least = energies.iter().map(|e| e.evidence).fold(f64::INFINITY, f64::min);
    let weighed = energies.iter().map(|e| (e.label, (-0.5 * (e.evidence - least)).exp()));
    let total: f64 = weighed.clone().map(|w| w.1).sum();
    weighed.map(|(l, w)| (l, w / total)).filter(|w| w.1 > 0.01).collect()
}
