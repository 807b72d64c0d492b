//! DMIS output (ISO 22093): actual features and tolerances.

use super::{Found, Inspection, Measured};
use crate::{
    answer::fits::Verdict,
    fit::feature::Element,
    geometry::{LengthUnit, Surface, Vec3, perpendicular_frame},
};

/// Longest line; what is longer goes on behind a dollar sign.
const LINE: usize = 78;

/// The features as `FA(...)=FEAT/...` and their tolerances as `TA(...)=TOL/...`.
///
/// Lengths are in the input's unit where DMIS has it, in millimetres where it has not or none is known; angles in degrees. What DMIS has
/// no word for (ellipsoids, elliptic cylinders, what is undecided) stands in comments.
pub fn dmis(inspection: &Inspection) -> String {
    let (word, scale) = unit(inspection.unit);
    let mut out = Lines(String::new());
    let p = &inspection.passed;
    let name = p.name.as_deref().or(p.part.as_deref()).unwrap_or("conicoid");
    out.put(&format!("DMISMN/{},05.2", text(name)));
    out.comment(&inspection.program);
    out.comment(&format!("input SHA-256 {}", inspection.sha256));
    if inspection.unit.is_none() {
        out.comment("the unit of lengths is not known: taken for millimetres");
    }
    out.put(&format!("UNITS/{word},ANGDEC"));
    for (label, kind, value) in [
        ("PN", "PARTID", &p.part),
        ("PS", "PARTSN", &p.serial),
        ("OP", "OPERID", &p.operator),
        ("DI", "DMEID", &p.instrument),
    ] {
        if let Some(value) = value {
            out.put(&format!("{label}(CONICOID)={kind}/{}", text(value)));
        }
    }
    for (name, value) in [("temperature", &p.temperature), ("time", &p.time)] {
        if let Some(value) = value {
            out.comment(&format!("{name} {value}"));
        }
    }
    for feature in &inspection.features {
        put_feature(&mut out, feature, scale);
    }
    out.put("ENDFIL");
    out.0
}

/// The word of a unit, and what lengths are multiplied by for it.
fn unit(unit: Option<LengthUnit>) -> (&'static str, f64) {
    match unit {
        Some(LengthUnit::Mm) | None => ("MM", 1.0),
        Some(LengthUnit::Cm) => ("CM", 1.0),
        Some(LengthUnit::M) => ("M", 1.0),
        Some(LengthUnit::In) => ("INCH", 1.0),
        Some(LengthUnit::Ft) => ("FEET", 1.0),
        Some(other) => ("MM", other.millimetres()),
    }
}

/// Lines of a file.
struct Lines(String);

impl Lines {
    /// A statement, broken behind commas.
    fn put(&mut self, statement: &str) {
        let mut line = String::new();
        for part in statement.split_inclusive(',') {
            if !line.is_empty() && line.len() + part.len() > LINE {
                self.0 += &line;
                self.0 += "$\r\n";
                line.clear();
            }
            line += part;
        }
        self.0 += &line;
        self.0 += "\r\n";
    }

    fn comment(&mut self, words: &str) {
        self.0 += &format!("$$ {}\r\n", plain(words));
    }
}

/// ASCII, one line.
fn plain(words: &str) -> String {
    words.chars().map(|c| if c.is_ascii() && !c.is_ascii_control() { c } else { '?' }).collect()
}

fn text(words: &str) -> String {
    format!("'{}'", plain(words).replace('\'', "''"))
}

fn vector(v: &Vec3, scale: f64) -> String {
    let v = v * scale;
    format!("{},{},{}", v.x, v.y, v.z)
}

fn put_feature(out: &mut Lines, feature: &Found, scale: f64) {
    let label = feature.name.to_ascii_uppercase();
    let is_sided =
        !matches!(feature.element, Element::Line(_) | Element::Surface(Surface::Plane(_)));
    if feature.is_hole.is_none() && is_sided {
        out.comment(&format!("{label}: inner or outer is not known"));
    }
    let side = if feature.is_hole == Some(true) { "INNER" } else { "OUTER" };
    let at = |p: &Vec3| vector(p, scale);
    let along = |v: &Vec3| vector(v, 1.0);
    let told = match &feature.element {
        Element::Circle(s) => {
            format!(
                "CIRCLE,{side},CART,{},{},{}",
                at(&s.center),
                along(&s.normal),
                2.0 * s.radius * scale
            )
        }
        Element::Line(s) => {
            // a plane that it lies in is asked for: any
            let (normal, _) = perpendicular_frame(&s.direction);
            format!("LINE,UNBND,CART,{},{},{}", at(&s.point), along(&s.direction), along(&normal))
        }
        Element::Surface(Surface::Plane(s)) => {
            format!("PLANE,CART,{},{}", at(&s.point), along(&s.normal))
        }
        Element::Surface(Surface::Sphere(s)) => {
            format!("SPHERE,{side},CART,{},{}", at(&s.center), 2.0 * s.radius * scale)
        }
        Element::Surface(Surface::Cylinder(s)) => format!(
            "CYLNDR,{side},CART,{},{},{}",
            at(&s.axis_point),
            along(&s.axis_direction),
            2.0 * s.radius * scale
        ),
        Element::Surface(Surface::Cone(s)) => format!(
            "CONE,{side},CART,{},{},{}",
            at(&s.apex),
            along(&s.axis_direction),
            2.0 * s.half_angle.to_degrees()
        ),
        Element::Surface(Surface::Torus(s)) => format!(
            "TORUS,{side},CART,{},{},{},{}",
            at(&s.center),
            along(&s.axis_direction),
            2.0 * s.major_radius * scale,
            2.0 * s.minor_radius * scale
        ),
        Element::Surface(surface) => {
            let told = serde_json::to_string(surface).unwrap_or_default();
            out.comment(&format!("{label}: no feature of DMIS, in the unit of the input: {told}"));
            "GSURF".to_owned()
        }
    };
    let mut told_of = Lines(String::new());
    told_of.put(&format!("FA({label})=FEAT/{told}"));
    let mut outputs = vec![format!("FA({label})")];
    for measured in &feature.measured {
        outputs.extend(put_tolerance(&mut told_of, &label, measured, scale));
    }
    out.put(&format!("OUTPUT/{}", outputs.join(",")));
    out.0 += &told_of.0;
}

/// The measured value of a tolerance; `None`, and a comment, where DMIS has no word for it.
fn put_tolerance(out: &mut Lines, label: &str, measured: &Measured, scale: f64) -> Option<String> {
    let limits = measured.toleranced.as_ref()?;
    let scale = if measured.is_angle() { 1.0_f64.to_degrees() } else { scale };
    let name = format!("{label}_{}", measured.name.to_ascii_uppercase());
    let within = match limits.verdict {
        Verdict::Conform => "INTOL",
        Verdict::NotConform => "OUTOL",
        Verdict::Undecided => {
            let u = limits.expanded.map_or("not known".to_owned(), |u| (u * scale).to_string());
            out.comment(&format!(
                "T({name}): undecided by ISO 14253-1: measured {}, expanded uncertainty {u}",
                measured.value * scale
            ));
            return None;
        }
    };
    let kind = match measured.name.as_str() {
        "diameter" | "tube_diameter" => "DIAM",
        "full_angle" => "ANGL",
        "flatness" => "FLAT",
        "straightness" => "STRGHT",
        "roundness" => "CIRLTY",
        "cylindricity" => "CYLCTY",
        _ => "PROFS",
    };
    let value = limits.deviation.unwrap_or(measured.value);
    out.put(&format!("TA({name})=TOL/{kind},{},{within}", value * scale));
    Some(format!("TA({name})"))
}
