use std::{sync::Arc, time::Instant};

use super::{Answer, Input, Request, ServiceError, Timing};
use crate::{
    answer::{self, mesh_told, sha256, sha256_unless, thin_told},
    formats::{self, Fields, Format, Hints, Limits, Watched},
    geometry::PointCloud,
    jobs::{Control, trace},
    segment::{SegmentError, Segmentation, resolution, segment},
};

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
    let format = request.hints().format_of(bytes);
    trace::note(|facts| {
        (facts.format, facts.bytes) = (format.map(Format::name), Some(bytes.len()))
    });
    let stopped = || control.stop().is_some();
    let watched = Watched { limits: *limits, stopped: &stopped };
    // a run that was stopped says so, wherever it was
    let stopped_or = |error: ServiceError| control.stop().map_or(error, ServiceError::from);
    let run = || {
        let cloud = trace::step("parse")
            .in_scope(|| formats::read(bytes, Hints { format, ..request.hints() }, &watched))
            .map_err(|e| stopped_or(named_otherwise(e.into(), request.format, bytes)))?;
        let cloud = with_columns(cloud, bytes, format);
        check_labels(cloud.input_len, request)?;
        let parse = begin.elapsed().as_secs_f64();
        let span = trace::step("segment");
        let found = span.in_scope(|| segment(&cloud, &request.parameters, control));
        let of_thinned = |error: SegmentError| answer::error_of_thinned(error, &cloud);
        let found = found.map_err(|error| stopped_or(of_thinned(error)));
        found.map(|found| (cloud, found, parse, span))
    };
    // the digest takes as long as a good part of the run, and one thread
    let (done, sha256) = rayon::join(run, || sha256_unless(bytes, stopped));
    let (cloud, found, parse, span) = done?;
    let timing = Timing { parse, stages: control.finish(), total: begin.elapsed().as_secs_f64() };
    Ok(told(&span, cloud, found, request, (sha256, format), timing))
}

/// The answer of what was found, told to whoever watches the service too.
pub(super) fn told(
    span: &tracing::Span,
    cloud: PointCloud,
    found: Segmentation,
    request: &Request,
    (sha256, format): (String, Option<Format>),
    timing: Timing,
) -> Answer {
    describe(span, &cloud, &found, &timing);
    trace::note(|facts| {
        (facts.points, facts.regions) = (Some(cloud.input_len), Some(found.regions.len()));
    });
    metrics::counter!("conicoid_points_total").increment(cloud.input_len as u64);
    let format = format.map(Format::name).unwrap_or_default();
    Answer::new(Arc::new(cloud), found, request, (sha256, format), timing)
}

/// The cloud with what its file says of each point beside where it is: its labels and normals.
fn with_columns(mut cloud: PointCloud, bytes: &[u8], format: Option<Format>) -> PointCloud {
    // samples of a mesh are none of the file's vertices
    let is_sampled = cloud.samples().is_some();
    if format == Some(Format::Ply) && !is_sampled && Fields::are_told(bytes) {
        let fields = Fields::of_some(bytes, cloud.input_index.as_deref());
        let n = cloud.points.len();
        cloud.labels = fields.labels().filter(|labels| labels.len() == n);
        cloud.normals = fields.normals().filter(|normals| normals.len() == n);
    }
    cloud
}

/// Reads the cloud in `bytes` for a use case that takes next to no time.
///
/// # Errors
/// The cloud cannot be read, or `control` stopped the run.
pub(super) fn read(
    bytes: &[u8],
    request: &Request,
    limits: &Limits,
    control: &Control,
) -> Result<(PointCloud, Input), ServiceError> {
    let format = request.hints().format_of(bytes);
    trace::note(|facts| {
        (facts.format, facts.bytes) = (format.map(Format::name), Some(bytes.len()))
    });
    let stopped = || control.stop().is_some();
    let watched = Watched { limits: *limits, stopped: &stopped };
    let told = |error: ServiceError| control.stop().map_or(error, ServiceError::from);
    let cloud = trace::step("parse")
        .in_scope(|| formats::read(bytes, Hints { format, ..request.hints() }, &watched))
        .map_err(|e| told(named_otherwise(e.into(), request.format, bytes)))?;
    trace::note(|facts| facts.points = Some(cloud.input_len));
    let input = Input {
        points: cloud.input_len,
        sha256: sha256(bytes),
        format: format.map(Format::name).unwrap_or_default().to_owned(),
        skipped: cloud.skipped(),
        unit: request.unit.or(cloud.unit),
        resolution: resolution(&cloud),
        mesh: cloud.mesh.as_deref().map(mesh_told),
        thin: thin_told(&cloud),
    };
    Ok((cloud, input))
}

/// Refuses the work whose answer would be too long by its labels alone, of at least a byte each.
pub(super) fn check_labels(points: usize, request: &Request) -> Result<(), ServiceError> {
    let most = request.max_answer_bytes.unwrap_or(u64::MAX);
    let labels = if request.labels { points as u64 } else { 0 };
    if labels <= most { Ok(()) } else { Err(ServiceError::answer_too_large(labels, most)) }
}

/// An error of reading, which says so where the bytes look like another format than the one that was named.
pub(super) fn named_otherwise(
    error: ServiceError,
    named: Option<Format>,
    bytes: &[u8],
) -> ServiceError {
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
