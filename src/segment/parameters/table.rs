use super::kind::ParameterKind;
use super::limits::MAX_HINTS;

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
    "torus",
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
        default: Some("plane,sphere,cylinder,elliptic_cylinder,cone,ellipsoid,torus"),
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
    ParameterSpec {
        name: "hints",
        kind: ParameterKind::Hints { max: MAX_HINTS },
        unit: None,
        default: None,
        help: "What you know of places in the cloud: a JSON list of objects, each with a place (at, extent or labels) and a type, radius or axis_direction there, or an action (merge, split, crop), such as [{\"at\": [[1, 2, 3]], \"type\": \"cylinder\", \"radius\": 10}]. What became of each stands in the answer's hints",
    },
];
