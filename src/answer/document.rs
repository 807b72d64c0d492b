use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::fits::RegionFit;
use crate::geometry::LengthUnit;
use crate::model::datum::DatumSystem;
use crate::model::relations::{Measure, Relation, Snapping};
use crate::segment::{Counters, HintOutcome, Parameters, Region, Sampling, Warning};

/// The result of a segmentation, as it is told.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Document {
    /// Version of the program that made it.
    #[schema(example = "0.1.0")]
    pub conicoid: String,
    /// Which sources it was built of: a digest of them. Absent from results that earlier versions kept.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    #[schema(example = "8c2f0a4be1d94c57a3f6e0b1920d7c4e")]
    pub build: String,
    /// What the input was.
    pub input: Input,
    /// Every parameter as used, `tolerance` and `noise_sigma` resolved.
    pub parameters: Parameters,
    /// The surfaces; a region's id is its place here. Their order means nothing, but is the same for the
    /// same cloud and parameters.
    pub regions: Vec<Region>,
    /// One label for each input point, in input order, or for each sample of a mesh; -1 = unassigned. Absent with `labels=none`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub labels: Option<Vec<i32>>,
    /// One label for each face of a mesh that was sampled, in the file's order: that of most of its samples; -1 =
    /// unassigned, or without an area. Absent for other clouds, and with `labels=none`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub face_labels: Option<Vec<i32>>,
    /// The points without a region, skipped ones included.
    pub unassigned: UnassignedPoints,
    /// How the points lie beside each other. Absent under `rcond`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sampling: Option<Sampling>,
    /// What of the input limits the answer; absent where nothing does.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub warnings: Vec<Warning>,
    /// What holds between the surfaces: directions, axes and sizes that they have in common, smooth joints, patterns.
    /// Between the 400 largest at most, and those whose uncertainty is known.
    #[serde(default)]
    pub relations: Vec<Relation>,
    /// By how much the surfaces stand off from where their relations would have them, beyond what the uncertainty of their
    /// measurement explains: how exactly the part was made, in the input's unit. It counts as part of every surface's
    /// uncertainty in `relations`, `measures` and `snapped`. 0 where the measurement explains all.
    #[serde(default)]
    pub relation_scatter: f64,
    /// Distances of parallel surfaces from the next, and angles of touching ones.
    #[serde(default)]
    pub measures: Vec<Measure>,
    /// What it took to make all accepted relations hold exactly; with `snap` alone.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub snapping: Option<Snapping>,
    /// What became of each hint, in their order; absent where none was given.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub hints: Vec<HintOutcome>,
    /// The feature of each region by the association asked for; with `association` alone.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub fits: Vec<RegionFit>,
    /// The coordinate system of the datums asked for; with `datums` alone.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub datum_system: Option<DatumSystem>,
    /// How much work the method did.
    pub counters: Counters,
    /// How long the steps took: the one part that differs between two runs.
    pub timing: Timing,
}

/// What the input was.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Input {
    /// Points in the file, skipped ones included; samples where a mesh was sampled.
    pub points: usize,
    /// SHA-256 of the file's bytes, in hexadecimal.
    pub sha256: String,
    /// The format the file was read as.
    #[schema(example = "ply")]
    pub format: String,
    /// Points left out because a coordinate was not finite, or because they are holes: marked so in the file, or many at
    /// exactly 0, 0, 0.
    pub skipped: usize,
    /// The unit of all lengths: the parameter `unit`, or else the one that the file states. Absent where neither does.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub unit: Option<LengthUnit>,
    /// The step in which the coordinates x, y and z come: that of their decimals, of single precision at their size, or of
    /// the file before a pose was applied. No surface is known better than its points are. 0 where there is none to be
    /// seen, and where it is that of any double.
    #[serde(default)]
    pub resolution: [f64; 3],
    /// The mesh, where the file is one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mesh: Option<MeshInput>,
    /// How the points were thinned; absent where all were used.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub thin: Option<ThinInput>,
}

/// What was kept of a cloud that was thinned.
///
/// `labels`, `point_count` and `unassigned` are about all points of the input, each with the label of the kept point nearest
/// to it; everything else is about those kept: `fit`, uncertainties, `sampling` and what `min_points` counts.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct ThinInput {
    /// The least distance of kept points from each other: the parameter `thin`.
    pub length: f64,
    /// How many of the points were kept.
    pub kept: usize,
}

/// A mesh, and what was taken of it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct MeshInput {
    /// What the points are.
    pub points: MeshPoints,
    /// Vertices of the file, those of a STL file each once.
    pub vertices: usize,
    /// Faces of the file.
    pub faces: usize,
    /// Distance of a sample from the next, were they on squares; of samples alone.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub spacing: Option<f64>,
    /// The largest distance found of the curved surfaces from the flat faces that stand for them, but for a few. Samples
    /// scatter by a fifth of it; of samples alone.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub chord_error: Option<f64>,
}

/// What the points of a mesh are.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum MeshPoints {
    /// Its vertices.
    Vertices,
    /// Samples of the surface that its faces stand for.
    Samples,
}

/// Points without a region.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct UnassignedPoints {
    /// How many.
    pub count: usize,
    /// How many for each reason: `outlier` (alone, within a volume, or further from every surface than the
    /// tolerance), `too_small` (a patch of fewer than `min_points`), `no_quadric` (a surface of another
    /// type than those looked for, or outside the constraints, or with residuals beyond the noise given; with
    /// `rcond` all), `not_examined` (the work on the cloud came to its bound before), `over_max_regions` (of a
    /// region beyond the largest `max_regions`), `duplicate` (a further copy of a point that another reason
    /// counts), `not_finite` (a coordinate is NaN or infinite), `outside`
    /// (left out by the hints that crop). More may come. Above 50 000 points without
    /// a region the shares of the first three are estimated.
    pub reasons: BTreeMap<String, usize>,
}

/// How long the steps took, in seconds.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Timing {
    /// Reading the cloud.
    pub parse: f64,
    /// Each stage of the method, by its name.
    pub stages: BTreeMap<String, f64>,
    /// Reading and segmenting together.
    pub total: f64,
}

impl Document {
    /// The document with its labels or without.
    pub fn shown(self, labels: bool) -> Self {
        let face_labels = self.face_labels.filter(|_| labels);
        Self { labels: self.labels.filter(|_| labels), face_labels, ..self }
    }

    /// The labels, none where they were left out.
    pub fn labels(&self) -> &[i32] {
        self.labels.as_deref().unwrap_or_default()
    }
}
