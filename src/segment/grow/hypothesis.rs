//! Growing one hypothesis from a seed: start set, fits at doubling sizes, support.

use std::ops::ControlFlow;

use crate::fit::constant::constants;
use crate::fit::starts::Patch;
use crate::fit::{Family, Ruler, Shape};
use crate::geometry::Vec3;
use crate::segment::family::{Families, Scored};
use crate::segment::grow::start::{Start, nearest, start_set, starts};
use crate::segment::grow::walk::Walk;
use crate::segment::judge::parabola::is_parabolic;
use crate::segment::judge::whiteness::{correlated, correlation};
use crate::segment::objective::{CHANCE, FEW, GOOD, SURE};
use crate::segment::prepare::scene::Scene;

constants! {
    /// Points a fit during growth looks at.
    FIT_SAMPLE: usize = 400, Effort("points of one fit");
    /// Points that a fit looks at where growth ends although residuals are correlated.
    THOROUGH_SAMPLE: usize = 1200, Effort("points of one fit");
    /// How often growth may end so.
    THOROUGH: usize = 3, Effort("thorough fits of one growth");
    /// Reduced chi2 up to which a surface may be the points'.
    FITS: f64 = 2.0, Trial(2.0, 2.0);
    /// Times that a support grows at most.
    TIMES: usize = 40, Effort("rounds of one growth");
    /// Correlation of residuals up to which growth may end, beside chance.
    WHITE: f64 = 0.08, Trial(0.08, 0.08);
    /// Points that a growing support may have at least.
    GROWTH: usize = 40, Effort("points of the first rounds");
    /// Growth of a support below which it has stalled.
    STALLED: f64 = 1.05, Effort("rounds of one growth");
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

/// Points of a set and the normals there.
#[derive(Default)]
struct Sample {
    points: Vec<Vec3>,
    normals: Vec<Vec3>,
}

impl Sample {
    /// Takes at most about `limit` points of `support`, evenly.
    fn take(&mut self, scene: &Scene, support: &[u32], limit: usize) {
        self.points.clear();
        self.normals.clear();
        let m = support.len().min(limit);
        for k in 0..m {
            let i = support[k * support.len() / m] as usize;
            self.points.push(scene.points[i]);
            self.normals.push(scene.normals[i]);
        }
    }

    fn patch(&self) -> Patch<'_> {
        Patch { points: &self.points, normals: &self.normals }
    }
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
    let mut starts =
        starts().into_iter().filter(|s| families.strips || !matches!(s.0, Start::Flat));
    // What does not explain the nearest points explains no more of them.
    let mut hopeful = None;
    starts.find_map(|(start, most, least)| {
        if matches!(start, Start::Tangent)
            && !*hopeful.get_or_insert_with(|| fits_nearest(scene, walk, families, seed))
        {
            return None;
        }
        let set = start_set(scene, walk, seed, start, most, families.sigma);
        if set.len() < least.min(min_points) || scene.cancelled() {
            return None;
        }
        let grown = grow_from(scene, walk, families, set, min_points);
        grown.filter(|h| h.support.len() >= min_points)
    })
}

/// Whether any family explains the nearest points of a seed that lie in each other's tangent planes.
fn fits_nearest(scene: &Scene, walk: &mut Walk, families: &Families, seed: usize) -> bool {
    let (start, most, _) = nearest();
    let set = start_set(scene, walk, seed, start, most, families.sigma);
    let mut sample = Sample::default();
    sample.take(scene, &set, FIT_SAMPLE.get());
    families.best(&sample.patch(), &[], &mut Vec::new()).is_some_and(|b| b.reduced <= FITS.get())
}

fn grow_from(
    scene: &Scene,
    walk: &mut Walk,
    families: &Families,
    start: Vec<u32>,
    min_points: usize,
) -> Option<Hypothesis> {
    let mut sample = Sample::default();
    sample.take(scene, &start, FIT_SAMPLE.get());
    let mut hopeless = Vec::new();
    let best = families.best(&sample.patch(), &[], &mut hopeless)?;
    if best.reduced > FITS.get() {
        return None;
    }
    let mut growth = Growth {
        scene,
        walk,
        families,
        sample,
        support: start,
        best,
        hopeless,
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
        let next = self.walk.near(self.scene, &self.support, limit, &Ruler::of(&shape), reach);
        // So few have slid off their surface.
        if next.len() < min_points.min(FEW.get()) {
            return ControlFlow::Break(());
        }
        let stalled = (next.len() as f64) < STALLED.get() * self.support.len() as f64;
        self.support.clear();
        self.support.extend_from_slice(next);
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
        let points = &sample.points;
        let warm = families
            .polish(shape, points, STEPS.get())
            .map(|f| families.score(f.shape, points))
            .filter(|s| !families.degenerate(&s.shape));
        if let Some(w) = warm.filter(|w| !stalled && families.explains(w, points.len())) {
            (self.best, self.fresh) = (w, false);
            return ControlFlow::Continue(());
        }
        let start = warm.map_or(*shape, |w| w.shape);
        if stalled {
            self.hopeless.clear();
        }
        match families.best(&sample.patch(), &[start], &mut self.hopeless) {
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
                walk.near(scene, &support, usize::MAX, &ruler, SURE.get() * sigma).to_vec();
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
