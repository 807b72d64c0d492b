use serde_json::Value;

use super::{count, v1};
use crate::{
    geometry::{Scale, Surface, Vec3},
    segment::{Continuity, Evidence, Extent, Fit, Neighbour, Region},
};

fn vector(v: &Vec3) -> Option<v1::Vector> {
    Some(v1::Vector { x: v.x, y: v.y, z: v.z })
}

fn vectors(directions: &[Vec3]) -> Vec<v1::Vector> {
    directions.iter().filter_map(vector).collect()
}

impl From<&Region> for v1::Region {
    fn from(region: &Region) -> Self {
        Self {
            id: count(region.id),
            r#type: v1::SurfaceType::from(region.surface_type).into(),
            point_count: count(region.point_count),
            coefficients: region.coefficients.into(),
            coefficients_scale: v1::CoefficientsScale::from(region.coefficients_scale).into(),
            coefficients_error: region.coefficients_error,
            local_origin: vector(&region.local_origin.into()),
            local_coefficients: region.local_coefficients.into(),
            surface: region.surface.as_ref().map(Into::into),
            uncertainty: region.uncertainty.as_ref().map(deviations).unwrap_or_default(),
            fit: Some((&region.fit).into()),
            evidence: region.evidence.as_ref().map(Into::into),
            extent: region.extent.as_ref().map(Into::into),
            neighbours: region.neighbours.iter().map(Into::into).collect(),
        }
    }
}

impl From<Scale> for v1::CoefficientsScale {
    fn from(scale: Scale) -> Self {
        match scale {
            Scale::A10 => Self::A10,
            Scale::Unit => Self::Unit,
        }
    }
}

impl From<&Surface> for v1::region::Surface {
    fn from(surface: &Surface) -> Self {
        match surface {
            Surface::Plane(s) => {
                Self::Plane(v1::Plane { point: vector(&s.point), normal: vector(&s.normal) })
            }
            Surface::Sphere(s) => {
                Self::Sphere(v1::Sphere { center: vector(&s.center), radius: s.radius })
            }
            Surface::Cylinder(s) => Self::Cylinder(v1::Cylinder {
                axis_point: vector(&s.axis_point),
                axis_direction: vector(&s.axis_direction),
                radius: s.radius,
            }),
            Surface::EllipticCylinder(s) => Self::EllipticCylinder(v1::EllipticCylinder {
                axis_point: vector(&s.axis_point),
                axis_direction: vector(&s.axis_direction),
                semi_axes: s.semi_axes.into(),
                semi_axis_directions: vectors(&s.semi_axis_directions),
            }),
            Surface::Cone(s) => Self::Cone(v1::Cone {
                apex: vector(&s.apex),
                axis_direction: vector(&s.axis_direction),
                half_angle: s.half_angle,
            }),
            Surface::Ellipsoid(s) => Self::Ellipsoid(v1::Ellipsoid {
                center: vector(&s.center),
                semi_axes: s.semi_axes.into(),
                semi_axis_directions: vectors(&s.semi_axis_directions),
            }),
        }
    }
}

/// One row for each entry of an uncertainty; matrices are written row by row.
fn deviations(uncertainty: &Value) -> Vec<v1::Deviation> {
    let entries = uncertainty.as_object().into_iter().flatten();
    entries
        .map(|(parameter, value)| {
            let mut values = Vec::new();
            numbers(value, &mut values);
            let note = words(value);
            v1::Deviation { parameter: parameter.clone(), values, note }
        })
        .collect()
}

/// Words and truth values as text, lists of them with commas.
fn words(value: &Value) -> String {
    match value {
        Value::String(word) => word.clone(),
        Value::Bool(truth) => truth.to_string(),
        Value::Array(items) if items.iter().all(Value::is_string) => {
            items.iter().map(words).collect::<Vec<_>>().join(",")
        }
        _ => String::new(),
    }
}

fn numbers(value: &Value, into: &mut Vec<f64>) {
    match value {
        Value::Array(items) => items.iter().for_each(|item| numbers(item, into)),
        other => into.extend(other.as_f64()),
    }
}

impl From<&Fit> for v1::Fit {
    fn from(fit: &Fit) -> Self {
        let Fit { rms, noise, max, used, rejected } = *fit;
        Self { rms, noise, max, used: count(used), rejected: count(rejected) }
    }
}

impl From<&Evidence> for v1::Evidence {
    fn from(evidence: &Evidence) -> Self {
        let runner_up = v1::SurfaceType::from(evidence.runner_up).into();
        Self { runner_up, delta_bic: evidence.delta_bic }
    }
}

impl From<&Extent> for v1::Extent {
    fn from(extent: &Extent) -> Self {
        Self { min: vector(&extent.min.into()), max: vector(&extent.max.into()) }
    }
}

impl From<&Neighbour> for v1::Neighbour {
    fn from(neighbour: &Neighbour) -> Self {
        let continuity = match neighbour.continuity {
            Continuity::G0 => v1::Continuity::G0,
            Continuity::G1 => v1::Continuity::G1,
        };
        Self {
            region: count(neighbour.region),
            continuity: continuity.into(),
            resolution: neighbour.resolution,
        }
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn an_uncertainty_keeps_its_numbers_and_its_words() {
        let rows =
            deviations(&json!({"radius": 0.5, "covariance": [[1, 2], [3, 4]], "apex": "far",
                "identifiable": false, "covariance_of": ["apex", "radius"]}));
        let row = |name: &str| rows.iter().find(|row| row.parameter == name).unwrap();
        assert_eq!(row("radius").values, [0.5]);
        assert_eq!(row("covariance").values, [1.0, 2.0, 3.0, 4.0]);
        assert_eq!(row("apex").note, "far");
        assert_eq!(row("identifiable").note, "false");
        assert_eq!(row("covariance_of").note, "apex,radius");
    }
}
