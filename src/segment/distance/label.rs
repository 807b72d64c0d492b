//! Placing boundaries: every point takes the label with the least energy.

use rayon::prelude::*;

use super::scene::{K, Scene};
use crate::fit::{Ruler, Shape};
use crate::geometry::Vec3;

/// A point further than this many sigmas from every candidate stays unassigned.
pub const ACCEPT: f64 = 4.0;
/// Cost of each neighbour with another label.
const DISAGREEMENT: f64 = 0.3;
/// A neighbour says at most this much for one label against another across a smooth joint.
const SMOOTH_CUT: f64 = 16.0;
/// And this much across a sharp edge: a point past it says that it lies there itself, not that its
/// neighbour does.
const SHARP_CUT: f64 = 1.0;
/// Surfaces that part by more than this within a neighbourhood, squared and in sigmas, meet at a sharp edge.
const SHARP: f64 = ACCEPT * ACCEPT;
/// Evidence for one label over the next best that needs no more points' word.
const ENOUGH: f64 = 12.0;
/// Rings of neighbours' neighbours that are asked where there is less than that.
const RINGS: usize = 2;
/// Most points asked: three rings of a surface's.
const ASKED: usize = 256;
/// Most labels met at one point: its own and its neighbours'.
const MOST: usize = K + 1;

/// What labels are placed by: points, their neighbours, labels and surfaces.
pub trait Labelling {
    /// A point.
    fn point(&self, i: u32) -> &Vec3;
    /// The nearest other points to a point, nearest first, at most `K` of them.
    fn neighbours(&self, i: u32) -> &[u32];
    /// A point's label, -1 = none.
    fn label(&self, i: u32) -> i32;
    /// The surface of a label.
    fn ruler(&self, label: i32) -> &Ruler;
    /// 1 / sigma2.
    fn inverse(&self) -> f64;

    /// Squared distance of a point from a label's surface, in sigmas.
    fn sq(&self, label: i32, i: u32) -> f64 {
        self.ruler(label).distance(self.point(i)).powi(2) * self.inverse()
    }
}

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

/// What a label costs at a point.
#[derive(Clone, Copy, Debug, Default)]
pub struct Energy {
    /// The label.
    pub label: i32,
    /// Its own r2/sigma2 and its neighbours' evidence about that surface.
    pub evidence: f64,
    /// A little for each neighbour with another label.
    pub against: f64,
}

impl Energy {
    fn total(&self) -> f64 {
        self.evidence + self.against
    }
}

/// What the labels met at a point cost there.
pub struct Energies {
    all: [Energy; MOST],
    len: usize,
}

impl Energies {
    /// Energies at point `i` of its own label and its neighbours', of those within reach of it.
    ///
    /// The neighbours' evidence is what places a smooth joint better than the point alone can: there each
    /// tells the surfaces apart a little, and together they tell much. Two surfaces that join smoothly part with
    /// the square of the way from the joint, on either side alike: the more of their points are asked, the
    /// better, as long as they see one joint and no edge. So rings of neighbours are added until they tell enough.
    pub fn at(of: &impl Labelling, i: u32) -> Self {
        let (mut met, parting) = Met::heard(of, i);
        let mut asked = None;
        for ring in 1..=RINGS {
            let width = (ring + 1) as f64;
            if met.len < 2 || parting * width * width > SHARP || met.margin() > ENOUGH {
                break;
            }
            let asked = asked.get_or_insert_with(|| Asked::of(of.neighbours(i)));
            met.ask(of, asked.widen(of, i), SMOOTH_CUT);
        }
        met.energies()
    }

    /// [`at`](Self::at) by the nearest neighbours alone: for trials of surfaces, whose labels do not stay.
    pub fn near(of: &impl Labelling, i: u32) -> Self {
        Met::heard(of, i).0.energies()
    }

    /// The labels and their costs.
    pub fn iter(&self) -> impl Iterator<Item = &Energy> + Clone {
        self.all[..self.len].iter()
    }

    /// The label with the least energy, -1 where none lies within reach.
    pub fn best(&self) -> i32 {
        self.iter().min_by(|a, b| a.total().total_cmp(&b.total())).map_or(-1, |e| e.label)
    }
}

/// The labels met at a point, and what was heard about each.
struct Met {
    len: usize,
    labels: [i32; MOST],
    /// Squared distance of the point from each surface, in sigmas.
    own: [f64; MOST],
    /// What the points asked add to it.
    around: [f64; MOST],
    /// How many of them have each label.
    for_it: [u32; MOST],
    asked: u32,
}

impl Met {
    /// The distinct labels of a point and its neighbours, the point's own first.
    fn of(of: &impl Labelling, i: u32) -> Self {
        let (mut len, mut labels) = (0, [0; MOST]);
        let near = of.neighbours(i).iter().map(|&j| of.label(j));
        for l in std::iter::once(of.label(i)).chain(near) {
            if l >= 0 && !labels[..len].contains(&l) {
                labels[len] = l;
                len += 1;
            }
        }
        let mut own = [0.0; MOST];
        own.iter_mut().zip(&labels[..len]).for_each(|(own, &l)| *own = of.sq(l, i));
        Self { len, labels, own, around: [0.0; MOST], for_it: [0; MOST], asked: 0 }
    }

    /// What the nearest neighbours of a point say, and how far surfaces part among them.
    fn heard(of: &impl Labelling, i: u32) -> (Self, f64) {
        let near = of.neighbours(i);
        let mut met = Self::of(of, i);
        let parting = met.parting(of, i, near);
        met.ask(of, near, if parting > SHARP { SHARP_CUT } else { SMOOTH_CUT });
        (met, parting)
    }

    /// Adds what points say, each at most `cut`.
    fn ask(&mut self, of: &impl Labelling, points: &[u32], cut: f64) {
        for points in points.chunks(K) {
            // Mostly two surfaces meet: the table is no larger than it need be.
            match self.len {
                ..=2 => self.ask_few::<2>(of, points, cut),
                3..=5 => self.ask_few::<5>(of, points, cut),
                _ => self.ask_few::<MOST>(of, points, cut),
            }
        }
    }

    fn ask_few<const M: usize>(&mut self, of: &impl Labelling, points: &[u32], cut: f64) {
        let n = points.len();
        let mut at = [Vec3::zeros(); K];
        at.iter_mut().zip(points).for_each(|(p, &j)| *p = *of.point(j));
        let mut sq = [[0.0; K]; M];
        let mut least = [f64::INFINITY; K];
        let inverse = of.inverse();
        for (sq, &l) in sq.iter_mut().zip(&self.labels[..self.len]) {
            of.ruler(l).distances(&at[..n], sq);
            for (sq, least) in sq[..n].iter_mut().zip(&mut least) {
                *sq = sq.powi(2) * inverse;
                *least = least.min(*sq);
            }
        }
        for c in 0..self.len {
            self.around[c] +=
                sq[c][..n].iter().zip(&least).map(|(sq, least)| (sq - least).min(cut)).sum::<f64>();
            let l = self.labels[c];
            self.for_it[c] += points.iter().filter(|&&j| of.label(j) == l).count() as u32;
        }
        self.asked += n as u32;
    }

    /// By how much the evidence for the best label exceeds that for the next.
    fn margin(&self) -> f64 {
        let mut best = [f64::INFINITY; 2];
        for e in self.energies().iter().map(|e| e.evidence) {
            best = if e < best[0] { [e, best[0]] } else { [best[0], best[1].min(e)] };
        }
        best[1] - best[0]
    }

    /// Of the labels within reach.
    fn energies(&self) -> Energies {
        let (mut all, mut len) = ([Energy::default(); MOST], 0);
        for c in (0..self.len).filter(|&c| self.own[c] <= ACCEPT * ACCEPT) {
            let others = (self.asked - self.for_it[c]) as f64;
            let evidence = self.own[c] + self.around[c];
            all[len] = Energy { label: self.labels[c], evidence, against: DISAGREEMENT * others };
            len += 1;
        }
        Energies { all, len }
    }

    /// By how much the two nearest surfaces part within the neighbourhood if they meet at the point, squared and in
    /// sigmas: much where they meet at an edge that single neighbours see.
    fn parting(&self, of: &impl Labelling, i: u32, near: &[u32]) -> f64 {
        let (true, Some(&middle)) = (self.len > 1, near.get(near.len() / 2)) else { return 0.0 };
        // The nearest, and the nearest of the others; the first where several are as near.
        let nearest = |but: usize| {
            let others = (0..self.len).filter(|&c| c != but);
            others.min_by(|&a, &b| self.own[a].total_cmp(&self.own[b])).unwrap_or(0)
        };
        let a = nearest(usize::MAX);
        let p = of.point(i);
        let sq_reach = (of.point(middle) - p).norm_squared();
        let [a, b] = [a, nearest(a)].map(|c| of.ruler(self.labels[c]).shape().offset(p).normal);
        a.cross(&b).norm_squared() * sq_reach * of.inverse()
    }
}

/// The points asked about a point's label, ring after ring.
struct Asked {
    points: [u32; ASKED],
    len: usize,
    /// Where the last ring begins.
    last: usize,
}

impl Asked {
    fn of(near: &[u32]) -> Self {
        let mut points = [0; ASKED];
        points[..near.len()].copy_from_slice(near);
        Self { points, len: near.len(), last: 0 }
    }

    /// Adds the neighbours of the last ring that are not yet among them, and returns these.
    fn widen(&mut self, of: &impl Labelling, i: u32) -> &[u32] {
        let from = std::mem::replace(&mut self.last, self.len);
        for k in from..self.last {
            for &j in of.neighbours(self.points[k]) {
                if self.len < ASKED && j != i && !self.points[..self.len].contains(&j) {
                    self.points[self.len] = j;
                    self.len += 1;
                }
            }
        }
        &self.points[self.last..self.len]
    }
}

/// Points looked at between two looks at whether the work was cancelled.
const WATCHED: u32 = 256;

/// Relabels points beside a boundary until none changes, at most `sweeps` times. Returns the changes
/// of the last sweep.
///
/// Most points lie inside a region, where there is nothing to choose: one look at all of them finds the others.
pub fn relabel(
    scene: &Scene,
    shapes: &[Shape],
    labels: &mut [i32],
    sigma: f64,
    sweeps: usize,
) -> usize {
    let inverse = 1.0 / (sigma * sigma);
    let n = scene.len();
    let rulers: Vec<Ruler> = shapes.iter().map(Ruler::of).collect();
    let frozen: &[i32] = labels;
    let of = SceneLabels { scene, rulers: &rulers, labels: frozen, inverse };
    let mut active: Vec<u32> = (0..n as u32)
        .into_par_iter()
        .with_min_len(4096)
        .filter(|&i| {
            (i % WATCHED != 0 || !scene.cancelled()) && best_label(&of, i) != frozen[i as usize]
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
        return if of.sq(own, i) <= ACCEPT * ACCEPT { own } else { -1 };
    }
    Energies::at(of, i).best()
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
