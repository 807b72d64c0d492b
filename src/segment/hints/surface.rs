//! One surface at a place, of which something is told.

use crate::fit::constant::constants;
use crate::fit::{Family, Held, Shape};
use crate::geometry::Vec3;
use crate::segment::found::Found;
use crate::segment::hints::draft::Draft;
use crate::segment::hints::extend::extend;
use crate::segment::hints::local::{families, refitted, rms, shapes, sigma, within};
use crate::segment::hints::place;
use crate::segment::hints::told::{Compared, compare};
use crate::segment::objective::{ACCEPT, FEW, MOST};
use crate::segment::outcome::Outcome;
use crate::segment::{Cancelled, Hint, Monitor, Parameters};

constants! {
    /// Regions in a place, and the whole of it, that starts are made from.
    STARTS: usize = 6, Effort("starts of one fit");
    /// Rounds of taking the points within reach and fitting them.
    ROUNDS: usize = 10, Effort("rounds of one fit");
}

/// A surface at a place.
pub struct Proposal {
    /// The surface.
    pub shape: Shape,
    /// The points of the place within reach of it.
    pub inliers: Vec<u32>,
    /// What of it was told and agrees.
    pub compared: Compared,
}

/// The families that a hint allows.
pub fn allowed(hint: &Hint) -> Vec<Family> {
    let meant = |f: &Family| match hint.surface_type {
        Some(told) => f.surface_type() == told,
        None if hint.radius.is_some() => matches!(f, Family::Sphere | Family::Cylinder),
        None => hint.axis_direction.is_none() || !matches!(f, Family::Sphere | Family::Ellipsoid),
    };
    Family::ALL.into_iter().filter(meant).collect()
}

/// The surface of a hint that most of `members` lie on.
///
/// # Errors
/// `monitor` cancelled the work.
pub fn propose(
    found: &Found,
    members: &[u32],
    hint: &Hint,
    sigma: f64,
    parameters: &Parameters,
    monitor: &dyn Monitor,
) -> Result<Option<Proposal>, Cancelled> {
    let families = families(found, allowed(hint), sigma, parameters);
    let reach = ACCEPT.get() * sigma;
    let mut sets = vec![members.to_vec()];
    for (l, _) in place::regions(found, members) {
        let part: Vec<u32> =
            members.iter().copied().filter(|&i| found.labels[i as usize] == l as i32).collect();
        sets.push(part);
    }
    sets.retain(|s| s.len() >= FEW.get());
    sets.truncate(STARTS.get());
    let mut best: Option<(usize, f64, Shape)> = None;
    for set in sets {
        let warm: Vec<Shape> =
            place::regions(found, &set).iter().map(|r| found.shapes[r.0]).collect();
        for start in shapes(found, &set, &warm, &families, monitor)? {
            let shape = settled(found, members, start, reach);
            let inliers = within(found, members, &shape, reach);
            let points: Vec<Vec3> = inliers.iter().map(|&i| found.points[i as usize]).collect();
            if families.degenerate(&shape, &points) {
                continue;
            }
            // of as many points the simpler family, and of one family the nearer
            let price = rms(found, &inliers, &shape) / sigma * inliers.len() as f64
                + shape.family.description_length(inliers.len());
            let gain = inliers.len() as f64 * ACCEPT.get() - price;
            if best.is_none_or(|b| gain > b.1) {
                best = Some((inliers.len(), gain, shape));
            }
        }
    }
    let Some((_, _, free)) = best else { return Ok(None) };
    let inliers = within(found, members, &free, reach);
    let compared = compare(found, &inliers, &free, hint);
    let shape = if compared.held.is_nothing() {
        free
    } else {
        refitted(found, &inliers, &free, &compared.held)
    };
    let inliers = within(found, members, &shape, reach);
    Ok(Some(Proposal { shape, inliers, compared }))
}

/// A shape fitted to the points within its reach until these stay.
fn settled(found: &Found, members: &[u32], start: Shape, reach: f64) -> Shape {
    let mut shape = start;
    let mut before = Vec::new();
    for _ in 0..ROUNDS.get() {
        let inliers = within(found, members, &shape, reach);
        if inliers == before || inliers.len() <= shape.family.dof() {
            break;
        }
        shape = refitted(found, &inliers, &shape, &Held::default());
        before = inliers;
    }
    shape
}

/// Does what a hint of the action `surface` says.
///
/// # Errors
/// `monitor` cancelled the work.
pub fn apply(
    found: &mut Found,
    number: usize,
    hint: &Hint,
    members: &[u32],
    parameters: &Parameters,
    monitor: &dyn Monitor,
) -> Result<Draft, Cancelled> {
    let regions = place::regions(found, members);
    let about: Vec<usize> = regions.iter().map(|r| r.0).collect();
    if members.len() < parameters.min_points {
        let n = members.len();
        let message =
            format!("{n} points lie there, and a region has at least {}", parameters.min_points);
        return Ok(Draft::new(number, Outcome::NotFound, about, message));
    }
    let sigma = sigma(found, &regions, parameters);
    let Some(proposal) = propose(found, members, hint, sigma, parameters, monitor)? else {
        let message = format!("the points there tell no {}", names(hint));
        return Ok(Draft::new(number, Outcome::Contradicted, about, message));
    };
    let Proposal { shape, inliers, compared } = proposal;
    let subject = subject(found, hint, members, &inliers);
    let off = rms(found, &subject, &shape) / sigma;
    let taken = inliers.iter().filter(|i| subject.binary_search(i).is_ok()).count();
    if (taken as f64) < MOST.get() * subject.len() as f64 || inliers.len() < parameters.min_points {
        let share = 100.0 * (1.0 - taken as f64 / subject.len().max(1) as f64);
        let message = format!(
            "{share:.0} % of the points there lie further than the tolerance from the nearest {}: what the points say is kept; \
             a larger tolerance allows more",
            name(&shape)
        );
        let mut draft = Draft::new(number, Outcome::Contradicted, about, message);
        draft.outcome.scatter = Some(off);
        draft.outcome.misfit = compared.misfit;
        return Ok(draft);
    }
    let place = put_in(found, &shape, &inliers, &compared.held, ACCEPT.get() * sigma);
    extend(found, place, sigma, true, parameters, monitor)?;
    Ok(draft(number, place, "it is a", &shape, compared, off))
}

/// The outcome of a hint that made the surface at `place`: `what` it is, and what of it the points deny.
pub fn draft(
    number: usize,
    place: usize,
    what: &str,
    shape: &Shape,
    compared: Compared,
    scatter: f64,
) -> Draft {
    let denied = !compared.denied.is_empty();
    let outcome = if denied { Outcome::Contradicted } else { Outcome::Applied };
    let mut message = format!("{what} {}", name(shape));
    if denied {
        message += &format!(", and {}", compared.denied.join(", and "));
    }
    let mut draft = Draft::new(number, outcome, vec![place], message);
    draft.outcome.scatter = Some(scatter);
    draft.outcome.misfit = compared.misfit;
    draft
}

fn name(shape: &Shape) -> String {
    shape.family.surface_type().name().replace('_', " ")
}

fn names(hint: &Hint) -> String {
    let all: Vec<_> =
        allowed(hint).iter().map(|f| f.surface_type().name().replace('_', " ")).collect();
    all.join(" or ")
}

/// The points that the surface must explain for the hint to be right: all that are meant; where a box means them, those of
/// the region that it takes most of, and what it takes beside.
fn subject(found: &Found, hint: &Hint, members: &[u32], inliers: &[u32]) -> Vec<u32> {
    if hint.extent.is_none() {
        return members.to_vec();
    }
    let Some((main, n)) = place::regions(found, inliers).first().copied() else {
        return inliers.to_vec();
    };
    let is_of_main = |i: &u32| found.labels[*i as usize] == main as i32;
    // what lies on no region yet is the hint's own finding
    let free = inliers.iter().filter(|i| found.labels[**i as usize] < 0).count();
    let keep = |i: &u32| (n >= free && is_of_main(i)) || inliers.binary_search(i).is_ok();
    members.iter().copied().filter(keep).collect()
}

/// Puts a surface with its points in: at the place of the region that it takes nearly all of, or as a new one. Returns its
/// place.
pub fn put_in(found: &mut Found, shape: &Shape, inliers: &[u32], held: &Held, reach: f64) -> usize {
    let main = place::regions(found, inliers).into_iter().find(|&(l, n)| {
        let own = found.labels.iter().filter(|k| **k == l as i32).count();
        n as f64 >= MOST.get() * own as f64
    });
    let place = main.map_or(found.shapes.len(), |m| m.0);
    if place == found.shapes.len() {
        found.shapes.push(*shape);
        found.reaches.push(reach);
        found.told.push(None);
    }
    found.shapes[place] = *shape;
    found.reaches[place] = found.reaches[place].max(reach);
    found.told[place] = Some(*held);
    inliers.iter().for_each(|&i| found.labels[i as usize] = place as i32);
    place
}
