//! Every family tried on a few points, and those that come near on more.

use super::{Families, ROBUST, Scored};
use crate::fit::constant::constants;
use crate::fit::least_squares::{Options, fit_below};
use crate::fit::local_quadric::LocalQuadrics;
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
    /// does not explain a larger one. A reduced chi2 above `fits` is of no use.
    pub fn best(
        &self,
        patch: &Patch<'_>,
        warm: &[Shape],
        hopeless: &mut Vec<Family>,
        fits: f64,
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
        let quadrics = LocalQuadrics::of(first.points);
        let mut seen: Vec<Shape> = warm.to_vec();
        let mut out: Vec<Scored> = Vec::new();
        let mut least = f64::INFINITY;
        for &family in &self.allowed {
            if n <= family.dof() + 3 {
                break;
            }
            let most = (fits * (n - family.dof()) as f64).min(self.chi2_of(least, family, n));
            if hopeless.contains(&family) || most <= 0.0 {
                continue;
            }
            let mut starts = self.starts(family, &first, &seen, &quadrics);
            if let Some(few) = &few
                && !starts.is_empty()
            {
                let hopeful = self.promising(starts, few, SOUND.get(), f64::INFINITY);
                starts = hopeful.into_iter().map(|s| s.shape).collect();
                if starts.is_empty() {
                    hopeless.push(family);
                }
            }
            if let Some(o) = self.polished(starts, patch.points, STEPS.get(), most) {
                seen.push(o.shape);
                least = least.min(o.bic);
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
        self.each_but(patch, warm, &[], f64::INFINITY)
    }

    /// [`each`](Self::each) without some families, where a BIC above `most` is of no use.
    fn each_but(
        &self,
        patch: &Patch<'_>,
        warm: &[Shape],
        without: &[Family],
        most: f64,
    ) -> Vec<Scored> {
        let n = patch.points.len();
        let (points, normals);
        let mut screen = *patch;
        if n > 2 * SCREEN.get() {
            (points, normals) =
                (thinned(patch.points, SCREEN.get()), thinned(patch.normals, SCREEN.get()));
            screen = Patch { points: &points, normals: &normals };
        }
        // What that BIC leaves a family of chi2 on m of the points.
        let useful = |f: Family, m: usize| {
            let left = self.chi2_of(most, f, n).max(0.0);
            near(left * m as f64 / n as f64, m)
        };
        let tried = self.glanced(&screen, warm, without, useful);
        let all = n <= 2 * SCREEN.get();
        let mut screened: Vec<Scored> = Vec::new();
        let mut least = f64::INFINITY;
        for fits in tried {
            let family = fits[0].shape.family;
            let m = screen.points.len();
            let wanted = if all { f64::INFINITY } else { near(least, m) };
            let starts = fits.into_iter().map(|s| s.shape).collect();
            let found =
                self.polished(starts, screen.points, STEPS.get(), wanted.min(useful(family, m)));
            least = found.iter().map(|f| f.chi2).fold(least, f64::min);
            screened.extend(found);
        }
        if all {
            return screened;
        }
        screened.retain(|s| s.chi2 < near(least, SCREEN.get()));
        let whole = |s: Scored| {
            self.polished(
                vec![s.shape],
                patch.points,
                FURTHER_STEPS.get(),
                useful(s.shape.family, n),
            )
        };
        screened.into_iter().filter_map(whole).collect()
    }

    /// The fits of every family that comes near the best on a few of the points, the better ones of each first; a chi2
    /// above `useful` is of no use.
    fn glanced(
        &self,
        patch: &Patch<'_>,
        warm: &[Shape],
        without: &[Family],
        useful: impl Fn(Family, usize) -> f64,
    ) -> Vec<Vec<Scored>> {
        let few = thinned(patch.points, GLANCE.get());
        let quadrics = LocalQuadrics::of(patch.points);
        let mut seen: Vec<Shape> = warm.to_vec();
        let mut tried: Vec<Vec<Scored>> = Vec::new();
        let (mut least, m) = (f64::INFINITY, few.len());
        let determined = |f: &&Family| patch.points.len() > f.dof() + 3;
        for &family in self.allowed.iter().take_while(determined) {
            if without.contains(&family) {
                continue;
            }
            let starts = self.starts(family, patch, &seen, &quadrics);
            let wanted = (2.0 * near(least, m)).min(useful(family, m));
            let fits = self.promising(starts, &few, f64::INFINITY, wanted);
            if let Some(best) = fits.first() {
                seen.push(best.shape);
                least = least.min(best.chi2);
                tried.push(fits);
            }
        }
        tried.retain(|t| t[0].chi2 < 2.0 * near(least, m));
        tried
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
        let most = before.bic - LITTLE.get();
        let mut starts = vec![*shape];
        starts.extend(self.each_but(patch, &[*shape], hopeless, most).iter().map(|s| s.shape));
        let sq = self.sigma * self.sigma;
        let fitted = starts.iter().filter_map(|s| {
            let chi2 = self.chi2_of(most, s.family, patch.points.len());
            fit_below(s, patch.points, &options, chi2 * sq)
        });
        fitted
            .filter(|f| !self.degenerate(&f.shape, patch.points))
            .map(|f| self.score(f.shape, patch.points))
            .min_by(|a, b| a.bic.total_cmp(&b.bic))
            .filter(|best| best.bic < most)
    }

    /// The starts after a fit of each to a few of the points, the better ones first, those of one kind once;
    /// without those whose family will not explain the points. Fits that will not come below a chi2 of `most` give up.
    fn promising(&self, starts: Vec<Shape>, few: &[Vec3], hopeless: f64, most: f64) -> Vec<Scored> {
        let of = |s: &Shape| most.min(hopeless * (few.len() - s.family.dof()).max(1) as f64);
        let mut fitted: Vec<Scored> = starts
            .iter()
            .filter_map(|s| self.polish_below(s, few, STEPS.get(), of(s)))
            .map(|f| self.score(f.shape, few))
            .filter(|s| s.reduced < hopeless)
            .collect();
        fitted.sort_by(|a, b| a.chi2.total_cmp(&b.chi2));
        // What came to the same cost came to the same place.
        fitted.dedup_by(|b, a| b.chi2 - a.chi2 < SAME.get());
        fitted.truncate(PROMISING.get());
        fitted
    }

    /// The best fit from some starts of one family, up to the first that explains the points. Fits that will not come
    /// below a chi2 of `most` give up.
    fn polished(
        &self,
        starts: Vec<Shape>,
        points: &[Vec3],
        steps: usize,
        most: f64,
    ) -> Option<Scored> {
        let mut best: Option<Scored> = None;
        for s in starts {
            let wanted = best.map_or(most, |b| most.min(b.chi2));
            let Some(f) = self.polish_below(&s, points, steps, wanted) else { continue };
            if self.degenerate(&f.shape, points) {
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

/// The chi2 on `m` points up to which a family comes near one with the `least`.
fn near(least: f64, m: usize) -> f64 {
    NEARBY.get() * least + SLACK.get() * m as f64
}

/// At most `m` of some values, evenly.
fn thinned(all: &[Vec3], m: usize) -> Vec<Vec3> {
    let (n, m) = (all.len(), m.min(all.len()));
    (0..m).map(|k| all[k * n / m]).collect()
}
