//! Joining regions that are one surface.

use std::collections::BTreeMap;

use rayon::prelude::*;

use crate::fit::constant::constants;
use crate::fit::least_squares::{Options, fit};
use crate::fit::{Family, Shape};
use crate::geometry::Vec3;
use crate::segment::family::Families;
use crate::segment::moves::directions::{Directions, asked};
use crate::segment::moves::glance::Glance;
use crate::segment::moves::memo::{Key, Memo, Move};
use crate::segment::objective::{ACCEPT, BORDER, SOUND};
use crate::segment::partition::{Partition, members, retain};
use crate::segment::prepare::scene::Scene;
use crate::segment::prepare::take::take;

constants! {
    /// Points of each region that a joint fit looks at: too few cannot tell apart two large planes a
    /// sigma from each other.
    MERGE_SAMPLE: usize = 1500, Effort("points of one fit");
    /// Points of each region that the cheap look takes.
    LOOK: usize = 100, Effort("points of one look");
    /// Share of the larger region's reach by which most of its points may miss the other's surface for the two to be tried
    /// as one.
    MISSED: f64 = 0.1, Effort("pairs that are not tried; the larger the fewer are missed");
    /// Cosine of the angle between axes beyond which two surfaces are not one.
    ALONG: f64 = 0.9, Effort("pairs that are not tried; the smaller the fewer are missed");
    /// Mean truncated chi2 of the other's points beyond which a surface is no start for both.
    MISSES: f64 = 8.0, Effort("starts that are not tried");
    /// Steps of a joint fit.
    STEPS: usize = 20, Effort("steps of one fit");
}

/// Joins pairs of regions whose joint fit costs less description length: pairs of one family
/// wherever they lie, and neighbours of unlike families under either one's.
pub fn merge(scene: &Scene, model: &mut Partition, families: &Families) -> usize {
    if !families.policy.merge {
        return 0;
    }
    let mut merges = 0;
    loop {
        if scene.cancelled() {
            return merges;
        }
        let found = found(scene, model, families, 0);
        let joined = join(model, &found);
        if joined == 0 {
            return merges;
        }
        merges += joined;
    }
}

/// Pairs of regions whose joint fit costs less, the best first; of those that are not known to be none the ones whose
/// second is `from` or later.
pub fn found(scene: &Scene, model: &mut Partition, families: &Families, from: usize) -> Vec<Joint> {
    model.note(scene, families.sigma);
    let pairs = Pairs::of(scene, model, families);
    let open: Vec<(usize, usize)> = pairs.open().into_iter().filter(|p| p.1 >= from).collect();
    let keys = open.iter().map(|&(a, b)| Memo::key(&model.changes, Move::Merge, a, [b]));
    let keys: Vec<Option<Key>> = keys.collect();
    let tried = |(&(a, b), key): (&(usize, usize), &Option<Key>)| {
        let skipped = model.vain.is_vain(key.as_ref()) || scene.cancelled();
        if skipped { None } else { pairs.joint(a, b) }
    };
    let tried: Vec<Option<Joint>> = open.par_iter().zip(&keys).map(tried).collect();
    model.vain.add(keys, &tried);
    let mut found: Vec<Joint> = tried.into_iter().flatten().collect();
    found.sort_by(|x, y| x.saved.total_cmp(&y.saved).then(x.pair.cmp(&y.pair)));
    found
}

/// One surface for two regions.
pub struct Joint {
    /// What it costs more than the two.
    saved: f64,
    /// The two.
    pub pair: (usize, usize),
    /// It.
    pub shape: Shape,
}

/// Joins pairs of regions in the order given, each region once. Returns how many went.
fn join(model: &mut Partition, found: &[Joint]) -> usize {
    let mut to: Vec<i32> = (0..model.shapes.len() as i32).collect();
    let mut used = vec![false; to.len()];
    let mut joined = 0;
    for Joint { pair: (a, b), shape, .. } in found {
        if used[*a] || used[*b] {
            continue;
        }
        (used[*a], used[*b]) = (true, true);
        to[*b] = *a as i32;
        model.shapes[*a] = *shape;
        joined += 1;
    }
    if joined > 0 {
        for l in model.labels.iter_mut().filter(|l| **l >= 0) {
            *l = to[*l as usize];
        }
        let keep: Vec<bool> = to.iter().enumerate().map(|(k, t)| k as i32 == *t).collect();
        retain(model, &keep);
    }
    joined
}

/// The regions of a partition, two at a time.
struct Pairs<'a> {
    scene: &'a Scene<'a>,
    shapes: &'a [Shape],
    groups: Vec<Vec<u32>>,
    samples: Vec<Vec<Vec3>>,
    touching: BTreeMap<(usize, usize), usize>,
    directions: Directions,
    families: &'a Families,
}

impl<'a> Pairs<'a> {
    fn of(scene: &'a Scene<'a>, model: &'a Partition, families: &'a Families) -> Self {
        let shapes = &model.shapes[..];
        let groups = members(&model.labels, shapes.len());
        let samples = groups.iter().map(|g| take(scene, g, MERGE_SAMPLE.get())).collect();
        let touching = model.changes.borders();
        let directions = Directions::of(scene, shapes, &groups);
        Self { scene, shapes, groups, samples, touching, directions, families }
    }

    /// Those that may be one surface: of one family wherever they lie, or neighbours.
    fn open(&self) -> Vec<(usize, usize)> {
        let glances: Vec<Glance> = self.samples.iter().map(|s| Glance::of(s, LOOK.get())).collect();
        let shapes = self.shapes;
        let may_be = |a: usize, b: usize| {
            let known = !self.samples[a].is_empty() && !self.samples[b].is_empty();
            known
                && if shapes[a].family == shapes[b].family {
                    could_be_one([&shapes[a], &shapes[b]], [&glances[a], &glances[b]])
                } else {
                    self.touching.contains_key(&(a, b))
                }
        };
        let m = shapes.len();
        let with = |a: usize| {
            let end = if self.scene.cancelled() { 0 } else { m };
            (a + 1..end).filter(move |&b| may_be(a, b)).map(move |b| (a, b))
        };
        (0..m).into_par_iter().flat_map_iter(with).collect()
    }

    fn cost(&self, s: &Shape, points: &[Vec3]) -> f64 {
        self.families.misfit(s, points)
    }

    fn is_sound(&self, s: &Shape, points: &[Vec3]) -> bool {
        self.families.score(*s, points).chi2 <= SOUND.get() * points.len() as f64
    }

    /// One surface for two regions, where it costs less than theirs.
    fn joint(&self, a: usize, b: usize) -> Option<Joint> {
        let Self { samples, groups, .. } = self;
        let (sa, sb) = (&self.shapes[a], &self.shapes[b]);
        let points: Vec<Vec3> = samples[a].iter().chain(&samples[b]).copied().collect();
        let needed = asked(&points, groups[a].len() + groups[b].len());
        let length = |s: &Shape, p: &[Vec3]| match s.family {
            Family::Plane => self.directions.length(s, p, needed, self.families),
            family => family.description_length(self.families.worth(points.len())),
        };
        let alone = |k: usize| {
            let (s, p) = (&self.shapes[k], &samples[k]);
            self.cost(s, p) + length(s, p)
        };
        let share = points.len() as f64 / (groups[a].len() + groups[b].len()) as f64;
        let edges = self.touching.get(&(a, b)).map_or(0.0, |n| *n as f64);
        let apart = alone(a) + alone(b) + BORDER.get() * edges * share;
        // Both halves must lie on it: a region whose own surface is poor saves nothing.
        let sound = |s: &Shape| self.is_sound(s, &samples[a]) && self.is_sound(s, &samples[b]);
        let is_one = |s: &Shape| sound(s) && !self.families.degenerate(s, &points);
        let mut best: Option<(f64, Shape)> = None;
        if sa.family == Family::Plane && sb.family == Family::Plane {
            let parallel = self.directions.plane(&points, &sa.w(), needed, self.families);
            best = parallel.filter(|(s, _)| sound(s)).map(|(s, c)| (c, s));
        }
        for (s, other) in [(sa, &samples[b]), (sb, &samples[a])] {
            // A surface that misses most of the other's points is no start for both.
            if sa.family != sb.family
                && self.families.score(*s, other).chi2 > MISSES.get() * other.len() as f64
            {
                continue;
            }
            let cauchy = Some(ACCEPT.get() * self.families.sigma);
            let o = Options { cauchy, steps: STEPS.get(), tolerance: 1e-4 };
            let Some(f) = fit(s, &points, None, &o).filter(|f| is_one(&f.shape)) else { continue };
            let c = self.cost(&f.shape, &points) + length(&f.shape, &points);
            if best.is_none_or(|b| c < b.0) {
                best = Some((c, f.shape));
            }
        }
        let (joint, shape) = best?;
        (joint < apart).then_some(Joint { saved: joint - apart, pair: (a, b), shape })
    }
}

/// A cheap look before the joint fit: whether sizes and directions are near enough to try.
fn could_be_one([a, b]: [&Shape; 2], [of_a, of_b]: [&Glance; 2]) -> bool {
    let axial = a.family != Family::Sphere && a.family != Family::Ellipsoid;
    if axial && a.w().dot(&b.w()).abs() <= ALONG.get() {
        return false;
    }
    let most = MISSED.get() * of_a.reach.max(of_b.reach);
    if of_b.least_distance(a).min(of_a.least_distance(b)) >= most {
        return false;
    }
    of_b.distance(a).min(of_a.distance(b)) < most
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::fits::Random;
    use crate::segment::fixtures;

    #[test]
    fn two_halves_of_the_noise_of_one_sheet_are_one_region_and_a_step_of_its_size_is_two() {
        let random = &mut Random::new(4);
        let sheet = |step: f64, random: &mut Random| -> Vec<Vec3> {
            let mut at = || {
                let (x, y) = (random.uniform(0.0, 50.0), random.uniform(0.0, 50.0));
                Vec3::new(x, y, random.normal() + if x < 25.0 { 0.0 } else { step })
            };
            (0..2000).map(|_| at()).collect()
        };
        let families = Families { sigma: 1.0, floor: 1.0, max_radius: 1e3, ..fixtures::families() };
        let plane =
            |z: f64| Shape::with_axis(Family::Plane, Vec3::new(25.0, 25.0, z), Vec3::z(), [0.0; 3]);
        // One sheet, whose points took the surface that their neighbours lie nearer to.
        let scene = Scene::new(sheet(0.0, random));
        let side = |i: usize| {
            let around = scene.neighbours(i).iter().map(|&j| scene.points[j as usize].z);
            i32::from(around.sum::<f64>() > 0.0)
        };
        let labels: Vec<i32> = (0..scene.len()).map(side).collect();
        let mut model =
            Partition { shapes: vec![plane(-0.1), plane(0.1)], labels, ..Partition::default() };
        assert_eq!(merge(&scene, &mut model, &families), 1);
        // Two sheets a sigma apart.
        let scene = Scene::new(sheet(1.0, random));
        let labels = scene.points.iter().map(|p| i32::from(p.x > 25.0)).collect();
        let mut model =
            Partition { shapes: vec![plane(0.0), plane(1.0)], labels, ..Partition::default() };
        assert_eq!(merge(&scene, &mut model, &families), 0);
    }
}
