//! One geometric feature through all points of a cloud, as metrology asks for it.

mod compute;
mod document;
mod request;

pub use compute::compute_fit;
pub use document::{
    Certificate, Contact, Convergence, Determination, FeatureUncertainty, FitDocument,
    FitParameters, Form, ParameterUncertainty, PassedThrough, Residuals,
};
pub use request::{FIT_PARAMETERS, FitRequest, fit_specs, unknown_fit_parameter};
