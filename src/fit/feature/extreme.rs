//! The associations other than least squares: where they begin, for which types they are, and when there is none.

use super::association::Association;
use super::descend::Freedoms;
use super::error::FitError;
use super::kind::FeatureType;
use super::pose::{Pose, SLOTS};
use super::rows::Gauge;
use super::zone::{Aim, Held, Program, places};
use crate::geometry::Vec3;

/// Distances below this, in the points' size, are rounding.
const EXACT: f64 = 1e-13;
/// Distances below this, in the points' size, are less than what associations are exact to: a zone that nothing is found to
/// hold is the least-squares one.
const NEARLY_EXACT: f64 = 1e-9;
/// Starts beside the least-squares feature: of several minima the least is taken.
const STARTS: usize = 4;
/// Radius, over that of least squares, beyond which an inscribed feature has left its points.
const WIDE: f64 = 3.0;

/// The feature of an association that is none of least squares, near the least-squares one `least` of local points.
///
/// # Errors
/// The type has no such association, or nothing holds the feature.
pub fn extreme(association: Association, points: &[Vec3], least: &Pose) -> Result<Held, FitError> {
    let kind = least.kind;
    let (aim, free) = opened(association, kind);
    if !association.is_for(kind) || association == Association::Gaussian {
        return Err(FitError::NotAssociated { kind, association });
    }
    let gauge = Gauge::of(least);
    let bound = points.iter().fold(0.0_f64, |m, x| m.max(gauge.distance(x).abs()));
    if bound < EXACT && association == Association::MinimumZone {
        // Rounding alone is left, and no point holds more than another.
        return Ok(Held { pose: *least, bound, contacts: Vec::new(), stationarity: 0.0 });
    }
    // Circles and lines are held within a plane across their axis, and about it.
    let start = match kind {
        FeatureType::Circle => Pose { kind: FeatureType::Cylinder, ..*least },
        FeatureType::Line => Pose { kind: FeatureType::Cylinder, size: [1.0, 0.0, 0.0], ..*least },
        _ => *least,
    };
    if aim == Aim::Inscribed && !is_surrounded(&start, points) {
        return Err(FitError::NotHeld { kind });
    }
    let mut best: Option<Held> = None;
    for one in starts(&start, points, free.slots()) {
        let Some(held) = search(points, free, aim, &one) else { continue };
        let is_near = moved(&start, &held.pose, aim).powi(2) < STRAIGHT * bound;
        if best.as_ref().is_none_or(|b| held.bound < b.bound - 1e-14) {
            best = Some(held);
        }
        if is_near {
            break;
        }
    }
    let is_zone = association == Association::MinimumZone;
    if best.is_none() && is_zone && bound < NEARLY_EXACT {
        return Ok(Held { pose: *least, bound, contacts: Vec::new(), stationarity: 0.0 });
    }
    let held = best.ok_or(FitError::NotReached { kind, association })?;
    if aim == Aim::Inscribed && held.pose.size[0] > WIDE * least.size[0] {
        return Err(FitError::NotHeld { kind });
    }
    let mut pose = held.pose;
    pose.kind = kind;
    if kind == FeatureType::Line {
        pose.size = [0.0; 3];
    }
    let side = if aim == Aim::Inscribed { -1.0 } else { 1.0 };
    let mut held = Held { pose, ..held };
    held.contacts.iter_mut().for_each(|c| c.side *= side);
    Ok(held)
}

/// Share of the largest distance that the square of a move may be for distances to be nearly linear in it: the largest of linear
/// functions has one minimum, and no other start leads elsewhere.
const STRAIGHT: f64 = 0.01;

/// How far a pose is from another, in the points' size and in radians; the radius of a circumscribed or inscribed feature is its bound.
fn moved(from: &Pose, to: &Pose, aim: Aim) -> f64 {
    let sizes = from.size.iter().zip(to.size).map(|(a, b)| (a - b).abs()).sum::<f64>();
    let turn = (from.frame - to.frame).norm();
    (from.origin - to.origin).norm() + turn + if aim == Aim::Zone { sizes } else { 0.0 }
}

/// What an association makes least, and the places of a step that it opens for that.
pub fn opened(association: Association, kind: FeatureType) -> (Aim, Freedoms) {
    let aim = match association {
        // The zone of a line is a cylinder.
        _ if kind == FeatureType::Line => Aim::Circumscribed,
        Association::MinimumCircumscribed => Aim::Circumscribed,
        Association::MaximumInscribed => Aim::Inscribed,
        _ => Aim::Zone,
    };
    // Circles and lines are held within a plane across their axis, and about it.
    let is_curve = matches!(kind, FeatureType::Circle | FeatureType::Line);
    let free = places(if is_curve { FeatureType::Cylinder } else { kind }, aim);
    if kind != FeatureType::Circle {
        return (aim, free);
    }
    let within = free.slots().iter().copied().filter(|slot| ![3, 4].contains(slot));
    (aim, Freedoms::of(within))
}

/// Points from which on searches go over some of them, and how many of those that lie furthest out come to these in one round.
const MANY: usize = 400;
const FURTHER: usize = 40;
/// Rounds after which some points would still lie further out.
const ROUNDS: usize = 200;

/// The minimum that a search over all points from `start` leads to.
///
/// Few of many points can hold a feature: it is searched for among those that lie furthest out and proven by all.
fn search(points: &[Vec3], free: Freedoms, aim: Aim, start: &Pose) -> Option<Held> {
    if points.len() <= MANY {
        return Program { points, free, aim }.search(start);
    }
    let all = Program { points, free, aim };
    let heights = all.heights(start);
    let mut order: Vec<usize> = (0..points.len()).collect();
    order.sort_by(|&a, &b| heights[b].total_cmp(&heights[a]).then(a.cmp(&b)));
    // The furthest out, and some all over, so that none is forgotten that a turn brings out.
    let stride = points.len().div_ceil(MANY / 4);
    let mut chosen: Vec<usize> = order[..MANY / 2].to_vec();
    chosen.extend((0..points.len()).step_by(stride));
    chosen.sort_unstable();
    chosen.dedup();
    let mut pose = *start;
    for _ in 0..ROUNDS {
        let some: Vec<Vec3> = chosen.iter().map(|&i| points[i]).collect();
        let mut held = Program { points: &some, free, aim }.search(&pose)?;
        let heights = all.heights(&held.pose);
        let most = held.bound + 1e-13 * (1.0 + held.bound.abs());
        let mut over: Vec<usize> = (0..points.len()).filter(|&i| heights[i] > most).collect();
        if over.is_empty() {
            held.contacts.iter_mut().for_each(|c| c.index = chosen[c.index]);
            return Some(held);
        }
        over.sort_by(|&a, &b| heights[b].total_cmp(&heights[a]).then(a.cmp(&b)));
        chosen.extend(&over[..over.len().min(FURTHER)]);
        pose = held.pose;
    }
    None
}

/// The least-squares pose and some beside it, as far as its distances range.
fn starts(pose: &Pose, points: &[Vec3], slots: &[usize]) -> Vec<Pose> {
    let gauge = Gauge::of(pose);
    let (least, most) = points
        .iter()
        .map(|x| gauge.distance(x))
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(least, most), d| (least.min(d), most.max(d)));
    let range = (most - least).min(0.2);
    let mut state = 1_u64;
    let mut next = || {
        // SplitMix64
        state = state.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = state;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
    };
    let beside = (0..STARTS).filter_map(|_| {
        let mut step = [0.0; SLOTS];
        for &slot in slots {
            step[slot] = 2.0 * range * next();
        }
        pose.stepped(&step)
    });
    std::iter::once(*pose).chain(beside).collect()
}

/// Whether the points lie on all sides of the centre or axis: seen from there, no half of the directions is empty.
fn is_surrounded(pose: &Pose, points: &[Vec3]) -> bool {
    let flat = |x: &Vec3| {
        let q = pose.frame.tr_mul(&(x - pose.origin));
        (q.x, q.y, q.z)
    };
    if pose.kind == FeatureType::Sphere {
        return super::starts::directions(200).flat_map(|w| [w, -w]).all(|w| {
            points.iter().any(|x| {
                let q = x - pose.origin;
                q.dot(&w) > -0.05 * q.norm()
            })
        });
    }
    let mut angles: Vec<f64> = points.iter().map(|x| flat(x).1.atan2(flat(x).0)).collect();
    angles.sort_by(f64::total_cmp);
    let Some((first, last)) = angles.first().zip(angles.last()) else { return false };
    let round = first + std::f64::consts::TAU - last;
    angles.windows(2).map(|w| w[1] - w[0]).fold(round, f64::max) < std::f64::consts::PI
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::feature::{Asked, Fixed, assess};
    use crate::fit::fits::Random;

    fn asked(kind: FeatureType, association: Association) -> Asked {
        let (fixed, outliers) = (Fixed::default(), None);
        Asked { kind: Some(kind), association, fixed, outliers, type_b: 0.0, coverage: 0.9545 }
    }

    fn ring(n: usize, z: f64) -> impl Iterator<Item = Vec3> {
        let angle = move |k: usize| std::f64::consts::TAU * k as f64 / n as f64;
        (0..n).map(move |k| Vec3::new(angle(k).cos(), angle(k).sin(), z))
    }

    fn radius(kind: FeatureType, points: &[Vec3], association: Association, most: f64) -> f64 {
        let feature =
            assess(points, &asked(kind, association)).unwrap_or_else(|e| panic!("{kind:?} {e}"));
        let held = feature.held.unwrap();
        let sum: f64 = held.contacts.iter().map(|c| c.multiplier).sum();
        assert!(held.contacts.is_empty() || (sum - 1.0).abs() < 1e-9, "{held:?}");
        assert!(held.contacts.iter().all(|c| c.multiplier >= 0.0) && held.stationarity < 1e-9);
        let reached = |c: &super::super::zone::Contact| feature.distances[c.index].abs() < most;
        assert!(held.contacts.iter().all(reached), "{held:?}");
        feature.pose.size[0]
    }

    /// What points hold, and what stops where they do not: all are as far from the centre as the others.
    #[test]
    fn points_at_one_distance_hold_what_is_inscribed_and_circumscribed() {
        use FeatureType::{Circle, Cylinder, Sphere};
        let exact = |points: Vec<Vec3>, kind| (points, kind, 1e-12);
        let mut cases = Vec::new();
        for n in [3, 4, 5, 6, 7, 8, 10, 12, 16, 24, 36, 100, 360] {
            cases.push(exact(ring(n, 0.0).collect(), Circle));
            cases
                .push(exact([-3.0, 0.0, 3.0].iter().flat_map(|z| ring(n, *z)).collect(), Cylinder));
            for noise in [1e-13, 1e-12, 1e-10] {
                let mut random = Random::new(n as u64);
                let off = |p: Vec3| p + Vec3::new(random.normal(), random.normal(), 0.0) * noise;
                cases.push((ring(n, 0.0).map(off).collect(), Circle, 20.0 * noise));
            }
        }
        let corner = |k: usize| [0, 1, 2].map(|bit| if k >> bit & 1 == 1 { 1.0 } else { -1.0 });
        let cube: Vec<Vec3> = (0..8).map(|k| Vec3::from(corner(k)) / 3.0_f64.sqrt()).collect();
        cases.push(exact(cube.clone(), Sphere));
        // one along each of its edges
        cases.push(exact(cube.iter().map(|p| p * 1.5_f64.sqrt()).collect(), Cylinder));
        let axes = [Vec3::x(), Vec3::y(), Vec3::z()];
        cases.push(exact(axes.iter().flat_map(|a| [*a, -a]).collect(), Sphere));
        for (points, kind, most) in cases {
            for association in [
                Association::MaximumInscribed,
                Association::MinimumCircumscribed,
                Association::MinimumZone,
            ] {
                let r = radius(kind, &points, association, 2.0 * most);
                let n = points.len();
                assert!((r - 1.0).abs() < most, "{kind:?} of {n} {association:?} {most}: {r}");
            }
        }
    }

    #[test]
    fn half_a_ring_holds_nothing() {
        let points: Vec<Vec3> = ring(16, 0.0).take(8).collect();
        let asked = asked(FeatureType::Circle, Association::MaximumInscribed);
        let refused = assess(&points, &asked).map(drop);
        assert!(matches!(refused, Err(FitError::NotHeld { .. })), "{refused:?}");
    }
}
