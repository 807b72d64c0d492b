//! A table of characteristics, as systems for statistical process control read it.

use super::{Inspection, Measured};
use crate::geometry::LengthUnit;

/// The columns, in their order.
const COLUMNS: [&str; 24] = [
    "part",
    "serial",
    "operator",
    "instrument",
    "temperature",
    "time",
    "name",
    "feature",
    "type",
    "association",
    "points",
    "characteristic",
    "nominal",
    "lower_limit",
    "upper_limit",
    "measured",
    "deviation",
    "standard_uncertainty",
    "expanded_uncertainty",
    "verdict",
    "unit",
    "angle_unit",
    "program",
    "sha256",
];

/// One line a characteristic under a line of names, as CSV (RFC 4180); empty where there is no value.
pub fn characteristics(inspection: &Inspection) -> String {
    let mut out = COLUMNS.join(",") + "\r\n";
    let unit = inspection.unit.map(LengthUnit::name).unwrap_or_default();
    let p = &inspection.passed;
    let head = [&p.part, &p.serial, &p.operator, &p.instrument, &p.temperature, &p.time, &p.name];
    for feature in &inspection.features {
        for measured in &feature.measured {
            let mut cells: Vec<String> =
                head.iter().map(|text| (*text).clone().unwrap_or_default()).collect();
            cells.extend([
                feature.name.clone(),
                feature.kind.name().to_owned(),
                feature.association.clone(),
                feature.points.to_string(),
            ]);
            cells.extend(values(measured));
            let (lengths, angles) = if measured.is_angle() { ("", "rad") } else { (unit, "") };
            cells
                .extend([lengths, angles, &inspection.program, &inspection.sha256].map(Into::into));
            out += &cells.iter().map(|text| cell(text)).collect::<Vec<_>>().join(",");
            out += "\r\n";
        }
    }
    out
}

/// From the name on to the verdict.
fn values(measured: &Measured) -> [String; 9] {
    let number = |value: Option<f64>| value.map(|v| v.to_string()).unwrap_or_default();
    let limits = measured.toleranced.as_ref();
    let verdict = measured.verdict().map(|v| v.name().to_owned()).unwrap_or_default();
    [
        measured.name.clone(),
        number(limits.and_then(|c| c.nominal)),
        number(limits.and_then(|c| c.lower_limit)),
        number(limits.and_then(|c| c.upper_limit)),
        number(Some(measured.value)),
        number(limits.and_then(|c| c.deviation)),
        number(measured.standard),
        number(measured.expanded),
        verdict,
    ]
}

/// A cell, in quotes where it has a character of the format's own. One that a spreadsheet would run as a formula is text to it
/// behind an apostrophe.
fn cell(text: &str) -> String {
    let is_number = text.parse::<f64>().is_ok();
    let is_formula = !is_number && text.starts_with(['=', '+', '-', '@']);
    let text = if is_formula { format!("'{text}") } else { text.to_owned() };
    if text.contains(['"', ',', '\r', '\n']) {
        return format!("\"{}\"", text.replace('"', "\"\""));
    }
    text
}
