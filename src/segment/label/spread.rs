//! From a sample's labels to every point's.
//!
//! Sample and cloud share one Morton order, so the points between two neighbours of the sample lie
//! beside them: their candidates are the labels around those two. Where one candidate is near, the point takes
//! it at once; only points near several surfaces look at their neighbours.

use kiddo::SquaredEuclidean;
use rayon::prelude::*;

use crate::fit::{Ruler, Shape};
use crate::geometry::Vec3;
use crate::segment::label::around::{Around, CHUNK};
use crate::segment::label::between::{Between, WATCHED, nearest, tree};
use crate::segment::label::shares::Labelled;
use crate::segment::objective::unassigned;
use crate::segment::partition::Partition;
use crate::segment::prepare::scene::Scene;
use crate::segment::{Cancelled, Monitor};

/// Labels `points` (in Morton order) from the model of a sample of them, which knows its places among them.
///
/// # Errors
/// `monitor` cancelled the work.
pub fn spread(
    points: &[Vec3],
    scene: &Scene,
    model: &Partition,
    sigma: f64,
    monitor: &dyn Monitor,
) -> Result<Labelled, Cancelled> {
    let around = Around::of(scene, &model.labels);
    monitor.check()?;
    let places: Vec<i64> = scene.places.iter().map(|&k| i64::from(k)).collect();
    spread_by(
        points,
        &Guide { points: &scene.points, places: &places, around: &around },
        &model.shapes,
        sigma,
        monitor,
    )
}

/// What points are labelled by: some of them, or of those around.
pub struct Guide<'a> {
    /// The sample's points in Morton order.
    pub points: &'a [Vec3],
    /// The place of each among the points to label, rising: -1 for those before the first, their number for those
    /// after the last.
    pub places: &'a [i64],
    /// The labels around each.
    pub around: &'a Around,
}

/// Labels `points` (in Morton order) by a `guide`, with the surfaces `shapes`.
///
/// # Errors
/// `monitor` cancelled the work.
pub fn spread_by(
    points: &[Vec3],
    guide: &Guide,
    shapes: &[Shape],
    sigma: f64,
    monitor: &dyn Monitor,
) -> Result<Labelled, Cancelled> {
    let around = guide.around;
    let rulers: Vec<Ruler> = shapes.iter().map(Ruler::of).collect();
    let inverse = 1.0 / (sigma * sigma);
    let mut labels = vec![-1; points.len()];
    let open: Vec<Open> = labels
        .par_chunks_mut(CHUNK)
        .enumerate()
        .map(|(c, labels)| {
            if monitor.cancelled() {
                return Open::default();
            }
            let places = guide.places;
            let mut nearest =
                Nearest { rulers: &rulers, inverse, places, first: c * CHUNK, labels };
            nearest.label(points, around)
        })
        .collect();
    monitor.check()?;
    let several: Vec<u32> = open.iter().flat_map(|o| o.several.iter().copied()).collect();
    let none: Vec<u32> = open.iter().flat_map(|o| o.none.iter().copied()).collect();
    second_look(points, guide, &rulers, &none, &mut labels, inverse, monitor);
    monitor.check()?;
    let near = nearest(points, &several, monitor);
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
    /// The places of the sample's points.
    places: &'a [i64],
    /// The place of the chunk's first point.
    first: usize,
    labels: &'a mut [i32],
}

impl Nearest<'_> {
    /// Labels the chunk, one stretch between two points of the sample after the other.
    fn label(&mut self, points: &[Vec3], around: &Around) -> Open {
        let (mut from, end) = (self.first, self.first + self.labels.len());
        // The last point of the sample before these, or the first.
        let mut q = self.places.partition_point(|&k| k < from as i64).saturating_sub(1);
        let mut open = Open::default();
        let mut candidates = Vec::new();
        let mut scratch = Scratch::default();
        while from < end {
            let to = self.places.get(q + 1).map_or(end, |&next| end.min((next + 1) as usize));
            around.beside(q, &mut candidates);
            self.label_stretch(&points[from..to], from, &candidates, &mut scratch, &mut open);
            (from, q) = (to, q + 1);
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
                let within = sq <= unassigned();
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

/// Points near none of their stretch's candidates look at those of the sample points nearest in space:
/// the curve jumps now and then.
fn second_look(
    points: &[Vec3],
    guide: &Guide,
    rulers: &[Ruler],
    none: &[u32],
    labels: &mut [i32],
    inverse: f64,
    monitor: &dyn Monitor,
) {
    if none.is_empty() {
        return;
    }
    let Some(tree) = tree(guide.points) else { return };
    let found: Vec<i32> = none
        .par_iter()
        .with_min_len(256)
        .with_max_len(WATCHED)
        .map_init(
            || monitor.cancelled(),
            |cancelled, &i| {
                if *cancelled {
                    return -1;
                }
                let p = &points[i as usize];
                let nearest =
                    tree.query(&[p.x, p.y, p.z]).nearest_one::<SquaredEuclidean<f64>>().execute();
                let mut best = (unassigned(), -1);
                for &l in guide.around.at(nearest.item as usize) {
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
