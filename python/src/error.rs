//! Errors of the library as exceptions of `conicoid.errors`.

use conicoid::answer::{AnswerError, ErrorKind};
use pyo3::{exceptions::PyRuntimeError, prelude::*};

/// The exception that tells `error`, with the code that the service has for it.
pub fn raised(py: Python<'_>, error: &AnswerError) -> PyErr {
    let code = serde_json::to_value(error.kind).unwrap_or_default();
    let code = code.as_str().unwrap_or_default();
    let made = py
        .import("conicoid.errors")
        .and_then(|errors| errors.getattr("of_code"))
        .and_then(|of_code| of_code.call1((code, &error.detail)));
    made.map_or_else(|error| error, PyErr::from_value)
}

/// The error for a panic: a fault of the library.
pub fn of_panic() -> AnswerError {
    AnswerError::new(
        ErrorKind::Internal,
        "the work failed by a fault of conicoid; please report the cloud and the parameters",
    )
}

/// What the system does not give, threads above all.
pub fn of_system(error: &dyn std::fmt::Display) -> PyErr {
    PyRuntimeError::new_err(error.to_string())
}
