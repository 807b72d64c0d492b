//! The association `gaussian`: orthogonal least squares of all points.

use super::descend::{Descent, Freedoms, descend, polish, residuals};
use super::error::FitError;
use super::fixed::Fixed;
use super::kind::FeatureType;
use super::pose::Pose;
use super::rows::Gauge;
use super::starts::{starts_of, thinned};
use crate::fit::least_squares::{self, Options};
use crate::geometry::Vec3;

/// Points that starts are judged on; of the elliptic types fewer, whose distances take long.
const JUDGES: usize = 64;
const ELLIPTIC_JUDGES: usize = 40;
/// Starts that go on to all points.
const GO_ON: usize = 3;
/// Costs that differ by less than these shares are as good, of poses at their minimum and near it.
const SAME: f64 = 1e-9;
const ROUGH: f64 = 1e-3;

/// Points moved to a place among them and scaled to about unit size, by a power of two, so that neither costs a digit.
#[derive(Clone, Debug)]
pub struct Local {
    /// The points.
    pub points: Vec<Vec3>,
    /// Where their origin is.
    pub origin: Vec3,
    /// The length of their unit.
    pub scale: f64,
}

impl Local {
    /// Of `points`.
    ///
    /// # Errors
    /// There is none, one is not finite, or all are at one place.
    pub fn of(points: &[Vec3]) -> Result<Self, FitError> {
        if let Some(index) = points.iter().position(|p| !p.iter().all(|v| v.is_finite())) {
            return Err(FitError::NotFinite { index });
        }
        let n = points.len() as f64;
        let first = points.first().copied().unwrap_or_default();
        let origin = first + points.iter().map(|p| p - first).sum::<Vec3>() / n.max(1.0);
        let sq = points.iter().map(|p| (p - origin).norm_squared()).sum::<f64>() / n;
        if !(sq > 0.0 && sq.is_finite()) {
            return Err(FitError::OnePlace);
        }
        let scale = sq.sqrt().log2().round().exp2();
        let points = points.iter().map(|p| (p - origin) / scale).collect();
        Ok(Self { points, origin, scale })
    }

    /// A pose in the input's terms.
    pub fn world(&self, pose: &Pose) -> Pose {
        pose.scaled(self.scale).translated(&self.origin)
    }
}

/// A least-squares feature in the frame of its points.
#[derive(Clone, Debug)]
pub struct Least {
    /// The pose.
    pub pose: Pose,
    /// Its sum of squares.
    pub cost: f64,
    /// Steps of the last descent.
    pub steps: usize,
    /// Length of the last step.
    pub last_step: f64,
    /// Other features whose sum of squares is as small, as far as rounding and chance go.
    pub others: Vec<Pose>,
}

/// The least-squares feature of local points.
///
/// # Errors
/// No start leads anywhere: the points determine no such feature.
pub fn least(kind: FeatureType, points: &[Vec3], fixed: &Fixed) -> Result<Least, FitError> {
    let free = fixed.freedoms(kind);
    let needed = kind.fewest(free.count());
    if points.len() < needed {
        return Err(FitError::TooFew { kind, points: points.len(), needed });
    }
    let is_elliptic = matches!(kind, FeatureType::EllipticCylinder | FeatureType::Ellipsoid);
    let judges = thinned(points, if is_elliptic { ELLIPTIC_JUDGES } else { JUDGES });
    let is_engines =
        kind.family().is_some() && fixed.is_none() && points.len() > kind.slots().len();
    let glance = Steps { most: 20, gain: 1e-3, engines: 1e-3 };
    let mut near: Vec<Descent> = starts_of(kind, &judges, fixed)
        .iter()
        .filter_map(|start| approach(start, &judges, &free, &glance, is_engines))
        .collect();
    near.sort_by(|a, b| a.cost.total_cmp(&b.cost));
    let most = near.first().map_or(0.0, |best| 9.0 * best.cost + 1e-20);
    near.retain(|d| d.cost <= most);
    let near = distinct(near, &judges, ROUGH);
    let whole = Steps { most: 200, gain: 1e-5, engines: 1e-5 };
    // One without a rival needs no slow descent to be told from it: Newton's steps find their way from here, but for the
    // valleys of the elliptic families.
    let alone = match near[..] {
        [one] if !is_engines && !is_elliptic => {
            let cost = residuals(&one.pose, points).iter().map(|d| d * d).sum();
            polish(&one.pose, points, &free).filter(|done| done.cost <= cost)
        }
        _ => None,
    };
    if let Some(Descent { pose, cost, steps, last_step }) = alone {
        return Ok(Least { pose, cost, steps, last_step, others: Vec::new() });
    }
    let mut close: Vec<Descent> = near
        .iter()
        .take(GO_ON)
        .filter_map(|d| approach(&d.pose, points, &free, &whole, is_engines))
        .collect();
    close.sort_by(|a, b| a.cost.total_cmp(&b.cost));
    let most = close.first().map_or(0.0, |best| (1.0 + ROUGH) * best.cost + 1e-20);
    close.retain(|d| d.cost <= most);
    let polished = |d: &Descent| {
        let done = polish(&d.pose, points, &free).filter(|p| p.cost <= most);
        done.or_else(|| {
            // The engine's distances of the elliptic families are of second order: these are not.
            let closer = descend(&d.pose, points, &free, 200, 1e-13)?;
            Some(polish(&closer.pose, points, &free).filter(|p| p.cost <= most).unwrap_or(closer))
        })
    };
    let mut done: Vec<Descent> =
        distinct(close, points, ROUGH).iter().filter_map(polished).collect();
    done.sort_by(|a, b| a.cost.total_cmp(&b.cost));
    let done = distinct(done, points, SAME);
    let Some(best) = done.first() else { return Err(FitError::Undetermined { kind }) };
    let as_good = |d: &&Descent| d.cost <= best.cost * (1.0 + 1e-9) + 1e-26 * points.len() as f64;
    let others = done.iter().skip(1).filter(as_good).map(|d| d.pose).collect();
    let Descent { pose, cost, steps, last_step } = *best;
    Ok(Least { pose, cost, steps, last_step, others })
}

/// How far a descent goes: at most so many steps, until one lowers the cost by less than the share `gain`; those of the
/// engine's fit, of which there are up to 40, by less than `engines`.
struct Steps {
    most: usize,
    gain: f64,
    engines: f64,
}

/// A pose near the minimum below a start.
fn approach(
    start: &Pose,
    points: &[Vec3],
    free: &Freedoms,
    steps: &Steps,
    is_engines: bool,
) -> Option<Descent> {
    if is_engines && let Some(shape) = start.shape() {
        // Fast, and it knows the valleys of the elliptic families.
        let options = Options { cauchy: None, steps: 40.min(steps.most), tolerance: steps.engines };
        if let Some(fitted) = least_squares::fit(&shape, points, None, &options) {
            let cost = fitted.mean_sq * points.len() as f64;
            let pose = Pose::of(&fitted.shape);
            return Some(Descent { pose, cost, steps: 0, last_step: f64::INFINITY });
        }
    }
    descend(start, points, free, steps.most, steps.gain)
}

/// Those that are not the same as one before: of about the same cost, and as far from the points and from places beside them, but
/// for the share `apart`.
fn distinct(all: Vec<Descent>, points: &[Vec3], apart: f64) -> Vec<Descent> {
    let mut kept: Vec<Descent> = Vec::new();
    for one in all {
        let is_same = |other: &Descent| {
            let gauges = [&one.pose, &other.pose].map(Gauge::of);
            let beside = points.iter().take(16).map(|p| p * 1.3);
            let is_near = |x: Vec3| {
                let [a, b] = gauges.map(|g| g.distance(&x).abs());
                (a - b).abs() < apart.sqrt()
            };
            (one.cost - other.cost).abs() <= apart * (one.cost + other.cost) + 1e-20
                && points.iter().take(16).copied().chain(beside).all(is_near)
        };
        if !kept.iter().any(is_same) {
            kept.push(one);
        }
    }
    kept
}
