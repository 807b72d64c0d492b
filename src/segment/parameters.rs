use serde::{Deserialize, Serialize};

use crate::geometry::SurfaceType;

/// Which policies the pipeline runs with.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, utoipa::ToSchema)]
#[serde(rename_all = "lowercase")]
pub enum Method {
    /// Orthogonal distance: hypotheses, selection by description length, relabelling.
    Distance,
    /// The seed's: growth on the scatter matrix's reciprocal condition number, algebraic extraction.
    Rcond,
}

/// Every parameter of a segmentation. Lengths are in the input's unit, angles in radians.
///
/// `PARAMETERS` holds each one's name, unit, range and meaning; all transports read that table.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct Parameters {
    /// Which policies to run with.
    pub method: Method,
    /// Largest distance of a point from its surface; four noise sigmas when absent. No region has a point
    /// beyond it.
    pub tolerance: Option<f64>,
    /// Standard deviation of the points' noise; estimated from the cloud when absent. No region is
    /// reported whose residuals' root mean square is above twice the value given, or above half the
    /// tolerance where one is given that allows more. What is below 5e-8 of the cloud's size, the rounding
    /// of single precision, counts as that.
    pub noise_sigma: Option<f64>,
    /// The types looked for.
    pub surfaces: Vec<SurfaceType>,
    /// Smallest number of points a region may have.
    pub min_points: usize,
    /// Largest number of regions reported.
    pub max_regions: usize,
    /// Largest gap inside one piece of a surface: wider ones part it into regions; none does when absent.
    pub connectivity: Option<f64>,
    /// Smallest radius or semi-axis looked for.
    pub min_radius: Option<f64>,
    /// Largest radius or semi-axis looked for.
    pub max_radius: Option<f64>,
    /// Direction the axes (or plane normals) must have.
    pub axis_direction: Option<[f64; 3]>,
    /// Largest angle between an axis and `axis_direction`.
    pub axis_tolerance: f64,
    /// Seed of the random generator.
    pub seed: u64,
    /// How many seeds in a row may fail before growth stops.
    pub max_failed_seeds: usize,
    /// Whether pieces of one surface are joined.
    pub merge: bool,
    /// Whether boundaries and surfaces are refined at the end.
    pub refine: bool,
    /// `rcond` only: a point joins while rcond(S) stays below this. 1-norm, raw coordinates.
    pub rcond_threshold: f64,
    /// `rcond` only: largest algebraic residual |x.a| (a10 = 1) of an extracted point.
    pub algebraic_threshold: f64,
}

impl Default for Parameters {
    fn default() -> Self {
        Self {
            method: Method::Distance,
            tolerance: None,
            noise_sigma: None,
            surfaces: SurfaceType::DEFAULT.to_vec(),
            min_points: 50,
            max_regions: 10_000,
            connectivity: None,
            min_radius: None,
            max_radius: None,
            axis_direction: None,
            axis_tolerance: 0.05,
            seed: 0,
            max_failed_seeds: 50,
            merge: true,
            refine: true,
            rcond_threshold: 0.5e-19,
            algebraic_threshold: 5e-5,
        }
    }
}

/// What kind of value a parameter takes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ParameterKind {
    /// One of these words.
    Choice(&'static [&'static str]),
    /// A comma-separated list of these words.
    List(&'static [&'static str]),
    /// A finite number in `min..=max`; `min` itself is excluded where it is zero.
    Number {
        /// Lower end.
        min: f64,
        /// Upper end.
        max: f64,
    },
    /// A whole number in `min..=max`.
    Integer {
        /// Lower end.
        min: u64,
        /// Upper end.
        max: u64,
    },
    /// `true` or `false`.
    Boolean,
    /// Three comma-separated numbers, not all zero.
    Direction,
    /// Three different comma-separated whole numbers in `1..=max`.
    Columns {
        /// Largest number.
        max: u64,
    },
}

/// One row of the parameter table.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ParameterSpec {
    /// Name in queries, JSON and protobuf; the flag is the same with hyphens.
    pub name: &'static str,
    /// What it takes.
    pub kind: ParameterKind,
    /// Unit, where it has one.
    pub unit: Option<&'static str>,
    /// Default as text; `None` = worked out from the cloud.
    pub default: Option<&'static str>,
    /// One sentence of help.
    pub help: &'static str,
}

const TYPES: &[&str] = &[
    "plane",
    "sphere",
    "cylinder",
    "elliptic_cylinder",
    "cone",
    "ellipsoid",
    "elliptic_paraboloid",
    "hyperbolic_paraboloid",
    "hyperboloid_one_sheet",
    "hyperboloid_two_sheets",
    "parabolic_cylinder",
    "hyperbolic_cylinder",
    "elliptic_cone",
];
const LENGTH: ParameterKind = ParameterKind::Number { min: 0.0, max: 1e12 };

/// Every parameter, in the order of the reference.
pub const PARAMETERS: &[ParameterSpec] = &[
    ParameterSpec {
        name: "method",
        kind: ParameterKind::Choice(&["distance", "rcond"]),
        unit: None,
        default: Some("distance"),
        help: "distance: every surface and boundary by orthogonal distance. rcond: the seed's growth on the scatter matrix's condition. A parameter that is one method's only is not looked at by the other",
    },
    ParameterSpec {
        name: "tolerance",
        kind: LENGTH,
        unit: Some("length"),
        default: None,
        help: "distance only: largest distance of a point from its surface (four noise sigmas when absent); no region has a point beyond it",
    },
    ParameterSpec {
        name: "noise_sigma",
        kind: LENGTH,
        unit: Some("length"),
        default: None,
        help: "distance only: standard deviation of the points' noise (estimated from the cloud when absent). No region is reported whose residuals' root mean square is above twice the value given, or above half the tolerance where one is given that allows more",
    },
    ParameterSpec {
        name: "surfaces",
        kind: ParameterKind::List(TYPES),
        unit: None,
        default: Some("plane,sphere,cylinder,elliptic_cylinder,cone,ellipsoid"),
        help: "distance only: the surface types looked for, each for itself: ellipsoid does not stand for sphere, nor elliptic_cylinder for cylinder",
    },
    ParameterSpec {
        name: "min_points",
        kind: ParameterKind::Integer { min: 10, max: 1_000_000_000 },
        unit: Some("points"),
        default: Some("50"),
        help: "Smallest number of points a region may have; below about 30 only clear surfaces are found",
    },
    ParameterSpec {
        name: "max_regions",
        kind: ParameterKind::Integer { min: 1, max: 1_000_000 },
        unit: None,
        default: Some("10000"),
        help: "Largest number of regions reported; the largest ones stay",
    },
    ParameterSpec {
        name: "connectivity",
        kind: LENGTH,
        unit: Some("length"),
        default: None,
        help: "distance only: largest gap inside one piece of a surface: wider ones part it (none does when absent)",
    },
    ParameterSpec {
        name: "min_radius",
        kind: LENGTH,
        unit: Some("length"),
        default: None,
        help: "distance only: smallest radius or semi-axis looked for; at most max_radius",
    },
    ParameterSpec {
        name: "max_radius",
        kind: LENGTH,
        unit: Some("length"),
        default: None,
        help: "distance only: largest radius or semi-axis looked for; at least min_radius",
    },
    ParameterSpec {
        name: "axis_direction",
        kind: ParameterKind::Direction,
        unit: None,
        default: None,
        help: "distance only: direction that axes and plane normals must have, as x,y,z",
    },
    ParameterSpec {
        name: "axis_tolerance",
        kind: ParameterKind::Number { min: 0.0, max: std::f64::consts::FRAC_PI_2 },
        unit: Some("radians"),
        default: Some("0.05"),
        help: "distance only: largest angle between an axis and axis_direction",
    },
    ParameterSpec {
        name: "seed",
        kind: ParameterKind::Integer { min: 0, max: u64::MAX },
        unit: None,
        default: Some("0"),
        help: "Seed of the random generator; the same seed gives the same bytes, timing apart",
    },
    ParameterSpec {
        name: "max_failed_seeds",
        kind: ParameterKind::Integer { min: 1, max: 1_000_000 },
        unit: None,
        default: Some("50"),
        help: "How many seed points in a row may fail before the search stops",
    },
    ParameterSpec {
        name: "merge",
        kind: ParameterKind::Boolean,
        unit: None,
        default: Some("true"),
        help: "Join pieces of one surface into one region",
    },
    ParameterSpec {
        name: "refine",
        kind: ParameterKind::Boolean,
        unit: None,
        default: Some("true"),
        help: "Refine boundaries and surfaces at the end",
    },
    ParameterSpec {
        name: "rcond_threshold",
        kind: ParameterKind::Number { min: 0.0, max: 1.0 },
        unit: None,
        default: Some("0.5e-19"),
        help: "rcond only: a point joins while the 1-norm reciprocal condition number of the scatter matrix, in raw coordinates, stays below this. It depends on the unit and the origin",
    },
    ParameterSpec {
        name: "algebraic_threshold",
        kind: ParameterKind::Number { min: 0.0, max: 1e6 },
        unit: None,
        default: Some("5e-5"),
        help: "rcond only: largest algebraic residual, with a10 = 1, of an extracted point",
    },
];

/// A parameter that is unknown or out of its range.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ParameterError {
    /// No parameter has this name.
    #[error("unknown parameter '{0}'; known ones: {known}", known = names())]
    Unknown(String),
    /// The value is not what the parameter takes.
    #[error("parameter '{name}': '{value}' is not {expected}")]
    Invalid {
        /// The parameter.
        name: &'static str,
        /// What was given.
        value: String,
        /// What it takes, with its range.
        expected: String,
    },
    /// No radius is in the range.
    #[error("parameter 'min_radius': {min} is above 'max_radius': {max}")]
    EmptyRange {
        /// The smallest radius.
        min: f64,
        /// The largest radius.
        max: f64,
    },
}

fn names() -> String {
    PARAMETERS.iter().map(|p| p.name).collect::<Vec<_>>().join(", ")
}

impl std::fmt::Display for ParameterKind {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Choice(words) => write!(f, "one of {}", words.join(", ")),
            Self::List(words) => write!(f, "a comma-separated list of {}", words.join(", ")),
            Self::Number { min, max } if *min == 0.0 => {
                write!(f, "a number above 0 and at most {max}")
            }
            Self::Number { min, max } => write!(f, "a number from {min} to {max}"),
            Self::Integer { min, max } => write!(f, "a whole number from {min} to {max}"),
            Self::Boolean => write!(f, "true or false"),
            Self::Direction => write!(f, "three numbers x,y,z, not all zero"),
            Self::Columns { max } => write!(f, "three different whole numbers from 1 to {max}"),
        }
    }
}

impl Parameters {
    /// Sets one parameter from text, as queries and flags give it.
    ///
    /// # Errors
    /// The name is unknown, or the value is not one the parameter takes, by itself or beside those set
    /// before.
    pub fn set(&mut self, name: &str, value: &str) -> Result<(), ParameterError> {
        let spec = PARAMETERS
            .iter()
            .find(|p| p.name == name)
            .ok_or_else(|| ParameterError::Unknown(name.to_owned()))?;
        let invalid = || ParameterError::Invalid {
            name: spec.name,
            value: value.to_owned(),
            expected: spec.kind.to_string(),
        };
        let text = value.trim();
        let number = || match spec.kind {
            ParameterKind::Number { min, max } => text
                .parse::<f64>()
                .ok()
                .filter(|v| *v <= max && if min == 0.0 { *v > 0.0 } else { *v >= min })
                .ok_or_else(invalid),
            _ => Err(invalid()),
        };
        let integer = || match spec.kind {
            ParameterKind::Integer { min, max } => {
                text.parse::<u64>().ok().filter(|v| (min..=max).contains(v)).ok_or_else(invalid)
            }
            _ => Err(invalid()),
        };
        let boolean = || text.parse::<bool>().map_err(|_| invalid());
        match spec.name {
            "method" => {
                self.method = match text {
                    "distance" => Method::Distance,
                    "rcond" => Method::Rcond,
                    _ => return Err(invalid()),
                }
            }
            "tolerance" => self.tolerance = Some(number()?),
            "noise_sigma" => self.noise_sigma = Some(number()?),
            "surfaces" => {
                let mut types = text
                    .split(',')
                    .map(|t| SurfaceType::from_name(t.trim()).ok_or_else(invalid))
                    .collect::<Result<Vec<_>, _>>()?;
                types.sort();
                types.dedup();
                self.surfaces = types;
            }
            "min_points" => self.min_points = integer()? as usize,
            "max_regions" => self.max_regions = integer()? as usize,
            "connectivity" => self.connectivity = Some(number()?),
            "min_radius" => self.min_radius = Some(number()?),
            "max_radius" => self.max_radius = Some(number()?),
            "axis_direction" => {
                let v = text
                    .split(',')
                    .map(|x| x.trim().parse::<f64>().ok().filter(|x| x.is_finite()))
                    .collect::<Option<Vec<_>>>()
                    .and_then(|v| <[f64; 3]>::try_from(v).ok())
                    .filter(|v| v.iter().any(|x| *x != 0.0))
                    .ok_or_else(invalid)?;
                self.axis_direction = Some(v);
            }
            "axis_tolerance" => self.axis_tolerance = number()?,
            "seed" => self.seed = integer()?,
            "max_failed_seeds" => self.max_failed_seeds = integer()? as usize,
            "merge" => self.merge = boolean()?,
            "refine" => self.refine = boolean()?,
            "rcond_threshold" => self.rcond_threshold = number()?,
            "algebraic_threshold" => self.algebraic_threshold = number()?,
            _ => return Err(ParameterError::Unknown(name.to_owned())),
        }
        self.check_radii()
    }

    fn check_radii(&self) -> Result<(), ParameterError> {
        match (self.min_radius, self.max_radius) {
            (Some(min), Some(max)) if min > max => Err(ParameterError::EmptyRange { min, max }),
            _ => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_row_with_a_default_sets_to_that_default() {
        let mut p = Parameters::default();
        for spec in PARAMETERS {
            if let Some(default) = spec.default {
                p.set(spec.name, default).unwrap_or_else(|e| panic!("{e}"));
            }
        }
        assert_eq!(p, Parameters::default());
    }

    #[test]
    fn the_table_names_every_field() {
        let json = serde_json::to_value(Parameters::default()).unwrap_or_default();
        let mut fields: Vec<_> = json.as_object().into_iter().flat_map(|o| o.keys()).collect();
        let mut rows: Vec<_> = PARAMETERS.iter().map(|p| p.name).collect();
        fields.sort();
        rows.sort();
        assert_eq!(fields, rows);
    }

    #[test]
    fn a_value_out_of_range_is_refused_with_its_range() {
        let error = Parameters::default().set("axis_tolerance", "2").map_err(|e| e.to_string());
        assert_eq!(
            error,
            Err("parameter 'axis_tolerance': '2' is not a number above 0 and at most 1.5707963267948966".into())
        );
        for (name, value) in [
            ("tolerance", "0"),
            ("tolerance", "NaN"),
            ("min_points", "9"),
            ("surfaces", "plane,blob"),
            ("axis_direction", "0,0,0"),
            ("merge", "maybe"),
        ] {
            assert!(Parameters::default().set(name, value).is_err(), "{name}={value}");
        }
    }

    #[test]
    fn a_smallest_radius_above_the_largest_is_refused_whichever_comes_first() {
        let set = |order: [(&str, &str); 2]| {
            let mut p = Parameters::default();
            order.iter().try_for_each(|(name, value)| p.set(name, value))
        };
        let error = Err(ParameterError::EmptyRange { min: 5.0, max: 2.0 });
        assert_eq!(set([("min_radius", "5"), ("max_radius", "2")]), error);
        assert_eq!(set([("max_radius", "2"), ("min_radius", "5")]), error);
        assert_eq!(set([("min_radius", "2"), ("max_radius", "2")]), Ok(()));
    }
}
