//! One geometric feature through all points of a cloud, as metrology asks for it.

mod compute;
mod document;
mod regions;
mod request;
mod tolerance;

pub use compute::compute_fit;
pub use document::{
    Certificate, Characteristic, Contact, Convergence, Determination, FeatureUncertainty,
    FitDocument, FitParameters, Form, ParameterUncertainty, PassedThrough, Residuals, Verdict,
};
pub use regions::RegionFit;
pub(super) use regions::region_fits;
pub use request::{FIT_PARAMETERS, FitRequest, fit_specs, unknown_fit_parameter};
