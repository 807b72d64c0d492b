//! Whether a feature keeps its tolerances.

use super::document::{Characteristic, FitParameters, Verdict};
use crate::fit::feature::{Exactness, Feature, FeatureType};

/// Why tolerances cannot be judged.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ToleranceError {
    /// No size is within the limits.
    #[error("parameter 'lower': {lower} is above 'upper': {upper}")]
    Empty {
        /// The lower limit deviation.
        lower: f64,
        /// The upper limit deviation.
        upper: f64,
    },
    /// There is nothing that limits deviate from.
    #[error(
        "parameter '{name}': {value} is a deviation from 'nominal', which is missing: give 'nominal' too"
    )]
    NoNominal {
        /// The limit.
        name: &'static str,
        /// Its value.
        value: f64,
    },
    /// The feature has no one size.
    #[error(
        "parameter 'nominal': {nominal} is of a diameter or a full angle, and {} has none: leave out 'nominal', 'lower' and \
         'upper', or name another type. Its form error is judged by 'form_tolerance'",
        kind.with_article()
    )]
    NoSize {
        /// The nominal size.
        nominal: f64,
        /// The feature's type.
        kind: FeatureType,
    },
}

/// Refuses tolerances that no feature of the type could be judged by, or, where that is open yet, none of any type.
///
/// # Errors
/// See [`ToleranceError`].
pub fn check(p: &FitParameters, kind: Option<FeatureType>) -> Result<(), ToleranceError> {
    if let (Some(lower), Some(upper)) = (p.lower, p.upper)
        && lower > upper
    {
        return Err(ToleranceError::Empty { lower, upper });
    }
    let limits = [("lower", p.lower), ("upper", p.upper)];
    let limit = limits.into_iter().find_map(|(name, value)| Some((name, value?)));
    match (p.nominal, limit, kind) {
        (None, Some((name, value)), _) => Err(ToleranceError::NoNominal { name, value }),
        (Some(nominal), _, Some(kind)) if size_of(kind).is_none() => {
            Err(ToleranceError::NoSize { nominal, kind })
        }
        _ => Ok(()),
    }
}

/// The toleranced characteristics of a feature, each with its verdict by the decision rule of ISO 14253-1: an uncertainty interval wholly
/// within the limits proves that it conforms, one wholly beyond a limit that it does not, and any other leaves it open.
pub fn characteristics(feature: &Feature, p: &FitParameters) -> Vec<Characteristic> {
    size(feature, p).into_iter().chain(form(feature, p)).collect()
}

/// The size that `nominal` is of: its name, that of the parameter that it is twice of, and the parameter's place among the sizes.
fn size_of(kind: FeatureType) -> Option<(&'static str, &'static str, usize)> {
    Some(match kind {
        FeatureType::Circle | FeatureType::Cylinder | FeatureType::Sphere => {
            ("diameter", "radius", 0)
        }
        FeatureType::Cone => ("full_angle", "half_angle", 1),
        FeatureType::Torus => ("tube_diameter", "minor_radius", 1),
        _ => return None,
    })
}

fn size(feature: &Feature, p: &FitParameters) -> Option<Characteristic> {
    let nominal = p.nominal?;
    let (name, parameter, place) = size_of(feature.pose.kind)?;
    let of = |e: &Exactness| {
        let found = e.parameters.iter().find(|p| p.name == parameter)?;
        found.expanded.first().map(|u| 2.0 * u)
    };
    // what the points do not tell is told nowhere
    let is_told = !feature.unknown.contains(&parameter);
    let measured = is_told.then(|| 2.0 * feature.pose.size[place].abs());
    let expanded = feature.exactness.as_ref().and_then(of).filter(|_| is_told);
    let (lower, upper) = (p.lower.map(|d| nominal + d), p.upper.map(|d| nominal + d));
    let (verdict, undecided) = verdict(measured, expanded, lower, upper);
    Some(Characteristic {
        name: name.to_owned(),
        nominal: Some(nominal),
        lower_limit: lower,
        upper_limit: upper,
        measured,
        deviation: measured.map(|measured| measured - nominal),
        expanded,
        verdict,
        undecided: undecided.map(str::to_owned),
    })
}

fn form(feature: &Feature, p: &FitParameters) -> Option<Characteristic> {
    let upper = p.form_tolerance?;
    let measured = feature.form.minimum_zone.unwrap_or(feature.form.gaussian);
    // Noise moves either end of the range by no more than it reaches.
    let expanded = feature.noise.map(|noise| {
        let k = feature.exactness.as_ref().map_or(2.0, |e| e.k);
        (2.0 * noise.reach).hypot(k * p.type_b.unwrap_or(0.0))
    });
    let (verdict, undecided) = verdict(Some(measured), expanded, None, Some(upper));
    Some(Characteristic {
        name: feature.pose.kind.form_name().to_owned(),
        nominal: None,
        lower_limit: None,
        upper_limit: Some(upper),
        measured: Some(measured),
        deviation: None,
        expanded,
        verdict,
        undecided: undecided.map(str::to_owned),
    })
}

/// The verdict, and why it is open where it is.
fn verdict(
    measured: Option<f64>,
    expanded: Option<f64>,
    lower: Option<f64>,
    upper: Option<f64>,
) -> (Verdict, Option<&'static str>) {
    let open = |why| (Verdict::Undecided, Some(why));
    let Some(measured) = measured else {
        return open(
            "the points do not tell it, see not_identifiable: give points that are spread over more of the feature",
        );
    };
    if lower.is_none() && upper.is_none() {
        return open("there is no limit: give lower, upper or both");
    }
    let Some(u) = expanded else {
        return open("its uncertainty is not known: give more points than determine the feature");
    };
    let is_below = lower.is_some_and(|l| measured + u < l);
    let is_above = upper.is_some_and(|l| measured - u > l);
    if is_below || is_above {
        return (Verdict::NotConform, None);
    }
    let is_within =
        lower.is_none_or(|l| measured - u >= l) && upper.is_none_or(|l| measured + u <= l);
    if is_within { (Verdict::Conform, None) } else { open("a limit lies within its uncertainty") }
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
            let (told, why) = verdict(Some(measured), u, limits.0, limits.1);
            assert_eq!(
                (told, why.is_some()),
                (expected, expected == Undecided),
                "{measured} {u:?}"
            );
        }
        assert_eq!(verdict(Some(0.01), Some(0.002), None, Some(0.02)), (Conform, None));
        for (measured, u, upper, told) in [
            (Some(5.0), Some(0.1), None, "no limit"),
            (Some(5.0), None, Some(6.0), "not known"),
            (Some(5.0), Some(2.0), Some(6.0), "within its uncertainty"),
            (None, None, Some(6.0), "not_identifiable"),
        ] {
            let (verdict, why) = verdict(measured, u, None, upper);
            assert!(verdict == Undecided && why.unwrap().contains(told), "{why:?}");
        }
    }

    #[test]
    fn tolerances_that_cannot_be_judged_are_refused() {
        use FeatureType::{Cone, Cylinder, Ellipsoid, Plane};
        let told = |nominal, lower, upper, kind| {
            let p = FitParameters { nominal, lower, upper, ..FitParameters::default() };
            check(&p, kind).map_err(|e| e.to_string())
        };
        let some = Some(20.0);
        let refused = told(some, Some(0.1), Some(-0.1), Some(Cylinder)).unwrap_err();
        assert!(refused.contains("0.1 is above 'upper': -0.1"), "{refused}");
        for kind in [None, Some(Cylinder), Some(Plane)] {
            let refused = told(None, None, Some(0.02), kind).unwrap_err();
            assert!(refused.contains("give 'nominal'"), "{refused}");
        }
        for kind in [Plane, Ellipsoid] {
            let refused = told(some, None, None, Some(kind)).unwrap_err();
            assert!(refused.contains("form_tolerance"), "{refused}");
        }
        for (lower, upper, kind) in [
            (Some(-0.02), Some(0.02), Some(Cylinder)),
            (Some(0.1), Some(0.1), Some(Cone)),
            (None, None, None),
        ] {
            assert_eq!(told(some, lower, upper, kind), Ok(()));
        }
        assert_eq!(told(None, None, None, Some(Plane)), Ok(()));
    }
}
