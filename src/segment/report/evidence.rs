//! Why a region has its type: the next best one and how much worse it is.

use crate::fit::starts::Patch;
use crate::fit::{Family, Shape};
use crate::geometry::Vec3;
use crate::segment::family::{Families, Policy};
use crate::segment::{Evidence, Parameters};

/// Points of a region that are worth fitting other families to.
pub const SAMPLE: usize = 400;

/// The runner-up among the reported types and its margin, on a few `points` of the region, whose
/// distances from `shape` scatter by `sigma`.
///
/// The criterion is the one types are chosen by: sum of min(r2 / sigma2, 16), and the description length.
/// More points of the same kind only widen the margin over a type that does not fit. Negative where the
/// neighbours' points, not these, decided the type. `None` where no other family can be fitted.
pub fn evidence(shape: &Shape, points: &[Vec3], sigma: f64) -> Option<Evidence> {
    // The surface's own normals are better than any estimated from neighbours.
    let normals: Vec<Vec3> = points.iter().map(|p| shape.offset(p).normal).collect();
    let others = Family::ALL.into_iter().filter(|f| *f != shape.family && *f != Family::Torus);
    let families = Families {
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
    let runner_up = next.shape.family.surface_type()?;
    Some(Evidence { runner_up, delta_bic: next.bic - own.bic })
}
