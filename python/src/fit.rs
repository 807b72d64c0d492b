//! One feature through all points of a cloud.

use std::{num::NonZeroUsize, sync::Arc};

use conicoid::{
    answer::{
        Input,
        fits::{FitRequest, fit_cloud},
        mesh_told, sha256_of_points,
    },
    segment::resolution,
};
use pyo3::{prelude::*, types::PyBytes};

use crate::{
    cloud::{Cloud, Source},
    error::raised,
    run::{Watch, attended, check_hints},
};

/// Fits one feature to all points of `cloud`: the document as JSON; `given` are parameters and options as names and text.
///
/// # Errors
/// A parameter is not one, or the points do not determine the feature.
#[pyfunction]
#[pyo3(signature = (cloud, given, threads=None))]
pub fn fit<'py>(
    py: Python<'py>,
    cloud: &Bound<'py, Cloud>,
    given: Vec<(String, String)>,
    threads: Option<NonZeroUsize>,
) -> PyResult<Bound<'py, PyBytes>> {
    let pairs = given.iter().map(|(name, value)| (name.as_str(), value.as_str()));
    let mut request = FitRequest::from_pairs(pairs).map_err(|error| raised(py, &error))?;
    let cloud = cloud.get();
    check_hints(&cloud.source, &request.request).map_err(|error| raised(py, &error))?;
    let watch = Watch::new(request.request.deadline);
    let (stop, points, source) =
        (Arc::clone(&watch), Arc::clone(&cloud.points), cloud.source.clone());
    let work = move || {
        let stopped = || stop.stop().is_some();
        let (format, sha256) = match &source {
            Source::Array => ("array", sha256_of_points(&points, stopped)),
            Source::File(file) => (file.format, file.sha256.clone()),
        };
        if let Some(stop) = stop.stop() {
            return Err(stop);
        }
        if let (None, Source::File(file)) = (&request.request.name, &source) {
            request.request.name.clone_from(&file.name);
        }
        let input = Input {
            points: points.input_len,
            sha256,
            format: format.to_owned(),
            skipped: points.skipped(),
            unit: request.request.unit.or(points.unit),
            resolution: resolution(&points),
            mesh: points.mesh.as_deref().map(mesh_told),
            thin: None,
        };
        fit_cloud(&points, input, &request)?.to_json()
    };
    attended(py, &watch, None, threads, work).map(|bytes| PyBytes::new(py, &bytes))
}
