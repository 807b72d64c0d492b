//! A trial move: what a region's points and those around it would cost under another surface.

use crate::fit::constant::constants;
use crate::fit::least_squares::{Options, fit};
use crate::fit::{Ruler, Shape};
use crate::geometry::Vec3;
use crate::segment::family::Families;
use crate::segment::label::energy::Energies;
use crate::segment::label::labelling::Labelling;
use crate::segment::moves::settle::is_another;
use crate::segment::objective::{ACCEPT, FEW, SURFACE, unassigned};
use crate::segment::partition::Partition;
use crate::segment::prepare::scene::Scene;

constants! {
    /// Rings of neighbours around a region that a move may relabel.
    RINGS: usize = 3, Effort("points that one move may relabel");
    /// Rounds of relabelling and refitting inside one trial move.
    ROUNDS: usize = 3, Effort("rounds of one trial");
    /// Sweeps of one such relabelling.
    SWEEPS: usize = 3, Effort("sweeps of one relabelling");
    /// Points that a fit looks at.
    SAMPLE: usize = 6000, Effort("points of one fit");
    /// Steps of a fit.
    pub STEPS: usize = 8, Effort("steps of one fit");
}

/// Points looked at between two looks at whether the work was cancelled.
const WATCHED: usize = 512;

/// The region's points and the rings around it.
fn affected(scene: &Scene, region: &[u32], slot: &mut [u32]) -> Vec<u32> {
    let mut points = region.to_vec();
    for (k, &i) in points.iter().enumerate() {
        slot[i as usize] = k as u32 + 1;
    }
    let mut from = 0;
    for _ in 0..RINGS.get() {
        let to = points.len();
        for k in from..to {
            for &j in scene.neighbours(points[k] as usize) {
                if slot[j as usize] == 0 {
                    points.push(j);
                    slot[j as usize] = points.len() as u32;
                }
            }
        }
        from = to;
    }
    points
}

/// Where one region's surface is tried anew: the points that it may win or lose.
pub struct Place<'a> {
    scene: &'a Scene<'a>,
    /// Labels and surfaces as they are.
    labels: &'a [i32],
    rulers: &'a [Ruler],
    region: i32,
    /// The points, the region's own first; `slot` holds each one's place among them plus one, 0 elsewhere.
    points: Vec<u32>,
    slot: &'a mut [u32],
    at: Vec<Vec3>,
    /// What each point costs under the label it has.
    costs: Vec<f64>,
    /// Whether all of a point's neighbours belong to the region, as itself does.
    inside: Vec<bool>,
    inverse: f64,
    /// How many points say the same.
    repeats: f64,
}

impl<'a> Place<'a> {
    /// The place of a region; `slot` is nought everywhere.
    pub fn new(
        scene: &'a Scene<'a>,
        model: &'a Partition,
        rulers: &'a [Ruler],
        region: usize,
        group: &[u32],
        slot: &'a mut [u32],
        families: &Families,
    ) -> Self {
        let (sigma, repeats) = (families.sigma, families.repeats());
        let (labels, inverse) = (&model.labels[..], 1.0 / (sigma * sigma));
        let region = region as i32;
        let points = affected(scene, group, slot);
        let at: Vec<Vec3> = points.iter().map(|&i| scene.points[i as usize]).collect();
        let mut costs = vec![0.0; points.len()];
        let own = |i: u32| labels[i as usize];
        for ((cost, p), &i) in costs.iter_mut().zip(&at).zip(&points).skip(group.len()) {
            let l = own(i);
            *cost =
                if l < 0 { unassigned() } else { rulers[l as usize].distance(p).powi(2) * inverse };
        }
        let inside = |&i: &u32| scene.neighbours(i as usize).iter().all(|&j| own(j) == region);
        let inside = points.iter().enumerate().map(|(k, i)| k < group.len() && inside(i)).collect();
        Self { scene, labels, rulers, region, points, slot, at, costs, inside, inverse, repeats }
    }

    /// Leaves `slot` as it was.
    pub fn leave(self) {
        for i in self.points {
            self.slot[i as usize] = 0;
        }
    }
}

/// Labels of a place's points under another surface for its region.
struct Tried<'a> {
    place: &'a Place<'a>,
    labels: &'a [i32],
    ruler: &'a Ruler,
}

impl Labelling for Tried<'_> {
    fn point(&self, i: u32) -> &Vec3 {
        &self.place.scene.points[i as usize]
    }

    fn neighbours(&self, i: u32) -> &[u32] {
        self.place.scene.neighbours(i as usize)
    }

    fn label(&self, i: u32) -> i32 {
        let s = self.place.slot[i as usize];
        if s > 0 { self.labels[s as usize - 1] } else { self.place.labels[i as usize] }
    }

    fn ruler(&self, label: i32) -> &Ruler {
        if label == self.place.region { self.ruler } else { &self.place.rulers[label as usize] }
    }

    fn inverse(&self) -> f64 {
        self.place.inverse
    }
}

/// A trial move: labels of the place's points under another surface.
pub struct Trial<'a> {
    place: &'a Place<'a>,
    labels: Vec<i32>,
    /// Points to look at in the next sweep: those beside a change.
    open: Vec<bool>,
    /// Points whose neighbours all have the region's label.
    inside: Vec<bool>,
    distances: Vec<f64>,
}

impl<'a> Trial<'a> {
    /// A trial in this place.
    pub fn new(place: &'a Place<'a>) -> Self {
        let labels: Vec<i32> = place.points.iter().map(|&i| place.labels[i as usize]).collect();
        let n = labels.len();
        Self {
            place,
            labels,
            open: vec![true; n],
            inside: place.inside.clone(),
            distances: vec![0.0; n],
        }
    }

    /// Energy of the points after relabelling them with `start` in the region's place, and the surface that
    /// it has become.
    pub fn run(mut self, start: &Shape, sigma: f64, refit: bool) -> (f64, Shape) {
        let mut shape = *start;
        for round in 0..ROUNDS.get() {
            if self.place.scene.cancelled() {
                break;
            }
            self.relabel(&shape);
            let last = !refit || round + 1 == ROUNDS.get();
            if last {
                break;
            }
            let own = self.own();
            if own.len() < FEW.get() {
                break;
            }
            let thin: Vec<Vec3> =
                own.iter().step_by(own.len().div_ceil(SAMPLE.get())).copied().collect();
            let o =
                Options { cauchy: Some(ACCEPT.get() * sigma), steps: STEPS.get(), tolerance: 1e-5 };
            match fit(&shape, &thin, None, &o) {
                Some(f) if is_another(&shape, &f.shape, &thin, sigma) => shape = f.shape,
                // the same labels would come of it
                _ => break,
            }
        }
        (self.energy(&shape), shape)
    }

    fn own(&self) -> Vec<Vec3> {
        let own = |l: &i32| *l == self.place.region;
        self.place.at.iter().zip(&self.labels).filter(|(_, l)| own(l)).map(|(p, _)| *p).collect()
    }

    /// A few sweeps, of which the first looks at every point.
    fn relabel(&mut self, shape: &Shape) {
        let ruler = Ruler::of(shape);
        ruler.distances(&self.place.at, &mut self.distances);
        self.open.fill(true);
        for _ in 0..SWEEPS.get() {
            let mut changed = false;
            for k in 0..self.labels.len() {
                if k % WATCHED == 0 && self.place.scene.cancelled() {
                    return;
                }
                if std::mem::take(&mut self.open[k]) {
                    changed |= self.look(k, &ruler);
                }
            }
            if !changed {
                break;
            }
        }
    }

    /// Puts the best label on a point. Whether that is another than it had.
    fn look(&mut self, k: usize, ruler: &Ruler) -> bool {
        let place = self.place;
        let (i, old) = (place.points[k] as usize, self.labels[k]);
        let near = place.scene.neighbours(i);
        let best = if self.inside[k] && old == place.region {
            let sq = self.distances[k].powi(2) * place.inverse;
            if sq <= unassigned() { old } else { -1 }
        } else {
            Energies::near(&Tried { place, labels: &self.labels, ruler }, i as u32).best()
        };
        if best == old {
            return false;
        }
        self.labels[k] = best;
        self.open[k] = true;
        for &j in near {
            let s = place.slot[j as usize] as usize;
            if s > 0 {
                self.open[s - 1] = true;
                self.inside[s - 1] = false;
            }
        }
        true
    }

    fn energy(&self, shape: &Shape) -> f64 {
        let place = self.place;
        let count = self.labels.iter().filter(|l| **l == place.region).count();
        let worth = (count as f64 / place.repeats) as usize;
        let mut length = shape.family.description_length(worth);
        if count < FEW.get() {
            length += SURFACE.get();
        }
        let mut e = 0.0;
        for (k, &l) in self.labels.iter().enumerate() {
            e += if l == place.region {
                self.distances[k].powi(2) * place.inverse
            } else if l == place.labels[place.points[k] as usize] {
                place.costs[k]
            } else if l >= 0 {
                place.rulers[l as usize].distance(&place.at[k]).powi(2) * place.inverse
            } else {
                unassigned()
            };
        }
        e / place.repeats + length
    }
}
