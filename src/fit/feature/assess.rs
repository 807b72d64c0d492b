//! A fitted feature with all that is known of it: uncertainty, condition, form, outliers.

use std::borrow::Cow;

use super::asked::Asked;
use super::association::Association;
use super::condition::{Condition, condition};
use super::descend::normal;
use super::error::FitError;
use super::exactness::{Exactness, exactness};
use super::extreme::{extreme, opened};
use super::fixed::Fixed;
use super::gauss::{Least, Local, least};
use super::kind::FeatureType;
use super::noise::{Foot, Noise};
use super::pose::Pose;
use super::reach::{self, Known, left_to_least_squares};
use super::rows::Gauge;
use super::zone::{Contact, Held, Program};
use crate::geometry::Vec3;

/// A feature and what is known of it.
#[derive(Clone, Debug, PartialEq)]
pub struct Feature {
    /// The feature, its origin beside the points' mean; lengths in the input's unit, its place relative to `origin`.
    pub pose: Pose,
    /// What the places of `pose` are relative to.
    pub origin: Vec3,
    /// `None` where the points are as few as determine it: they have no scatter.
    pub exactness: Option<Exactness>,
    /// How far the points' noise reaches, a length: a form error is known to twice that. `None` as with `exactness`.
    pub noise: Option<Noise>,
    /// Parameters that the points do not tell: sizes less than three standard uncertainties from zero or told less well than their
    /// uncertainty says, what hangs on these, directions known to no better than a third of a radian, and all of a feature that is
    /// thinner than its noise.
    pub unknown: Vec<&'static str>,
    /// How well the points determine it.
    pub condition: Condition,
    /// Form errors of the points used.
    pub form: FormError,
    /// What holds a feature that is none of least squares: its contacts' places are among all points, and its bound a length.
    pub held: Option<Held>,
    /// Signed distances of all points, in their order; of a curve their lengths.
    pub distances: Vec<f64>,
    /// Points left out, in rising order.
    pub rejected: Vec<usize>,
    /// Steps of the last descent, and the length of the last one over the points' size.
    pub steps: (usize, f64),
    /// Other features of the type that fit as well.
    pub others: Vec<Pose>,
}

/// Peak to valley, lengths; of a line the diameters of cylinders, of a circle ranges within its plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FormError {
    /// About the least-squares feature.
    pub gaussian: f64,
    /// The least about any feature of the type; `None` where none is proven.
    pub minimum_zone: Option<f64>,
}

/// Rounds after which points still come and go with the outlier rule.
const ROUNDS: usize = 50;

/// The least-squares feature of `points`.
///
/// # Errors
/// See [`FitError`].
pub fn assess(points: &[Vec3], asked: &Asked) -> Result<Feature, FitError> {
    let local = Local::of(points)?;
    let fixed = asked.fixed.scaled(1.0 / local.scale);
    let kind = match asked.kind {
        Some(kind) => kind,
        None => super::auto::simplest(&local.points, &fixed)?,
    };
    if let Some(name) = fixed.refused_by(kind) {
        return Err(FitError::NotFixed { kind, name });
    }
    let (fit, used) = robust(kind, &local.points, &fixed, asked.outliers)?;
    let some: Vec<Vec3> = used.iter().map(|&i| local.points[i]).collect();
    describe(&local, &fit, &used, &some, &fixed, asked)
}

/// The fit to all points but the outliers, and those that it used.
fn robust(
    kind: FeatureType,
    points: &[Vec3],
    fixed: &Fixed,
    outliers: Option<f64>,
) -> Result<(Least, Vec<usize>), FitError> {
    let mut used: Vec<usize> = (0..points.len()).collect();
    let mut fit = least(kind, points, fixed)?;
    let Some(k) = outliers else { return Ok((fit, used)) };
    let p = fixed.freedoms(kind).count();
    for _ in 0..ROUNDS {
        let spare = (kind.rows() * used.len()).saturating_sub(p);
        if spare == 0 {
            break;
        }
        let most = k * (fit.cost / spare as f64).sqrt();
        let gauge = Gauge::of(&fit.pose);
        // What rounding leaves of exact points is no scatter.
        let keep = |i: &usize| gauge.distance(&points[*i]).abs() <= most.max(1e-14);
        let next: Vec<usize> = (0..points.len()).filter(keep).collect();
        if next == used {
            break;
        }
        let some: Vec<Vec3> = next.iter().map(|&i| points[i]).collect();
        (fit, used) = (least(kind, &some, fixed)?, next);
    }
    Ok((fit, used))
}

fn describe(
    local: &Local,
    fit: &Least,
    used: &[usize],
    some: &[Vec3],
    fixed: &Fixed,
    asked: &Asked,
) -> Result<Feature, FitError> {
    let kind = fit.pose.kind;
    let free = fixed.freedoms(kind);
    let mean = some.iter().sum::<Vec3>() / some.len() as f64;
    let pose = fit.pose.recentred(&mean);
    let sums = normal(&pose, &feet(&pose, some), &free);
    let condition = condition(&pose, &sums.jj, &free);
    if condition.is_singular() {
        return Err(FitError::Free { kind, directions: condition.weakest });
    }
    let is_gaussian = asked.association == Association::Gaussian;
    if !is_gaussian && !fixed.is_none() {
        return Err(FitError::FixedExtreme { association: asked.association });
    }
    let zone = extreme(Association::MinimumZone, some, &pose);
    let form = FormError {
        gaussian: peak_to_valley(&pose, some) * local.scale,
        minimum_zone: zone.as_ref().ok().map(|held| 2.0 * held.bound * local.scale),
    };
    let held = match asked.association {
        Association::Gaussian => None,
        Association::MinimumZone => Some(zone?),
        other => Some(extreme(other, some, &pose)?),
    };
    // The fixed values are those of the local points.
    let unit = Asked { fixed: *fixed, ..*asked };
    let noise = Noise::of(&pose, some, free.count(), asked.coverage);
    let (mut exactness, unknown) = match exactness(&pose, some, &sums.jj, &unit, local.scale) {
        Some((exactness, unknown)) => (Some(exactness), unknown),
        None => (None, Vec::new()),
    };
    let held = held.map(|held| Held { pose: held.pose.recentred(&mean), ..held });
    if let Some(held) = &held {
        // What is known of the least-squares feature is not what is known of another.
        exactness = noise.map(|noise| of_held(held, &pose, some, noise, asked, local.scale));
        drop_untold(&mut exactness, &unknown);
    }
    let pose = held.as_ref().map_or(pose, |held| held.pose);
    let held = held.map(|held| in_input(held, local.scale, used));
    let gauge = Gauge::of(&pose);
    let distances = local.points.iter().map(|x| gauge.distance(x) * local.scale).collect();
    let taken: std::collections::HashSet<usize> = used.iter().copied().collect();
    let rejected = (0..local.points.len()).filter(|i| !taken.contains(i)).collect();
    let world = |pose: &Pose| pose.scaled(local.scale);
    Ok(Feature {
        pose: world(&pose),
        origin: local.origin,
        exactness,
        noise: noise.map(|noise| noise.scaled(local.scale)),
        unknown,
        condition,
        form,
        held,
        distances,
        rejected,
        steps: (fit.steps, fit.last_step),
        others: fit.others.iter().map(|p| world(&p.recentred(&mean))).collect(),
    })
}

/// How exactly a feature that contacts hold is known, `least` being that of least squares.
fn of_held(
    held: &Held,
    least: &Pose,
    points: &[Vec3],
    noise: Noise,
    asked: &Asked,
    scale: f64,
) -> Exactness {
    let (aim, free) = opened(asked.association, least.kind);
    let known = Known {
        noise,
        others: left_to_least_squares(least, points, &free, noise.deviation),
        type_b: asked.type_b / scale,
        coverage: asked.coverage,
        scale,
    };
    reach::exactness(held, &Program { points, free, aim }, &known)
}

/// Takes out what is told nowhere.
fn drop_untold(exactness: &mut Option<Exactness>, unknown: &[&str]) {
    if let Some(exactness) = exactness {
        exactness.parameters.retain(|p| !unknown.contains(&p.name));
    }
}

/// What holds a feature, with places among all points and lengths in the input's unit.
fn in_input(held: Held, scale: f64, used: &[usize]) -> Held {
    Held {
        bound: held.bound * scale,
        pose: held.pose.scaled(scale),
        contacts: held.contacts.iter().map(|c| Contact { index: used[c.index], ..*c }).collect(),
        ..held
    }
}

/// Where derivatives are taken: of a curve beside the points, as the noise along one normal is no lever of the other's distances.
/// Of surfaces they are the same at a point.
fn feet<'a>(pose: &Pose, points: &'a [Vec3]) -> Cow<'a, [Vec3]> {
    if pose.kind.rows() == 1 {
        return points.into();
    }
    points.iter().map(|x| Foot::of(pose, x).at).collect()
}

fn peak_to_valley(pose: &Pose, points: &[Vec3]) -> f64 {
    let gauge = Gauge::of(pose);
    let heights = points.iter().map(|x| gauge.form_height(x));
    let least = heights.clone().fold(f64::INFINITY, f64::min);
    let most = heights.fold(f64::NEG_INFINITY, f64::max);
    if pose.kind == FeatureType::Line { 2.0 * most } else { most - least }
}
