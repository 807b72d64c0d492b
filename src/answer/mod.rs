//! An answer as it is told, without the service around it: the request, the document, its forms, and the error where
//! there is none.
//!
//! This is the last layer of the library, which is built without the feature `service`; like those before it, it is
//! synchronous and silent.

mod clock;
mod digest;
mod document;
mod error;
pub mod fits;
mod form;
mod json;
mod options;
mod report;
mod request;
pub mod sheet;
mod step;
mod table;
mod whole;

pub use clock::{StageClock, StageTimes};
pub use digest::{sha256, sha256_of_points, sha256_unless};
pub use document::{Document, Input, MeshInput, MeshPoints, Timing, UnassignedPoints};
pub use error::{AnswerError, ErrorKind};
pub use form::Form;
pub use options::OPTIONS;
pub use report::REPORT_POLICY;
pub use request::{ParameterForm, Request, is_list, specs, unknown_format, unknown_parameter};
pub use whole::{Answer, mesh_told};
