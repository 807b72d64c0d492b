//! Which family explains a set of points best.

pub mod screening;
pub mod starts;

use crate::fit::constant::constants;
use crate::fit::least_squares::{Fitted, Options, fit_below};
use crate::fit::{Family, Ruler, Shape};
use crate::geometry::{Mat3, Vec3};
use crate::segment::Parameters;
use crate::segment::objective::{CHANCE, ENOUGH, unassigned};
use crate::segment::prepare::candidates::K;

constants! {
    /// Largest radius, in extents of the scene: the sagitta of a face this much narrower than its radius is still seen
    /// through the noise of many points.
    pub MOST_RADIUS: f64 = 1000.0, Trial(1000.0, 1000.0);
    /// Least radius of a torus about its axis, over that of its tube: below that a sphere is meant.
    LEAST_TORUS: f64 = 0.02, Trial(0.02, 0.02);
    /// Least radius in sigmas: what bends more is as thick as the noise.
    LEAST_RADIUS: f64 = 6.0, Derived("the noise of both its sides, three sigmas each, meets in the middle");
    /// Ratio of semi-axes up to which an ellipse is as thick as its least radius says.
    LONG: f64 = 3.0, Effort("looks at points");
    /// Sigmas between two walls up to which they are one.
    ONE_WALL: f64 = 2.0, Derived("two equal normal densities have one mode between them up to two sigmas apart");
    /// Points at which it is looked how thick an ellipse is.
    LOOK: usize = 64, Effort("points looked at");
    /// Least half angle of a cone, in radians: below that a cylinder is meant.
    LEAST_ANGLE: f64 = 1e-4, Trial(0.0001, 0.0001);
    /// Cauchy's constant of fits while surfaces are looked for, in sigmas: 2.385 has an efficiency of 95 % on normal noise.
    pub ROBUST: f64 = 2.5, Trial(2.5, 2.5);
    /// Share of its cost by which a step of such a fit must lower it.
    ROUGHLY: f64 = 1e-3, Effort("steps of one fit");
}

/// What may be fitted, and how exact the points are.
#[derive(Clone, Debug)]
pub struct Families {
    /// Allowed families by degrees of freedom; the torus is always among them as a competitor.
    pub allowed: Vec<Family>,
    /// Noise of the points.
    pub sigma: f64,
    /// Sigma is never taken to be less: rounding of the input.
    pub floor: f64,
    /// Whether surfaces of less noise have been taken out: what is left need not be surfaces.
    pub rougher: bool,
    /// What residuals of neighbours have in common at true surfaces: nought where noise is independent, towards 1
    /// where it is smooth. Decisions count only what points say anew: see [`Families::repeats`].
    pub common: f64,
    /// Largest radius taken seriously; beyond it a plane is meant.
    pub max_radius: f64,
    /// Whether growth may start from a part of a neighbourhood, as narrow strips side by side need.
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

impl Policy {
    /// The policy that `parameters` ask for.
    pub fn of(parameters: &Parameters) -> Self {
        let Parameters { merge, refine, max_failed_seeds, min_points, .. } = *parameters;
        Self { merge, refine, failures: max_failed_seeds, least: min_points.min(ENOUGH.get()) }
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

    /// How many points say the same: a point and its neighbours of the graph, each of which repeats a share of its
    /// residual.
    pub fn repeats(&self) -> f64 {
        1.0 + K as f64 * self.common
    }

    /// What `n` points say anew.
    pub fn worth(&self, n: usize) -> usize {
        (n as f64 / self.repeats()) as usize
    }

    /// Whether a shape is too small, too large or too flat to mean anything at this noise, or encloses next to nothing
    /// where the `points` lie.
    pub fn degenerate(&self, s: &Shape, points: &[Vec3]) -> bool {
        s.min_radius() < LEAST_RADIUS.get() * self.sigma
            || s.max_radius() > self.max_radius
            || (s.family == Family::Cone && s.size[1].abs() < LEAST_ANGLE.get())
            || (s.family == Family::Torus
                && s.size[0] < (LEAST_RADIUS.get() * self.sigma).max(LEAST_TORUS.get() * s.size[1]))
            || self.hollow(s, points)
    }

    /// Whether the two walls of an ellipse are as near to each other as their noise at most of the points. One of them is
    /// always nearer to a point than a single surface between them, most of all where the noise grows along it.
    fn hollow(&self, s: &Shape, points: &[Vec3]) -> bool {
        if s.elongation() < LONG.get() {
            return false;
        }
        let thin = |p: &&Vec3| s.thickness(p) < ONE_WALL.get() * self.sigma;
        let looked = || points.iter().step_by(points.len().div_ceil(LOOK.get()).max(1));
        2 * looked().filter(thin).count() > looked().count()
    }

    /// Whether points lie on a line as far as their noise lets tell: no more of how far they spread across it is their
    /// own than is noise. What noise along a scanner's beams makes of a row of points is an exact plane through it.
    pub fn line(&self, points: &[Vec3]) -> bool {
        let few = points.iter().step_by(points.len().div_ceil(LOOK.get()).max(1));
        let n = few.clone().count() as f64;
        let mean = few.clone().sum::<Vec3>() / n;
        let square = |p: &Vec3| (p - mean) * (p - mean).transpose();
        let mut variances: [f64; 3] = few.map(square).sum::<Mat3>().symmetric_eigenvalues().into();
        variances.sort_by(f64::total_cmp);
        variances[1] < 2.0 * self.sigma * self.sigma * n
    }

    /// Scores a shape on points.
    pub fn score(&self, shape: Shape, points: &[Vec3]) -> Scored {
        let chi2 = self.chi2(&shape, points);
        let (n, p) = (points.len() as f64, shape.family.dof() as f64);
        Scored {
            shape,
            chi2,
            bic: chi2 / self.repeats() + shape.family.description_length(self.worth(points.len())),
            reduced: chi2 / (n - p).max(1.0),
        }
    }

    /// The truncated chi2 with which a family comes to this BIC on `n` points.
    fn chi2_of(&self, bic: f64, family: Family, n: usize) -> f64 {
        (bic - family.description_length(self.worth(n))) * self.repeats()
    }

    /// What points cost at a shape: their truncated chi2, as far as they say anything anew.
    pub fn misfit(&self, shape: &Shape, points: &[Vec3]) -> f64 {
        self.chi2(shape, points) / self.repeats()
    }

    /// Truncated chi2 of points at a shape.
    fn chi2(&self, shape: &Shape, points: &[Vec3]) -> f64 {
        let inverse = 1.0 / (self.sigma * self.sigma);
        Ruler::of(shape).truncated(points, inverse, unassigned())
    }

    /// Robust fit of one family from `start`.
    pub fn polish(&self, start: &Shape, points: &[Vec3], steps: usize) -> Option<Fitted> {
        self.polish_below(start, points, steps, f64::INFINITY)
    }

    /// [`polish`](Self::polish) that is of use only where it comes to a truncated chi2 of at most `most`, and gives up
    /// where it will not.
    fn polish_below(
        &self,
        start: &Shape,
        points: &[Vec3],
        steps: usize,
        most: f64,
    ) -> Option<Fitted> {
        let cauchy = Some(ROBUST.get() * self.sigma);
        let options = Options { cauchy, steps, tolerance: ROUGHLY.get() };
        fit_below(start, points, &options, most * self.sigma * self.sigma)
    }

    /// Whether a score is what noise alone would give.
    pub fn explains(&self, s: &Scored, n: usize) -> bool {
        s.reduced < 1.0 + CHANCE.get() * (2.0 / n as f64).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::fits::Random;
    use crate::segment::fixtures;

    #[test]
    fn walls_nearer_to_each_other_than_their_noise_are_none_and_those_of_a_flat_tube_are() {
        let random = &mut Random::new(3);
        let size = [20_000.0, 6.0, 0.0];
        let hairpin = Shape::with_axis(Family::EllipticCylinder, Vec3::zeros(), Vec3::z(), size);
        // A sheet whose noise grows from the tip of the ellipse on.
        let mut at = || {
            let x = random.uniform(1.0, 100.0);
            let across = 0.01 * x * random.normal();
            hairpin.frame * Vec3::new(x - 20_000.0, across, random.uniform(0.0, 50.0))
        };
        let sheet: Vec<Vec3> = (0..2000).map(|_| at()).collect();
        let squares = |s: &Shape| sheet.iter().map(|p| s.distance(p).powi(2)).sum::<f64>();
        let flat = fixtures::plane(Vec3::zeros(), hairpin.frame.column(1).into_owned());
        assert!(squares(&hairpin) < 0.8 * squares(&flat));
        let families = Families { sigma: 0.5, max_radius: 1e6, ..fixtures::families() };
        assert!(families.degenerate(&hairpin, &sheet));
        let exact = Families { sigma: 0.1, ..families };
        assert!(!exact.degenerate(&hairpin, &sheet));
    }
}
