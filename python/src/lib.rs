//! The native half of the Python package `conicoid`: the library in process, numbers as NumPy arrays.
//!
//! What a user sees stands in `conicoid/`; this module hands over clouds, answers and the table of parameters.

mod answer;
mod cloud;
mod error;
mod fit;
mod parameters;
mod run;

use pyo3::prelude::*;

/// The module `conicoid._native`.
#[pymodule]
mod _native {
    #[pymodule_export]
    use super::{
        answer::{Answer, colors, restored},
        cloud::{Cloud, from_array, read},
        fit::fit,
        parameters::parameters,
        run::segment,
    };
}
