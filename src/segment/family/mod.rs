//! Which family explains a set of points best.

pub mod screening;

use rayon::prelude::*;

use crate::fit::least_squares::{Fitted, Options, fit};
use crate::fit::starts::Patch;
use crate::fit::{Family, Ruler, Shape, starts};
use crate::geometry::Vec3;
use crate::segment::Parameters;
use crate::segment::family::screening::{
    GLANCE, HOPELESS, LITTLE, NEARBY, PROMISING, SAME, SCREEN, SLACK, START, thinned,
};

/// Largest radius, in extents of the scene: the sagitta of a face this much narrower than its radius is still seen
/// through the noise of many points.
pub const MOST_RADIUS: f64 = 1000.0;

/// The same where surfaces have a form error, which bends what is straight that much.
pub const MOST_RADIUS_OF_FORM: f64 = 20.0;

/// Least radius of a torus about its axis, over that of its tube: below that a sphere is meant.
const LEAST_TORUS: f64 = 0.02;

/// What may be fitted, and how exact the points are.
#[derive(Clone, Debug)]
pub struct Families {
    /// Allowed families by degrees of freedom; the torus is always among them as a competitor.
    pub allowed: Vec<Family>,
    /// Noise of the points.
    pub sigma: f64,
    /// Sigma is never taken to be less: rounding of the input.
    pub floor: f64,
    /// Largest radius taken seriously; beyond it a plane is meant.
    pub max_radius: f64,
    /// Whether growth may start from a part of a neighbourhood, as narrow strips side by side need: with a form
    /// error any part is some surface's.
    pub strips: bool,
    /// What the caller allows the search.
    pub policy: Policy,
}

/// What the caller allows the search.
#[derive(Clone, Copy, Debug)]
pub struct Policy {
    /// Whether pieces of one surface are joined.
    pub merge: bool,
    /// Whether labels, families and surfaces are refined once found.
    pub refine: bool,
    /// Draws of seeds, several at a time, that may fail in a row before the search stops.
    pub failures: usize,
    /// Points that a surface must explain beyond others.
    pub least: usize,
}

/// Points that a surface must explain, unless regions may have fewer.
const LEAST: usize = 40;

impl Policy {
    /// The policy that `parameters` ask for.
    pub fn of(parameters: &Parameters) -> Self {
        let Parameters { merge, refine, max_failed_seeds, min_points, .. } = *parameters;
        Self { merge, refine, failures: max_failed_seeds, least: min_points.min(LEAST) }
    }
}

/// A fit and its score.
#[derive(Clone, Copy, Debug)]
pub struct Scored {
    /// The shape.
    pub shape: Shape,
    /// Truncated chi2: sum of min(r2 / sigma2, 16).
    pub chi2: f64,
    /// chi2 and the family's description length.
    pub bic: f64,
    /// chi2 / (n - dof).
    pub reduced: f64,
}

impl Families {
    /// The same where surfaces of fewer points count, `least` of them.
    pub fn with_least(&self, least: usize) -> Self {
        let policy = Policy { least: least.min(self.policy.least), ..self.policy };
        Self { policy, ..self.clone() }
    }

    /// Whether a shape is too small, too large or too flat to mean anything at this noise.
    pub fn degenerate(&self, s: &Shape) -> bool {
        s.min_radius() < 6.0 * self.sigma
            || s.max_radius() > self.max_radius
            || (s.family == Family::Cone && s.size[1].abs() < 1e-4)
            || (s.family == Family::Torus
                && s.size[0] < (6.0 * self.sigma).max(LEAST_TORUS * s.size[1]))
    }

    /// Scores a shape on points.
    pub fn score(&self, shape: Shape, points: &[Vec3]) -> Scored {
        let inverse = 1.0 / (self.sigma * self.sigma);
        let chi2 = Ruler::of(&shape).truncated(points, inverse, 16.0);
        let (n, p) = (points.len() as f64, shape.family.dof() as f64);
        Scored {
            shape,
            chi2,
            bic: chi2 + shape.family.description_length(points.len()),
            reduced: chi2 / (n - p).max(1.0),
        }
    }

    /// Robust fit of one family from `start`.
    pub fn polish(&self, start: &Shape, points: &[Vec3], steps: usize) -> Option<Fitted> {
        fit(
            start,
            points,
            None,
            &Options { cauchy: Some(2.5 * self.sigma), steps, tolerance: 1e-3 },
        )
    }

    /// Whether a score is what noise alone would give.
    pub fn explains(&self, s: &Scored, n: usize) -> bool {
        s.reduced < 1.0 + 1.5 * (2.0 / n as f64).sqrt()
    }

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
        let quadrics = std::cell::OnceCell::new();
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
        let quadrics = std::cell::OnceCell::new();
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

    /// Starts of one family: shapes of it (or one step simpler) already seen, then cold ones.
    fn starts(
        &self,
        family: Family,
        patch: &Patch<'_>,
        seen: &[Shape],
        quadrics: &std::cell::OnceCell<(
            Option<starts::LocalQuadric>,
            Option<starts::LocalQuadric>,
        )>,
    ) -> Vec<Shape> {
        let p = patch.points;
        let quadrics = || quadrics.get_or_init(|| starts::quadrics(p));
        let mut out: Vec<Shape> =
            seen.iter().rev().filter(|s| s.family == family).copied().collect();
        match family {
            Family::Plane => out.extend(starts::plane(p)),
            Family::Sphere => out.extend(starts::sphere(p)),
            Family::Cylinder => out.extend(
                starts::cylinder_axes(patch, quadrics().0.as_ref())
                    .iter()
                    .filter_map(|w| starts::cylinder(p, w)),
            ),
            Family::Cone => {
                out.extend(starts::cone(patch));
                for s in seen.iter().filter(|s| s.family == Family::Cylinder) {
                    for half in [0.05, -0.05] {
                        out.push(Shape { family, size: [s.size[0], half, 0.0], ..*s });
                    }
                }
            }
            Family::EllipticCylinder => {
                out.extend(
                    starts::cylinder_axes(patch, quadrics().0.as_ref())
                        .iter()
                        .filter_map(|w| starts::elliptic_cylinder(p, w)),
                );
                for s in seen.iter().filter(|s| s.family == Family::Cylinder) {
                    out.push(Shape { family, size: [s.size[0] * 1.05, s.size[0], 0.0], ..*s });
                }
            }
            Family::Torus => out.extend(starts::torus(patch)),
            Family::Ellipsoid => {
                let (taubin, specific) = quadrics();
                out.extend(taubin.as_ref().and_then(starts::LocalQuadric::ellipsoid));
                out.extend(specific.as_ref().and_then(starts::LocalQuadric::ellipsoid));
                for s in seen.iter().filter(|s| s.family == Family::Sphere) {
                    out.push(Shape {
                        family,
                        size: [s.size[0] * 1.05, s.size[0], s.size[0] * 0.95],
                        ..*s
                    });
                }
            }
        }
        out
    }
}
