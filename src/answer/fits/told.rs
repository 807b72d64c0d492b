use super::super::{AnswerError, BUILD, ErrorKind, Input};
use super::document::{
    Certificate, Contact, Convergence, Determination, FeatureUncertainty, FitDocument, FormError,
    ParameterUncertainty, Residuals,
};
use super::request::FitRequest;
use super::tolerance::{ToleranceError, characteristics, check};
use crate::{
    fit::feature::{self, Association, Exactness, Feature, FitError, Held, assess},
    geometry::PointCloud,
};

/// The feature of all points of a cloud.
///
/// # Errors
/// Its points do not determine the feature, or tolerances are given that it cannot be judged by.
pub fn fit_cloud(
    cloud: &PointCloud,
    input: Input,
    request: &FitRequest,
) -> Result<FitDocument, AnswerError> {
    let asked = request.asked();
    check(&request.parameters, asked.kind)?;
    let feature = assess(&cloud.points, &asked)?;
    check(&request.parameters, Some(feature.pose.kind))?;
    Ok(told(feature, cloud, input, request))
}

/// A last step longer than this, in units of the points' size and of the feature's sizes, is more than rounding.
const ROUNDING: f64 = 1e-8;

/// A feature of a cloud in the contract's terms.
fn told(feature: Feature, cloud: &PointCloud, input: Input, request: &FitRequest) -> FitDocument {
    let Feature { pose, origin, condition, .. } = &feature;
    let is_told = feature.unknown.is_empty();
    let world = pose.translated(origin);
    let rejected = &feature.rejected;
    let input_place = |i: usize| cloud.input_index.as_ref().map_or(i, |index| index[i] as usize);
    let used = used(&feature.distances, rejected);
    let mut passed = request.passed.clone();
    passed.name.clone_from(&request.request.name);
    let (steps, last_step) = feature.steps;
    FitDocument {
        conicoid: env!("CARGO_PKG_VERSION").to_owned(),
        build: BUILD.to_owned(),
        input,
        parameters: request.parameters.clone(),
        passed,
        r#type: pose.kind,
        surface: is_told.then(|| world.element()),
        local_origin: (*origin).into(),
        local_surface: is_told.then(|| pose.element()),
        not_identifiable: feature.unknown.iter().map(|&name| name.to_owned()).collect(),
        uncertainty: feature.exactness.as_ref().map(|e| uncertainty(e, request)),
        residuals: Residuals {
            values: request.residuals.then(|| in_input_order(&feature.distances, cloud)),
            ..residuals(&used)
        },
        form: FormError {
            characteristic: pose.kind.form_name().to_owned(),
            gaussian: feature.form.gaussian,
            minimum_zone: feature.form.minimum_zone,
        },
        certificate: feature.held.as_ref().map(|held| certificate(held, input_place)),
        used: used.len(),
        rejected: rejected.iter().map(|&i| input_place(i)).collect(),
        characteristics: characteristics(&feature, &request.parameters),
        determination: Determination {
            condition: condition.number,
            weakest: condition.weakest.clone(),
        },
        convergence: Convergence {
            converged: last_step < ROUNDING * condition.number.max(1.0),
            steps,
            last_step: if last_step.is_finite() { last_step } else { 0.0 },
        },
        others: feature.others.iter().map(|p| p.translated(origin).element()).collect(),
    }
}

fn certificate(held: &Held, input_place: impl Fn(usize) -> usize) -> Certificate {
    let contact = |c: &feature::Contact| Contact {
        point: input_place(c.index),
        side: if c.side > 0.0 { "outside" } else { "inside" }.to_owned(),
        multiplier: c.multiplier,
    };
    Certificate {
        bound: held.bound.abs(),
        contacts: held.contacts.iter().map(contact).collect(),
        stationarity: held.stationarity,
    }
}

fn used(distances: &[f64], rejected: &[usize]) -> Vec<f64> {
    let kept = |i: &usize| rejected.binary_search(i).is_err();
    (0..distances.len()).filter(kept).map(|i| distances[i]).collect()
}

fn in_input_order(distances: &[f64], cloud: &PointCloud) -> Vec<Option<f64>> {
    let Some(index) = &cloud.input_index else {
        return distances.iter().map(|d| Some(*d)).collect();
    };
    let mut all = vec![None; cloud.input_len];
    for (&i, d) in index.iter().zip(distances) {
        all[i as usize] = Some(*d);
    }
    all
}

fn residuals(used: &[f64]) -> Residuals {
    let n = used.len().max(1) as f64;
    let min = used.iter().copied().fold(f64::INFINITY, f64::min);
    let max = used.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let mean = used.iter().sum::<f64>() / n;
    let sq = |about: f64| used.iter().map(|d| (d - about).powi(2)).sum::<f64>();
    Residuals {
        min,
        max,
        range: max - min,
        rms: (sq(0.0) / n).sqrt(),
        standard_deviation: (sq(mean) / (n - 1.0).max(1.0)).sqrt(),
        values: None,
    }
}

fn uncertainty(e: &Exactness, request: &FitRequest) -> FeatureUncertainty {
    let is_gaussian = request.asked().association == Association::Gaussian;
    let mut leaves_out = vec![
        "form error that is alike at all points, and any systematic error of the instrument that type_b does not hold"
            .to_owned(),
    ];
    leaves_out.extend(if is_gaussian {
        vec!["the bias of second order of the estimate, about the square of the scatter over twice the radius".to_owned()]
    } else {
        vec![
            "noise that neighbouring points have in common, which counts as form".to_owned(),
            "what the surface does between the points".to_owned(),
        ]
    });
    if request.parameters.type_b.is_none() {
        leaves_out.push("every uncertainty of type B: none was given".to_owned());
    }
    FeatureUncertainty {
        parameters: e
            .parameters
            .iter()
            .map(|p| ParameterUncertainty {
                name: p.name.to_owned(),
                values: p.values.clone(),
                standard: p.standard.clone(),
                expanded: p.expanded.clone(),
            })
            .collect(),
        covariance_of: e.covariance_of.iter().map(|&name| name.to_owned()).collect(),
        covariance: e.covariance.clone(),
        s: e.s,
        n_eff: e.n_eff,
        degrees_of_freedom: e.freedom,
        k: e.k,
        leaves_out,
    }
}

impl From<ToleranceError> for AnswerError {
    fn from(error: ToleranceError) -> Self {
        Self::new(ErrorKind::InvalidParameter, error.to_string())
    }
}

impl From<FitError> for AnswerError {
    fn from(error: FitError) -> Self {
        let kind = match &error {
            FitError::NotFinite { .. } => ErrorKind::NoFinitePoints,
            FitError::OnePlace => ErrorKind::ExtentOutOfRange,
            FitError::TooFew { .. } | FitError::TooFewForAuto { .. } => ErrorKind::TooFewPoints,
            FitError::NotFixed { .. }
            | FitError::FixedExtreme { .. }
            | FitError::NotAssociated { .. } => ErrorKind::InvalidParameter,
            FitError::NoType { .. }
            | FitError::Free { .. }
            | FitError::Undetermined { .. }
            | FitError::NotHeld { .. }
            | FitError::NotReached { .. } => ErrorKind::NotDetermined,
        };
        Self::new(kind, error.to_string())
    }
}
