use super::super::{
    AnswerError, ErrorKind, OPTIONS, Request,
    options::ASSOCIATIONS,
    request::{ParameterForm, check_length, known_names, worded},
};
use super::document::{FitParameters, PassedThrough};
use crate::{
    fit::feature::{Asked, Association, FeatureType, Fixed},
    geometry::{Vec3, moderate},
    segment::{ParameterKind, ParameterSpec, truth},
};

const LENGTH: ParameterKind = ParameterKind::Number { min: 0.0, max: 1e12 };
const DEVIATION: ParameterKind = ParameterKind::Number { min: -1e12, max: 1e12 };
/// Most characters of what is passed through.
const MAX_TEXT: usize = 255;

const fn row(
    name: &'static str,
    kind: ParameterKind,
    unit: Option<&'static str>,
    default: Option<&'static str>,
    help: &'static str,
) -> ParameterSpec {
    ParameterSpec { name, kind, unit, default, help }
}

const fn passed(name: &'static str, help: &'static str) -> ParameterSpec {
    row(name, ParameterKind::Text { max: MAX_TEXT }, None, None, help)
}

const TYPES: &[&str] = &[
    "auto",
    "plane",
    "sphere",
    "cylinder",
    "cone",
    "elliptic_cylinder",
    "ellipsoid",
    "torus",
    "circle",
    "line",
];

/// The parameters of a fit, in the order of the reference.
pub const FIT_PARAMETERS: &[ParameterSpec] = &[
    row(
        "type",
        ParameterKind::Choice(TYPES),
        None,
        Some("auto"),
        "The type of the feature; auto: the one that tells where the points lie in the fewest words",
    ),
    row(
        "association",
        ParameterKind::Choice(ASSOCIATIONS),
        None,
        Some("gaussian"),
        "gaussian: the least sum of squared distances of all points. minimum_zone: the least largest distance, of a line the thinnest cylinder that holds all points. minimum_circumscribed, maximum_inscribed: of a circle, sphere or cylinder, the smallest about all points and the largest among them",
    ),
    row("radius", LENGTH, Some("length"), None, "A fixed radius: of a sphere, cylinder or circle"),
    row(
        "axis",
        ParameterKind::Direction,
        None,
        None,
        "A fixed direction of the axis, of the line, or of the normal of a plane or circle",
    ),
    row(
        "half_angle",
        ParameterKind::Number { min: 0.0, max: 1.57 },
        Some("radians"),
        None,
        "A fixed half angle of a cone",
    ),
    row(
        "outliers",
        ParameterKind::Number { min: 1.0, max: 100.0 },
        Some("deviations"),
        None,
        "Points further off than this many standard deviations are left out, again and again until none is (none is left out when absent)",
    ),
    row(
        "type_b",
        LENGTH,
        Some("length"),
        None,
        "Standard uncertainty of what all points have in common, such as the instrument's scale or probe, from elsewhere: added in quadrature to the uncertainty of each length, and over the points' size to that of each angle",
    ),
    row(
        "coverage",
        ParameterKind::Number { min: 0.5, max: 0.9999 },
        None,
        Some("0.9545"),
        "Probability that expanded uncertainties are made for",
    ),
    row(
        "nominal",
        LENGTH,
        Some("length"),
        None,
        "Nominal diameter of a circle, sphere, cylinder or of the tube of a torus; of a cone its full angle in radians",
    ),
    row(
        "lower",
        DEVIATION,
        Some("length"),
        None,
        "Lower limit deviation from nominal, mostly below 0 (no lower limit when absent)",
    ),
    row(
        "upper",
        DEVIATION,
        Some("length"),
        None,
        "Upper limit deviation from nominal (no upper limit when absent)",
    ),
    row("form_tolerance", LENGTH, Some("length"), None, "Largest form error allowed"),
    row(
        "residuals",
        ParameterKind::Boolean,
        None,
        Some("false"),
        "Whether the answer holds each point's signed distance",
    ),
    passed("part", "Passed through: the part"),
    passed("serial", "Passed through: its serial number"),
    passed("operator", "Passed through: who measured"),
    passed("instrument", "Passed through: what was measured with"),
    passed("temperature", "Passed through: the temperature, with its unit"),
    passed("time", "Passed through: when it was measured"),
];

/// The options that a fit shares with a segmentation.
const SHARED: [&str; 5] = ["format", "columns", "unit", "name", "deadline"];

/// Every parameter and option a fit may have.
pub fn fit_specs() -> impl Iterator<Item = &'static ParameterSpec> + Clone {
    FIT_PARAMETERS.iter().chain(OPTIONS.iter().filter(|spec| SHARED.contains(&spec.name)))
}

/// The parameters of a fit as text, and what is shared with segmentations.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FitRequest {
    /// Format, columns, unit, name and deadline; all that was given, in its order.
    pub request: Request,
    /// The parameters as used.
    pub parameters: FitParameters,
    /// What is passed through.
    pub passed: PassedThrough,
    /// Whether the answer holds each point's distance.
    pub residuals: bool,
}

impl FitRequest {
    /// Reads name and value pairs, as a query gives them.
    ///
    /// # Errors
    /// A name is unknown, or a value is not one its parameter takes.
    pub fn from_pairs<'a>(
        pairs: impl IntoIterator<Item = (&'a str, &'a str)>,
    ) -> Result<Self, AnswerError> {
        let mut request = Self::default();
        for (name, value) in pairs {
            request.set(name, value)?;
        }
        Ok(request)
    }

    /// What the engine is asked.
    pub fn asked(&self) -> Asked {
        let p = &self.parameters;
        Asked {
            kind: FeatureType::from_name(&p.r#type),
            association: Association::from_name(&p.association).unwrap_or_default(),
            fixed: Fixed {
                radius: p.radius,
                axis: p.axis.map(Vec3::from),
                half_angle: p.half_angle,
            },
            outliers: p.outliers,
            type_b: p.type_b.unwrap_or(0.0),
            coverage: p.coverage,
        }
    }

    fn set_own(&mut self, spec: &ParameterSpec, text: &str) -> Option<()> {
        let number = || {
            let ParameterKind::Number { min, max } = spec.kind else { return None };
            let value = text.parse::<f64>().ok()?;
            let is_in = if min == 0.0 { value > 0.0 } else { value >= min };
            (is_in && value <= max).then_some(value)
        };
        let word = || {
            let ParameterKind::Choice(words) = spec.kind else { return None };
            words.contains(&text).then(|| text.to_owned())
        };
        let line = || {
            let is_line = text.chars().count() <= MAX_TEXT && !text.contains(char::is_control);
            is_line.then(|| Some(text.to_owned()).filter(|t| !t.is_empty()))
        };
        let (p, passed) = (&mut self.parameters, &mut self.passed);
        match spec.name {
            "type" => p.r#type = word()?,
            "association" => p.association = word()?,
            "radius" => p.radius = Some(number()?),
            "axis" => p.axis = Some(direction(text)?),
            "half_angle" => p.half_angle = Some(number()?),
            "outliers" => p.outliers = Some(number()?),
            "type_b" => p.type_b = Some(number()?),
            "coverage" => p.coverage = number()?,
            "nominal" => p.nominal = Some(number()?),
            "lower" => p.lower = Some(number()?),
            "upper" => p.upper = Some(number()?),
            "form_tolerance" => p.form_tolerance = Some(number()?),
            "residuals" => self.residuals = truth(text)?,
            "part" => passed.part = line()?,
            "serial" => passed.serial = line()?,
            "operator" => passed.operator = line()?,
            "instrument" => passed.instrument = line()?,
            "temperature" => passed.temperature = line()?,
            "time" => passed.time = line()?,
            _ => return None,
        }
        Some(())
    }
}

impl ParameterForm for FitRequest {
    fn set(&mut self, name: &str, value: &str) -> Result<(), AnswerError> {
        if SHARED.contains(&name) {
            return self.request.set(name, value);
        }
        let spec = fit_specs().find(|spec| spec.name == name);
        let spec = spec.ok_or_else(|| unknown_fit_parameter(name))?;
        check_length(spec, value.trim())?;
        let text = worded(spec, value.trim());
        self.set_own(spec, text).ok_or_else(|| {
            AnswerError::new(
                ErrorKind::InvalidParameter,
                format!("parameter '{name}': '{value}' is not {}", spec.kind),
            )
        })?;
        self.request.given.push((name.to_owned(), text.to_owned()));
        Ok(())
    }

    fn request(&mut self) -> &mut Request {
        &mut self.request
    }

    fn spec(&self, name: &str) -> Option<&'static ParameterSpec> {
        fit_specs().find(|spec| spec.name == name)
    }
}

/// The error for a parameter of a fit that nobody knows.
pub fn unknown_fit_parameter(name: &str) -> AnswerError {
    let known = known_names(fit_specs());
    let detail = format!("unknown parameter '{name}'; known ones: {known}");
    AnswerError::new(ErrorKind::UnknownParameter, detail)
}

fn direction(text: &str) -> Option<[f64; 3]> {
    let numbers: Vec<f64> =
        text.split(',').map(|t| t.trim().parse().ok()).collect::<Option<_>>()?;
    let d: [f64; 3] = numbers.try_into().ok()?;
    let is_good = d.iter().all(|x| x.is_finite()) && d.iter().any(|x| *x != 0.0);
    is_good.then(|| moderate(d))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_unknown_or_out_of_range_is_refused_by_name() {
        let kind = |name, value: &str| FitRequest::from_pairs([(name, value)]).map_err(|e| e.kind);
        for (name, value) in [
            ("type", "blob"),
            ("association", "feldspar"),
            ("radius", "0"),
            ("radius", "1e13"),
            ("axis", "0,0,0"),
            ("axis", "1,2"),
            ("axis", "0,0,inf"),
            ("half_angle", "1.58"),
            ("outliers", "0.99"),
            ("outliers", "101"),
            ("coverage", "0.49"),
            ("coverage", "1"),
            ("residuals", "maybe"),
            ("part", &"x".repeat(256)),
        ] {
            assert_eq!(kind(name, value), Err(ErrorKind::InvalidParameter), "{name}={value}");
        }
        assert_eq!(kind("min_points", "50"), Err(ErrorKind::UnknownParameter));
        for (name, value) in [
            ("type", "line"),
            ("radius", "1e12"),
            ("half_angle", "1.57"),
            ("outliers", "1"),
            ("coverage", "0.9999"),
            ("axis", "0,0,-2"),
            ("axis", "0,0,1e300"),
            ("axis", "0,0,1e-200"),
            ("residuals", "1"),
            ("part", &"x".repeat(255)),
            ("format", "csv"),
        ] {
            assert!(kind(name, value).is_ok(), "{name}={value}");
        }
    }

    #[test]
    fn the_types_are_those_that_are_fitted() {
        assert!(ASSOCIATIONS.iter().copied().eq(Association::ALL.map(Association::name)));
        assert!(TYPES[1..].iter().copied().eq(FeatureType::ALL.map(FeatureType::name)));
    }
}
