//! What is told of a surface beside its type, against what its points say.

use crate::fit::{Family, Held, Shape};
use crate::geometry::Vec3;
use crate::segment::Hint;
use crate::segment::found::Found;
use crate::segment::hints::local::{FITTED, points_of, rms, thinned};
use crate::segment::objective::ACCEPT;
use crate::segment::report::uncertainty::Uncertainty;

/// A value that was told, compared with the points'.
pub struct Compared {
    /// What to hold of it.
    pub held: Held,
    /// By how many standard deviations the points deny it, the worst of several; none where nothing was told.
    pub misfit: Option<f64>,
    /// What the points say where they deny it, in words.
    pub denied: Vec<String>,
}

/// Compares the radius and direction of a hint with those of `free`, fitted to `members` by itself. How exactly the points
/// tell these follows from their scatter about it, as in what is reported.
pub fn compare(found: &Found, members: &[u32], free: &Shape, hint: &Hint) -> Compared {
    let mut out = Compared { held: Held::default(), misfit: None, denied: Vec::new() };
    let some = points_of(found, &thinned(members, FITTED.get()));
    let centroid = some.iter().sum::<Vec3>() / some.len().max(1) as f64;
    let share = members.len() as f64 / some.len().max(1) as f64;
    let shape = free.recentred(&centroid);
    let freedom = members.len().saturating_sub(shape.family.dof()).max(1) as f64;
    let scatter = rms(found, members, free) * (members.len() as f64 / freedom).sqrt();
    let sigma = found.rounding.max(scatter);
    let known = Uncertainty::of(&shape, &some, share, sigma);
    let variance =
        |a: usize, b: usize| known.as_ref().map_or(f64::INFINITY, |k| k.of_freedoms[(a, b)]);
    if let (Some(radius), Some(at)) = (hint.radius, radius_freedom(shape.family)) {
        let tolerance = hint.radius_tolerance.unwrap_or(0.0);
        let off = shape.size[0] - radius;
        let deviation = variance(at, at).sqrt();
        let misfit = excess(off.abs() - tolerance, deviation);
        out.misfit = Some(misfit);
        if misfit > ACCEPT.get() {
            out.denied.push(format!("the points say radius {} ± {deviation:.2e}", shape.size[0]));
        } else if off.abs() >= tolerance {
            out.held.radius = Some(radius + off.signum() * tolerance);
        }
    }
    if let (Some(direction), Some(at)) = (hint.axis_direction, turn_freedoms(shape.family)) {
        let told = Vec3::from(direction).normalize();
        let w = shape.w();
        let told = if told.dot(&w) < 0.0 { -told } else { told };
        let tolerance = hint.axis_tolerance.unwrap_or(0.0);
        let turn = w.cross(&told);
        let angle = turn.norm().atan2(w.dot(&told));
        let axis = shape.frame.tr_mul(&turn.try_normalize(0.0).unwrap_or_else(Vec3::zeros));
        let [a, b] = at;
        let along = axis.x * axis.x * variance(a, a)
            + 2.0 * axis.x * axis.y * variance(a, b)
            + axis.y * axis.y * variance(b, b);
        let misfit = excess(angle - tolerance, along.max(0.0).sqrt());
        out.misfit = Some(out.misfit.unwrap_or(0.0).max(misfit));
        if misfit > ACCEPT.get() {
            let [x, y, z]: [f64; 3] = w.into();
            out.denied.push(format!(
                "the points say direction {x:.6}, {y:.6}, {z:.6}, {angle:.2e} radians off"
            ));
        } else if angle >= tolerance {
            let back = nalgebra::Rotation3::new(
                -turn.try_normalize(0.0).unwrap_or_else(Vec3::zeros) * tolerance,
            );
            out.held.direction = Some((back * told).normalize());
        }
    }
    out
}

/// Standard deviations by which something is too much.
fn excess(by: f64, deviation: f64) -> f64 {
    if by <= 0.0 { 0.0 } else { (by / deviation.max(f64::MIN_POSITIVE)).min(f64::MAX) }
}

/// The place of the radius among the degrees of freedom.
fn radius_freedom(family: Family) -> Option<usize> {
    match family {
        Family::Sphere => Some(3),
        Family::Cylinder => Some(4),
        _ => None,
    }
}

/// The places of the turns of an axis or normal among the degrees of freedom.
fn turn_freedoms(family: Family) -> Option<[usize; 2]> {
    match family {
        Family::Plane => Some([1, 2]),
        Family::Cylinder | Family::Cone | Family::EllipticCylinder => Some([2, 3]),
        Family::Torus => Some([3, 4]),
        Family::Sphere | Family::Ellipsoid => None,
    }
}
