//! Which type of feature points are of.

use super::error::FitError;
use super::fixed::Fixed;
use super::gauss::least;
use super::kind::FeatureType;
use crate::fit::Family;
use crate::geometry::Vec3;

/// Standard deviations below this, in units of the points' size, are rounding.
const ROUNDING: f64 = 1e-12;

/// A size of fewer standard deviations than this is within the scatter.
const THIN: f64 = 10.0;

/// The type that tells local points in the fewest words: where they lie along it, and how far from it.
///
/// A point of a surface lies within its scatter in one direction and anywhere within the points' size, which is 1, in two; one of a
/// curve in two and in one. Twice the negative log likelihood is then n r ln s2 with r = 1 or 2, to which the freedoms add
/// their number times ln n, and rare types what they add in segmentation.
pub fn simplest(points: &[Vec3], fixed: &Fixed) -> Result<FeatureType, FitError> {
    let n = points.len();
    let length = |kind: FeatureType| -> Option<f64> {
        let p = fixed.freedoms(kind).count();
        let rows = kind.rows() * n;
        if fixed.refused_by(kind).is_some() || rows <= p {
            return None;
        }
        let fit = least(kind, points, fixed).ok()?;
        let sq = (fit.cost / (rows - p) as f64).max(ROUNDING * ROUNDING);
        // A flat tube about the points of a plane is as near to them as they are to it, and no surface of theirs.
        let sizes = fit.pose.size.iter().zip(0..).filter(|(_, k)| kind.slots().contains(&(6 + k)));
        let is_cone = kind == FeatureType::Cone;
        if !is_cone && sizes.into_iter().any(|(size, _)| *size < THIN * sq.sqrt()) {
            return None;
        }
        // Half as many words as of the likelihood: both are told as twice as many.
        let price = match kind.family() {
            Some(family) => 0.5 * family.description_length(n),
            None => 0.5 * p as f64 * (n as f64).ln() + 0.5 * Family::Plane.description_length(1),
        };
        Some(0.5 * rows as f64 * (sq.ln() + LN_2_PI_E) + price)
    };
    let all = FeatureType::ALL.into_iter().filter_map(|kind| Some((length(kind)?, kind)));
    let best = all.min_by(|a, b| a.0.total_cmp(&b.0));
    best.map(|(_, kind)| kind).ok_or_else(|| match n {
        ..FEWEST => FitError::TooFewForAuto { points: n, needed: FEWEST },
        _ => FitError::NoType { fixed: fixed.names() },
    })
}

/// Fewer points are of several types.
const FEWEST: usize = 4;

/// ln(2 pi e): what a normal number of variance 1 takes, twice.
const LN_2_PI_E: f64 = 2.837_877_066_409_345;
