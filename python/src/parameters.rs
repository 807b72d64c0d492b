//! The table of parameters.

use conicoid::answer::{fits::fit_specs, specs};
use pyo3::{prelude::*, types::PyDict};

/// Every parameter and option of a segmentation, or of a fit: its name, what it takes, its unit, default and meaning.
///
/// # Errors
/// The interpreter has no memory.
#[pyfunction]
pub fn parameters(py: Python<'_>, fit: bool) -> PyResult<Vec<Bound<'_, PyDict>>> {
    let row = |spec: &conicoid::segment::ParameterSpec| {
        let row = PyDict::new(py);
        row.set_item("name", spec.name)?;
        row.set_item("takes", spec.kind.to_string())?;
        row.set_item("unit", spec.unit)?;
        row.set_item("default", spec.default)?;
        row.set_item("help", spec.help)?;
        Ok(row)
    };
    if fit { fit_specs().map(row).collect() } else { specs().map(row).collect() }
}
