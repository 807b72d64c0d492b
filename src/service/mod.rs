//! The use cases both transports call, the request and the result they share, and the one table of
//! error kinds.

mod announced;
mod compute;
mod error;
mod fit;
mod jobs;
mod keys;
pub mod message;
mod peer;
mod representation;
mod request_id;
mod reread;
mod segmentations;
mod upload;

pub use crate::answer::fits::{
    Certificate, Characteristic, Contact, Convergence, Determination, FIT_PARAMETERS,
    FeatureUncertainty, FitDocument, FitParameters, FitRequest, Form, ParameterUncertainty,
    PassedThrough, RegionFit, Residuals, Verdict, fit_specs, unknown_fit_parameter,
};
pub use crate::answer::{
    Answer, Document, Input, MeshInput, MeshPoints, OPTIONS, ParameterForm, REPORT_POLICY, Request,
    Timing, UnassignedPoints, is_list, sha256, sheet, specs, unknown_format, unknown_parameter,
};
pub use compute::compute;
pub use error::{ERRORS, ErrorKind, ErrorRow, ServiceError};
pub use fit::compute_fit;
pub use keys::{Caller, Keys, KeysError};
pub use peer::Peer;
pub use representation::Representation;
pub use request_id::request_id;
pub use reread::Reread;
pub use segmentations::{Service, ServiceConfig, StartError};
pub use upload::{Allowance, Upload, WINDOW};
