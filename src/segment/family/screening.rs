//! Every family tried on a few points, and those that come near on more.

use std::cell::OnceCell;

use rayon::prelude::*;

use super::{Families, ROBUST, Scored};
use crate::fit::constant::constants;
use crate::fit::least_squares::{Options, fit};
use crate::fit::starts::Patch;
use crate::fit::{Family, Shape};
use crate::geometry::Vec3;
use crate::segment::objective::SOUND;

constants! {
    /// Points that every family is first tried on where all are wanted.
    SCREEN: usize = 250, Effort("points of one fit");
    /// Points that a start is made from where the first family that explains all will do.
    START: usize = 160, Effort("points of one fit");
    /// Points that a start is first fitted to.
    GLANCE: usize = 80, Effort("points of one fit");
    /// A family comes near the best where its chi2 is below this many times that one's and [`SLACK`] a point; on the few
    /// points of a glance, below twice that.
    NEARBY: f64 = 1.5, Effort("families that are not tried");
    /// Chi2 a point by which a family may be worse than the best and come near it.
    SLACK: f64 = 0.4, Effort("families that are not tried");
    /// Difference in chi2 of two fits of one family that are the same.
    SAME: f64 = 0.1, Effort("starts that are not followed up");
    /// How many unlike fits of one family are followed up.
    PROMISING: usize = 2, Effort("starts that are followed up");
    /// A gain in BIC that is not worth growing on for.
    LITTLE: f64 = 4.0, Effort("growths that are not followed up");
    /// Steps of a fit from a cold start.
    STEPS: usize = 14, Effort("steps of one fit");
    /// Steps of a fit that goes on from one to fewer points.
    FURTHER_STEPS: usize = 8, Effort("steps of one fit");
    /// Steps of a fit until it no longer moves.
    THOROUGH_STEPS: usize = 60, Effort("steps of one fit");
    /// Share of its cost below which a step of that is none.
    NO_STEP: f64 = 1e-7, Effort("steps of one fit");
}

impl Families {
    /// The best family for a patch: families by rising degrees of freedom, from `warm` shapes and
    /// from cold starts, up to the first that explains the points; the least BIC of those tried.
    ///
    /// Those in `hopeless` are left out, and those found to be so are put there: what does not explain a set
    /// does not explain a larger one.
    pub fn best(
        &self,
        patch: &Patch<'_>,
        warm: &[Shape],
        hopeless: &mut Vec<Family>,
    ) -> Option<Scored> {
        let n = patch.points.len();
        let few = (n >= 2 * GLANCE.get()).then(|| thinned(patch.points, GLANCE.get()));
        let (points, normals);
        let mut first = *patch;
        if n > START.get() {
            (points, normals) =
                (thinned(patch.points, START.get()), thinned(patch.normals, START.get()));
            first = Patch { points: &points, normals: &normals };
        }
        let quadrics = OnceCell::new();
        let mut seen: Vec<Shape> = warm.to_vec();
        let mut out: Vec<Scored> = Vec::new();
        for &family in &self.allowed {
            if n <= family.dof() + 3 {
                break;
            }
            if hopeless.contains(&family) {
                continue;
            }
            let mut starts = self.starts(family, &first, &seen, &quadrics);
            if let Some(few) = &few
                && !starts.is_empty()
            {
                starts =
                    self.promising(starts, few, SOUND.get()).into_iter().map(|s| s.shape).collect();
                if starts.is_empty() {
                    hopeless.push(family);
                }
            }
            if let Some(o) = self.polished(starts, patch.points, STEPS.get()) {
                seen.push(o.shape);
                out.push(o);
                if self.explains(&o, n) {
                    break;
                }
            }
        }
        out.into_iter().min_by(|a, b| a.bic.total_cmp(&b.bic))
    }

    /// The best fit of every family that comes near explaining the points as well as any, by degrees of
    /// freedom: all are tried on a few points, and those that come near on more.
    pub fn each(&self, patch: &Patch<'_>, warm: &[Shape]) -> Vec<Scored> {
        self.each_but(patch, warm, &[])
    }

    /// [`each`](Self::each) without some families.
    fn each_but(&self, patch: &Patch<'_>, warm: &[Shape], without: &[Family]) -> Vec<Scored> {
        let n = patch.points.len();
        let (points, normals);
        let mut screen = *patch;
        if n > 2 * SCREEN.get() {
            (points, normals) =
                (thinned(patch.points, SCREEN.get()), thinned(patch.normals, SCREEN.get()));
            screen = Patch { points: &points, normals: &normals };
        }
        let glance = thinned(screen.points, GLANCE.get());
        let quadrics = OnceCell::new();
        let mut seen: Vec<Shape> = warm.to_vec();
        let mut tried: Vec<Vec<Scored>> = Vec::new();
        for &family in self.allowed.iter().take_while(|f| n > f.dof() + 3) {
            if without.contains(&family) {
                continue;
            }
            let starts = self.starts(family, &screen, &seen, &quadrics);
            let fits = self.promising(starts, &glance, f64::INFINITY);
            seen.extend(fits.first().map(|f| f.shape));
            tried.push(fits);
        }
        let best = |tried: &[Scored]| tried.iter().map(|s| s.chi2).fold(f64::INFINITY, f64::min);
        let near = |least: f64, m: usize| NEARBY.get() * least + SLACK.get() * m as f64;
        let least = tried.iter().map(|t| best(t)).fold(f64::INFINITY, f64::min);
        tried.retain(|t| best(t) < 2.0 * near(least, glance.len()));
        let mut screened: Vec<Scored> = tried
            .into_par_iter()
            .filter_map(|t| {
                self.polished(t.into_iter().map(|s| s.shape).collect(), screen.points, STEPS.get())
            })
            .collect();
        if n <= 2 * SCREEN.get() {
            return screened;
        }
        let least = best(&screened);
        screened.retain(|s| s.chi2 < near(least, SCREEN.get()));
        screened
            .into_par_iter()
            .filter_map(|s| self.polished(vec![s.shape], patch.points, FURTHER_STEPS.get()))
            .collect()
    }

    /// The best family for a patch but the `hopeless` ones, each fitted until it no longer moves; `None` where
    /// that is hardly better than `shape`.
    pub fn thorough(
        &self,
        patch: &Patch<'_>,
        shape: &Shape,
        hopeless: &[Family],
    ) -> Option<Scored> {
        let options = Options {
            cauchy: Some(ROBUST.get() * self.sigma),
            steps: THOROUGH_STEPS.get(),
            tolerance: NO_STEP.get(),
        };
        let before = self.score(*shape, patch.points);
        let mut starts = vec![*shape];
        starts.extend(self.each_but(patch, &[*shape], hopeless).iter().map(|s| s.shape));
        let fitted: Vec<Scored> = starts
            .par_iter()
            .filter_map(|s| fit(s, patch.points, None, &options))
            .filter(|f| !self.degenerate(&f.shape))
            .map(|f| self.score(f.shape, patch.points))
            .collect();
        let best = fitted.into_iter().min_by(|a, b| a.bic.total_cmp(&b.bic))?;
        (best.bic < before.bic - LITTLE.get()).then_some(best)
    }

    /// The starts after a fit of each to a few of the points, the better ones first, those of one kind once;
    /// without those whose family will not explain the points.
    fn promising(&self, starts: Vec<Shape>, few: &[Vec3], hopeless: f64) -> Vec<Scored> {
        let mut fitted: Vec<Scored> = starts
            .iter()
            .filter_map(|s| self.polish(s, few, STEPS.get()))
            .map(|f| self.score(f.shape, few))
            .filter(|s| s.reduced < hopeless)
            .collect();
        fitted.sort_by(|a, b| a.chi2.total_cmp(&b.chi2));
        // What came to the same cost came to the same place.
        fitted.dedup_by(|b, a| b.chi2 - a.chi2 < SAME.get());
        fitted.truncate(PROMISING.get());
        fitted
    }

    /// The best fit from some starts of one family, up to the first that explains the points.
    fn polished(&self, starts: Vec<Shape>, points: &[Vec3], steps: usize) -> Option<Scored> {
        let mut best: Option<Scored> = None;
        for s in starts {
            let Some(f) = self.polish(&s, points, steps) else { continue };
            if self.degenerate(&f.shape) {
                continue;
            }
            let scored = self.score(f.shape, points);
            if best.is_none_or(|o| scored.chi2 < o.chi2) {
                best = Some(scored);
            }
            if self.explains(&scored, points.len()) {
                break;
            }
        }
        best
    }
}

/// At most `m` of some values, evenly.
fn thinned(all: &[Vec3], m: usize) -> Vec<Vec3> {
    let (n, m) = (all.len(), m.min(all.len()));
    (0..m).map(|k| all[k * n / m]).collect()
}
