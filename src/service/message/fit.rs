use super::{
    count, format_from_message,
    parameters::{association_name, unknown_number, word},
    region::vector,
    v1,
};
use crate::{
    fit::feature::{Element, FeatureType},
    service::{
        Certificate, Characteristic, Contact, Convergence, Determination, ErrorKind,
        FeatureUncertainty, FitDocument, FitParameters, FitRequest, FormError, ParameterForm,
        ParameterUncertainty, PassedThrough, RegionFit, Residuals, ServiceError, Verdict,
        unknown_format,
    },
};

impl From<FeatureType> for v1::FeatureType {
    fn from(kind: FeatureType) -> Self {
        named(kind.name())
    }
}

/// The type of that name; `auto` is none.
fn named(name: &str) -> v1::FeatureType {
    let name = format!("FEATURE_TYPE_{}", name.to_ascii_uppercase());
    // a test shows that every type has its name in the contract
    v1::FeatureType::from_str_name(&name).unwrap_or_default()
}

fn association(name: &str) -> v1::Association {
    let name = format!("ASSOCIATION_{}", name.to_ascii_uppercase());
    v1::Association::from_str_name(&name).unwrap_or_default()
}

/// Reads the request in a message; ranges are those of the parameter table.
///
/// # Errors
/// A value is out of its range, or an enum's number is not known.
pub fn fit_from_message(message: &v1::FitRequest) -> Result<FitRequest, ServiceError> {
    let mut request = FitRequest::default();
    let format = v1::Format::try_from(message.format)
        .map_err(|_| unknown_format(&format!("number {}", message.format)))?;
    request.request.set_format(format_from_message(format));
    if !message.columns.is_empty() {
        let columns = message.columns.iter().map(u32::to_string).collect::<Vec<_>>();
        request.set("columns", &columns.join(","))?;
    }
    if let Some(name) = &message.name {
        request.set("name", name)?;
    }
    if let Some(deadline) = message.deadline {
        request.set("deadline", &deadline.to_string())?;
    }
    match v1::LengthUnit::try_from(message.unit) {
        Ok(v1::LengthUnit::Unspecified) => {}
        Ok(unit) => request.set("unit", &word(unit.as_str_name(), "LENGTH_UNIT_"))?,
        Err(_) => return Err(unknown_number("unit", message.unit)),
    }
    if message.residuals {
        request.set("residuals", "true")?;
    }
    for (name, value) in message.passed.iter().flat_map(texts) {
        request.set(name, value)?;
    }
    for (name, value) in message.parameters.iter().flat_map(numbers) {
        request.set(name, &value)?;
    }
    if let Some(parameters) = &message.parameters {
        set_enums(&mut request, parameters)?;
    }
    Ok(request)
}

fn texts(p: &v1::PassedThrough) -> Vec<(&'static str, &str)> {
    let all = [
        ("part", &p.part),
        ("serial", &p.serial),
        ("operator", &p.operator),
        ("instrument", &p.instrument),
        ("temperature", &p.temperature),
        ("time", &p.time),
    ];
    all.into_iter().filter_map(|(name, value)| Some((name, value.as_deref()?))).collect()
}

fn numbers(p: &v1::FitParameters) -> Vec<(&'static str, String)> {
    let axis = p.axis.iter().map(f64::to_string).collect::<Vec<_>>().join(",");
    let all = [
        ("radius", p.radius),
        ("half_angle", p.half_angle),
        ("outliers", p.outliers),
        ("type_b", p.type_b),
        ("coverage", p.coverage),
        ("nominal", p.nominal),
        ("lower", p.lower),
        ("upper", p.upper),
        ("form_tolerance", p.form_tolerance),
    ];
    let numbers = all.into_iter().filter_map(|(name, value)| Some((name, value?.to_string())));
    numbers.chain((!p.axis.is_empty()).then_some(("axis", axis))).collect()
}

fn set_enums(request: &mut FitRequest, p: &v1::FitParameters) -> Result<(), ServiceError> {
    let unknown = |name: &str, number: i32| {
        let detail = format!("parameter '{name}': {number} is no number of it");
        ServiceError::new(ErrorKind::InvalidParameter, detail)
    };
    let kind = v1::FeatureType::try_from(p.r#type).map_err(|_| unknown("type", p.r#type))?;
    if kind != v1::FeatureType::Unspecified {
        let name = kind.as_str_name().trim_start_matches("FEATURE_TYPE_").to_ascii_lowercase();
        request.set("type", &name)?;
    }
    if let Some(name) = association_name(p.association)? {
        request.set("association", &name)?;
    }
    Ok(())
}

impl From<FitDocument> for v1::FitResult {
    fn from(document: FitDocument) -> Self {
        let [x, y, z] = document.local_origin;
        Self {
            conicoid: document.conicoid,
            build: document.build,
            input: Some((&document.input).into()),
            parameters: Some(document.parameters.into()),
            passed: Some(document.passed.into()),
            r#type: v1::FeatureType::from(document.r#type).into(),
            surface: document.surface.as_ref().map(Into::into),
            local_origin: Some(v1::Vector { x, y, z }),
            local_surface: document.local_surface.as_ref().map(Into::into),
            not_identifiable: document.not_identifiable,
            uncertainty: document.uncertainty.map(Into::into),
            residuals: Some(document.residuals.into()),
            form: Some(document.form.into()),
            used: count(document.used),
            rejected: document.rejected.into_iter().map(count).collect(),
            determination: Some(document.determination.into()),
            convergence: Some(document.convergence.into()),
            characteristics: document.characteristics.into_iter().map(Into::into).collect(),
            certificate: document.certificate.map(Into::into),
            others: document.others.iter().map(Into::into).collect(),
        }
    }
}

impl From<FitParameters> for v1::FitParameters {
    fn from(p: FitParameters) -> Self {
        Self {
            r#type: named(&p.r#type).into(),
            association: association(&p.association).into(),
            radius: p.radius,
            axis: p.axis.map(Vec::from).unwrap_or_default(),
            half_angle: p.half_angle,
            outliers: p.outliers,
            type_b: p.type_b,
            coverage: Some(p.coverage),
            nominal: p.nominal,
            lower: p.lower,
            upper: p.upper,
            form_tolerance: p.form_tolerance,
        }
    }
}

impl From<PassedThrough> for v1::PassedThrough {
    fn from(p: PassedThrough) -> Self {
        let PassedThrough { name, part, serial, operator, instrument, temperature, time } = p;
        Self { name, part, serial, operator, instrument, temperature, time }
    }
}

impl From<&Element> for v1::Feature {
    fn from(element: &Element) -> Self {
        use v1::feature::Feature as F;
        let feature = match element {
            Element::Circle(c) => F::Circle(v1::Circle {
                center: vector(&c.center),
                normal: vector(&c.normal),
                radius: c.radius,
            }),
            Element::Line(l) => {
                F::Line(v1::Line { point: vector(&l.point), direction: vector(&l.direction) })
            }
            Element::Surface(surface) => match v1::region::Surface::from(surface) {
                v1::region::Surface::Plane(s) => F::Plane(s),
                v1::region::Surface::Sphere(s) => F::Sphere(s),
                v1::region::Surface::Cylinder(s) => F::Cylinder(s),
                v1::region::Surface::EllipticCylinder(s) => F::EllipticCylinder(s),
                v1::region::Surface::Cone(s) => F::Cone(s),
                v1::region::Surface::Ellipsoid(s) => F::Ellipsoid(s),
                v1::region::Surface::Torus(s) => F::Torus(s),
            },
        };
        Self { feature: Some(feature) }
    }
}

impl From<FeatureUncertainty> for v1::FeatureUncertainty {
    fn from(u: FeatureUncertainty) -> Self {
        Self {
            parameters: u.parameters.into_iter().map(Into::into).collect(),
            covariance_of: u.covariance_of,
            covariance: u.covariance.concat(),
            s: u.s,
            n_eff: u.n_eff,
            degrees_of_freedom: u.degrees_of_freedom,
            k: u.k,
            leaves_out: u.leaves_out,
        }
    }
}

impl From<ParameterUncertainty> for v1::ParameterUncertainty {
    fn from(p: ParameterUncertainty) -> Self {
        let ParameterUncertainty { name, values, standard, expanded } = p;
        Self { name, values, standard, expanded }
    }
}

impl From<Residuals> for v1::Residuals {
    fn from(r: Residuals) -> Self {
        let values = r.values.unwrap_or_default();
        Self {
            min: r.min,
            max: r.max,
            range: r.range,
            rms: r.rms,
            standard_deviation: r.standard_deviation,
            values: values.into_iter().map(|d| d.unwrap_or(f64::NAN)).collect(),
        }
    }
}

impl From<FormError> for v1::Form {
    fn from(form: FormError) -> Self {
        let FormError { characteristic, gaussian, minimum_zone } = form;
        Self { characteristic, gaussian, minimum_zone }
    }
}

impl From<Characteristic> for v1::Characteristic {
    fn from(c: Characteristic) -> Self {
        let verdict = match c.verdict {
            Verdict::Conform => v1::Verdict::Conform,
            Verdict::NotConform => v1::Verdict::NotConform,
            Verdict::Undecided => v1::Verdict::Undecided,
        };
        Self {
            name: c.name,
            nominal: c.nominal,
            lower_limit: c.lower_limit,
            upper_limit: c.upper_limit,
            measured: c.measured,
            deviation: c.deviation,
            expanded: c.expanded,
            verdict: verdict.into(),
            undecided: c.undecided,
        }
    }
}

impl From<RegionFit> for v1::RegionFit {
    fn from(of: RegionFit) -> Self {
        let RegionFit { region, fit, refused } = of;
        Self { region: count(region), fit: fit.map(Into::into), refused }
    }
}

impl From<Certificate> for v1::Certificate {
    fn from(c: Certificate) -> Self {
        let contact = |c: Contact| v1::Contact {
            point: count(c.point),
            side: c.side,
            multiplier: c.multiplier,
        };
        Self {
            bound: c.bound,
            contacts: c.contacts.into_iter().map(contact).collect(),
            stationarity: c.stationarity,
        }
    }
}

impl From<Determination> for v1::Determination {
    fn from(d: Determination) -> Self {
        Self { condition: d.condition, weakest: d.weakest }
    }
}

impl From<Convergence> for v1::Convergence {
    fn from(c: Convergence) -> Self {
        Self { converged: c.converged, steps: count(c.steps), last_step: c.last_step }
    }
}
