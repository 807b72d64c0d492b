//! Growing hypotheses all over a scene.

use std::collections::VecDeque;

use rayon::prelude::*;

use crate::fit::Ruler;
use crate::fit::constant::constants;
use crate::segment::family::Families;
use crate::segment::grow::hypothesis::{Hypothesis, grow};
use crate::segment::grow::walk::Walk;
use crate::segment::prepare::candidates::K;
use crate::segment::prepare::scene::Scene;
use crate::segment::random::SplitMix64;
use crate::segment::{Cancelled, Monitor};

constants! {
    /// Seeds grown at once; fixed, so that the result does not depend on the number of threads.
    BATCH: usize = 4, Effort("seeds grown side by side");
    /// Failed seeds that one draw of the policy stands for.
    DRAW: usize = 8, Effort("seeds that may fail");
    /// Batches of seeds over which the search looks at what it still gains.
    LOOK_BACK: usize = 64, Effort("seeds that may fail");
    /// New points a seed of those batches below which it ends: what is left is noise, freeform or clutter.
    LEAST_YIELD: usize = 2, Effort("points below which seeds are not worth growing");
    /// Points a hypothesis needs to be kept, unless surfaces may have fewer.
    pub MIN_SUPPORT: usize = 30, Trial(30.0, 30.0);
    /// Points among which a seed is chosen.
    CHOICE: usize = 8, Effort("seeds compared");
    /// Points of the pool for each seed more at once: where there are few, seeds grown side by side find the same.
    CROWD: usize = 12_000, Effort("seeds grown side by side");
    /// Sigmas within which a point on a hypothesis is no seed again.
    COVERED: f64 = 2.5, Trial(2.5, 2.5);
    /// Points that a search may visit for each of a scene's: several times the 20 to 100 that searches for surfaces
    /// need.
    VISITS: usize = 400, Effort("work that is allowed");
    /// The same beside that: as many as a hundred seeds visit.
    VISITS_BESIDE: usize = 1_000_000, Effort("work that is allowed");
}

/// The work that a search on so many points may be, in points visited: only where hardly anything grows, or everything
/// a little, it comes to more.
pub fn allowance(points: usize) -> u64 {
    (VISITS_BESIDE.get() + VISITS.get() * points) as u64
}

/// A search for hypotheses all over a scene.
pub struct Search<'a> {
    /// The scene.
    pub scene: &'a Scene<'a>,
    /// What may be fitted.
    pub families: &'a Families,
    /// Seeds tried at most.
    pub most: usize,
    /// Points that growth may visit, and what takes as long.
    pub visits: u64,
    /// Of the random generator.
    pub seed: u64,
    /// Points that were seeds in vain before, and are none again; empty where there was no search before.
    pub vain: &'a [bool],
}

impl<'a> Search<'a> {
    /// A search from all points.
    pub fn new(scene: &'a Scene<'a>, families: &'a Families, seed: u64) -> Self {
        let visits = allowance(scene.len());
        Self { scene, families, most: usize::MAX, visits, seed, vain: &[] }
    }

    /// Grows hypotheses until every point is covered or has been tried, `most` seeds were tried or what was found
    /// so far is `enough`, or the work comes to more than is allowed for so many points. In the order of their seeds.
    ///
    /// # Errors
    /// `monitor` cancelled the work.
    pub fn run(
        &self,
        trials: &mut (usize, usize),
        enough: impl Fn(&[Hypothesis]) -> bool,
        monitor: &dyn Monitor,
    ) -> Result<Vec<Hypothesis>, Cancelled> {
        let Self { scene, families, most, .. } = *self;
        let before = trials.0;
        let allowed = scene.work.done() + self.visits;
        let least = MIN_SUPPORT.get().min(families.policy.least);
        let mut seeds = Seeds::new(scene, self.seed, self.vain);
        let mut walks: Vec<Walk> = (0..BATCH.get()).map(|_| Walk::new(scene.len())).collect();
        let mut out: Vec<Hypothesis> = Vec::new();
        let (mut failures, mut yields) = (0, Yields::default());
        while failures < families.policy.failures * DRAW.get() && trials.0 - before < most {
            monitor.check()?;
            let batch = seeds.draw();
            if batch.is_empty() {
                break;
            }
            if scene.work.done() > allowed {
                scene.work.leave();
                break;
            }
            let grown: Vec<Option<Hypothesis>> = batch
                .par_iter()
                .zip(walks.par_iter_mut())
                .map(|(&s, walk)| grow(scene, walk, families, s, least))
                .collect();
            trials.0 += batch.len();
            let mut newly = 0;
            for h in grown {
                let Some(h) = h else {
                    trials.1 += 1;
                    failures += 1;
                    continue;
                };
                failures = 0;
                newly += seeds.cover(&h, families.sigma);
                out.push(h);
            }
            if yields.is_least(batch.len(), newly) || enough(&out) {
                break;
            }
        }
        Ok(out)
    }
}

/// Points that a look back at what the search gains takes account of.
#[derive(Default)]
struct Yields(VecDeque<(usize, usize)>);

impl Yields {
    /// Whether so many seeds, which covered so many new points, and those before gain too little to go on.
    fn is_least(&mut self, seeds: usize, newly: usize) -> bool {
        self.0.push_back((seeds, newly));
        if self.0.len() <= LOOK_BACK.get() {
            return false;
        }
        self.0.pop_front();
        let (tried, gained) = self.0.iter().fold((0, 0), |s, y| (s.0 + y.0, s.1 + y.1));
        gained < tried * LEAST_YIELD.get()
    }
}

/// Points that growth may start from: what is once covered or tried is none again.
struct Seeds<'a> {
    scene: &'a Scene<'a>,
    covered: Vec<bool>,
    tried: Vec<bool>,
    /// All that may be, and some that no longer are.
    pool: Vec<u32>,
    random: SplitMix64,
}

impl<'a> Seeds<'a> {
    fn new(scene: &'a Scene<'a>, seed: u64, vain: &[bool]) -> Self {
        let n = scene.len();
        let mut tried = vain.to_vec();
        tried.resize(n, false);
        let pool = (0..n as u32).filter(|&i| !tried[i as usize]).collect();
        Self { scene, covered: vec![false; n], tried, pool, random: SplitMix64::new(seed) }
    }

    /// The next seeds, the smoothest of a few each: interiors before edges, yet a tight arc has its turn.
    fn draw(&mut self) -> Vec<usize> {
        let mut seeds = Vec::new();
        for _ in 0..BATCH.get().min(2 + self.pool.len() / CROWD.get()) {
            let few: Vec<usize> = (0..CHOICE.get()).map_while(|_| self.pick()).collect();
            let rough = |i: &usize| self.scene.roughness[*i];
            let smoothest = few.into_iter().min_by(|a, b| rough(a).total_cmp(&rough(b)));
            let Some(s) = smoothest else { break };
            self.tried[s] = true;
            for &j in self.scene.neighbours(s) {
                self.tried[j as usize] = true;
            }
            seeds.push(s);
        }
        seeds
    }

    /// Any point that may be a seed; those met that may not leave the pool.
    fn pick(&mut self) -> Option<usize> {
        while !self.pool.is_empty() {
            let k = self.random.below(self.pool.len());
            let i = self.pool[k] as usize;
            if self.is_open(i) {
                return Some(i);
            }
            self.pool.swap_remove(k);
        }
        None
    }

    fn is_open(&self, i: usize) -> bool {
        let free = |j: &&u32| !self.covered[**j as usize];
        !self.covered[i]
            && !self.tried[i]
            && self.scene.neighbours(i).iter().filter(free).count() * 2 >= K
    }

    /// Covers what a hypothesis explains. Returns how many points that were not covered before.
    fn cover(&mut self, h: &Hypothesis, sigma: f64) -> usize {
        let ruler = Ruler::of(&h.shape);
        let mut newly = 0;
        for &j in &h.support {
            if ruler.distance(&self.scene.points[j as usize]).abs() < COVERED.get() * sigma {
                newly += usize::from(!self.covered[j as usize]);
                self.covered[j as usize] = true;
            }
        }
        newly
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::Family;
    use crate::geometry::Vec3;
    use crate::segment::Silent;
    use crate::segment::fixtures;
    use crate::segment::grow::seeded::TRIED;

    #[test]
    fn a_search_that_comes_to_its_bound_ends_and_the_scene_knows() {
        let mut random = SplitMix64::new(7);
        let mut uniform = || 8.0 * random.below(1 << 30) as f64 / f64::from(1 << 30);
        // Faces far apart: each takes a seed of its own.
        let faces = (0..20).flat_map(|k| (0..100).map(move |_| 100.0 * f64::from(k)));
        let points = faces.map(|z| Vec3::new(uniform(), uniform(), z)).collect();
        let scene = Scene::new(fixtures::ordered(&Vec::from_iter::<Vec<Vec3>>(points)));
        let families = Families { sigma: 1e-3, floor: 1e-3, ..fixtures::families() };
        let run = |visits: Option<u64>| {
            let all = Search::new(&scene, &families, 1);
            let search = Search { visits: visits.unwrap_or(all.visits), ..all };
            search.run(&mut (0, 0), |_| false, &Silent).unwrap().len()
        };
        assert!(run(None) >= 20 && !scene.work.is_left());
        let few = run(Some(TRIED.get() as u64));
        assert!((1..10).contains(&few) && scene.work.is_left(), "{few}");
    }

    #[test]
    fn a_cone_without_noise_is_found_whole_from_any_seed() {
        let mut random = SplitMix64::new(5);
        let mut uniform = || random.below(1 << 30) as f64 / f64::from(1 << 30);
        let at = |_| {
            let (t, h) = (std::f64::consts::TAU * uniform(), uniform());
            let radius = 26.0 - 6.0 * h;
            Vec3::new(radius * t.cos(), radius * t.sin(), 14.0 * h)
        };
        let scene = Scene::new((0..6000).map(at).collect());
        let families =
            Families { sigma: 2e-6, floor: 2e-6, max_radius: 600.0, ..fixtures::families() };
        let mut walk = Walk::new(scene.len());
        for seed in (0..scene.len()).step_by(600) {
            let found = grow(&scene, &mut walk, &families, seed, MIN_SUPPORT.get());
            let found = found.filter(|h| h.shape.family == Family::Cone && h.sound);
            assert!(found.is_some_and(|h| h.support.len() == scene.len()), "{seed}");
        }
    }
}
