use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::super::{AnswerError, ErrorKind, Form, Input};
use crate::fit::feature::{Element, FeatureType};

/// The type that leaves the type open.
const AUTO: &str = "auto";

/// The result of a fit, as it is told.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct FitDocument {
    /// Version of the program that made it.
    #[schema(example = "0.1.0")]
    pub conicoid: String,
    /// Which sources it was built of: a digest of them. Absent from results that earlier versions kept.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    #[schema(example = "8c2f0a4be1d94c57a3f6e0b1920d7c4e")]
    pub build: String,
    /// What the input was.
    pub input: Input,
    /// Every parameter as used.
    pub parameters: FitParameters,
    /// What was passed through.
    pub passed: PassedThrough,
    /// The feature's type.
    pub r#type: FeatureType,
    /// The feature in the input's coordinates; its point of axis, line or plane is the one beside the mean of the points used.
    /// Null where `not_identifiable` names a parameter.
    pub surface: Option<Element>,
    /// A place near the points.
    pub local_origin: [f64; 3],
    /// The feature with its places relative to `local_origin`: far from the input's origin these have digits that those of
    /// `surface` have no room for.
    pub local_surface: Option<Element>,
    /// Parameters that the points do not tell: sizes and angles less than three standard uncertainties from zero, directions known to
    /// no better than a third of a radian. They are told nowhere in the result.
    pub not_identifiable: Vec<String>,
    /// How exactly the parameters are known; null where there are no more points than determine the feature.
    pub uncertainty: Option<FeatureUncertainty>,
    /// Distances of the points used.
    pub residuals: Residuals,
    /// The form error.
    pub form: FormError,
    /// The proof of an association that is none of least squares; absent with `gaussian`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub certificate: Option<Certificate>,
    /// What tolerances were given for, each with its verdict.
    pub characteristics: Vec<Characteristic>,
    /// Points used.
    pub used: usize,
    /// Points that the outlier rule left out: their places in the input, from 0 on.
    pub rejected: Vec<usize>,
    /// How well the points determine the feature.
    pub determination: Determination,
    /// How the fit ended.
    pub convergence: Convergence,
    /// Other features of the type that fit the points as well; they are as good an answer.
    pub others: Vec<Element>,
}

/// The parameters of a fit, as used.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct FitParameters {
    /// The type asked for, or `auto`.
    pub r#type: String,
    /// How the feature is associated with the points.
    pub association: String,
    /// A fixed radius.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub radius: Option<f64>,
    /// A fixed direction.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub axis: Option<[f64; 3]>,
    /// A fixed half angle.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub half_angle: Option<f64>,
    /// Standard deviations beyond which points are left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub outliers: Option<f64>,
    /// Standard uncertainty of what all points have in common.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub type_b: Option<f64>,
    /// Probability that expanded uncertainties are made for.
    pub coverage: f64,
    /// Nominal diameter or full angle.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub nominal: Option<f64>,
    /// Lower limit deviation from `nominal`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lower: Option<f64>,
    /// Upper limit deviation from `nominal`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub upper: Option<f64>,
    /// Largest form error allowed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub form_tolerance: Option<f64>,
}

impl Default for FitParameters {
    fn default() -> Self {
        Self {
            r#type: AUTO.to_owned(),
            association: "gaussian".to_owned(),
            radius: None,
            axis: None,
            half_angle: None,
            outliers: None,
            type_b: None,
            coverage: 0.9545,
            nominal: None,
            lower: None,
            upper: None,
            form_tolerance: None,
        }
    }
}

/// What the caller gave to stand in the result.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct PassedThrough {
    /// What the cloud is called.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// The part.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub part: Option<String>,
    /// Its serial number.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub serial: Option<String>,
    /// Who measured.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub operator: Option<String>,
    /// What was measured with.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub instrument: Option<String>,
    /// The temperature.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub temperature: Option<String>,
    /// When it was measured.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub time: Option<String>,
}

/// How exactly a feature is known.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct FeatureUncertainty {
    /// The parameters that the points tell.
    pub parameters: Vec<ParameterUncertainty>,
    /// The parameters whose components the rows of `covariance` are, in their order.
    pub covariance_of: Vec<String>,
    /// Covariance of all their components from the scatter of the points alone, without the type B input. Empty for associations
    /// other than `gaussian`: how their few contacts may lie has none.
    pub covariance: Vec<Vec<f64>>,
    /// Standard deviation of the distances: the root of their sum of squares over their number less the degrees of freedom. For
    /// associations other than `gaussian` that of the noise about the least-squares feature, which may be told from neighbours.
    pub s: f64,
    /// How many independent points tell as much as these do: less than there are where the distances of neighbours are alike.
    pub n_eff: f64,
    /// Effective degrees of freedom.
    pub degrees_of_freedom: f64,
    /// Factor of the expanded uncertainties: Student's t for the coverage and the degrees of freedom. For associations other than
    /// `gaussian` the expanded ones are bounds, and the standard ones these over it.
    pub k: f64,
    /// What the uncertainties leave out.
    pub leaves_out: Vec<String>,
}

/// The uncertainty of one parameter.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct ParameterUncertainty {
    /// The parameter's name, as in the surface.
    pub name: String,
    /// Its components.
    pub values: Vec<f64>,
    /// Standard uncertainty of each component; of each direction one, its angle's in radians.
    pub standard: Vec<f64>,
    /// Expanded uncertainties: `k` times the standard ones.
    pub expanded: Vec<f64>,
}

/// Signed distances of the points used, positive outside; from a circle or a line their lengths.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Residuals {
    /// The smallest.
    pub min: f64,
    /// The largest.
    pub max: f64,
    /// The largest less the smallest.
    pub range: f64,
    /// Root mean square.
    pub rms: f64,
    /// Standard deviation about their mean.
    pub standard_deviation: f64,
    /// That of each input point, in input order, also of points left out; null where a coordinate is not finite. With
    /// `residuals` alone.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub values: Option<Vec<Option<f64>>>,
}

/// A form error.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[schema(as = Form)]
pub struct FormError {
    /// Its name by ISO 1101 and ISO 12180, 12181, 12780 and 12781: flatness, roundness, straightness, cylindricity, sphericity; conicity;
    /// profile_of_surface of the other types.
    pub characteristic: String,
    /// Peak to valley about the least-squares feature; of a line the diameter of the cylinder about it that holds all points, of a circle
    /// the range of the distances from its centre within its plane.
    pub gaussian: f64,
    /// The least peak to valley about any feature of the type: the form error of ISO 1101. Null where none is proven.
    pub minimum_zone: Option<f64>,
}

/// The proof that no feature nearby is better: at the contacts the bound is reached, beyond it lies no point, and the derivatives of
/// the distances at the contacts, each times its side and its multiplier, add up to zero. The multipliers are not negative and add
/// up to 1.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Certificate {
    /// The bound: half the width of a minimum zone; of a line, and of circumscribed and inscribed features, the radius.
    pub bound: f64,
    /// The points that hold the feature.
    pub contacts: Vec<Contact>,
    /// Length of the sum of the derivatives, for unit points: zero but for rounding.
    pub stationarity: f64,
}

/// A point that holds a feature.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Contact {
    /// Its place in the input, from 0 on.
    pub point: usize,
    /// `outside` where it lies on the outer side of the zone or holds a circumscribed feature, else `inside`.
    #[schema(example = "outside")]
    pub side: String,
    /// Its multiplier.
    pub multiplier: f64,
}

/// A toleranced characteristic.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Characteristic {
    /// `diameter`, `full_angle`, `tube_diameter`, or the name of the form error.
    pub name: String,
    /// The nominal value; null for a form error.
    pub nominal: Option<f64>,
    /// The smallest value allowed; null where there is none.
    pub lower_limit: Option<f64>,
    /// The largest value allowed; null where there is none.
    pub upper_limit: Option<f64>,
    /// The measured value: of the fitted feature; of a form error that of the minimum zone, or without one that of least squares.
    /// Null where the points do not tell it.
    pub measured: Option<f64>,
    /// The measured value less the nominal one.
    pub deviation: Option<f64>,
    /// Its expanded uncertainty; of a form error twice what the noise of no point goes beyond, with `k` times `type_b` in
    /// quadrature. Null where there are no more points than determine the feature.
    pub expanded: Option<f64>,
    /// The verdict by the decision rule of ISO 14253-1.
    pub verdict: Verdict,
    /// Why the verdict is open; absent where it is not.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub undecided: Option<String>,
}

/// Whether a characteristic keeps its limits.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// The measured value, with its uncertainty either way, lies within the limits.
    Conform,
    /// It lies beyond a limit by more than its uncertainty.
    NotConform,
    /// Neither is proven.
    Undecided,
}

/// How well points determine a feature.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Determination {
    /// Condition number: by how much more the best told combination of the degrees of freedom is told than the worst, angles in
    /// radians and lengths in units of the points' size.
    pub condition: f64,
    /// The combination that the points tell least, in words.
    pub weakest: String,
}

/// How a fit ended.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Convergence {
    /// Whether the last step was as short as rounding.
    pub converged: bool,
    /// Steps of the last descent.
    pub steps: usize,
    /// Length of the last step, in units of the points' size.
    pub last_step: f64,
}

impl Verdict {
    /// The word for it in every contract.
    pub fn name(self) -> &'static str {
        match self {
            Self::Conform => "conform",
            Self::NotConform => "not_conform",
            Self::Undecided => "undecided",
        }
    }
}

impl FitDocument {
    /// The forms that the library writes it in.
    pub const FORMS: [Form; 4] = [Form::Json, Form::Qif, Form::Dmis, Form::Characteristics];

    /// The forms that the service has of it: protobuf among them.
    pub const OFFERED: [Form; 5] =
        [Form::Json, Form::Protobuf, Form::Qif, Form::Dmis, Form::Characteristics];

    /// The form whose files end so, in any case; `csv` is its one table.
    pub fn form_from_extension(extension: &str) -> Option<Form> {
        if extension.eq_ignore_ascii_case("csv") {
            return Some(Form::Characteristics);
        }
        let form = Form::from_extension(extension)?;
        Self::OFFERED.contains(&form).then_some(form)
    }

    /// The result in a form.
    ///
    /// # Errors
    /// It is none of [`FORMS`](Self::FORMS), or JSON cannot be written: a fault of the service.
    pub fn write(&self, form: Form) -> Result<Vec<u8>, AnswerError> {
        match form {
            Form::Json => self.to_json(),
            form if Self::FORMS.contains(&form) => Ok(form.hand_over(&self.into())),
            form => {
                let known = Self::FORMS.map(|form| format!(".{}", form.extension())).join(", ");
                let detail =
                    format!("a fit is not written as .{}: take one of {known}", form.extension());
                Err(AnswerError::new(ErrorKind::NotAcceptable, detail))
            }
        }
    }

    /// The result as JSON, with a line's end.
    ///
    /// # Errors
    /// It cannot be written: a fault of the service.
    pub fn to_json(&self) -> Result<Vec<u8>, AnswerError> {
        let mut bytes = serde_json::to_vec(self)
            .map_err(|e| AnswerError::new(ErrorKind::Internal, e.to_string()))?;
        bytes.push(b'\n');
        Ok(bytes)
    }
}
