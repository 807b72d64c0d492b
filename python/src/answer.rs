//! What was found, as JSON, arrays and files.

use std::sync::Arc;

use conicoid::{
    answer::{self, AnswerError, Document, ErrorKind, Form},
    formats::{Fields, region_color},
    segment::deviations,
};
use numpy::{PyArray1, PyArray2, PyReadonlyArray1};
use pyo3::{prelude::*, types::PyBytes};

use crate::{
    cloud::{Source, array, from_array},
    error::{of_panic, raised},
};

/// An answer with the cloud it is about.
#[pyclass(frozen, module = "conicoid._native")]
pub struct Answer {
    answer: Arc<answer::Answer>,
    source: Source,
    has_labels: bool,
}

impl Answer {
    /// `answer` about a cloud from `source`; `has_labels` is what the request says of them.
    pub fn new(answer: answer::Answer, source: Source, has_labels: bool) -> Self {
        Self { answer: Arc::new(answer), source, has_labels }
    }
}

#[pymethods]
impl Answer {
    /// The document as JSON, without its labels.
    fn document<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        self.written(py, Form::Json, false)
    }

    /// Whether the request wants the labels in the document.
    #[getter]
    fn has_labels(&self) -> bool {
        self.has_labels
    }

    /// One label for each input point; -1 = unassigned.
    fn labels<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i32>> {
        PyArray1::from_slice(py, self.answer.document.labels())
    }

    /// One label for each face of a mesh that was sampled; None for other clouds.
    fn face_labels<'py>(&self, py: Python<'py>) -> Option<Bound<'py, PyArray1<i32>>> {
        let labels = self.answer.document.face_labels.as_ref()?;
        Some(PyArray1::from_slice(py, labels))
    }

    /// Signed distance of each input point from its own surface; NaN where it has none.
    fn deviations<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        let (document, cloud) = (&self.answer.document, self.answer.all_points());
        let all = py.detach(|| deviations(cloud, document.labels(), &document.regions));
        PyArray1::from_vec(py, all)
    }

    /// The points in input order, (n, 3); NaN where a coordinate is not finite.
    fn points<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        array(py, self.answer.all_points())
    }

    /// The file with this ending, such as `step`; `labels` says whether JSON holds the labels.
    ///
    /// # Errors
    /// No file ends so.
    fn write<'py>(
        &self,
        py: Python<'py>,
        ending: &str,
        labels: bool,
    ) -> PyResult<Bound<'py, PyBytes>> {
        let form = Form::from_extension(ending).filter(|form| *form != Form::Protobuf);
        let form = form.ok_or_else(|| {
            let known = Form::ALL.into_iter().filter(|form| *form != Form::Protobuf);
            let known = known.map(|form| format!(".{}", form.extension()));
            let known = known.collect::<Vec<_>>().join(", ");
            let detail = format!("no file ends in '.{ending}'; known endings: {known}");
            raised(py, &AnswerError::new(ErrorKind::NotAcceptable, detail))
        })?;
        self.written(py, form, labels)
    }
}

impl Answer {
    fn written<'py>(
        &self,
        py: Python<'py>,
        form: Form,
        labels: bool,
    ) -> PyResult<Bound<'py, PyBytes>> {
        let bytes = py.detach(|| {
            let mut answer = answer::Answer::clone(&self.answer);
            if let (Form::Ply, Source::File(file)) = (form, &self.source) {
                answer.fields = Fields::clone(&file.fields);
            }
            let write = std::panic::AssertUnwindSafe(|| form.write(answer, labels));
            std::panic::catch_unwind(write).unwrap_or_else(|_| Err(of_panic()))
        });
        bytes.map(|bytes| PyBytes::new(py, &bytes)).map_err(|error| raised(py, &error))
    }
}

/// The answer whose `document`, as JSON without labels, and `labels` these are, about `points`.
///
/// # Errors
/// The document is not one of this version, or the arrays have not as many entries as it says.
#[pyfunction]
pub fn restored(
    py: Python<'_>,
    document: &[u8],
    labels: PyReadonlyArray1<'_, i32>,
    points: &Bound<'_, PyAny>,
    has_labels: bool,
) -> PyResult<Answer> {
    let wrong = |detail: String| raised(py, &AnswerError::new(ErrorKind::MalformedBody, detail));
    let document: Document = serde_json::from_slice(document).map_err(|error| {
        wrong(format!("this is no result of this version of conicoid: {error}"))
    })?;
    let cloud = from_array(py, points)?.points;
    let labels: Vec<i32> = labels.as_array().iter().copied().collect();
    for (n, what) in [(labels.len(), "labels"), (cloud.input_len, "points")] {
        if n != document.input.points {
            let expected = document.input.points;
            return Err(wrong(format!(
                "the result is about {expected} points, and there are {n} {what}"
            )));
        }
    }
    let document = Document { labels: Some(labels), ..document };
    let fields = Fields::default();
    let answer = answer::Answer { document, cloud, whole: None, fields, name: None };
    Ok(Answer::new(answer, Source::Array, has_labels))
}

/// The colour (red, green, blue) of each region's points, that of the label -1 last.
#[pyfunction]
pub fn colors(regions: i32) -> Vec<[u8; 3]> {
    (0..regions).chain([-1]).map(region_color).collect()
}
