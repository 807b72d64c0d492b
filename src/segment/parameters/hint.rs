//! What a person knows of a cloud, as a request holds it.

use serde::{Deserialize, Serialize};

use super::error::ParameterError;
use super::limits::{LARGEST_TOLD, MAX_HINTS, MAX_PLACES};
use crate::geometry::SurfaceType;
use crate::segment::Extent;

/// Something a person knows: a place, and what is to be done or is known there.
///
/// A place is any of `at`, `extent` and `labels`, or several of them together. Lengths are in the input's unit, angles in
/// radians.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
#[serde(
    deny_unknown_fields,
    expecting = "a hint in braces, as {\"at\": [[1, 2, 3]], \"type\": \"cylinder\"}"
)]
pub struct Hint {
    /// What is to be done there.
    #[serde(default)]
    pub action: HintAction,
    /// Points on the surface meant, each taken for the cloud's point nearest to it: the region that is found there is
    /// meant as a whole, or what lies around it where there is none. At most 64.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    #[schema(max_items = 64)]
    pub at: Vec<[f64; 3]>,
    /// A box: the points in it are meant. `extent` of a region is one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub extent: Option<Extent>,
    /// The points that carry one of these numbers in the file's own column `label`, as the PLY files of results have
    /// them. At most 64.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    #[schema(max_items = 64)]
    pub labels: Vec<i32>,
    /// The surface's type: one of plane, sphere, cylinder, elliptic_cylinder, cone, ellipsoid and torus. Any of them when
    /// absent.
    #[serde(rename = "type", default, skip_serializing_if = "Option::is_none")]
    pub surface_type: Option<SurfaceType>,
    /// Radius of a sphere or cylinder; one of these two is meant where the type is absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub radius: Option<f64>,
    /// By how much the radius may differ; 0 when absent: it is exactly that.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub radius_tolerance: Option<f64>,
    /// Direction of the axis or a plane's normal, whichever way it points. Of a plane, cylinder, elliptic cylinder, cone or
    /// torus.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub axis_direction: Option<[f64; 3]>,
    /// By how much the direction may differ, in radians; 0 when absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub axis_tolerance: Option<f64>,
}

/// What a hint is for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, utoipa::ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum HintAction {
    /// There is one surface, of which `type`, `radius` or `axis_direction` is known.
    #[default]
    Surface,
    /// The regions there are one surface.
    Merge,
    /// Each point of `at`, or each of `labels`, is on a surface of its own.
    Split,
    /// Only the points in `extent`, or with one of the `labels`, are looked at. Several such hints add up.
    Crop,
}

/// Reads the hints in a JSON text: a list of objects, or objects with commas between them.
///
/// # Errors
/// It is no such text, there are too many hints, or one of them says nothing or what cannot be.
pub(super) fn read(text: &str) -> Result<Vec<Hint>, ParameterError> {
    let text = text.trim();
    let list = if text.starts_with('[') { text.to_owned() } else { format!("[{text}]") };
    let hints: Vec<Hint> = serde_json::from_str(&list).map_err(|e| {
        // the parser's words for what is no JSON are about itself
        let what =
            if e.is_data() { e.to_string() } else { format!("no JSON at column {}", e.column()) };
        ParameterError::Hints(format!("{what}: give a JSON list such as {EXAMPLE}"))
    })?;
    if hints.len() > MAX_HINTS {
        let most = format!("{} of them, and at most {MAX_HINTS} are taken", hints.len());
        return Err(ParameterError::Hints(most));
    }
    for (number, hint) in hints.iter().enumerate() {
        if let Some(wrong) = hint.wrong() {
            return Err(ParameterError::Hints(format!("number {number}: {wrong}")));
        }
    }
    Ok(hints)
}

/// A hint as people write it.
pub const EXAMPLE: &str = r#"[{"at": [[1, 2, 3]], "type": "cylinder", "radius": 10}]"#;

impl Hint {
    /// What of it cannot be, and what to do about it.
    fn wrong(&self) -> Option<String> {
        self.wrong_place().or_else(|| match self.action {
            HintAction::Surface => self.wrong_surface(true),
            HintAction::Merge => self.wrong_surface(false),
            HintAction::Split => self.wrong_split(),
            HintAction::Crop => self.wrong_crop(),
        })
    }

    fn wrong_place(&self) -> Option<String> {
        let Self { at, extent, labels, .. } = self;
        if at.is_empty() && extent.is_none() && labels.is_empty() {
            return Some("it has no place: give 'at', 'extent' or 'labels'".to_owned());
        }
        for (name, length) in [("at", at.len()), ("labels", labels.len())] {
            if length > MAX_PLACES {
                return Some(format!(
                    "'{name}' has {length} entries, and at most {MAX_PLACES} are taken"
                ));
            }
        }
        let corners = extent.iter().flat_map(|e| [e.min, e.max]);
        if at.iter().copied().chain(corners).flatten().any(|x| x.abs() > LARGEST_TOLD) {
            return Some(format!("a coordinate is beyond {LARGEST_TOLD:e}"));
        }
        let empty = |e: &Extent| (0..3).any(|k| e.min[k] > e.max[k]);
        extent.filter(empty).map(|_| "'extent' is empty: its 'min' is above its 'max'".to_owned())
    }

    /// What is wrong with what is told of a surface; `needed` where something must be.
    fn wrong_surface(&self, needed: bool) -> Option<String> {
        use SurfaceType::{Cylinder, Ellipsoid, Sphere};
        let told = self.surface_type;
        if needed && told.is_none() && self.radius.is_none() && self.axis_direction.is_none() {
            return Some("it says nothing: give 'type', 'radius' or 'axis_direction'".to_owned());
        }
        if let Some(told) = told.filter(|t| !SurfaceType::DEFAULT.contains(t)) {
            let known = SurfaceType::DEFAULT.map(SurfaceType::name).join(", ");
            return Some(format!("'type' {} cannot be told; these can: {known}", told.name()));
        }
        if let (Some(_), Some(told)) =
            (self.radius, told.filter(|t| ![Sphere, Cylinder].contains(t)))
        {
            return Some(format!(
                "a {} has no 'radius'; a sphere and a cylinder have",
                told.name()
            ));
        }
        if let (Some(_), Some(told)) =
            (self.axis_direction, told.filter(|t| [Sphere, Ellipsoid].contains(t)))
        {
            return Some(format!("a {} has no 'axis_direction'", told.name()));
        }
        let range = |name: &str, value: Option<f64>, most: f64, least: bool| {
            let fits = |v: &f64| *v <= most && if least { *v >= 0.0 } else { *v > 0.0 };
            let from = if least { "from 0 to" } else { "above 0 and at most" };
            value
                .filter(|v| !fits(v))
                .map(|v| format!("'{name}' {v:?} is not a number {from} {most}"))
        };
        let half = std::f64::consts::FRAC_PI_2;
        range("radius", self.radius, LARGEST_TOLD, false)
            .or_else(|| range("radius_tolerance", self.radius_tolerance, LARGEST_TOLD, true))
            .or_else(|| range("axis_tolerance", self.axis_tolerance, half, true))
            .or_else(|| self.wrong_company())
    }

    fn wrong_company(&self) -> Option<String> {
        if self.radius_tolerance.is_some() && self.radius.is_none() {
            return Some("'radius_tolerance' is given without 'radius'".to_owned());
        }
        if self.axis_tolerance.is_some() && self.axis_direction.is_none() {
            return Some("'axis_tolerance' is given without 'axis_direction'".to_owned());
        }
        let zero =
            |d: &[f64; 3]| d.iter().all(|x| *x == 0.0) || d.iter().any(|x| x.abs() > LARGEST_TOLD);
        self.axis_direction.filter(zero).map(|_| {
            format!(
                "'axis_direction' is no direction: give three numbers up to {LARGEST_TOLD:e}, not all 0"
            )
        })
    }

    /// Whether anything is told of the surface but its place.
    fn tells(&self) -> bool {
        let Self { radius, radius_tolerance, axis_direction, axis_tolerance, surface_type, .. } =
            self;
        surface_type.is_some()
            || radius.or(*radius_tolerance).or(*axis_tolerance).is_some()
            || axis_direction.is_some()
    }

    fn wrong_split(&self) -> Option<String> {
        let parts = self.at.len() + self.labels.len();
        if self.extent.is_some() || parts < 2 || self.at.len().min(self.labels.len()) > 0 {
            return Some("to split takes two or more points 'at', or two or more 'labels', one for each part".to_owned());
        }
        self.tells().then(|| {
            "to split takes no 'type' and no numbers: tell those of each part in a hint of its own".to_owned()
        })
    }

    fn wrong_crop(&self) -> Option<String> {
        if !self.at.is_empty() {
            return Some("to crop takes 'extent' or 'labels'".to_owned());
        }
        self.tells().then(|| "to crop takes nothing but a place".to_owned())
    }
}

#[cfg(test)]
mod tests;
