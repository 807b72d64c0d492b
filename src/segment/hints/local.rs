//! Fits to the points of a place.

use crate::fit::constant::constants;
use crate::fit::least_squares::{Options, fit};
use crate::fit::starts::Patch;
use crate::fit::{Family, Held, Ruler, Shape, fit_held};
use crate::geometry::Vec3;
use crate::segment::family::{Families, MOST_RADIUS, Policy};
use crate::segment::found::Found;
use crate::segment::objective::ACCEPT;
use crate::segment::prepare::place::place;
use crate::segment::prepare::scene::Scene;
use crate::segment::{Cancelled, Monitor, Parameters};

constants! {
    /// Points that a surface is looked for on.
    LOOKED_AT: usize = 4_000, Effort("points of one fit");
    /// Points of a last fit.
    pub FITTED: usize = 200_000, Effort("points of one fit");
    /// Steps of a fit.
    STEPS: usize = 30, Effort("steps of one fit");
}

/// At most `limit` of some points, evenly.
pub fn thinned(members: &[u32], limit: usize) -> Vec<u32> {
    let m = members.len().min(limit);
    (0..m).map(|k| members[place(k, m, members.len())]).collect()
}

/// The points at these places.
pub fn points_of(found: &Found, members: &[u32]) -> Vec<Vec3> {
    members.iter().map(|&i| found.points[i as usize]).collect()
}

/// What may be fitted at a place whose points have noise `sigma`.
pub fn families(
    found: &Found,
    allowed: Vec<Family>,
    sigma: f64,
    parameters: &Parameters,
) -> Families {
    let extent = found.points.iter().map(|p| p.norm()).fold(0.0, f64::max);
    Families {
        allowed,
        sigma,
        max_radius: MOST_RADIUS.get() * extent,
        floor: sigma,
        common: 0.0,
        rougher: false,
        strips: false,
        policy: Policy::of(parameters),
    }
}

/// The noise to reckon with at the points of some regions.
pub fn sigma(found: &Found, regions: &[(usize, usize)], parameters: &Parameters) -> f64 {
    let reach = regions.iter().map(|&(l, _)| found.reaches[l]).fold(0.0, f64::max);
    let reach = parameters.tolerance.unwrap_or(reach);
    found.noise.max(reach / ACCEPT.get()).max(found.rounding)
}

/// The best shape of each of the families that comes near explaining some points, the best first.
///
/// # Errors
/// `monitor` cancelled the work.
pub fn shapes(
    found: &Found,
    members: &[u32],
    warm: &[Shape],
    families: &Families,
    monitor: &dyn Monitor,
) -> Result<Vec<Shape>, Cancelled> {
    let points = points_of(found, &thinned(members, LOOKED_AT.get()));
    if points.is_empty() {
        return Ok(Vec::new());
    }
    let mut scene = Scene::watched(points, monitor)?;
    scene.sharpen_normals(families.sigma);
    let patch = Patch { points: &scene.points, normals: &scene.normals };
    let mut all = families.each(&patch, warm);
    monitor.check()?;
    all.retain(|s| families.allowed.contains(&s.shape.family));
    all.sort_by(|a, b| a.bic.total_cmp(&b.bic));
    Ok(all.into_iter().map(|s| s.shape).collect())
}

/// A shape fitted to some points, what is `held` apart; as it was where the points do not determine it.
pub fn refitted(found: &Found, members: &[u32], shape: &Shape, held: &Held) -> Shape {
    let points = points_of(found, &thinned(members, FITTED.get()));
    let fitted = if held.is_nothing() {
        let options = Options { cauchy: None, steps: STEPS.get(), tolerance: 1e-9 };
        fit(shape, &points, None, &options)
    } else {
        fit_held(&beside(shape, &points, held), &points, held)
    };
    fitted.map_or(*shape, |f| f.shape)
}

/// A start for a fit with a known radius: the shape, moved such that the surface stays where the points are.
fn beside(shape: &Shape, points: &[Vec3], held: &Held) -> Shape {
    let centroid = points.iter().sum::<Vec3>() / points.len().max(1) as f64;
    let offset = shape.offset(&centroid);
    let mut start = *shape;
    if let (Some(radius), Family::Sphere | Family::Cylinder) = (held.radius, shape.family) {
        // points all around have no side: there the axis stays
        if offset.distance > -0.5 * shape.size[0] {
            start.origin += offset.normal * (shape.size[0] - radius);
        }
    }
    held.put_in(&start)
}

/// The points of `members` within `reach` of a shape.
pub fn within(found: &Found, members: &[u32], shape: &Shape, reach: f64) -> Vec<u32> {
    let ruler = Ruler::of(shape);
    let near = |i: &u32| ruler.distance(&found.points[*i as usize]).abs() <= reach;
    members.iter().copied().filter(near).collect()
}

/// Root mean square distance of some points from a shape.
pub fn rms(found: &Found, members: &[u32], shape: &Shape) -> f64 {
    let ruler = Ruler::of(shape);
    let squares = members.iter().map(|&i| ruler.distance(&found.points[i as usize]).powi(2));
    (squares.sum::<f64>() / members.len().max(1) as f64).sqrt()
}
