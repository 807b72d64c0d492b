//! Growing one hypothesis from a seed: start set, fits at doubling sizes, support.

use std::ops::ControlFlow;

use crate::fit::starts::Patch;
use crate::fit::{Family, Ruler, Shape, may_hold};
use crate::geometry::Vec3;
use crate::segment::family::{Families, Scored};
use crate::segment::grow::start::{NEAREST, STARTS, Start, start_set};
use crate::segment::grow::walk::Walk;
use crate::segment::judge::parabola::is_parabolic;
use crate::segment::judge::whiteness::{CHANCE, correlated, correlation};
use crate::segment::prepare::scene::Scene;

/// Points a fit during growth looks at.
const FIT_SAMPLE: usize = 400;

/// Points that a fit looks at where growth ends although residuals are correlated, and how often it may.
const THOROUGH_SAMPLE: usize = 1200;

const THOROUGH: usize = 3;

/// Support reaches this many sigmas from the surface.
const REACH: f64 = 3.0;

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
    let grown = from_any_start(scene, walk, families, seed, min_points);
    scene.work.spend(walk.take_visited());
    grown
}

fn from_any_start(
    scene: &Scene,
    walk: &mut Walk,
    families: &Families,
    seed: usize,
    min_points: usize,
) -> Option<Hypothesis> {
    let starts = STARTS.iter().filter(|s| families.strips || !matches!(s.0, Start::Flat));
    // What does not explain the nearest points explains no more of them.
    let (start, most, _) = NEAREST;
    let nearest = start_set(scene, walk, seed, start, most, families.sigma);
    let mut core = Some(Seeded::of(scene, families, nearest.clone()));
    for &(start, most, least) in starts {
        let begun = if (start, most) == (NEAREST.0, NEAREST.1) {
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

/// A start set and the surface that explains it.
struct Seeded {
    support: Vec<u32>,
    sample: Sample,
    best: Scored,
    /// Families that do not explain it.
    hopeless: Vec<Family>,
}

/// Start sets up to so many points are first looked at for any quadric: larger ones may have too many outliers.
const FEW: usize = 40;
/// Mean square from a quadric, over that of a surface that may be the points', beyond which none is near them.
const CLEARLY: f64 = 5.0;
/// Points visited in the time that it takes to try every family on a sample, and to fit one.
const TRIED: u64 = 6000;
const FITTED: u64 = 1000;
/// Squares of residuals are cut at this many of sigma's.
const CUT: f64 = 16.0;

impl Seeded {
    /// The surface of any family that explains a start set.
    fn of(scene: &Scene, families: &Families, support: Vec<u32>) -> Option<Self> {
        let mut sample = Sample::default();
        sample.take(scene, &support, FIT_SAMPLE);
        let mut hopeless = Vec::new();
        let n = support.len();
        scene.work.spend(TRIED / 2);
        if n <= FEW {
            let outliers = (FITS * n as f64 / CUT) as usize;
            let reach = CLEARLY * FITS * families.sigma * families.sigma;
            if !may_hold(&sample.points, outliers, reach) {
                hopeless.extend(Family::ALL.into_iter().filter(|f| *f != Family::Torus));
            }
        }
        let best = families.best(&sample.patch(), &[], &mut hopeless, FITS)?;
        (best.reduced <= FITS).then_some(Self { support, sample, best, hopeless })
    }
}

/// Reduced chi2 up to which a surface may be the points', and one up to which it is good enough to be kept.
const FITS: f64 = 2.0;
const GOOD: f64 = 1.35;
/// Times that a support grows at most.
const TIMES: usize = 40;
/// Correlation of residuals up to which growth may end, beside chance.
const WHITE: f64 = 0.08;

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
        thorough: THOROUGH,
        good: None,
    };
    for _ in 0..TIMES {
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
        let limit = (self.support.len() * 2).max(40);
        let reach = REACH * self.families.sigma;
        // What was beyond the surface before may lie on another one.
        let from = (&self.support[..], if self.fresh { 0 } else { self.expanded });
        let next = self.walk.near(self.scene, from, limit, &Ruler::of(&shape), reach);
        if next.len() < min_points.min(20) {
            return ControlFlow::Break(());
        }
        let stalled = next.len() * 20 < self.support.len() * 21;
        self.support.clear();
        self.support.extend_from_slice(next);
        self.expanded = self.walk.expanded();
        if stalled && self.fresh {
            return self.fit_thoroughly(&shape);
        }
        self.fit(&shape, stalled)?;
        if self.best.reduced < GOOD {
            self.good = Some((self.best.shape, self.support.clone()));
        } else if self.best.reduced > FITS {
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
            || left < families.common + WHITE + CHANCE / (support.len() as f64).sqrt()
        {
            return ControlFlow::Break(());
        }
        self.thorough -= 1;
        self.sample.take(scene, support, THOROUGH_SAMPLE);
        scene.work.spend(2 * TRIED);
        match families.thorough(&self.sample.patch(), shape, &self.hopeless) {
            Some(found) => self.best = found,
            None => return ControlFlow::Break(()),
        }
        ControlFlow::Continue(())
    }

    /// Fits the surface to the points, or any family where it does not explain them or growth has `stalled`.
    fn fit(&mut self, shape: &Shape, stalled: bool) -> ControlFlow<()> {
        let Self { scene, families, support, sample, .. } = self;
        sample.take(scene, support, FIT_SAMPLE);
        scene.work.spend(FITTED);
        let points = &sample.points;
        let warm = families
            .polish(shape, points, 12)
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
        scene.work.spend(TRIED);
        match families.best(&sample.patch(), &[start], &mut self.hopeless, FITS) {
            Some(next) => (self.best, self.fresh) = (next, true),
            None => return ControlFlow::Break(()),
        }
        ControlFlow::Continue(())
    }

    /// The last good surface with all the points that hang together near it.
    fn end(self) -> Option<Hypothesis> {
        let Self { scene, walk, families, support, best, mut good, .. } = self;
        let sigma = families.sigma;
        if best.reduced < GOOD {
            let ruler = Ruler::of(&best.shape);
            let support =
                walk.near(scene, (&support, 0), usize::MAX, &ruler, REACH * sigma).to_vec();
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
