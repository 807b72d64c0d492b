//! What a result says in a designer's words: one place for the report, the terminal and whoever else shows it to
//! people. Lengths are in the input's unit, angles in degrees.

mod digits;
mod relations;

use serde_json::Value;

use crate::{
    geometry::{LengthUnit, Surface, Vec3},
    segment::{Region, Side},
};

pub use digits::{count, exact, number};
pub use relations::{in_common, measure, off, related, relation_name};

/// One quantity of a region.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Quantity {
    /// What it is.
    pub name: &'static str,
    /// Its value with its uncertainty, and its unit where that is not the input's.
    pub text: String,
}

/// What lengths are in: a unit, or that none is known.
pub fn unit(unit: Option<LengthUnit>) -> String {
    unit.map_or_else(
        || "lengths in the cloud's unit, which is not known".to_owned(),
        |unit| format!("lengths in {unit}"),
    )
}

/// The type with its side: `cylinder, hole`.
pub fn kind(region: &Region) -> String {
    let name = region.surface_type.name().replace('_', " ");
    match region.dimensions.side {
        Some(side) if side != Side::Unknown => format!("{name}, {}", side.name()),
        _ => name,
    }
}

/// The sizes by which a designer calls for such a face, the foremost first.
pub fn dimensions(region: &Region) -> Vec<Quantity> {
    let d = &region.dimensions;
    let mut all = Vec::new();
    let mut put = |name, text: Option<String>| all.extend(text.map(|text| Quantity { name, text }));
    let sd = |name: &str| deviation(region, name, None);
    let length = |value: Option<f64>, name: &str| value.map(|v| exact(v, sd(name)));
    let full = |angle: f64| angle > 2.0 * std::f64::consts::PI - 1e-6;
    if let Some(Surface::Torus(torus)) = &region.surface {
        put("ring radius", length(Some(torus.major_radius), "major_radius"));
    }
    put("diameter", length(d.diameter, "diameter"));
    put("diameters", d.diameters.as_ref().map(|all| product(region, "diameters", all)));
    put("full angle", d.full_angle.map(|angle| degrees(angle, sd("half_angle").map(|s| 2.0 * s))));
    put("end diameters", d.end_radii.map(|r| r.map(|r| number(2.0 * r)).join(" to ")));
    put("length", length(d.length, "length"));
    put("arc", d.arc_angle.map(|angle| degrees(angle, sd("arc_angle"))));
    put("swept", d.swept_angle.filter(|angle| !full(*angle)).map(|angle| degrees(angle, None)));
    put("size", d.size.map(|s| s.map(number).join(" × ")));
    put("area", d.area.map(number));
    put("seen", d.share_seen.map(|share| format!("{:.0} %", 100.0 * share)));
    all
}

/// Where the surface lies, and its parameters that are no dimension.
pub fn position(region: &Region) -> Vec<Quantity> {
    let mut all = Vec::new();
    let mut put = |name, text| all.push(Quantity { name, text });
    let point = |name: &str, at: &Vec3| {
        let sd = (0..3).filter_map(|k| deviation(region, name, Some(k))).fold(None, larger);
        spread(digits::vector((*at).into(), sd), sd, "")
    };
    let direction = |name: &str, d: &Vec3| {
        let sd = deviation(region, name, None);
        spread(digits::vector((*d).into(), sd), sd.map(f64::to_degrees), "°")
    };
    match &region.surface {
        Some(Surface::Plane(s)) => {
            put("point", point("point", &s.point));
            put("normal", direction("normal", &s.normal));
        }
        Some(Surface::Sphere(s)) => put("centre", point("center", &s.center)),
        Some(Surface::Cylinder(s)) => {
            put("axis through", point("axis_point", &s.axis_point));
            put("axis", direction("axis_direction", &s.axis_direction));
        }
        Some(Surface::EllipticCylinder(s)) => {
            put("axis through", point("axis_point", &s.axis_point));
            put("axis", direction("axis_direction", &s.axis_direction));
            put("longer semi-axis along", digits::vector(s.semi_axis_directions[0].into(), None));
        }
        Some(Surface::Cone(s)) => {
            put("apex", point("apex", &s.apex));
            put("axis", direction("axis_direction", &s.axis_direction));
        }
        Some(Surface::Ellipsoid(s)) => {
            put("centre", point("center", &s.center));
            put("longest semi-axis along", digits::vector(s.semi_axis_directions[0].into(), None));
        }
        Some(Surface::Torus(s)) => {
            put("centre", point("center", &s.center));
            put("axis", direction("axis_direction", &s.axis_direction));
        }
        None => {}
    }
    if let Some([from, to]) = region.dimensions.ends {
        put("ends", format!("{} to {}", digits::vector(from, None), digits::vector(to, None)));
    }
    all
}

/// The parameters that the points do not tell.
pub fn unknown(region: &Region) -> Vec<String> {
    let names = region.uncertainty.as_ref().and_then(|u| u.get("not_identifiable")?.as_array());
    let text = |name: &Value| Some(name.as_str()?.replace('_', " "));
    names.into_iter().flatten().filter_map(text).collect()
}

/// An angle in degrees; both are given in radians.
fn degrees(angle: f64, deviation: Option<f64>) -> String {
    exact(angle.to_degrees(), deviation.map(f64::to_degrees)) + "°"
}

fn product(region: &Region, name: &str, values: &[f64]) -> String {
    let one = |(k, value): (usize, &f64)| exact(*value, deviation(region, name, Some(k)));
    values.iter().enumerate().map(one).collect::<Vec<_>>().join(" × ")
}

/// The standard deviation of a quantity, or of one of its components.
fn deviation(region: &Region, name: &str, component: Option<usize>) -> Option<f64> {
    let told = region.uncertainty.as_ref()?.get(name)?;
    component.map_or(Some(told), |k| told.get(k))?.as_f64()
}

fn larger(a: Option<f64>, b: f64) -> Option<f64> {
    Some(a.map_or(b, |a| a.max(b)))
}

fn spread(text: String, deviation: Option<f64>, unit: &str) -> String {
    match deviation.filter(|d| *d > 0.0) {
        Some(deviation) => format!("{text} ± {}{unit}", digits::rough(deviation)),
        None => text,
    }
}

#[cfg(test)]
mod tests;
