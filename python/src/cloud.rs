//! Point clouds, from arrays and from files.

use std::{num::NonZeroUsize, path::PathBuf, sync::Arc, time::Instant};

use conicoid::{
    answer::{AnswerError, ErrorKind, Request, sha256_unless},
    formats::{self, Bounds, Fields, Format, FormatError, Hints, Limits, Packing, Watched},
    geometry::{PointCloud, Vec3},
};
use numpy::{Element, PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray2};
use pyo3::{exceptions::PyTypeError, prelude::*, types::PyBytes};

use crate::{
    error::raised,
    run::{Watch, attended},
};

/// As many as input indices can count.
const LIMITS: Limits = Limits::of(u32::MAX as usize);

/// A point cloud with what its file says beside the points.
#[pyclass(frozen, module = "conicoid._native")]
pub struct Cloud {
    /// The points.
    pub points: Arc<PointCloud>,
    /// Where they come from.
    pub source: Source,
}

/// Where a cloud comes from.
#[derive(Clone)]
pub enum Source {
    /// An array.
    Array,
    /// A file, or bytes like those of one.
    File(Arc<File>),
}

/// What is kept of a file.
pub struct File {
    /// The name of its format.
    pub format: &'static str,
    /// SHA-256 of its bytes.
    pub sha256: String,
    /// Its own columns.
    pub fields: Fields,
    /// What it is called.
    pub name: Option<String>,
    /// Seconds that reading took.
    pub parse: f64,
}

/// Name and PLY type of columns, and their records.
type Columns<'py> = (Vec<(String, &'static str)>, Bound<'py, PyBytes>);

#[pymethods]
impl Cloud {
    /// The points in input order, (n, 3); NaN where a coordinate is not finite.
    fn array<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        array(py, &self.points)
    }

    fn __len__(&self) -> usize {
        self.points.input_len
    }

    /// The name of the file's format; None for an array.
    #[getter]
    fn format(&self) -> Option<&'static str> {
        self.file().map(|file| file.format)
    }

    /// SHA-256 of the file's bytes; None for an array.
    #[getter]
    fn sha256(&self) -> Option<&str> {
        self.file().map(|file| file.sha256.as_str())
    }

    /// Points in a row and number of rows, where the file is organised.
    #[getter]
    fn grid(&self) -> Option<(usize, usize)> {
        self.points.grid.map(|grid| (grid.width, grid.height))
    }

    /// Name and PLY type of the file's own columns, and their records, little-endian.
    fn fields<'py>(&self, py: Python<'py>) -> Columns<'py> {
        let none = Fields::default();
        let fields = self.file().map_or(&none, |file| &file.fields);
        (fields.columns.clone(), PyBytes::new(py, &fields.records))
    }
}

impl Cloud {
    /// The file it comes from.
    pub fn file(&self) -> Option<&File> {
        match &self.source {
            Source::Array => None,
            Source::File(file) => Some(file),
        }
    }
}

/// The points of `cloud` in input order; NaN where one was left out.
pub fn array<'py>(py: Python<'py>, cloud: &PointCloud) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let all: Vec<f64> = py.detach(|| {
        let Some(index) = &cloud.input_index else {
            return cloud.points.iter().flat_map(|p| [p.x, p.y, p.z]).collect();
        };
        let mut all = vec![f64::NAN; 3 * cloud.input_len];
        for (&at, p) in index.iter().zip(&cloud.points) {
            all[3 * at as usize..][..3].copy_from_slice(&[p.x, p.y, p.z]);
        }
        all
    });
    PyArray1::from_vec(py, all).reshape([cloud.input_len, 3])
}

/// The cloud of an array of shape (n, 3), float64 or float32, in any memory order: the one copy that is made.
///
/// # Errors
/// It is no such array, is empty, has no finite row, or has more than 2^32 - 1 rows.
#[pyfunction]
pub fn from_array(py: Python<'_>, points: &Bound<'_, PyAny>) -> PyResult<Cloud> {
    let mut points = if let Ok(points) = points.extract::<PyReadonlyArray2<'_, f64>>() {
        rows(py, &points)?
    } else if let Ok(points) = points.extract::<PyReadonlyArray2<'_, f32>>() {
        rows(py, &points)?
    } else {
        return Err(PyTypeError::new_err("points must be a float64 or float32 array (n, 3)"));
    };
    // as in a file
    formats::take_holes(&mut points);
    let (kind, detail) = match (points.input_len, points.points.len()) {
        (0, _) => (ErrorKind::TooFewPoints, "the array has no points".to_owned()),
        (n, 0) => {
            let detail = format!(
                "each of the {n} points has a coordinate that is not finite, or is a hole at 0, 0, 0"
            );
            (ErrorKind::NoFinitePoints, detail)
        }
        _ => return Ok(Cloud { points: Arc::new(points), source: Source::Array }),
    };
    Err(raised(py, &AnswerError::new(kind, detail)))
}

fn rows<T: Element + Copy + Into<f64>>(
    py: Python<'_>,
    points: &PyReadonlyArray2<'_, T>,
) -> PyResult<PointCloud> {
    let view = points.as_array();
    if view.ncols() != 3 {
        return Err(PyTypeError::new_err("points must be an array (n, 3)"));
    }
    LIMITS.check(view.nrows() as u64).map_err(|error| raised(py, &error.into()))?;
    let point = |p: &[T]| Vec3::new(p[0].into(), p[1].into(), p[2].into());
    // rows one behind the other, as most arrays have them, are the faster way
    Ok(PointCloud::from_points(match view.as_slice() {
        Some(all) => all.chunks_exact(3).map(point).collect(),
        None => view.rows().into_iter().map(|row| point(&[row[0], row[1], row[2]])).collect(),
    }))
}

/// The cloud of a file, or of `bytes` like those of one; `given` are options of the request.
///
/// # Errors
/// It cannot be read as a cloud.
#[pyfunction]
#[pyo3(signature = (path, bytes, given, threads=None))]
pub fn read(
    py: Python<'_>,
    path: Option<PathBuf>,
    bytes: Option<&Bound<'_, PyBytes>>,
    given: Vec<(String, String)>,
    threads: Option<NonZeroUsize>,
) -> PyResult<Cloud> {
    let pairs = given.iter().map(|(name, value)| (name.as_str(), value.as_str()));
    let mut request = Request::from_pairs(pairs).map_err(|error| raised(py, &error))?;
    if let Some(path) = &path {
        describe(&mut request, path);
    }
    // the system's error comes as the exception that Python has for it
    let bytes = match (path, bytes) {
        (Some(path), _) => py.detach(|| std::fs::read(path))?,
        (None, bytes) => bytes.map(|bytes| bytes.as_bytes().to_vec()).unwrap_or_default(),
    };
    let watch = Watch::new(request.deadline);
    let stop = Arc::clone(&watch);
    let work = move || parsed(&bytes, &request, &stop);
    attended(py, &watch, None, threads, work)
}

/// What a file's name tells, as on the command line.
fn describe(request: &mut Request, path: &std::path::Path) {
    if request.format.is_none() {
        let extension = path.extension().and_then(|extension| extension.to_str());
        request.set_format(extension.and_then(Format::from_extension));
    }
    if let (None, Some(name)) = (&request.name, path.file_name()) {
        // it stays without a name where that is no text of one line
        let _ = request.set("name", &name.to_string_lossy());
    }
}

fn parsed(bytes: &[u8], request: &Request, watch: &Watch) -> Result<Cloud, AnswerError> {
    let begin = Instant::now();
    let stopped = || watch.stop().is_some();
    let unpacked = Packing::of(bytes)
        .map(|packing| packing.unpack(bytes, |_| Ok::<(), FormatError>(())))
        .transpose();
    let unpacked = unpacked.map_err(AnswerError::from)?;
    let bytes = unpacked.as_deref().unwrap_or(bytes);
    let format = request.hints().format_of(bytes);
    let bounds = Watched { limits: LIMITS, stopped: &stopped };
    let hints = Hints { format, ..request.hints().whole() };
    let (read, sha256) = rayon::join(
        || formats::read(bytes, hints, &bounds).map(|cloud| (cloud, begin.elapsed())),
        || sha256_unless(bytes, stopped),
    );
    let (mut points, parse) = read.map_err(|error| watch.stop().unwrap_or_else(|| error.into()))?;
    // samples of a mesh are none of the file's vertices
    let fields = points.samples().map_or_else(|| Fields::of(bytes), |_| Fields::default());
    // what the file says of each point beside where it is
    points.labels = fields.labels().and_then(|all| points.of_stored(all));
    points.normals = fields.normals().and_then(|all| points.of_stored(all));
    let file = File {
        format: format.map(Format::name).unwrap_or_default(),
        sha256,
        fields,
        name: request.name.clone(),
        parse: parse.as_secs_f64(),
    };
    Ok(Cloud { points: Arc::new(points), source: Source::File(Arc::new(file)) })
}
