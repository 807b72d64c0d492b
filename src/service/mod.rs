//! The use cases both transports call, the request and the result they share, and the one table of
//! error kinds.

mod announced;
mod compute;
mod document;
mod error;
mod jobs;
mod keys;
pub mod message;
mod options;
mod peer;
mod report;
mod representation;
mod request;
mod request_id;
mod reread;
mod segmentations;
pub mod sheet;
mod step;
mod upload;

pub use compute::{Answer, compute, sha256};
pub use document::{Document, Input, MeshInput, MeshPoints, Timing, UnassignedPoints};
pub use error::{ERRORS, ErrorKind, ErrorRow, ServiceError};
pub use keys::{Caller, Keys, KeysError};
pub use options::OPTIONS;
pub use peer::Peer;
pub use report::REPORT_POLICY;
pub use representation::Representation;
pub use request::{Request, is_list, specs, unknown_format, unknown_parameter};
pub use request_id::request_id;
pub use reread::Reread;
pub use segmentations::{Service, ServiceConfig, StartError};
pub use upload::{Allowance, Upload};
