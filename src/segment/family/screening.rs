//! Every family tried on a few points, and those that come near on more.

use rayon::prelude::*;

use super::{Families, Scored};
use crate::fit::least_squares::{Options, fit};
use crate::fit::local_quadric::LocalQuadrics;
use crate::fit::starts::Patch;
use crate::fit::{Family, Shape};
use crate::geometry::Vec3;

/// Points that every family is first tried on where all are wanted.
const SCREEN: usize = 250;

/// Points that a start is made from where the first family that explains all will do.
const START: usize = 160;

/// Points that a start is first fitted to, and the reduced chi2 of these few beyond which a family is out where
/// the first that explains all will do.
const GLANCE: usize = 80;

const HOPELESS: f64 = 3.0;

/// A family comes near the best where its chi2 is below this many times that one's and this much a point; on the
/// few points of a glance, below twice that.
const NEARBY: f64 = 1.5;

const SLACK: f64 = 0.4;

/// Difference in chi2 of two fits of one family that are the same, and how many unlike ones are followed up.
const SAME: f64 = 0.1;

const PROMISING: usize = 2;

/// A gain in BIC that is not worth growing on for.
const LITTLE: f64 = 4.0;

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
        let few = (n >= 2 * GLANCE).then(|| thinned(patch.points, GLANCE));
        let (points, normals);
        let mut first = *patch;
        if n > START {
            (points, normals) = (thinned(patch.points, START), thinned(patch.normals, START));
            first = Patch { points: &points, normals: &normals };
        }
        let quadrics = LocalQuadrics::of(first.points);
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
                    self.promising(starts, few, HOPELESS).into_iter().map(|s| s.shape).collect();
                if starts.is_empty() {
                    hopeless.push(family);
                }
            }
            if let Some(o) = self.polished(starts, patch.points, 14) {
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
        if n > 2 * SCREEN {
            (points, normals) = (thinned(patch.points, SCREEN), thinned(patch.normals, SCREEN));
            screen = Patch { points: &points, normals: &normals };
        }
        let glance = thinned(screen.points, GLANCE);
        let quadrics = LocalQuadrics::of(screen.points);
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
        let near = |least: f64, m: usize| NEARBY * least + SLACK * m as f64;
        let least = tried.iter().map(|t| best(t)).fold(f64::INFINITY, f64::min);
        tried.retain(|t| best(t) < 2.0 * near(least, glance.len()));
        let mut screened: Vec<Scored> = tried
            .into_par_iter()
            .filter_map(|t| {
                self.polished(t.into_iter().map(|s| s.shape).collect(), screen.points, 14)
            })
            .collect();
        if n <= 2 * SCREEN {
            return screened;
        }
        let least = best(&screened);
        screened.retain(|s| s.chi2 < near(least, SCREEN));
        screened
            .into_par_iter()
            .filter_map(|s| self.polished(vec![s.shape], patch.points, 8))
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
        let options = Options { cauchy: Some(2.5 * self.sigma), steps: 60, tolerance: 1e-7 };
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
        (best.bic < before.bic - LITTLE).then_some(best)
    }

    /// The starts after a fit of each to a few of the points, the better ones first, those of one kind once;
    /// without those whose family will not explain the points.
    fn promising(&self, starts: Vec<Shape>, few: &[Vec3], hopeless: f64) -> Vec<Scored> {
        let mut fitted: Vec<Scored> = starts
            .iter()
            .filter_map(|s| self.polish(s, few, 14))
            .map(|f| self.score(f.shape, few))
            .filter(|s| s.reduced < hopeless)
            .collect();
        fitted.sort_by(|a, b| a.chi2.total_cmp(&b.chi2));
        // What came to the same cost came to the same place.
        fitted.dedup_by(|b, a| b.chi2 - a.chi2 < SAME);
        fitted.truncate(PROMISING);
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
