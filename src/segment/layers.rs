//! Surfaces of one cloud whose scatter differs, those with the least first.
//!
//! Where the scatter about surfaces is more than the noise between neighbours (smooth noise, form errors, a surface
//! rougher than others) it need not be the same everywhere. What surfaces with the least leave is a cloud of its
//! own, in which those with more are looked for.

use crate::fit::Shape;
use crate::fit::constant::constants;
use crate::geometry::Vec3;
use crate::segment::family::Families;
use crate::segment::judge::scatter::{LEVEL, ROUGH, roughest};
use crate::segment::label::shares::Labelled;
use crate::segment::moves::merge::{Joint, found};
use crate::segment::partition::Partition;
use crate::segment::prepare::noise::Noise;
use crate::segment::prepare::scene::Scene;
use crate::segment::sample::discover_on_samples;
use crate::segment::sample::discovery::Discovery;
use crate::segment::{Counters, Monitor, Parameters, SegmentError, Stage, finish, objective};

constants! {
    /// Layers looked for at most.
    LAYERS: usize = 5, Effort("scatters beside the first that are looked for");
    /// Layers in a row in which there is nothing, after which what is left is taken for no surface.
    VAIN: usize = 2, Effort("scatters beside the first that are looked for");
}

/// The surfaces of a cloud that scatter by about as much.
pub struct Layer<'a> {
    /// The points that they were looked for on, taken evenly from all of them.
    pub scene: Scene<'a>,
    /// The surfaces.
    pub shapes: Vec<Shape>,
    /// Largest distance of a point from each.
    pub reaches: Vec<f64>,
    /// The scatter that points were given to each by.
    pub sigmas: Vec<f64>,
    /// Each point's surface, -1 = none.
    pub labels: Vec<i32>,
    /// The scatter of independent points about the surfaces.
    pub noise: f64,
    /// How much work it was.
    pub counters: Counters,
    /// What was fitted at the scatter that was reckoned with, where other surfaces may have more.
    rougher: Option<Families>,
}

impl<'a> Layer<'a> {
    /// The surfaces of points in Morton order, of which `noise` is known.
    ///
    /// # Errors
    /// `monitor` cancelled the work.
    pub fn of(
        points: &[Vec3],
        noise: &Noise,
        parameters: &Parameters,
        monitor: &'a dyn Monitor,
    ) -> Result<Self, SegmentError> {
        let (discovery, labelled) = discover_on_samples(points, noise, parameters, monitor)?;
        monitor.progress(Stage::Refine, 0.85);
        let reach = objective::ACCEPT.get() * discovery.scatter(points.len());
        let Discovery { scene, mut model, families, noise, raised } = discovery;
        let sigma = families.sigma;
        if parameters.refine {
            finish::finish(points, &labelled, &mut model, sigma, monitor);
            monitor.check()?;
        }
        let (trials, merges) = (model.trials, model.merges);
        let counters =
            Counters { trials: trials.0, failed_trials: trials.1, merges, ..Counters::default() };
        let mut labels = labelled.labels;
        for l in labels.iter_mut().filter(|l| !model.is_surface(**l)) {
            *l = -1;
        }
        let shapes = model.shapes;
        let (reaches, sigmas) = (vec![reach; shapes.len()], vec![sigma; shapes.len()]);
        let rougher = raised.then_some(families);
        Ok(Self { scene, shapes, reaches, sigmas, labels, noise, counters, rougher })
    }

    /// Takes in what was found among those of `points` that are at `places`, and joins what is one surface.
    fn add(&mut self, other: Layer, points: &[Vec3], places: &[u32], monitor: &dyn Monitor) {
        let first = self.shapes.len() as i32;
        for (&place, l) in places.iter().zip(other.labels).filter(|(_, l)| *l >= 0) {
            self.labels[place as usize] = first + l;
        }
        self.shapes.extend(other.shapes);
        self.reaches.extend(other.reaches);
        self.sigmas.extend(other.sigmas);
        self.scene.work.leave_with(&other.scene.work);
        self.counters.trials += other.counters.trials;
        self.counters.failed_trials += other.counters.failed_trials;
        self.counters.merges += other.counters.merges;
        self.rougher = other.rougher;
        if let Some(families) = &self.rougher.clone() {
            while self.join(points, families, first as usize, monitor) {}
        }
    }

    /// Joins surfaces from the `first` on with those that are the same, at the scatter of the rougher. Returns whether
    /// there were any.
    fn join(
        &mut self,
        points: &[Vec3],
        families: &Families,
        first: usize,
        monitor: &dyn Monitor,
    ) -> bool {
        let labels = self.scene.places.iter().map(|&i| self.labels[i as usize]).collect();
        let mut model = Partition { shapes: self.shapes.clone(), labels, ..Partition::default() };
        let mut to: Vec<i32> = (0..model.shapes.len() as i32).collect();
        let mut own = vec![-1; to.len()];
        let mut joined = Partition::default();
        for Joint { pair: (a, b), shape, .. } in found(&self.scene, &mut model, families, first) {
            if own[a] < 0 && own[b] < 0 {
                (own[a], own[b], to[b]) = (joined.shapes.len() as i32, 0, a as i32);
                self.reaches[a] = self.reaches[a].max(self.reaches[b]);
                self.sigmas[a] = self.sigmas[a].max(self.sigmas[b]);
                joined.shapes.push(shape);
            }
        }
        if joined.shapes.is_empty() || monitor.cancelled() {
            return false;
        }
        self.counters.merges += joined.shapes.len();
        self.labels.iter_mut().filter(|l| **l >= 0).for_each(|l| *l = to[*l as usize]);
        let of_joined = |l: &i32| if *l < 0 { -1 } else { own[*l as usize] };
        let labels = self.labels.iter().map(of_joined).collect();
        let labelled = Labelled { labels, shares: Vec::new() };
        finish::finish(points, &labelled, &mut joined, families.sigma, monitor);
        for (shape, k) in self
            .shapes
            .iter_mut()
            .zip(&own)
            .zip(&to)
            .enumerate()
            .filter(|(k, (_, t))| **t == *k as i32)
            .map(|(_, (s, _))| s)
        {
            if *k >= 0 {
                *shape = joined.shapes[*k as usize];
            }
        }
        true
    }
}

/// A layer of all `points` and those with more scatter, among the points that each leaves, as long as that gives any
/// and leaves a good part.
///
/// # Errors
/// `monitor` cancelled the work.
pub fn with_rougher<'a>(
    mut all: Layer<'a>,
    points: &[Vec3],
    parameters: &Parameters,
    monitor: &'a dyn Monitor,
) -> Result<Layer<'a>, SegmentError> {
    let quiet = Quiet(monitor);
    // Some surfaces are rougher than others, but not beyond measure.
    let most = all.rougher.as_ref().map_or(0.0, |f| roughest(f.sigma));
    let mut vain = usize::from(all.labels.iter().all(|l| *l < 0));
    for _ in 0..LAYERS.get() {
        if vain == VAIN.get() {
            break;
        }
        let rougher = all.rougher.as_ref().filter(|_| parameters.noise_sigma.is_none());
        let Some(sigma) = rougher.map(|f| LEVEL * f.sigma).filter(|s| *s <= most) else { break };
        let left = (0..points.len() as u32).filter(|&i| all.labels[i as usize] < 0);
        let left: Vec<u32> = left.collect();
        let least = parameters.min_points.max((ROUGH.get() * points.len() as f64) as usize);
        if left.len() < least {
            break;
        }

        let own: Vec<Vec3> = left.iter().map(|&i| points[i as usize]).collect();
        let steps = all.scene.steps;
        let noise = Noise { sigma, steps, rougher: true, ..Noise::default() };
        let next = Layer::of(&own, &noise, parameters, &quiet)?;
        vain = if next.labels.iter().all(|l| *l < 0) { vain + 1 } else { 0 };
        all.add(next, points, &left, monitor);
    }
    Ok(all)
}

/// A monitor that hears of no progress.
struct Quiet<'a>(&'a dyn Monitor);

impl Monitor for Quiet<'_> {
    fn progress(&self, _: Stage, _: f64) {}

    fn cancelled(&self) -> bool {
        self.0.cancelled()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::fits::Random;
    use crate::segment::Silent;
    use crate::segment::fixtures::{self, SIGMA, ordered, smooth};

    /// A floor and a ball beside it, whose smooth noise is `more` times as large.
    fn floor_and_ball(more: f64) -> Vec<Vec3> {
        let random = &mut Random::new(8);
        let field = smooth(random);
        let mut points: Vec<Vec3> = Vec::new();
        for _ in 0..10_000 {
            let p = Vec3::new(random.uniform(0.0, 25.0), random.uniform(0.0, 25.0), 0.0);
            points.push(p + SIGMA * (0.7 * random.normal() + field(&p)) * Vec3::z());
        }
        for _ in 0..2000 {
            let d = Vec3::new(random.normal(), random.normal(), random.normal()).normalize();
            let p = Vec3::new(40.0, 10.0, 6.0) + 3.0 * d;
            points.push(p + more * SIGMA * (0.7 * random.normal() + field(&p)) * d);
        }
        ordered(&points)
    }

    fn found(points: &[Vec3]) -> Layer<'static> {
        let parameters = Parameters::default();
        let noise = crate::segment::prepare::noise::estimate(points, &[0.0; 3], &Silent);
        let first = Layer::of(points, &noise, &parameters, &Silent).unwrap();
        with_rougher(first, points, &parameters, &Silent).unwrap()
    }

    #[test]
    fn surfaces_whose_smooth_noise_differs_are_each_found_with_their_own_reach() {
        let points = floor_and_ball(5.0);
        let all = found(&points);
        let reach = |on: &dyn Fn(&Vec3) -> bool| {
            let labels = points.iter().zip(&all.labels).filter(|(p, _)| on(p)).map(|(_, l)| *l);
            let labels: Vec<i32> = labels.collect();
            let most = (0..all.shapes.len())
                .max_by_key(|&k| labels.iter().filter(|l| **l == k as i32).count());
            let most = most.unwrap();
            let share = labels.iter().filter(|l| **l == most as i32).count() as f64;
            assert!(share > 0.95 * labels.len() as f64, "{share} of {}", labels.len());
            all.reaches[most]
        };
        let (floor, ball) = (reach(&|p| p.x < 30.0), reach(&|p| p.x > 30.0));
        assert!(ball > 2.0 * floor, "{ball} {floor}");
    }

    #[test]
    fn what_two_layers_found_of_one_surface_is_joined() {
        let random = &mut Random::new(9);
        let sheet = |random: &mut Random, sigma: f64| {
            Vec3::new(random.uniform(0.0, 9.0), random.uniform(0.0, 9.0), sigma * random.normal())
        };
        let points: Vec<Vec3> =
            (0..4000).map(|k| sheet(random, if k < 2000 { SIGMA } else { 3.0 * SIGMA })).collect();
        let layer = |points: &[Vec3], sigma: f64| {
            let noise = Noise { sigma, rougher: true, ..Noise::default() };
            Layer::of(points, &noise, &Parameters::default(), &Silent).unwrap()
        };
        let (fine, rough) = points.split_at(2000);
        let mut all = layer(&points, SIGMA);
        let one = layer(fine, SIGMA);
        all.shapes.clone_from(&one.shapes);
        all.reaches.clone_from(&one.reaches);
        all.sigmas.clone_from(&one.sigmas);
        all.labels = one.labels.iter().copied().chain([-1; 2000]).collect();
        let mut other = layer(rough, 3.0 * SIGMA);
        let reach = other.reaches[0];
        other.rougher = Some(Families {
            sigma: 3.0 * SIGMA,
            floor: 0.0,
            max_radius: 1e3,
            ..fixtures::families()
        });
        assert_eq!((all.shapes.len(), other.shapes.len()), (1, 1));
        let merges = all.counters.merges + other.counters.merges;
        all.add(other, &points, &(2000..4000).collect::<Vec<u32>>(), &Silent);
        assert!(all.labels.iter().filter(|l| **l == 0).count() > 3900);
        assert_eq!((all.reaches[0], all.counters.merges), (reach, merges + 1));
    }
}
