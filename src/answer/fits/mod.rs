//! One geometric feature through all points of a cloud, as metrology asks for it.

mod document;
mod regions;
mod request;
mod told;
mod tolerance;

pub use document::{
    Certificate, Characteristic, Contact, Convergence, Determination, FeatureUncertainty,
    FitDocument, FitParameters, FormError, ParameterUncertainty, PassedThrough, Residuals, Verdict,
};
pub use regions::{RegionFit, region_fits};
pub use request::{FIT_PARAMETERS, FitRequest, fit_specs, unknown_fit_parameter};
pub use told::fit_cloud;
