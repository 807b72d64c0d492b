use super::{count, v1};
use crate::{
    geometry::SurfaceType,
    segment::{Extent, Hint, HintAction, HintOutcome, Outcome},
    service::{ErrorKind, ServiceError},
};

fn vector([x, y, z]: [f64; 3]) -> v1::Vector {
    v1::Vector { x, y, z }
}

fn list(v: v1::Vector) -> [f64; 3] {
    [v.x, v.y, v.z]
}

impl From<HintAction> for v1::HintAction {
    fn from(action: HintAction) -> Self {
        match action {
            HintAction::Surface => Self::Surface,
            HintAction::Merge => Self::Merge,
            HintAction::Split => Self::Split,
            HintAction::Crop => Self::Crop,
        }
    }
}

impl From<&Hint> for v1::Hint {
    fn from(hint: &Hint) -> Self {
        let corners = |e: Extent| v1::Extent { min: Some(vector(e.min)), max: Some(vector(e.max)) };
        Self {
            action: v1::HintAction::from(hint.action).into(),
            at: hint.at.iter().map(|p| vector(*p)).collect(),
            extent: hint.extent.map(corners),
            labels: hint.labels.clone(),
            r#type: hint.surface_type.map_or(0, |t| v1::SurfaceType::from(t).into()),
            radius: hint.radius,
            radius_tolerance: hint.radius_tolerance,
            axis_direction: hint.axis_direction.map(vector),
            axis_tolerance: hint.axis_tolerance,
        }
    }
}

impl From<HintOutcome> for v1::HintOutcome {
    fn from(told: HintOutcome) -> Self {
        let outcome = match told.outcome {
            Outcome::Applied => v1::Outcome::Applied,
            Outcome::Contradicted => v1::Outcome::Contradicted,
            Outcome::NotFound => v1::Outcome::NotFound,
        };
        Self {
            hint: count(told.hint),
            outcome: outcome.into(),
            regions: told.regions.into_iter().map(count).collect(),
            scatter: told.scatter,
            misfit: told.misfit,
            message: told.message,
        }
    }
}

/// The hints of a message as text, as a query gives them.
///
/// # Errors
/// An enum's number is not known.
pub(super) fn hints_text(hints: &[v1::Hint]) -> Result<String, ServiceError> {
    let hints = hints.iter().map(read).collect::<Result<Vec<_>, _>>()?;
    serde_json::to_string(&hints)
        .map_err(|e| wrong(format!("parameter 'hints': a number is none that JSON has: {e}")))
}

fn wrong(detail: String) -> ServiceError {
    ServiceError::new(ErrorKind::InvalidParameter, detail)
}

fn read(message: &v1::Hint) -> Result<Hint, ServiceError> {
    let unknown =
        |number: i32| wrong(format!("parameter 'hints': {number} is not a number of its enum"));
    let action = match v1::HintAction::try_from(message.action) {
        Ok(v1::HintAction::Unspecified | v1::HintAction::Surface) => HintAction::Surface,
        Ok(v1::HintAction::Merge) => HintAction::Merge,
        Ok(v1::HintAction::Split) => HintAction::Split,
        Ok(v1::HintAction::Crop) => HintAction::Crop,
        Err(_) => return Err(unknown(message.action)),
    };
    let told = v1::SurfaceType::try_from(message.r#type).map_err(|_| unknown(message.r#type))?;
    let corners = |e: v1::Extent| Extent {
        min: e.min.map(list).unwrap_or_default(),
        max: e.max.map(list).unwrap_or_default(),
    };
    let hint = Hint {
        action,
        at: message.at.iter().map(|v| list(*v)).collect(),
        extent: message.extent.map(corners),
        labels: message.labels.clone(),
        surface_type: SurfaceType::from_name(&name_of(told)),
        radius: message.radius,
        radius_tolerance: message.radius_tolerance,
        axis_direction: message.axis_direction.map(list),
        axis_tolerance: message.axis_tolerance,
    };
    // JSON has no other numbers: what it makes of them would be told as something else
    if is_finite(&hint) {
        Ok(hint)
    } else {
        Err(wrong("parameter 'hints': a number is not finite".to_owned()))
    }
}

/// The name of a type; that of none where it is not given.
fn name_of(told: v1::SurfaceType) -> String {
    told.as_str_name().trim_start_matches("SURFACE_TYPE_").to_ascii_lowercase()
}

fn is_finite(hint: &Hint) -> bool {
    let numbers = [hint.radius, hint.radius_tolerance, hint.axis_tolerance];
    let corners = hint.extent.iter().flat_map(|e| [e.min, e.max]);
    let places = hint.at.iter().chain(&hint.axis_direction).copied().chain(corners);
    numbers.into_iter().flatten().chain(places.flatten()).all(f64::is_finite)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_hint_goes_through_a_message_unchanged() {
        let hint = Hint {
            action: HintAction::Merge,
            at: vec![[0.1, -2.0, 1e-9], [1.0, 2.0, 3.0]],
            extent: Some(Extent { min: [0.0; 3], max: [1.0, 2.0, 1.0 / 3.0] }),
            labels: vec![-1, 7],
            surface_type: Some(SurfaceType::Cylinder),
            radius: Some(10.0),
            radius_tolerance: Some(0.1),
            axis_direction: Some([0.0, 1.0, 0.0]),
            axis_tolerance: Some(0.0),
        };
        assert_eq!(read(&v1::Hint::from(&hint)), Ok(hint.clone()));
        let text = hints_text(&[v1::Hint::from(&hint)]).unwrap();
        assert_eq!(serde_json::from_str::<Vec<Hint>>(&text).unwrap(), [hint]);
        assert_eq!(read(&v1::Hint::default()), Ok(Hint::default()));
    }

    #[test]
    fn unknown_numbers_and_those_that_are_none_are_refused() {
        let action = v1::Hint { action: 99, ..v1::Hint::default() };
        let surface = v1::Hint { r#type: 99, ..v1::Hint::default() };
        let radius = v1::Hint { radius: Some(f64::NAN), ..v1::Hint::default() };
        for message in [action, surface, radius] {
            assert_eq!(read(&message).unwrap_err().kind, ErrorKind::InvalidParameter);
        }
    }
}
