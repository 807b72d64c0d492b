//! Growing one hypothesis from a seed: start set, fits at doubling sizes, support.

use std::ops::ControlFlow;

use crate::fit::constant::constants;
use crate::fit::{Family, Ruler, Shape};
use crate::segment::family::{Families, Scored};
use crate::segment::grow::seeded::{FIT_SAMPLE, FITS, Sample, Seeded, TRIED};
use crate::segment::grow::start::{Start, nearest, start_set, starts};
use crate::segment::grow::walk::Walk;
use crate::segment::judge::parabola::{Walls, is_parabolic};
use crate::segment::judge::whiteness::{correlated, correlation};
use crate::segment::objective::{CHANCE, FEW, GOOD, SURE};
use crate::segment::prepare::scene::Scene;
use crate::segment::prepare::take::take;

constants! {
    /// Points that a fit looks at where growth ends although residuals are correlated.
    THOROUGH_SAMPLE: usize = 1200, Effort("points of one fit");
    /// How often growth may end so.
    THOROUGH: usize = 3, Effort("thorough fits of one growth");
    /// Times that a support grows at most.
    TIMES: usize = 40, Effort("rounds of one growth");
    /// Correlation of residuals up to which growth may end, beside chance.
    WHITE: f64 = 0.08, Trial(0.08, 0.08);
    /// Points that a growing support may have at least.
    GROWTH: usize = 40, Effort("points of the first rounds");
    /// Growth of a support below which it has stalled.
    STALLED: f64 = 1.05, Effort("rounds of one growth");
    /// The same to fit one.
    FITTED: usize = 1000, Effort("work that is allowed");
    /// Steps of a fit that goes on.
    STEPS: usize = 12, Effort("steps of one fit");
}

/// A surface grown from one seed and the connected points near it.
#[derive(Clone, Debug)]
pub struct Hypothesis {
    /// The surface.
    pub shape: Shape,
    /// Connected points within three sigmas, in order of discovery.
    pub support: Vec<u32>,
    /// How far its residuals are from independent noise, see [`correlation`].
    pub correlation: f64,
    /// Whether it may be a surface: its residuals are not correlated beyond chance, or it is the same
    /// wherever growth starts. Others compete for points only.
    pub sound: bool,
}

/// Grows a hypothesis from `seed`; `None` where nothing fits from any start size, or where what fits
/// does not reach `min_points`.
pub fn grow(
    scene: &Scene,
    walk: &mut Walk,
    families: &Families,
    seed: usize,
    min_points: usize,
) -> Option<Hypothesis> {
    let grown = from_any_start(scene, walk, families, seed, min_points);
    let wall = grown.as_ref().and_then(|h| one_wall(scene, families, h, seed));
    let grown = match wall {
        Some(points) => on_wall(scene, walk, families, points, min_points).or(grown),
        None => grown,
    };
    scene.work.spend(walk.take_visited());
    grown
}

/// The points on the seed's side of an ellipse whose two walls are surfaces of their own.
fn one_wall(scene: &Scene, families: &Families, h: &Hypothesis, seed: usize) -> Option<Vec<u32>> {
    let walls = Walls::of(&h.shape)?;
    let side = |i: usize| walls.side(&scene.points[i]);
    let are_both = walls.hold(&take(scene, &h.support, FIT_SAMPLE.get()), families.sigma);
    are_both
        .then(|| h.support.iter().copied().filter(|&i| side(i as usize) == side(seed)).collect())
}

/// What grows from the points of one wall where it may not end in an ellipse.
fn on_wall(
    scene: &Scene,
    walk: &mut Walk,
    families: &Families,
    points: Vec<u32>,
    min_points: usize,
) -> Option<Hypothesis> {
    let is_ellipse = |f: &Family| matches!(f, Family::EllipticCylinder | Family::Ellipsoid);
    let mut others = families.clone();
    others.allowed.retain(|f| !is_ellipse(f));
    let start = Seeded::of(scene, &others, points)?;
    let grown = grow_from(scene, walk, &others, start, min_points);
    grown.filter(|h| h.support.len() >= min_points)
}

fn from_any_start(
    scene: &Scene,
    walk: &mut Walk,
    families: &Families,
    seed: usize,
    min_points: usize,
) -> Option<Hypothesis> {
    let starts = starts().into_iter().filter(|s| families.strips || !matches!(s.0, Start::Flat));
    // What does not explain the nearest points explains no more of them.
    let (nearest_start, nearest_most, _) = nearest();
    let nearest = start_set(scene, walk, seed, nearest_start, nearest_most, families.sigma);
    let mut core = Some(Seeded::of(scene, families, nearest.clone()));
    for (start, most, least) in starts {
        let begun = if (start, most) == (nearest_start, nearest_most) {
            core.take().flatten().filter(|s| s.support.len() >= least.min(min_points))
        } else if matches!(start, Start::Tangent) && core.as_ref().is_none_or(Option::is_none) {
            None
        } else {
            let set = start_set(scene, walk, seed, start, most, families.sigma);
            let enough = set.len() >= least.min(min_points);
            // Where no neighbour is left out the nearest are the same points again.
            (enough && set != nearest).then(|| Seeded::of(scene, families, set)).flatten()
        };
        if scene.cancelled() {
            return None;
        }
        let grown = begun.and_then(|s| grow_from(scene, walk, families, s, min_points));
        if grown.as_ref().is_some_and(|h| h.support.len() >= min_points) {
            return grown;
        }
    }
    None
}

fn grow_from(
    scene: &Scene,
    walk: &mut Walk,
    families: &Families,
    start: Seeded,
    min_points: usize,
) -> Option<Hypothesis> {
    let Seeded { support, sample, best, hopeless } = start;
    let mut growth = Growth {
        scene,
        walk,
        families,
        sample,
        support,
        best,
        hopeless,
        expanded: 0,
        fresh: true,
        thorough: THOROUGH.get(),
        good: None,
    };
    for _ in 0..TIMES.get() {
        if scene.cancelled() {
            return None;
        }
        if growth.step(min_points).is_break() {
            break;
        }
    }
    growth.end()
}

/// A surface on its way to all the points that it explains.
struct Growth<'a> {
    scene: &'a Scene<'a>,
    walk: &'a mut Walk,
    families: &'a Families,
    sample: Sample,
    support: Vec<u32>,
    /// Points of the support, the first ones, whose neighbours were looked at for this surface or a like one.
    expanded: usize,
    best: Scored,
    /// Families that do not explain the points so far.
    hopeless: Vec<Family>,
    /// Whether the last fit was of any family.
    fresh: bool,
    /// Thorough fits that are left.
    thorough: usize,
    /// The last surface that was good enough, and its points.
    good: Option<(Shape, Vec<u32>)>,
}

impl Growth<'_> {
    /// Takes in the points near the surface, up to twice as many as before, and fits it to them. Breaks where there
    /// are no more.
    fn step(&mut self, min_points: usize) -> ControlFlow<()> {
        let shape = self.best.shape;
        let limit = (self.support.len() * 2).max(GROWTH.get());
        let reach = SURE.get() * self.families.sigma;
        // What was beyond the surface before may lie on another one.
        let from = (&self.support[..], if self.fresh { 0 } else { self.expanded });
        let next = self.walk.near(self.scene, from, limit, &Ruler::of(&shape), reach);
        if next.len() < min_points.min(FEW.get()) {
            return ControlFlow::Break(());
        }
        let stalled = (next.len() as f64) < STALLED.get() * self.support.len() as f64;
        self.support.clear();
        self.support.extend_from_slice(next);
        self.expanded = self.walk.expanded();
        if stalled && self.fresh {
            return self.fit_thoroughly(&shape);
        }
        self.fit(&shape, stalled)?;
        if self.best.reduced < GOOD.get() {
            self.good = Some((self.best.shape, self.support.clone()));
        } else if self.best.reduced > FITS.get() {
            return ControlFlow::Break(());
        }
        ControlFlow::Continue(())
    }

    /// Looks for a better surface where growth would end although residuals go together: a fit caught halfway along
    /// its valley looks like that.
    fn fit_thoroughly(&mut self, shape: &Shape) -> ControlFlow<()> {
        let Self { scene, walk, families, support, .. } = self;
        let left = correlation(scene, shape, support, families.sigma, |j| walk.contains(j));
        if self.thorough == 0
            || left < families.common + WHITE.get() + CHANCE.get() / (support.len() as f64).sqrt()
        {
            return ControlFlow::Break(());
        }
        self.thorough -= 1;
        self.sample.take(scene, support, THOROUGH_SAMPLE.get());
        scene.work.spend(2 * TRIED.get() as u64);
        match families.thorough(&self.sample.patch(), shape, &self.hopeless) {
            Some(found) => self.best = found,
            None => return ControlFlow::Break(()),
        }
        ControlFlow::Continue(())
    }

    /// Fits the surface to the points, or any family where it does not explain them or growth has `stalled`.
    fn fit(&mut self, shape: &Shape, stalled: bool) -> ControlFlow<()> {
        let Self { scene, families, support, sample, .. } = self;
        sample.take(scene, support, FIT_SAMPLE.get());
        scene.work.spend(FITTED.get() as u64);
        let points = &sample.points;
        let warm = families
            .polish(shape, points, STEPS.get())
            .map(|f| families.score(f.shape, points))
            .filter(|s| !families.degenerate(&s.shape, points));
        if let Some(w) = warm.filter(|w| !stalled && families.explains(w, points.len())) {
            (self.best, self.fresh) = (w, false);
            return ControlFlow::Continue(());
        }
        let start = warm.map_or(*shape, |w| w.shape);
        if stalled {
            self.hopeless.clear();
        }
        scene.work.spend(TRIED.get() as u64);
        match families.best(&sample.patch(), &[start], &mut self.hopeless, FITS.get()) {
            Some(next) => (self.best, self.fresh) = (next, true),
            None => return ControlFlow::Break(()),
        }
        ControlFlow::Continue(())
    }

    /// The last good surface with all the points that hang together near it.
    fn end(self) -> Option<Hypothesis> {
        let Self { scene, walk, families, support, best, mut good, .. } = self;
        let sigma = families.sigma;
        if best.reduced < GOOD.get() {
            let ruler = Ruler::of(&best.shape);
            let support =
                walk.near(scene, (&support, 0), usize::MAX, &ruler, SURE.get() * sigma).to_vec();
            good = Some((best.shape, support));
        }
        let (shape, support) = good?;
        walk.run(scene, &support, support.len(), |from, _| from.is_none());
        let correlation = correlation(scene, &shape, &support, sigma, |j| walk.contains(j));
        let sound =
            !correlated(correlation, families.common, support.len()) && !is_parabolic(&shape);
        Some(Hypothesis { shape, support, correlation, sound })
    }
}
