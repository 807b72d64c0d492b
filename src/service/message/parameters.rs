use super::{count, hint::hints_text, v1};
use crate::{
    formats::Format,
    geometry::{LengthUnit, SurfaceType},
    segment::{Method, Parameters},
    service::{ErrorKind, Request, ServiceError},
};

impl From<SurfaceType> for v1::SurfaceType {
    fn from(surface_type: SurfaceType) -> Self {
        let name = format!("SURFACE_TYPE_{}", surface_type.name().to_ascii_uppercase());
        // a test shows that every type has its name in the contract
        Self::from_str_name(&name).unwrap_or_default()
    }
}

impl From<LengthUnit> for v1::LengthUnit {
    fn from(unit: LengthUnit) -> Self {
        let name = format!("LENGTH_UNIT_{}", unit.name().to_ascii_uppercase());
        // a test shows that every unit has its name in the contract
        Self::from_str_name(&name).unwrap_or_default()
    }
}

impl From<Method> for v1::Method {
    fn from(method: Method) -> Self {
        match method {
            Method::Distance => Self::Distance,
            Method::Rcond => Self::Rcond,
        }
    }
}

/// The format of that name.
pub(super) fn format_to_message(name: &str) -> v1::Format {
    v1::Format::from_str_name(&format!("FORMAT_{}", name.to_ascii_uppercase())).unwrap_or_default()
}

/// The format a message names; `None` = to be worked out.
pub fn format_from_message(format: v1::Format) -> Option<Format> {
    let name = format.as_str_name().trim_start_matches("FORMAT_").to_ascii_lowercase();
    Format::ALL.into_iter().find(|f| f.name() == name)
}

impl From<&Parameters> for v1::Parameters {
    fn from(p: &Parameters) -> Self {
        Self {
            method: v1::Method::from(p.method).into(),
            tolerance: p.tolerance,
            noise_sigma: p.noise_sigma,
            surfaces: p.surfaces.iter().map(|&t| v1::SurfaceType::from(t).into()).collect(),
            min_points: Some(count(p.min_points)),
            max_regions: Some(count(p.max_regions)),
            connectivity: p.connectivity,
            min_radius: p.min_radius,
            max_radius: p.max_radius,
            axis_direction: p.axis_direction.map(Vec::from).unwrap_or_default(),
            axis_tolerance: Some(p.axis_tolerance),
            seed: Some(p.seed),
            max_failed_seeds: Some(count(p.max_failed_seeds)),
            merge: Some(p.merge),
            refine: Some(p.refine),
            rcond_threshold: Some(p.rcond_threshold),
            algebraic_threshold: Some(p.algebraic_threshold),
            hints: p.hints.iter().map(Into::into).collect(),
        }
    }
}

/// Reads the request in a message; ranges are those of the parameter table.
///
/// # Errors
/// A value is out of its range, or an enum's number is not known.
pub fn request_from_message(message: &v1::SegmentRequest) -> Result<Request, ServiceError> {
    let mut request = Request::default();
    if message.omit_labels {
        request.set("labels", "none")?;
    }
    let format = v1::Format::try_from(message.format);
    let format = format
        .map_err(|_| crate::service::unknown_format(&format!("number {}", message.format)))?;
    request.set_format(format_from_message(format));
    if message.snap {
        request.set("snap", "true")?;
    }
    if let Some(name) = association_name(message.association)? {
        request.set("association", &name)?;
    }
    if !message.datums.is_empty() {
        let datums = message.datums.iter().map(u64::to_string).collect::<Vec<_>>();
        request.set("datums", &datums.join(","))?;
    }
    if let Some(deadline) = message.deadline {
        request.set("deadline", &deadline.to_string())?;
    }
    if !message.columns.is_empty() {
        let columns = message.columns.iter().map(u32::to_string).collect::<Vec<_>>();
        request.set("columns", &columns.join(","))?;
    }
    if let Some(lines) = message.skip_lines {
        request.set("skip_lines", &lines.to_string())?;
    }
    match v1::LengthUnit::try_from(message.unit) {
        Ok(v1::LengthUnit::Unspecified) => {}
        Ok(unit) => request.set("unit", &word(unit.as_str_name(), "LENGTH_UNIT_"))?,
        Err(_) => return Err(unknown_number("unit", message.unit)),
    }
    request.set_mesh_message(message)?;
    if let Some(thin) = message.thin {
        request.set("thin", &thin.to_string())?;
    }
    if let Some(name) = &message.name {
        request.set("name", name)?;
    }
    for (name, value) in message.parameters.iter().flat_map(pairs) {
        request.set(name, &value)?;
    }
    if let Some(parameters) = &message.parameters {
        request.set_enums(parameters)?;
        if !parameters.hints.is_empty() {
            request.set("hints", &hints_text(&parameters.hints)?)?;
        }
    }
    Ok(request)
}

impl Request {
    fn set_mesh_message(&mut self, message: &v1::SegmentRequest) -> Result<(), ServiceError> {
        match v1::MeshWay::try_from(message.mesh) {
            Ok(v1::MeshWay::Unspecified) => {}
            Ok(way) => self.set("mesh", &word(way.as_str_name(), "MESH_WAY_"))?,
            Err(_) => return Err(unknown_number("mesh", message.mesh)),
        }
        if let Some(spacing) = message.mesh_spacing {
            self.set("mesh_spacing", &spacing.to_string())?;
        }
        if let Some(points) = message.mesh_points {
            self.set("mesh_points", &points.to_string())?;
        }
        Ok(())
    }

    fn set_enums(&mut self, p: &v1::Parameters) -> Result<(), ServiceError> {
        match v1::Method::try_from(p.method) {
            Ok(v1::Method::Unspecified) => {}
            Ok(method) => self.set("method", &word(method.as_str_name(), "METHOD_"))?,
            Err(_) => return Err(unknown_number("method", p.method)),
        }
        if p.surfaces.is_empty() {
            return Ok(());
        }
        let name = |&number: &i32| {
            let known = v1::SurfaceType::try_from(number).ok();
            known
                .filter(|t| *t != v1::SurfaceType::Unspecified)
                .map(|t| word(t.as_str_name(), "SURFACE_TYPE_"))
                .ok_or_else(|| unknown_number("surfaces", number))
        };
        let names = p.surfaces.iter().map(name).collect::<Result<Vec<_>, _>>()?;
        self.set("surfaces", &names.join(","))
    }
}

/// The name of an association's number; none where it is not given.
pub(super) fn association_name(number: i32) -> Result<Option<String>, ServiceError> {
    let association = v1::Association::try_from(number).map_err(|_| {
        let detail = format!("parameter 'association': {number} is no number of it");
        ServiceError::new(ErrorKind::InvalidParameter, detail)
    })?;
    let name = association.as_str_name().trim_start_matches("ASSOCIATION_").to_ascii_lowercase();
    Ok((association != v1::Association::Unspecified).then_some(name))
}

pub(super) fn word(name: &str, prefix: &str) -> String {
    name.trim_start_matches(prefix).to_ascii_lowercase()
}

pub(super) fn unknown_number(name: &str, number: i32) -> ServiceError {
    ServiceError::new(
        ErrorKind::InvalidParameter,
        format!("parameter '{name}': {number} is not a number of its enum"),
    )
}

/// The parameters present in a message, as names and text. Rust's text of a float reads back as the
/// same float.
fn pairs(p: &v1::Parameters) -> Vec<(&'static str, String)> {
    fn text<T: ToString>(value: Option<T>) -> Option<String> {
        value.map(|v| v.to_string())
    }
    let direction = p.axis_direction.iter().map(f64::to_string).collect::<Vec<_>>().join(",");
    [
        ("tolerance", text(p.tolerance)),
        ("noise_sigma", text(p.noise_sigma)),
        ("min_points", text(p.min_points)),
        ("max_regions", text(p.max_regions)),
        ("connectivity", text(p.connectivity)),
        ("min_radius", text(p.min_radius)),
        ("max_radius", text(p.max_radius)),
        ("axis_direction", (!direction.is_empty()).then_some(direction)),
        ("axis_tolerance", text(p.axis_tolerance)),
        ("seed", text(p.seed)),
        ("max_failed_seeds", text(p.max_failed_seeds)),
        ("merge", text(p.merge)),
        ("refine", text(p.refine)),
        ("rcond_threshold", text(p.rcond_threshold)),
        ("algebraic_threshold", text(p.algebraic_threshold)),
    ]
    .into_iter()
    .filter_map(|(name, value)| Some((name, value?)))
    .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_type_and_format_has_its_name_in_the_contract() {
        for surface_type in SurfaceType::ALL {
            let message = v1::SurfaceType::from(surface_type);
            assert_ne!(message, v1::SurfaceType::Unspecified, "{surface_type:?}");
        }
        for format in Format::ALL {
            assert_eq!(format_from_message(format_to_message(format.name())), Some(format));
        }
        for unit in LengthUnit::ALL {
            let message = v1::SegmentRequest {
                unit: v1::LengthUnit::from(unit).into(),
                skip_lines: Some(7),
                ..v1::SegmentRequest::default()
            };
            let request = request_from_message(&message).unwrap();
            assert_eq!((request.unit, request.skip_lines), (Some(unit), 7));
        }
    }

    #[test]
    fn all_parameters_go_through_a_message_unchanged() {
        let parameters = Parameters {
            method: Method::Rcond,
            tolerance: Some(0.1 + 0.2),
            surfaces: vec![SurfaceType::Cone, SurfaceType::EllipticCone],
            axis_direction: Some([0.0, -1e-300, 1.0 / 3.0]),
            seed: u64::MAX,
            merge: false,
            ..Parameters::default()
        };
        let message = v1::SegmentRequest {
            parameters: Some((&parameters).into()),
            ..v1::SegmentRequest::default()
        };
        let request = request_from_message(&message).unwrap();
        assert_eq!(request.parameters, parameters);
        // what is kept with a job reads back as the same
        let given = request.given.iter().map(|(n, v)| (n.as_str(), v.as_str()));
        assert_eq!(Request::from_pairs(given).unwrap(), request);
    }

    #[test]
    fn an_unknown_number_is_refused() {
        let message = |p| v1::SegmentRequest { parameters: Some(p), ..Default::default() };
        let surfaces = message(v1::Parameters { surfaces: vec![99], ..Default::default() });
        let method = message(v1::Parameters { method: 99, ..Default::default() });
        for message in [surfaces, method] {
            let kind = request_from_message(&message).unwrap_err().kind;
            assert_eq!(kind, ErrorKind::InvalidParameter);
        }
    }
}
