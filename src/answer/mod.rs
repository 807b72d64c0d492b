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
pub mod handover;
mod json;
mod needs;
mod options;
mod report;
mod request;
pub mod sheet;
mod step;
mod table;
mod whole;

pub use clock::{StageClock, StageTimes};
pub use digest::{sha256, sha256_of_points, sha256_unless};
pub use document::{Document, Input, MeshInput, MeshPoints, ThinInput, Timing, UnassignedPoints};
pub use error::{AnswerError, ErrorKind};
pub use form::Form;
pub use needs::Needs;
pub use options::OPTIONS;
pub use report::REPORT_POLICY;
pub use request::{
    ParameterForm, Request, is_list, joined, specs, unknown_format, unknown_parameter,
};
pub use whole::{Answer, error_of_thinned, mesh_told, thin_told};

/// Which sources the program is built of: a digest of them, so that results tell by what they were made.
pub const BUILD: &str = env!("SOURCES_DIGEST");
