use std::{sync::Arc, time::Instant};

use sha2::{Digest, Sha256};

use super::{
    Document, Input, MeshInput, MeshPoints, Request, ServiceError, Timing, UnassignedPoints,
};
use crate::{
    formats::{self, Fields, Format, Hints, Limits, Watched},
    geometry::{Mesh, PointCloud},
    jobs::{Control, trace},
    model::relations::Relations,
    segment::{Segmentation, segment},
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

/// Reads the cloud in `bytes` and segments it: the one way from input to result.
///
/// Runs on the calling thread's rayon pool until done or until `control` stops it.
///
/// # Errors
/// The cloud cannot be read, is too small or too large, or `control` stopped the run.
pub fn compute(
    bytes: &[u8],
    request: &Request,
    limits: &Limits,
    control: &Control,
) -> Result<Answer, ServiceError> {
    if let Some(stop) = control.stop() {
        return Err(stop.into());
    }
    let begin = Instant::now();
    let format = request.format.or_else(|| Format::detect(bytes));
    trace::note(|facts| {
        (facts.format, facts.bytes) = (format.map(Format::name), Some(bytes.len()))
    });
    let stopped = || control.stop().is_some();
    let watched = Watched { limits: *limits, stopped: &stopped };
    // a run that was stopped says so, wherever it was
    let told = |error: ServiceError| control.stop().map_or(error, ServiceError::from);
    let run = || {
        let cloud = trace::step("parse")
            .in_scope(|| formats::read(bytes, Hints { format, ..request.hints() }, &watched))
            .map_err(|e| told(named_otherwise(e.into(), request.format, bytes)))?;
        let parse = begin.elapsed().as_secs_f64();
        let span = trace::step("segment");
        let found = span.in_scope(|| segment(&cloud, &request.parameters, control));
        found.map(|found| (cloud, found, parse, span)).map_err(|e| told(e.into()))
    };
    // the digest takes as long as a good part of the run, and one thread
    let (done, sha256) = rayon::join(run, || sha256_unless(bytes, stopped));
    let (cloud, found, parse, span) = done?;
    let timing = Timing { parse, stages: control.finish(), total: begin.elapsed().as_secs_f64() };
    describe(&span, &cloud, &found, &timing);
    trace::note(|facts| {
        (facts.points, facts.regions) = (Some(cloud.input_len), Some(found.regions.len()));
    });
    metrics::counter!("conicoid_points_total").increment(cloud.input_len as u64);
    let input = Input {
        points: cloud.input_len,
        sha256,
        format: format.map(Format::name).unwrap_or_default().to_owned(),
        skipped: cloud.skipped(),
        mesh: cloud.mesh.as_deref().map(mesh),
    };
    let document = document(&cloud, found, request.snap, input, timing);
    Ok(Answer {
        document,
        cloud: Arc::new(cloud),
        fields: Fields::default(),
        name: request.name.clone(),
    })
}

/// What is told of a mesh.
fn mesh(mesh: &Mesh) -> MeshInput {
    let samples = mesh.samples.as_ref();
    MeshInput {
        points: samples.map_or(MeshPoints::Vertices, |_| MeshPoints::Samples),
        vertices: mesh.vertices,
        faces: mesh.faces,
        spacing: samples.map(|samples| samples.spacing),
        chord_error: samples.map(|samples| samples.chord_error),
    }
}

/// An error of reading, which says so where the bytes look like another format than the one that was named.
fn named_otherwise(error: ServiceError, named: Option<Format>, bytes: &[u8]) -> ServiceError {
    let (Some(named), Some(seen)) = (named, Format::detect(bytes)) else { return error };
    if named == seen {
        return error;
    }
    let (named, seen) = (named.name(), seen.name());
    let detail = format!(
        "the cloud is named {named} and looks like {seen}: name that, or no format at all. As {named}: {error}"
    );
    ServiceError { detail, ..error }
}

/// What a trace tells of a segmentation.
fn describe(span: &tracing::Span, cloud: &PointCloud, found: &Segmentation, timing: &Timing) {
    trace::set(span, "conicoid.points", cloud.input_len as i64);
    trace::set(span, "conicoid.regions", found.regions.len() as i64);
    for (stage, seconds) in &timing.stages {
        trace::set(span, format!("conicoid.stage.{stage}.seconds"), *seconds);
    }
}

fn document(
    cloud: &PointCloud,
    found: Segmentation,
    snap: bool,
    input: Input,
    timing: Timing,
) -> Document {
    let samples = cloud.mesh.as_deref().and_then(|mesh| mesh.samples.as_ref());
    let face_labels = samples.map(|samples| samples.face_labels(&found.labels));
    let mut regions = found.regions;
    let mut relations = Relations::of(&regions);
    let snapping = if snap { relations.snap(&mut regions) } else { None };
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
        counters: found.counters,
        timing,
    }
}

/// SHA-256 of `bytes` in hexadecimal.
pub fn sha256(bytes: &[u8]) -> String {
    sha256_unless(bytes, || false)
}

/// SHA-256 of `bytes`, or of some of them once `stopped` says so: then nobody looks at it.
fn sha256_unless(bytes: &[u8], stopped: impl Fn() -> bool) -> String {
    /// About five milliseconds' worth.
    const BLOCK: usize = 8 << 20;
    let mut hash = Sha256::new();
    bytes.chunks(BLOCK).take_while(|_| !stopped()).for_each(|block| hash.update(block));
    hash.finalize().iter().map(|byte| format!("{byte:02x}")).collect()
}
