//! Why a region has its type: the next best one and how much worse it is.

use crate::fit::constant::constants;
use crate::fit::starts::Patch;
use crate::fit::{Family, Shape};
use crate::geometry::Vec3;
use crate::segment::family::{Families, Policy};
use crate::segment::{Evidence, Parameters};

constants! {
    /// Points of a region that are worth fitting other families to.
    pub SAMPLE: usize = 400, Effort("points of one fit");
}

/// The runner-up among the reported types and its margin, on a few `points` of the region, whose
/// distances from `shape` scatter by `sigma`.
///
/// The criterion is the one types are chosen by: sum of min(r2 / sigma2, 16), and the description length.
/// More points of the same kind only widen the margin over a type that does not fit. Negative where the
/// neighbours' points, not these, decided the type. `None` where no other family can be fitted.
pub fn evidence(shape: &Shape, points: &[Vec3], sigma: f64) -> Option<Evidence> {
    // The surface's own normals are better than any estimated from neighbours.
    let normals: Vec<Vec3> = points.iter().map(|p| shape.offset(p).normal).collect();
    let others = Family::ALL.into_iter().filter(|f| *f != shape.family);
    let families = Families {
        common: 0.0,
        rougher: false,
        allowed: others.collect(),
        sigma,
        floor: 0.0,
        max_radius: f64::INFINITY,
        strips: true,
        policy: Policy::of(&Parameters::default()),
    };
    let own = families.polish(shape, points, 8).map_or(*shape, |f| f.shape);
    let own = families.score(own, points);
    let patch = Patch { points, normals: &normals };
    let next = families
        .each(&patch, &[own.shape])
        .into_iter()
        .filter(|s| s.bic.is_finite())
        .min_by(|a, b| a.bic.total_cmp(&b.bic))?;
    let runner_up = next.shape.family.surface_type();
    Some(Evidence { runner_up, delta_bic: next.bic - own.bic })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::fits::Random;
    use crate::geometry::SurfaceType;

    /// Points of an arc of a cylinder of radius 5, 10 long, with noise 0.01.
    fn arc(angle: f64) -> Vec<Vec3> {
        let mut random = Random::new(4);
        let mut point = || {
            let (turn, r) = (random.uniform(0.0, angle), 5.0 + 0.01 * random.normal());
            Vec3::new(r * turn.cos(), random.uniform(-5.0, 5.0), r * turn.sin())
        };
        (0..SAMPLE.get()).map(|_| point()).collect()
    }

    #[test]
    fn the_runner_up_of_a_cylinder_has_more_freedom_and_saves_less_than_that_costs() {
        let shape = Shape::with_axis(Family::Cylinder, Vec3::zeros(), Vec3::y(), [5.0, 0.0, 0.0]);
        for angle in [1.0, 3.0] {
            let found = evidence(&shape, &arc(angle), 0.01).unwrap();
            let is_next = |f: &Family| f.surface_type() == found.runner_up;
            let next = Family::ALL.into_iter().find(is_next).unwrap();
            assert!(next.dof() > shape.family.dof(), "{found:?}");
            // Each parameter more gains one on average.
            let longer = [next, shape.family].map(|f| f.description_length(SAMPLE.get()));
            let gain = longer[0] - longer[1] - found.delta_bic;
            assert!((-0.1..8.0).contains(&gain), "{found:?} {gain}");
        }
    }

    #[test]
    fn a_type_that_does_not_fit_is_far_behind_its_runner_up() {
        let plane = Shape::with_axis(Family::Plane, 4.9 * Vec3::x(), Vec3::x(), [0.0; 3]);
        let found = evidence(&plane, &arc(1.0), 0.01).unwrap();
        assert!(found.runner_up == SurfaceType::Cylinder && found.delta_bic < -1000.0, "{found:?}");
    }
}
