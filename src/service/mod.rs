//! The use cases both transports call, the request and the result they share, and the one table of
//! error kinds.

mod announced;
mod compute;
mod elsewhere;
mod error;
mod fit;
mod jobs;
mod keys;
mod listing;
pub mod message;
mod peer;
mod representation;
mod request_id;
mod reread;
mod segmentations;
mod tiles;
mod upload;

pub use crate::answer::Form as Representation;
pub use crate::answer::fits::{
    Certificate, Characteristic, Contact, Convergence, Determination, FIT_PARAMETERS,
    FeatureUncertainty, FitDocument, FitParameters, FitRequest, FormError, ParameterUncertainty,
    PassedThrough, RegionFit, Residuals, Verdict, fit_specs, unknown_fit_parameter,
};
pub use crate::answer::{
    Answer, Document, Input, MeshInput, MeshPoints, Needs, OPTIONS, ParameterForm, REPORT_POLICY,
    Request, ThinInput, Timing, UnassignedPoints, is_list, joined, sha256, sheet, specs,
    unknown_format, unknown_parameter,
};
pub use compute::compute;
pub use error::{ERRORS, ErrorKind, ErrorRow, ServiceError};
pub use fit::compute_fit;
pub use jobs::MAX_WAIT;
pub use keys::{Caller, Keys, KeysError};
pub use listing::{JobPage, Listing};
pub use peer::Peer;
pub use representation::{render, render_fit};
pub use request_id::request_id;
pub use reread::Reread;
pub use segmentations::{Service, ServiceConfig, StartError};
pub use upload::{Allowance, Upload, WINDOW};
