use serde_json::Value;

use super::{count, v1};
use crate::{
    geometry::{Scale, Surface, Vec3},
    segment::{Continuity, Dimensions, Evidence, Extent, Fit, Neighbour, Region, Side, Snapped},
};

pub(super) fn vector(v: &Vec3) -> Option<v1::Vector> {
    Some(v1::Vector { x: v.x, y: v.y, z: v.z })
}

fn vectors(directions: &[Vec3]) -> Vec<v1::Vector> {
    directions.iter().filter_map(vector).collect()
}

impl From<&Region> for v1::Region {
    fn from(region: &Region) -> Self {
        let dimensions = &region.dimensions;
        Self {
            id: count(region.id),
            r#type: v1::SurfaceType::from(region.surface_type).into(),
            point_count: count(region.point_count),
            coefficients: list(region.coefficients),
            coefficients_scale: scale(region.coefficients_scale).into(),
            coefficients_error: region.coefficients_error,
            local_origin: vector(&region.local_origin.into()),
            local_coefficients: list(region.local_coefficients),
            surface: region.surface.as_ref().map(Into::into),
            uncertainty: region.uncertainty.as_ref().map(deviations).unwrap_or_default(),
            fit: Some((&region.fit).into()),
            evidence: region.evidence.as_ref().map(Into::into),
            extent: region.extent.as_ref().map(Into::into),
            neighbours: region.neighbours.iter().map(Into::into).collect(),
            snapped: region.snapped.as_ref().map(Into::into),
            ends: places(dimensions.ends.as_ref().map_or(&[], |ends| ends)),
            bounded_by: dimensions.bounded_by.map(|[first, second]| v1::Bounds {
                first: first.map(count),
                second: second.map(count),
            }),
            length: dimensions.length,
            diameter: dimensions.diameter,
            diameters: dimensions.diameters.clone().unwrap_or_default(),
            end_radii: dimensions.end_radii.map(Vec::from).unwrap_or_default(),
            full_angle: dimensions.full_angle,
            swept_angle: dimensions.swept_angle,
            arc_angle: dimensions.arc_angle,
            side: dimensions.side.map_or(v1::Side::Unspecified, Into::into).into(),
            share_seen: dimensions.share_seen,
            outline: polygons(dimensions),
            area: dimensions.area,
            size: dimensions.size.map(Vec::from).unwrap_or_default(),
            size_directions: places(dimensions.size_directions.as_ref().map_or(&[], |both| both)),
        }
    }
}

fn places(all: &[[f64; 3]]) -> Vec<v1::Vector> {
    all.iter().map(|&[x, y, z]| v1::Vector { x, y, z }).collect()
}

fn polygons(dimensions: &Dimensions) -> Vec<v1::Polygon> {
    let all = dimensions.outline.iter().flatten();
    all.map(|corners| v1::Polygon { corners: places(corners) }).collect()
}

impl From<&Snapped> for v1::Snapped {
    fn from(snapped: &Snapped) -> Self {
        Self {
            surface: Some((&snapped.surface).into()),
            coefficients: list(snapped.coefficients),
            coefficients_scale: scale(snapped.coefficients_scale).into(),
            local_coefficients: list(snapped.local_coefficients),
            moved: snapped.moved,
            p_value: snapped.p_value,
        }
    }
}

impl From<Side> for v1::Side {
    fn from(side: Side) -> Self {
        match side {
            Side::Hole => Self::Hole,
            Side::Boss => Self::Boss,
            Side::Unknown => Self::Unknown,
        }
    }
}

/// An empty list where there are no coefficients.
fn list(coefficients: Option<[f64; 10]>) -> Vec<f64> {
    coefficients.map(Vec::from).unwrap_or_default()
}

fn scale(scale: Option<Scale>) -> v1::CoefficientsScale {
    match scale {
        None => v1::CoefficientsScale::Unspecified,
        Some(Scale::A10) => v1::CoefficientsScale::A10,
        Some(Scale::Unit) => v1::CoefficientsScale::Unit,
    }
}

impl From<&Surface> for v1::snapped::Surface {
    fn from(surface: &Surface) -> Self {
        match v1::region::Surface::from(surface) {
            v1::region::Surface::Plane(s) => Self::Plane(s),
            v1::region::Surface::Sphere(s) => Self::Sphere(s),
            v1::region::Surface::Cylinder(s) => Self::Cylinder(s),
            v1::region::Surface::EllipticCylinder(s) => Self::EllipticCylinder(s),
            v1::region::Surface::Cone(s) => Self::Cone(s),
            v1::region::Surface::Ellipsoid(s) => Self::Ellipsoid(s),
            v1::region::Surface::Torus(s) => Self::Torus(s),
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
            Surface::Torus(s) => Self::Torus(v1::Torus {
                center: vector(&s.center),
                axis_direction: vector(&s.axis_direction),
                major_radius: s.major_radius,
                minor_radius: s.minor_radius,
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
