use std::collections::BTreeSet;

use super::*;
use crate::{
    answer::{
        Form, Input,
        fits::{FitRequest, fit_cloud},
    },
    fit::fits::Random,
    geometry::{PointCloud, Vec3},
};

/// Points of a feature of each type.
fn points(kind: FeatureType) -> Vec<Vec3> {
    let mut random = Random::new(7);
    let mut at = |k: usize| {
        let (t, v) = (k as f64 * 0.7, random.uniform(-1.0, 1.0));
        let (sin, cos) = t.sin_cos();
        let r = 10.0 + 0.01 * random.normal();
        let noise = 0.01 * random.normal();
        match kind {
            FeatureType::Plane => Vec3::new(9.0 * v, 7.0 * cos, noise),
            FeatureType::Line => Vec3::new(noise, 0.01 * random.normal(), 20.0 * v),
            FeatureType::Circle => Vec3::new(r * cos, r * sin, noise),
            FeatureType::Cylinder => Vec3::new(r * cos, r * sin, 9.0 * v),
            FeatureType::Cone => Vec3::new((r + v) * cos, (r + v) * sin, 2.0 * v),
            FeatureType::EllipticCylinder => Vec3::new(r * cos, 0.6 * r * sin, 9.0 * v),
            FeatureType::Torus => {
                let (down, out) = (3.0 * v).sin_cos();
                let d = 30.0 + r * out;
                Vec3::new(d * cos, d * sin, r * down)
            }
            _ => {
                let flat = (1.0 - v * v).sqrt();
                let b = if kind == FeatureType::Sphere { [1.0; 3] } else { [1.0, 0.8, 0.5] };
                Vec3::new(r * flat * cos * b[0], r * flat * sin * b[1], r * v * b[2])
            }
        }
    };
    (0..200).map(|k| at(k) + Vec3::new(120.0, -3.5, 0.25)).collect()
}

fn fit(kind: FeatureType, pairs: &[(&str, &str)]) -> FitDocument {
    let points = points(kind);
    let cloud = PointCloud { input_len: points.len(), points, ..PointCloud::default() };
    let input = Input {
        points: cloud.input_len,
        sha256: "ab".repeat(32),
        format: "xyz".to_owned(),
        skipped: 0,
        unit: Some(LengthUnit::Mm),
        resolution: [0.0; 3],
        mesh: None,
        thin: None,
    };
    let own = [("type", kind.name()), ("part", "a \"b\" <c> & d"), ("serial", "=1+1")];
    let request = FitRequest::from_pairs(own.iter().chain(pairs).copied()).unwrap();
    fit_cloud(&cloud, input, &request).unwrap()
}

/// An element: its name, its attributes, its children and its text.
#[derive(Debug, Default)]
struct Node {
    name: String,
    attributes: String,
    children: Vec<Node>,
    text: String,
}

impl Node {
    /// The one element of a document.
    fn read(text: &str) -> Self {
        let text = text.strip_prefix("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n").unwrap();
        let mut stack = vec![Self::default()];
        for part in text.split('<').skip(1) {
            let (tag, after) = part.split_once('>').unwrap();
            if let Some(name) = tag.strip_prefix('/') {
                let done = stack.pop().unwrap();
                assert_eq!(done.name, name);
                stack.last_mut().unwrap().children.push(done);
            } else {
                let (tag, is_empty) = tag.strip_suffix('/').map_or((tag, false), |tag| (tag, true));
                let (name, attributes) = tag.split_once(' ').unwrap_or((tag, ""));
                let text = after.trim().to_owned();
                let (name, attributes) = (name.to_owned(), attributes.to_owned());
                let node = Self { name, attributes, text, children: Vec::new() };
                if is_empty {
                    stack.last_mut().unwrap().children.push(node);
                } else {
                    stack.push(node);
                }
            }
        }
        assert_eq!(stack.len(), 1);
        stack.remove(0).children.remove(0)
    }

    fn attribute(&self, name: &str) -> Option<&str> {
        let (_, rest) = self.attributes.split_once(&format!("{name}=\""))?;
        Some(rest.split('"').next().unwrap())
    }

    fn names(&self) -> Vec<&str> {
        self.children.iter().map(|c| c.name.as_str()).collect()
    }

    fn all(&self) -> Vec<&Self> {
        std::iter::once(self).chain(self.children.iter().flat_map(Self::all)).collect()
    }

    fn find(&self, name: &str) -> Option<&Self> {
        self.all().into_iter().find(|node| node.name == name)
    }
}

/// Tolerances of the form, and of the size of what has one.
fn tolerances(kind: FeatureType) -> &'static [(&'static str, &'static str)] {
    use FeatureType::{Circle, Cone, Cylinder, Sphere, Torus};
    let all = &[("form_tolerance", "0.3"), ("nominal", "20"), ("lower", "-0.5"), ("upper", "0.5")];
    if matches!(kind, Circle | Cone | Cylinder | Sphere | Torus) { all } else { &all[..1] }
}

/// What the schema of QIF 3.0 asks for of the elements that are written: their order, their counts and what they refer to.
#[test]
fn qif_has_the_structure_of_its_schema_and_the_numbers_of_the_fit() {
    for kind in FeatureType::ALL {
        let fit = fit(kind, tolerances(kind));
        let text = String::from_utf8(fit.write(Form::Qif).unwrap()).unwrap();
        let root = Node::read(&text);
        assert_eq!(root.name, "QIFDocument");
        assert_eq!(root.attribute("versionQIF"), Some("3.0.0"));
        assert_eq!(root.attribute("xmlns"), Some("http://qifstandards.org/xsd/qif3"));
        let sections = root.names();
        let expected =
            ["QPId", "Header", "StandardsDefinitions", "FileUnits", "Characteristics", "Results"];
        assert_eq!(sections, expected);
        let id = &root.children[0].text;
        let lengths: Vec<usize> = id.split('-').map(str::len).collect();
        assert_eq!(lengths, [8, 4, 4, 4, 12], "{id}");
        let ids: Vec<&str> = root.all().iter().filter_map(|n| n.attribute("id")).collect();
        assert_eq!(ids.iter().collect::<BTreeSet<_>>().len(), ids.len());
        let most: usize = root.attribute("idMax").unwrap().parse().unwrap();
        assert!(ids.iter().all(|id| (1..=most).contains(&id.parse().unwrap())));
        for node in root.all() {
            if let Some(n) = node.attribute("n") {
                assert_eq!(n.parse::<usize>().unwrap(), node.children.len(), "{}", node.name);
            }
            let is_reference =
                node.name == "Id" || node.name.ends_with("Id") && node.name != "QPId";
            assert!(
                !is_reference || ids.contains(&node.text.as_str()),
                "{} {}",
                node.name,
                node.text
            );
            if let Ok(number) = node.text.parse::<f64>() {
                assert!(number.is_finite() && !node.text.contains(['e', 'E']), "{}", node.text);
            }
        }
        let measured = &root.find("MeasuredFeatures").unwrap().children[0];
        let names = measured.names();
        let expected: &[&str] = match kind {
            FeatureType::Plane => &["Location", "Normal", "Form"],
            FeatureType::Line => &["Location", "Direction", "Form"],
            FeatureType::Circle => &["Location", "Normal", "Diameter", "Form"],
            FeatureType::Sphere => &["Location", "Diameter", "Form"],
            FeatureType::Cylinder => &["Axis", "Diameter", "Form"],
            FeatureType::Cone => &["Axis", "Diameter", "FullAngle", "Form"],
            FeatureType::Torus => {
                &["Location", "AxisVector", "MinorDiameter", "MajorDiameter", "Form"]
            }
            FeatureType::EllipticCylinder | FeatureType::Ellipsoid => &[],
        };
        assert_eq!(names, [&["Attributes", "FeatureName"], expected].concat());
        if let Some(Element::Surface(Surface::Cylinder(s))) = fit.surface {
            let diameter = measured.find("Diameter").unwrap();
            assert_eq!(diameter.text.parse(), Ok(2.0 * s.radius));
            let told = fit.uncertainty.as_ref().unwrap().parameters.last().unwrap().standard[0];
            assert_eq!(diameter.attribute("combinedUncertainty").unwrap().parse(), Ok(2.0 * told));
        }
        let measurements = root.find("CharacteristicMeasurements").unwrap();
        assert_eq!(measurements.children.len(), fit.characteristics.len());
        for (node, told) in measurements.children.iter().zip(&fit.characteristics) {
            assert_eq!(node.find("Value").unwrap().text.parse().ok(), told.measured);
            let status = match told.verdict {
                Verdict::Conform => "PASS",
                Verdict::NotConform => "FAIL",
                Verdict::Undecided => "INDETERMINATE",
            };
            assert_eq!(node.find("CharacteristicStatusEnum").unwrap().text, status);
        }
        assert!(text.contains("value=\"a &quot;b&quot; &lt;c&gt; &amp; d\""));
    }
}

#[test]
fn dmis_output_has_the_feature_and_its_tolerances_in_short_lines() {
    for kind in FeatureType::ALL {
        let fit = fit(kind, tolerances(kind));
        let text = String::from_utf8(fit.write(Form::Dmis).unwrap()).unwrap();
        assert!(text.ends_with("ENDFIL\r\n") && text.starts_with("DMISMN/"), "{text}");
        let is_short = |line: &str| line.len() <= 80 || line.starts_with("$$");
        assert!(text.lines().all(is_short), "{text}");
        let joined = text.replace("$\r\n", "");
        let feature = joined.lines().find(|line| line.starts_with("FA(")).unwrap();
        let (_, told) = feature.split_once("=FEAT/").unwrap();
        let numbers: Vec<f64> = told.split(',').filter_map(|part| part.parse().ok()).collect();
        let expected = match fit.surface.unwrap() {
            Element::Surface(Surface::Cylinder(s)) => {
                let (p, d) = (s.axis_point, s.axis_direction);
                vec![p.x, p.y, p.z, d.x, d.y, d.z, 2.0 * s.radius]
            }
            Element::Surface(Surface::Sphere(s)) => {
                vec![s.center.x, s.center.y, s.center.z, 2.0 * s.radius]
            }
            Element::Surface(Surface::Cone(s)) => {
                let (p, d) = (s.apex, s.axis_direction);
                vec![p.x, p.y, p.z, d.x, d.y, d.z, 2.0 * s.half_angle.to_degrees()]
            }
            _ => numbers.clone(),
        };
        assert_eq!(numbers, expected, "{feature}");
        let decided = fit.characteristics.iter().filter(|c| c.verdict != Verdict::Undecided);
        let lines = joined.lines().filter(|line| line.starts_with("TA(")).count();
        assert_eq!(lines, decided.count());
        let undecided = fit.characteristics.iter().any(|c| c.verdict == Verdict::Undecided);
        assert_eq!(joined.contains("undecided by ISO 14253-1"), undecided);
    }
}

#[test]
fn the_table_has_one_line_a_quantity_and_no_formula() {
    let fit = fit(FeatureType::Cylinder, tolerances(FeatureType::Cylinder));
    let text = String::from_utf8(fit.write(Form::Characteristics).unwrap()).unwrap();
    let lines: Vec<&str> = text.lines().collect();
    assert_eq!(lines.len(), 3);
    assert!(lines[1].starts_with("\"a \"\"b\"\" <c> & d\",'=1+1,"), "{}", lines[1]);
    let columns: Vec<&str> = lines[0].split(',').collect();
    let cells: Vec<&str> = lines[1].rsplit(',').collect();
    let cell = |name: &str| {
        let from_end = columns.len() - 1 - columns.iter().position(|c| *c == name).unwrap();
        cells[from_end]
    };
    let told = &fit.characteristics[0];
    assert_eq!(cell("characteristic"), "diameter");
    assert_eq!(cell("measured").parse().ok(), told.measured);
    assert_eq!(cell("expanded_uncertainty").parse().ok(), told.expanded);
    assert_eq!((cell("verdict"), cell("unit")), ("conform", "mm"));
    assert_eq!(cell("upper_limit"), "20.5");
}

#[test]
fn what_a_fit_is_not_written_as_is_refused() {
    let fit = fit(FeatureType::Plane, &[]);
    for form in Form::ALL {
        let is_known = FitDocument::FORMS.contains(&form);
        assert_eq!(fit.write(form).is_ok(), is_known, "{form:?}");
    }
    assert_eq!(FitDocument::form_from_extension("CSV"), Some(Form::Characteristics));
    assert_eq!(FitDocument::form_from_extension("step"), None);
    let qif = String::from_utf8(fit.write(Form::Qif).unwrap()).unwrap();
    assert!(!qif.contains("Characteristic") && qif.contains("UNDEFINED"));
}
