//! Results as inspection software takes them: QIF 3.0 Results, DMIS output, and a table of characteristics.

mod characteristics;
mod dmis;
mod qif;
mod xml;

use super::{
    BUILD, Document,
    fits::{Characteristic, FitDocument, PassedThrough, Verdict},
};
use crate::{
    fit::feature::{Element, FeatureType},
    geometry::{LengthUnit, Surface},
    segment::Side,
};

pub use characteristics::characteristics;
pub use dmis::dmis;
pub use qif::qif;

/// What was inspected.
#[derive(Clone, Debug)]
pub struct Inspection {
    /// The program, its version and its build.
    pub program: String,
    /// SHA-256 of the input.
    pub sha256: String,
    /// The unit of lengths, where it is known.
    pub unit: Option<LengthUnit>,
    /// What was passed through.
    pub passed: PassedThrough,
    /// The features.
    pub features: Vec<Found>,
}

/// A feature with what was measured of it.
#[derive(Clone, Debug)]
pub struct Found {
    /// Its name: `region_3`, or the type of the one feature.
    pub name: String,
    /// Its type.
    pub kind: FeatureType,
    /// The feature.
    pub element: Element,
    /// How it is associated with its points.
    pub association: String,
    /// Whether it is a hole; `None` where that is not known.
    pub is_hole: Option<bool>,
    /// Points used.
    pub points: usize,
    /// What was measured: sizes, then the form error.
    pub measured: Vec<Measured>,
}

/// One measured quantity.
#[derive(Clone, Debug)]
pub struct Measured {
    /// Name, as in the result's `characteristics`; `semi_axis_1` and so on of the elliptic types.
    pub name: String,
    /// Value; an angle in radians.
    pub value: f64,
    /// Standard uncertainty, where it is known.
    pub standard: Option<f64>,
    /// Expanded uncertainty, where it is known.
    pub expanded: Option<f64>,
    /// The tolerance and its verdict, where one was given.
    pub toleranced: Option<Characteristic>,
}

impl Measured {
    /// Whether it is an angle.
    pub fn is_angle(&self) -> bool {
        self.name == "full_angle"
    }

    /// The verdict, where there is one.
    pub fn verdict(&self) -> Option<Verdict> {
        Some(self.toleranced.as_ref()?.verdict)
    }
}

fn program(version: &str) -> String {
    format!("conicoid {version} (build {BUILD})")
}

impl From<&FitDocument> for Inspection {
    fn from(fit: &FitDocument) -> Self {
        Self {
            program: program(&fit.conicoid),
            sha256: fit.input.sha256.clone(),
            unit: fit.input.unit,
            passed: fit.passed.clone(),
            features: found(fit, fit.r#type.name().to_owned(), None).into_iter().collect(),
        }
    }
}

impl Inspection {
    /// The features of a segmentation: its fits where there are such, or else the surfaces of its regions.
    pub fn of(document: &Document, name: Option<&str>) -> Self {
        let fit = |region: usize| document.fits.get(region)?.fit.as_ref();
        let features = document.regions.iter().filter_map(|region| {
            let name = format!("region_{}", region.id);
            let is_hole = match region.dimensions.side {
                Some(Side::Hole) => Some(true),
                Some(Side::Boss) => Some(false),
                _ => None,
            };
            if !document.fits.is_empty() {
                return found(fit(region.id)?, name, is_hole);
            }
            let surface = region.surface?;
            let deviation = |name: &str| region.uncertainty.as_ref()?.get(name).cloned();
            let standard = |name: &str, k: usize| {
                let told = deviation(name)?;
                told.as_f64().or_else(|| told.get(k)?.as_f64())
            };
            Some(Found {
                name,
                kind: FeatureType::from_name(region.surface_type.name())?,
                element: Element::Surface(surface),
                association: "gaussian".to_owned(),
                is_hole,
                points: region.point_count,
                measured: sizes(&Element::Surface(surface), |name, k| (standard(name, k), None)),
            })
        });
        Self {
            program: program(&document.conicoid),
            sha256: document.input.sha256.clone(),
            unit: document.input.unit,
            passed: PassedThrough { name: name.map(str::to_owned), ..PassedThrough::default() },
            features: features.collect(),
        }
    }
}

/// The feature of a fit; `None` where the points do not tell it.
fn found(fit: &FitDocument, name: String, is_hole: Option<bool>) -> Option<Found> {
    let element = fit.surface?;
    let known = |parameter: &str, k: usize| {
        let told = fit.uncertainty.as_ref()?.parameters.iter().find(|p| p.name == parameter)?;
        Some((*told.standard.get(k)?, *told.expanded.get(k)?))
    };
    let known = |parameter: &str, k: usize| known(parameter, k).unzip();
    let mut measured = sizes(&element, known);
    measured.push(Measured {
        name: fit.form.characteristic.clone(),
        value: fit.form.minimum_zone.unwrap_or(fit.form.gaussian),
        standard: None,
        expanded: None,
        toleranced: None,
    });
    for one in &mut measured {
        one.toleranced = fit.characteristics.iter().find(|c| c.name == one.name).cloned();
        if let Some(told) = &one.toleranced {
            one.expanded = told.expanded;
        }
    }
    let association = fit.parameters.association.clone();
    Some(Found {
        name,
        kind: fit.r#type,
        element,
        association,
        is_hole,
        points: fit.used,
        measured,
    })
}

/// The sizes of a feature as drawings have them; `known` gives the uncertainties of a parameter's component.
fn sizes(
    element: &Element,
    known: impl Fn(&str, usize) -> (Option<f64>, Option<f64>),
) -> Vec<Measured> {
    let size = |name: &str, value: f64, parameter: &str, k: usize, times: f64| {
        let (standard, expanded) = known(parameter, k);
        Measured {
            name: name.to_owned(),
            value: times * value,
            standard: standard.map(|u| times * u),
            expanded: expanded.map(|u| times * u),
            toleranced: None,
        }
    };
    let axes = |axes: &[f64]| {
        let one = |(k, value): (usize, &f64)| {
            size(&format!("semi_axis_{}", k + 1), *value, "semi_axes", k, 1.0)
        };
        axes.iter().enumerate().map(one).collect()
    };
    match element {
        Element::Line(_) | Element::Surface(Surface::Plane(_)) => Vec::new(),
        Element::Circle(s) => vec![size("diameter", s.radius, "radius", 0, 2.0)],
        Element::Surface(Surface::Sphere(s)) => vec![size("diameter", s.radius, "radius", 0, 2.0)],
        Element::Surface(Surface::Cylinder(s)) => {
            vec![size("diameter", s.radius, "radius", 0, 2.0)]
        }
        Element::Surface(Surface::Cone(s)) => {
            vec![size("full_angle", s.half_angle, "half_angle", 0, 2.0)]
        }
        Element::Surface(Surface::Torus(s)) => vec![
            size("tube_diameter", s.minor_radius, "minor_radius", 0, 2.0),
            size("ring_diameter", s.major_radius, "major_radius", 0, 2.0),
        ],
        Element::Surface(Surface::EllipticCylinder(s)) => axes(&s.semi_axes),
        Element::Surface(Surface::Ellipsoid(s)) => axes(&s.semi_axes),
    }
}

#[cfg(test)]
mod tests;
