//! Whether a feature keeps its tolerances.

use super::document::{Characteristic, FitParameters, Verdict};
use crate::fit::feature::{Exactness, Feature, FeatureType};

/// The toleranced characteristics of a feature, each with its verdict by the decision rule of ISO 14253-1: an uncertainty interval wholly
/// within the limits proves that it conforms, one wholly beyond a limit that it does not, and any other leaves it open.
pub fn characteristics(feature: &Feature, p: &FitParameters) -> Vec<Characteristic> {
    size(feature, p).into_iter().chain(form(feature, p)).collect()
}

/// The size that `nominal` is of: its name, that of the parameter that it is twice of, and the parameter's value.
fn size_of(feature: &Feature) -> Option<(&'static str, &'static str, f64)> {
    let size = feature.pose.size;
    Some(match feature.pose.kind {
        FeatureType::Circle | FeatureType::Cylinder | FeatureType::Sphere => {
            ("diameter", "radius", size[0])
        }
        FeatureType::Cone => ("full_angle", "half_angle", size[1].abs()),
        FeatureType::Torus => ("tube_diameter", "minor_radius", size[1]),
        _ => return None,
    })
}

fn size(feature: &Feature, p: &FitParameters) -> Option<Characteristic> {
    let nominal = p.nominal?;
    let (name, parameter, half) = size_of(feature)?;
    if feature.unknown.contains(&parameter) {
        return None;
    }
    let of = |e: &Exactness| {
        let found = e.parameters.iter().find(|p| p.name == parameter)?;
        found.expanded.first().map(|u| 2.0 * u)
    };
    let (measured, expanded) = (2.0 * half, feature.exactness.as_ref().and_then(of));
    let (lower, upper) = (p.lower.map(|d| nominal + d), p.upper.map(|d| nominal + d));
    Some(Characteristic {
        name: name.to_owned(),
        nominal: Some(nominal),
        lower_limit: lower,
        upper_limit: upper,
        measured,
        deviation: Some(measured - nominal),
        expanded,
        verdict: verdict(measured, expanded, lower, upper),
    })
}

fn form(feature: &Feature, p: &FitParameters) -> Option<Characteristic> {
    let upper = p.form_tolerance?;
    let measured = feature.form.minimum_zone.unwrap_or(feature.form.gaussian);
    // The scatter of points tells nothing of how exactly their range is known.
    let expanded = feature.exactness.as_ref().and_then(|e| p.type_b.map(|u| e.k * u));
    Some(Characteristic {
        name: feature.pose.kind.form_name().to_owned(),
        nominal: None,
        lower_limit: None,
        upper_limit: Some(upper),
        measured,
        deviation: None,
        expanded,
        verdict: verdict(measured, expanded, None, Some(upper)),
    })
}

fn verdict(
    measured: f64,
    expanded: Option<f64>,
    lower: Option<f64>,
    upper: Option<f64>,
) -> Verdict {
    let Some(u) = expanded else { return Verdict::Undecided };
    if lower.is_none() && upper.is_none() {
        return Verdict::Undecided;
    }
    let is_below = lower.is_some_and(|l| measured + u < l);
    let is_above = upper.is_some_and(|l| measured - u > l);
    if is_below || is_above {
        return Verdict::NotConform;
    }
    let is_within =
        lower.is_none_or(|l| measured - u >= l) && upper.is_none_or(|l| measured + u <= l);
    if is_within { Verdict::Conform } else { Verdict::Undecided }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_verdict_is_open_where_the_uncertainty_reaches_over_a_limit() {
        use Verdict::{Conform, NotConform, Undecided};
        let limits = (Some(9.9), Some(10.1));
        for (measured, u, expected) in [
            (10.0, Some(0.05), Conform),
            (10.05, Some(0.049), Conform),
            (10.05, Some(0.06), Undecided),
            (10.12, Some(0.03), Undecided),
            (10.16, Some(0.05), NotConform),
            (9.8, Some(0.05), NotConform),
            (9.87, Some(0.05), Undecided),
            (10.0, Some(0.2), Undecided),
            (10.0, None, Undecided),
        ] {
            assert_eq!(verdict(measured, u, limits.0, limits.1), expected, "{measured} {u:?}");
        }
        assert_eq!(verdict(0.01, Some(0.002), None, Some(0.02)), Conform);
        assert_eq!(verdict(5.0, Some(0.1), None, None), Undecided);
    }
}
