//! QIF 3.0 Results (ANSI/DMSC QIF 3.0, ISO 23952): measured features and characteristics.

use super::{
    Found, Inspection, Measured,
    xml::{Xml, escaped},
};
use crate::{
    answer::{fits::Verdict, sha256},
    fit::feature::{Element, FeatureType},
    geometry::{LengthUnit, Surface, Vec3},
};

/// A QIF document with the results of an inspection.
///
/// Sizes are diameters, angles are radians, lengths are in the input's unit or, where none is known, in millimetres, which an
/// attribute then says. There is no type for ellipsoids and elliptic cylinders: they are other surfaces whose attributes hold
/// the parameters. A verdict of `undecided` is the status INDETERMINATE.
pub fn qif(inspection: &Inspection) -> String {
    let plan = Plan::of(inspection);
    let body = body(inspection, &plan);
    // the same results are the same document
    let hash = sha256(body.as_bytes());
    let id = format!(
        "{}-{}-8{}-a{}-{}",
        &hash[..8],
        &hash[8..12],
        &hash[13..16],
        &hash[17..20],
        &hash[20..32]
    );
    body.replacen(PLACE_OF_ID, &id, 1)
}

/// What stands for the document's id until it is known.
const PLACE_OF_ID: &str = "@id@";

/// The ids of what refers to each other, from 1 on.
struct Plan {
    /// Id of each feature, and of each of its toleranced quantities those of definition, nominal, item and measurement.
    features: Vec<(usize, Vec<[usize; 4]>)>,
    standard: usize,
    results: usize,
    most: usize,
}

impl Plan {
    fn of(inspection: &Inspection) -> Self {
        let mut most = 2;
        let mut next = || {
            most += 1;
            most
        };
        let mut features = Vec::new();
        for feature in &inspection.features {
            let own = next();
            let toleranced = feature.measured.iter().filter(|m| m.toleranced.is_some());
            features.push((own, toleranced.map(|_| [0; 4].map(|_| next())).collect()));
        }
        Self { features, standard: 1, results: 2, most }
    }
}

/// The toleranced quantities with the ids of their parts.
fn toleranced<'a>(
    inspection: &'a Inspection,
    plan: &'a Plan,
) -> Vec<(&'a Found, usize, &'a Measured, [usize; 4])> {
    let mut out = Vec::new();
    for (feature, (own, ids)) in inspection.features.iter().zip(&plan.features) {
        let measured = feature.measured.iter().filter(|m| m.toleranced.is_some());
        out.extend(measured.zip(ids).map(|(m, ids)| (feature, *own, m, *ids)));
    }
    out
}

fn body(inspection: &Inspection, plan: &Plan) -> String {
    let mut x = Xml::new();
    x.open(
        "QIFDocument",
        &format!(
            "xmlns=\"http://qifstandards.org/xsd/qif3\" versionQIF=\"3.0.0\" idMax=\"{}\"",
            plan.most
        ),
    );
    x.leaf("QPId", PLACE_OF_ID);
    x.open("Header", "");
    x.open("Application", "");
    x.leaf("Name", &inspection.program);
    x.close();
    x.close();
    let all = toleranced(inspection, plan);
    if !all.is_empty() {
        standard(&mut x, plan.standard);
    }
    units(&mut x, inspection.unit);
    if !all.is_empty() {
        characteristics(&mut x, plan.standard, &all);
    }
    x.open("Results", "");
    x.open("MeasurementResultsSet", "n=\"1\"");
    x.open("MeasurementResults", &format!("id=\"{}\"", plan.results));
    attributes(&mut x, &passed(inspection));
    if !inspection.features.is_empty() {
        x.open("MeasuredFeatures", &format!("n=\"{}\"", inspection.features.len()));
        for (feature, (id, _)) in inspection.features.iter().zip(&plan.features) {
            measured_feature(&mut x, feature, *id);
        }
        x.close();
    }
    if !all.is_empty() {
        x.open("MeasuredCharacteristics", "");
        x.open("CharacteristicMeasurements", &format!("n=\"{}\"", all.len()));
        all.iter().for_each(|one| measured_characteristic(&mut x, one));
        x.close();
        x.close();
    }
    x.open("InspectionStatus", "");
    x.leaf("InspectionStatusEnum", status(&all));
    x.finish()
}

/// The status of the whole.
fn status(all: &[(&Found, usize, &Measured, [usize; 4])]) -> &'static str {
    let verdicts = || all.iter().filter_map(|(_, _, m, _)| m.verdict());
    if verdicts().any(|v| v == Verdict::NotConform) {
        "FAIL"
    } else if verdicts().next().is_none() {
        "UNDEFINED"
    } else if verdicts().all(|v| v == Verdict::Conform) {
        "PASS"
    } else {
        "UNKNOWN"
    }
}

fn standard(x: &mut Xml, id: usize) {
    x.open("StandardsDefinitions", "n=\"1\"");
    x.open("Standard", &format!("id=\"{id}\""));
    x.open("Organization", "");
    x.leaf("StandardsOrganizationEnum", "ISO");
    x.close();
    x.leaf("Designator", "1101");
    x.leaf("Year", "2017");
    x.close();
    x.close();
}

fn units(x: &mut Xml, unit: Option<LengthUnit>) {
    let unit = unit.unwrap_or(LengthUnit::Mm);
    x.open("FileUnits", "");
    x.open("PrimaryUnits", "");
    x.open("AngularUnit", "");
    x.leaf("SIUnitName", "radian");
    x.leaf("UnitName", "radian");
    x.close();
    x.open("LinearUnit", "");
    x.leaf("SIUnitName", "meter");
    x.leaf("UnitName", unit.name());
    x.open("UnitConversion", "");
    x.leaf("Factor", &(unit.millimetres() / 1000.0).to_string());
    x.close();
    x.close();
    x.close();
    x.close();
}

/// What was passed through, and what the document cannot say elsewhere.
fn passed(inspection: &Inspection) -> Vec<(&'static str, String)> {
    let p = &inspection.passed;
    let all = [
        ("name", &p.name),
        ("part", &p.part),
        ("serial", &p.serial),
        ("operator", &p.operator),
        ("instrument", &p.instrument),
        ("temperature", &p.temperature),
        ("time", &p.time),
    ];
    let mut out = vec![("input_sha256", inspection.sha256.clone())];
    out.extend(all.into_iter().filter_map(|(name, value)| Some((name, value.clone()?))));
    if inspection.unit.is_none() {
        out.push(("unit", "not known: taken for mm".to_owned()));
    }
    out
}

fn attributes(x: &mut Xml, all: &[(&str, String)]) {
    x.open("Attributes", &format!("n=\"{}\"", all.len()));
    for (name, value) in all {
        x.empty("AttributeStr", &format!("name=\"{name}\" value=\"{}\"", escaped(value)));
    }
    x.close();
}

/// The word that the elements of a characteristic begin with.
fn word(feature: &Found, measured: &Measured) -> &'static str {
    match (measured.name.as_str(), feature.kind) {
        ("diameter", FeatureType::Sphere) => "SphericalDiameter",
        ("diameter" | "tube_diameter", _) => "Diameter",
        ("full_angle", _) => "Angle",
        ("flatness", _) => "Flatness",
        ("straightness", _) => "Straightness",
        ("roundness", _) => "Circularity",
        ("cylindricity", _) => "Cylindricity",
        ("sphericity", _) => "Sphericity",
        ("conicity", _) => "Conicity",
        (_, FeatureType::Torus) => "Toroidicity",
        _ => "OtherForm",
    }
}

fn characteristics(x: &mut Xml, standard: usize, all: &[(&Found, usize, &Measured, [usize; 4])]) {
    let n = format!("n=\"{}\"", all.len());
    x.open("Characteristics", "");
    x.leaf("FormalStandardId", &standard.to_string());
    x.open("CharacteristicDefinitions", &n);
    for (feature, _, measured, [id, ..]) in all {
        let Some(limits) = &measured.toleranced else { continue };
        x.open(&element(feature, measured, "Definition"), &format!("id=\"{id}\""));
        if limits.nominal.is_none() {
            let most = limits.upper_limit.unwrap_or_default();
            x.leaf("ToleranceValue", &most.to_string());
            if measured.name == "straightness" {
                x.open("ZoneShape", "");
                x.open("DiametricalZone", "");
                x.close();
                x.close();
            }
        } else if limits.lower_limit.is_none() && limits.upper_limit.is_none() {
            x.leaf("NonTolerance", "MEASURED");
        } else {
            x.open("Tolerance", "");
            for (name, limit) in
                [("MaxValue", limits.upper_limit), ("MinValue", limits.lower_limit)]
            {
                limit.iter().for_each(|limit| x.leaf(name, &limit.to_string()));
            }
            x.leaf("DefinedAsLimit", "true");
            x.close();
        }
        x.close();
    }
    x.close();
    x.open("CharacteristicNominals", &n);
    for (feature, _, measured, [definition, id, ..]) in all {
        x.open(&element(feature, measured, "Nominal"), &format!("id=\"{id}\""));
        x.leaf("CharacteristicDefinitionId", &definition.to_string());
        let nominal = measured.toleranced.as_ref().and_then(|c| c.nominal);
        nominal.iter().for_each(|nominal| x.leaf("TargetValue", &nominal.to_string()));
        x.close();
    }
    x.close();
    x.open("CharacteristicItems", &n);
    for (feature, _, measured, [_, nominal, id, _]) in all {
        x.open(&element(feature, measured, "Item"), &format!("id=\"{id}\""));
        x.leaf("Name", &format!("{} {}", feature.name, measured.name));
        x.leaf("CharacteristicNominalId", &nominal.to_string());
        x.close();
    }
    x.close();
    x.close();
}

fn element(feature: &Found, measured: &Measured, part: &str) -> String {
    format!("{}Characteristic{part}", word(feature, measured))
}

fn measured_characteristic(
    x: &mut Xml,
    (feature, own, measured, [_, _, item, id]): &(&Found, usize, &Measured, [usize; 4]),
) {
    x.open(&element(feature, measured, "Measurement"), &format!("id=\"{id}\""));
    if let Some(u) = measured.expanded {
        attributes(x, &[("expanded_uncertainty", u.to_string())]);
    }
    x.open("Status", "");
    let status = match measured.verdict() {
        Some(Verdict::Conform) => "PASS",
        Some(Verdict::NotConform) => "FAIL",
        Some(Verdict::Undecided) => "INDETERMINATE",
        None => "NOT_ANALYZED",
    };
    x.leaf("CharacteristicStatusEnum", status);
    x.close();
    x.leaf("CharacteristicItemId", &item.to_string());
    x.open("FeatureMeasurementIds", "n=\"1\"");
    x.leaf("Id", &own.to_string());
    x.close();
    value(x, "Value", measured);
    x.close();
}

/// A measured value with its standard uncertainty.
fn value(x: &mut Xml, name: &str, measured: &Measured) {
    let known = measured.standard.map(|u| format!("combinedUncertainty=\"{u}\""));
    x.leaf_with(name, &known.unwrap_or_default(), &measured.value.to_string());
}

fn three(v: &Vec3) -> String {
    format!("{} {} {}", v.x, v.y, v.z)
}

/// A feature as it was measured.
fn measured_feature(x: &mut Xml, feature: &Found, id: usize) {
    let kind = match feature.kind {
        FeatureType::Plane => "Plane",
        FeatureType::Sphere => "Sphere",
        FeatureType::Cylinder => "Cylinder",
        FeatureType::Cone => "Cone",
        FeatureType::Torus => "Torus",
        FeatureType::Circle => "Circle",
        FeatureType::Line => "Line",
        FeatureType::EllipticCylinder | FeatureType::Ellipsoid => "OtherSurface",
    };
    x.open(&format!("{kind}FeatureMeasurement"), &format!("id=\"{id}\""));
    let mut more =
        vec![("association", feature.association.clone()), ("points", feature.points.to_string())];
    if kind == "OtherSurface" {
        more.push(("type", feature.kind.name().to_owned()));
        more.push(("surface", serde_json::to_string(&feature.element).unwrap_or_default()));
        more.extend(form(feature).map(|form| ("profile_of_surface", form.value.to_string())));
    }
    attributes(x, &more);
    x.leaf("FeatureName", &feature.name);
    let size = |name: &str| feature.measured.iter().find(|m| m.name == name);
    let sized = |x: &mut Xml, name: &str, of: &str| {
        size(of).iter().for_each(|measured| value(x, name, measured));
    };
    let axis = |x: &mut Xml, point: &Vec3, direction: &Vec3| {
        x.open("Axis", "");
        x.leaf("AxisPoint", &three(point));
        x.leaf("Direction", &three(direction));
        x.close();
    };
    let placed = |x: &mut Xml, point: &Vec3, name: &str, direction: &Vec3| {
        x.leaf("Location", &three(point));
        x.leaf(name, &three(direction));
    };
    match &feature.element {
        Element::Circle(s) => {
            placed(x, &s.center, "Normal", &s.normal);
            sized(x, "Diameter", "diameter");
        }
        Element::Line(s) => placed(x, &s.point, "Direction", &s.direction),
        Element::Surface(Surface::Plane(s)) => placed(x, &s.point, "Normal", &s.normal),
        Element::Surface(Surface::Sphere(s)) => {
            x.leaf("Location", &three(&s.center));
            sized(x, "Diameter", "diameter");
        }
        Element::Surface(Surface::Cylinder(s)) => {
            axis(x, &s.axis_point, &s.axis_direction);
            sized(x, "Diameter", "diameter");
        }
        Element::Surface(Surface::Cone(s)) => {
            axis(x, &s.apex, &s.axis_direction);
            // at the apex, which is the point of the axis
            x.leaf("Diameter", "0");
            sized(x, "FullAngle", "full_angle");
        }
        Element::Surface(Surface::Torus(s)) => {
            placed(x, &s.center, "AxisVector", &s.axis_direction);
            sized(x, "MinorDiameter", "tube_diameter");
            sized(x, "MajorDiameter", "ring_diameter");
        }
        Element::Surface(_) => {}
    }
    if kind != "OtherSurface" {
        form(feature).iter().for_each(|measured| value(x, "Form", measured));
    }
    x.close();
}

/// The form error, where it was measured.
fn form(feature: &Found) -> Option<&Measured> {
    feature.measured.iter().find(|m| m.name == feature.kind.form_name())
}
