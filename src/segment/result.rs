use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::{Dimensions, Extent, HintOutcome, Parameters};
use crate::geometry::{Scale, Surface, SurfaceType};

/// What a segmentation found.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Segmentation {
    /// Every parameter as used, `tolerance` and `noise_sigma` resolved.
    pub parameters: Parameters,
    /// The regions; a region's id is its place here.
    pub regions: Vec<Region>,
    /// One label for each stored point of the cloud, in its order; -1 = unassigned.
    #[serde(skip)]
    pub labels: Vec<i32>,
    /// The points without a region, and why.
    pub unassigned: Unassigned,
    /// How much work the method did.
    pub counters: Counters,
    /// How the points lie beside each other; none under `rcond`.
    pub sampling: Option<Sampling>,
    /// What of the input limits the answer.
    pub warnings: Vec<Warning>,
    /// What became of each hint, in their order.
    pub hints: Vec<HintOutcome>,
}

/// How a cloud was sampled.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct Sampling {
    /// How points lie beside each other.
    pub kind: SamplingKind,
    /// Median distance of a point from the nearest one, in the input's unit: along a scan line where points lie on
    /// some. 0 where there are no two points.
    pub along: f64,
    /// Median distance from the nearest one about at right angles to that: to the next line. 0 where there is none.
    pub across: f64,
    /// The step in which each coordinate comes (decimals, voxels, single precision at the size of the coordinates); 0
    /// where it comes in none.
    pub steps: [f64; 3],
}

/// How points lie beside each other.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, utoipa::ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum SamplingKind {
    /// In no order.
    Scattered,
    /// On lines, much closer along these than across.
    ScanLines,
    /// On lines in two directions.
    Grid,
    /// At the places of a lattice along the axes, as voxels are.
    Lattice,
}

/// Something of the input that limits the answer.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct Warning {
    /// What it is: `rows_apart`, `coordinate_steps`, `noise_above_spacing`, `holes_at_origin`, `unit_differs`. More may
    /// come.
    pub code: String,
    /// The same in words, with the lengths in question.
    pub message: String,
}

/// One surface and its points.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct Region {
    /// The label of its points.
    pub id: usize,
    /// The surface's type, the simplest that the points do not speak against.
    #[serde(rename = "type")]
    pub surface_type: SurfaceType,
    /// How many points carry its label.
    pub point_count: usize,
    /// a1..a10 in the seed's order (1), about the file's origin. Far from it their terms cancel: where
    /// `coefficients_error` is not small against what matters, reckon with `local_coefficients`. null for a
    /// torus, which is no quadric; so are the other fields of the coefficients.
    pub coefficients: Option<[f64; 10]>,
    /// How the coefficients are scaled.
    pub coefficients_scale: Option<Scale>,
    /// How far off `coefficients` are as written, as a length: the largest difference, over the region's
    /// points, between the distance |Q| / |grad Q| by them and by `local_coefficients`, reckoned term
    /// by term in double precision. null where it is infinite or where the gradient vanishes at all points.
    pub coefficients_error: Option<f64>,
    /// An origin near the region's points: the middle of its box, rounded to few decimal digits, which read
    /// back as the same number. A point x of the file is x - local_origin in the local equation.
    pub local_origin: [f64; 3],
    /// a1..a10 about `local_origin`: the surface with no digits lost, however far the cloud lies from the
    /// file's origin. Scaled so that the gradient's root mean square over the region's points is 1: the
    /// value at a point near the surface is about its distance from it. Of unit length where the gradient
    /// vanishes at all points.
    pub local_coefficients: Option<[f64; 10]>,
    /// The surface in engineering terms; absent for the quadrics that have none here.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub surface: Option<Surface>,
    /// Ends, lengths, diameters and outlines.
    #[serde(flatten)]
    pub dimensions: Dimensions,
    /// How exactly the surface's parameters are known; absent where that is not known. In the form of
    /// [`Uncertainty`].
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(value_type = Option<Uncertainty>)]
    pub uncertainty: Option<serde_json::Value>,
    /// How well the points fit.
    pub fit: Fit,
    /// Why this type.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub evidence: Option<Evidence>,
    /// How far the region reaches.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub extent: Option<Extent>,
    /// The regions it touches.
    pub neighbours: Vec<Neighbour>,
    /// The surface for which the accepted relations hold exactly; with `snap` alone. Its own where that is related to no
    /// other.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub snapped: Option<Snapped>,
}

/// A region's surface after all surfaces were moved, as little as their uncertainties allow, to where the accepted relations
/// hold exactly.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct Snapped {
    /// The surface in engineering terms.
    pub surface: Surface,
    /// a1..a10 about the file's origin. null for a torus; so are the other fields of the coefficients.
    pub coefficients: Option<[f64; 10]>,
    /// How the coefficients are scaled.
    pub coefficients_scale: Option<Scale>,
    /// a1..a10 about the region's `local_origin`, on the scale of its own `local_coefficients`.
    pub local_coefficients: Option<[f64; 10]>,
    /// By how many of its standard uncertainties the parameter moved that moved by the most of them.
    pub moved: f64,
    /// Probability of so large a movement of all its parameters, or a larger one, if the surface as it is now is the true
    /// one.
    pub p_value: f64,
}

/// How exactly the parameters of a surface are known: the standard deviation of each, under its name.
///
/// A point has one for each coordinate. A direction has one alone, the angle in radians by which it may
/// be off.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct Uncertainty {
    /// Of a plane's point. It is the one beside the points' centroid, so it does not vary within the plane.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub point: Option<[f64; 3]>,
    /// Of a plane's normal, in radians.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub normal: Option<f64>,
    /// Of a centre.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub center: Option<[f64; 3]>,
    /// Of an axis' point. It is the one beside the points' centroid, so it does not vary along the axis.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub axis_point: Option<[f64; 3]>,
    /// Of a cone's apex.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub apex: Option<[f64; 3]>,
    /// Of an axis' direction, in radians.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub axis_direction: Option<f64>,
    /// Of a radius.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub radius: Option<f64>,
    /// Of a torus' radius about its axis.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub major_radius: Option<f64>,
    /// Of the radius of a torus' tube.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub minor_radius: Option<f64>,
    /// Of a cone's half angle, in radians.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub half_angle: Option<f64>,
    /// Of each semi-axis.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub semi_axes: Option<Vec<f64>>,
    /// Of each semi-axis' direction, in radians.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub semi_axis_directions: Option<Vec<f64>>,
    /// Of the ends, along the axis or a torus' tube.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ends: Option<[f64; 2]>,
    /// Of the length between the ends.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub length: Option<f64>,
    /// Of a torus' arc, in radians.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub arc_angle: Option<f64>,
    /// Of a diameter.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub diameter: Option<f64>,
    /// Of each diameter.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub diameters: Option<Vec<f64>>,
    /// The parameters whose components are the rows of `covariance`, in their order; each has the
    /// components it has in the surface, directions x, y and z.
    pub covariance_of: Vec<String>,
    /// Covariance matrix of the components of all parameters.
    pub covariance: Vec<Vec<f64>>,
    /// False where the points do not tell a parameter: a radius, semi-axis or angle less than three
    /// standard deviations from zero, a direction known to no better than a third of a radian.
    pub identifiable: bool,
    /// The parameters that the points do not tell; absent where they tell all.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub not_identifiable: Option<Vec<String>>,
}

/// Distances of a region's points from its surface, in the input's unit.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct Fit {
    /// Root mean square.
    pub rms: f64,
    /// The noise of this region's points: 1.4826 times the median distance, which a few outliers don't change.
    #[serde(default)]
    pub noise: f64,
    /// Largest.
    pub max: f64,
    /// Points the final fit used.
    pub used: usize,
    /// Points of the region that the final fit left out.
    pub rejected: usize,
}

/// How sure the choice of the type is.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct Evidence {
    /// The next best type.
    pub runner_up: SurfaceType,
    /// How much larger its Bayesian information criterion is (natural units).
    pub delta_bic: f64,
}

/// How two surfaces meet.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, utoipa::ToSchema)]
pub enum Continuity {
    /// They meet at an edge.
    G0,
    /// They share their tangent planes along the joint.
    G1,
}

/// A region that touches another.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct Neighbour {
    /// The other region's id.
    pub region: usize,
    /// The class of the joint.
    pub continuity: Continuity,
    /// How far from the true joint the boundary may lie, in the input's unit.
    pub resolution: f64,
}

/// Points without a region.
#[derive(Clone, Debug, Default, PartialEq, Serialize, utoipa::ToSchema)]
pub struct Unassigned {
    /// How many.
    pub count: usize,
    /// How many for each reason.
    pub reasons: BTreeMap<&'static str, usize>,
}

/// How much work the method did.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct Counters {
    /// Seeds tried.
    pub trials: usize,
    /// Seeds that led to no region.
    pub failed_trials: usize,
    /// Regions joined to another.
    pub merges: usize,
    /// `rcond` only: points added in each extraction cycle, one list a region.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub extraction_cycles: Vec<Vec<usize>>,
    /// `rcond` only: how often each reseeding strategy went on, in the seed's order.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub strategies: Option<[usize; 3]>,
}
