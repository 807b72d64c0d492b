use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::Parameters;
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
}

/// One surface and its points.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct Region {
    /// The label of its points.
    pub id: usize,
    /// The surface's type.
    #[serde(rename = "type")]
    pub surface_type: SurfaceType,
    /// How many points carry its label.
    pub point_count: usize,
    /// a1..a10 in the seed's order (1).
    pub coefficients: [f64; 10],
    /// How the coefficients are scaled.
    pub coefficients_scale: Scale,
    /// The surface in engineering terms; absent for the quadrics that have none here.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub surface: Option<Surface>,
    /// Standard deviation of each engineering parameter, by its name, and `covariance`.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(value_type = Option<Object>)]
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
}

/// Distances of a region's points from its surface, in the input's unit.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct Fit {
    /// Root mean square.
    pub rms: f64,
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

/// Where a region lies.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct Extent {
    /// Smallest coordinates of its points.
    pub min: [f64; 3],
    /// Largest coordinates of its points.
    pub max: [f64; 3],
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
