use std::sync::Arc;

use super::fits::region_fits;
use super::{Document, Input, MeshInput, MeshPoints, Request, Timing, UnassignedPoints};
use crate::{
    formats::Fields,
    geometry::{LengthUnit, Mesh, PointCloud},
    model::relations::Relations,
    segment::{Segmentation, Warning, resolution},
};

/// A result, and the cloud it is about.
#[derive(Clone, Debug, PartialEq)]
pub struct Answer {
    /// The result, with its labels.
    pub document: Document,
    /// The points.
    pub cloud: Arc<PointCloud>,
    /// The file's own columns, where the form of the result has room for them.
    pub fields: Fields,
    /// What the cloud is called, where that is known.
    pub name: Option<String>,
}

impl Answer {
    /// What `found` in `cloud` tells, with the relations between its regions; `sha256` and `format` are those of the
    /// bytes the cloud came in.
    pub fn new(
        cloud: Arc<PointCloud>,
        mut found: Segmentation,
        request: &Request,
        (sha256, format): (String, &str),
        timing: Timing,
    ) -> Self {
        let input = Input {
            points: cloud.input_len,
            sha256,
            format: format.to_owned(),
            skipped: cloud.skipped(),
            unit: request.unit.or(cloud.unit),
            resolution: resolution_of(&cloud, &found),
            mesh: cloud.mesh.as_deref().map(mesh_told),
        };
        found.warnings.extend(warnings(&cloud, request.unit));
        let document = document(&cloud, found, request, input, timing);
        Self { document, cloud, fields: Fields::default(), name: request.name.clone() }
    }

    /// The label of each stored point of the cloud; -1 = unassigned, or labels that were left out.
    pub fn stored_labels(&self) -> Vec<i32> {
        let labels = self.document.labels();
        match &self.cloud.input_index {
            Some(index) => {
                index.iter().map(|at| labels.get(*at as usize).copied().unwrap_or(-1)).collect()
            }
            None => labels.to_vec(),
        }
    }
}

/// What is told of a mesh.
pub fn mesh_told(mesh: &Mesh) -> MeshInput {
    let samples = mesh.samples.as_ref();
    MeshInput {
        points: samples.map_or(MeshPoints::Vertices, |_| MeshPoints::Samples),
        vertices: mesh.vertices,
        faces: mesh.faces,
        spacing: samples.map(|samples| samples.spacing),
        chord_error: samples.map(|samples| samples.chord_error),
    }
}

/// The step of each coordinate, as it was seen or is known.
fn resolution_of(cloud: &PointCloud, found: &Segmentation) -> [f64; 3] {
    found.sampling.map_or_else(|| resolution(cloud), |sampling| sampling.steps)
}

/// What of the file limits the answer, or was decided about it.
fn warnings(cloud: &PointCloud, unit: Option<LengthUnit>) -> Vec<Warning> {
    let mut warnings = Vec::new();
    let mut warn = |code: &str, message| warnings.push(Warning { code: code.to_owned(), message });
    if cloud.holes_at_origin > 0 {
        let n = cloud.holes_at_origin;
        warn("holes_at_origin", format!("{n} points at exactly 0, 0, 0 are taken for holes"));
    }
    if let (Some(given), Some(stated)) = (unit, cloud.unit)
        && given != stated
    {
        warn(
            "unit_differs",
            format!(
                "the file states its lengths in {stated}; they are labelled {given}, as asked, and not converted"
            ),
        );
    }
    warnings
}

fn document(
    cloud: &PointCloud,
    found: Segmentation,
    request: &Request,
    input: Input,
    timing: Timing,
) -> Document {
    let face_labels = cloud.samples().map(|samples| samples.face_labels(&found.labels));
    let mut regions = found.regions;
    let mut relations = Relations::of(&regions);
    let snapping = if request.snap { relations.snap(&mut regions) } else { None };
    let fits = request
        .association
        .map(|association| region_fits(cloud, &found.labels, &regions, association, &input));
    let relation_scatter = relations.scatter;
    let (relations, measures) = relations.told();
    let reasons = found.unassigned.reasons.into_iter().map(|(why, n)| (why.to_owned(), n));
    let skipped = (input.skipped > 0).then(|| ("not_finite".to_owned(), input.skipped));
    Document {
        conicoid: env!("CARGO_PKG_VERSION").to_owned(),
        unassigned: UnassignedPoints {
            count: found.unassigned.count + input.skipped,
            reasons: reasons.chain(skipped).collect(),
        },
        input,
        parameters: found.parameters,
        regions,
        labels: Some(cloud.labels_in_input_order(found.labels)),
        face_labels,
        sampling: found.sampling,
        warnings: found.warnings,
        relations,
        relation_scatter,
        measures,
        snapping,
        hints: found.hints,
        fits: fits.unwrap_or_default(),
        counters: found.counters,
        timing,
    }
}
