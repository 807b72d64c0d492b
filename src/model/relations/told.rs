//! Relations as they are told.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// What surfaces have to do with each other.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize, ToSchema,
)]
#[serde(rename_all = "snake_case")]
pub enum RelationKind {
    /// Planes or axes are parallel, or axes to planes.
    Parallel,
    /// Planes or axes are perpendicular, or axes to planes.
    Perpendicular,
    /// Axes are one line; the centre of a sphere or an ellipsoid lies on it.
    Coaxial,
    /// Planes are one.
    Coplanar,
    /// Centres of spheres, ellipsoids and tori are one.
    Concentric,
    /// Radii of cylinders and spheres, and those of the tubes of tori, are equal.
    EqualRadius,
    /// Radii of tori about their axes are equal.
    EqualMajorRadius,
    /// Half angles of cones are equal.
    EqualAngle,
    /// All semi-axes of elliptic cylinders, or of ellipsoids, are equal.
    EqualSemiAxes,
    /// Two surfaces share their tangent planes where they meet (G1).
    Tangent,
    /// Pairs, one after the other in `regions`, are mirrored by one plane; a region that lies in the mirror is its own
    /// partner.
    Symmetric,
    /// Parallel axes, or centres, stand evenly on a circle.
    CirclePattern,
    /// They stand evenly in rows: in one, or in several at right angles.
    GridPattern,
}

/// Something that holds between surfaces of a result.
///
/// Lengths are in the input's unit, angles in radians.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Relation {
    /// What it is.
    pub kind: RelationKind,
    /// The regions that it holds between: among all of them, or, where `to` names others, between each of them and each
    /// of those.
    pub regions: Vec<usize>,
    /// The regions on its other side; absent where there is none.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub to: Vec<usize>,
    /// How far the surfaces as fitted are from it: the angle between directions, the distance of axes, planes or centres,
    /// the difference of radii or angles, the gap of a joint. Of several regions, the largest deviation, in standard
    /// uncertainties, of one from what the others tell.
    pub deviation: f64,
    /// Standard uncertainty of `deviation`, from the covariances of the surfaces.
    pub uncertainty: f64,
    /// Probability of deviations as large as those found, or larger, if the relation holds exactly.
    pub p_value: f64,
    /// Natural logarithm of the odds that it holds exactly against that the deviation may be anything, after all that the
    /// other surfaces tell about how common such relations are here. Of several regions, the weakest.
    pub log_odds: f64,
    /// Whether it is accepted: the deviation is compatible with it, and so much smaller than what chance brings about that
    /// the odds are above ten to one.
    pub accepted: bool,
    /// The direction that parallel surfaces have in common, of the common axis, across the mirror, or across a pattern.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub direction: Option<[f64; 3]>,
    /// A point of the common axis or plane or of the mirror; the common centre; the middle of a circle pattern, the first
    /// place of a grid pattern.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub point: Option<[f64; 3]>,
    /// The common radius or half angle; the pitch radius of a circle pattern.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub value: Option<f64>,
    /// Circle pattern: how many places a full circle has. Of these `regions` may miss some.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub count: Option<usize>,
    /// Circle pattern: the angle from one place to the next.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub spacing: Option<f64>,
    /// Grid pattern: how many places in each direction; 1 in the second of a single row.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub counts: Option<[usize; 2]>,
    /// Grid pattern: distance from one place to the next in each direction; 0 in the second of a single row.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pitches: Option<[f64; 2]>,
    /// Grid pattern: the unit directions.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub grid_directions: Option<[[f64; 3]; 2]>,
}

impl Relation {
    /// A relation of that kind with nothing else known.
    pub(super) fn new(kind: RelationKind, regions: Vec<usize>) -> Self {
        Self {
            kind,
            regions,
            to: Vec::new(),
            deviation: 0.0,
            uncertainty: 0.0,
            p_value: 1.0,
            log_odds: 0.0,
            accepted: true,
            direction: None,
            point: None,
            value: None,
            count: None,
            spacing: None,
            counts: None,
            pitches: None,
            grid_directions: None,
        }
    }
}

/// A distance or an angle between two regions.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Measure {
    /// What is measured.
    pub kind: MeasureKind,
    /// The regions.
    pub regions: [usize; 2],
    /// The distance, in the input's unit, or the angle, in radians from 0 to pi/2.
    pub value: f64,
    /// Its standard uncertainty.
    pub uncertainty: f64,
}

/// What is measured between two regions.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum MeasureKind {
    /// Distance of two parallel planes, or of two parallel axes.
    Distance,
    /// Angle between two planes, between two axes, or between an axis and a plane.
    Angle,
}

/// What it took to make all accepted relations hold exactly.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Snapping {
    /// Chi-squared by which the surfaces moved, in units of their covariances.
    pub chi2: f64,
    /// How many independent equations the accepted relations are.
    pub freedom: usize,
    /// Probability of so large a chi-squared, or a larger one, if all accepted relations hold exactly.
    pub p_value: f64,
}
