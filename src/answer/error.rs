use serde::Serialize;

use crate::{
    formats::FormatError,
    segment::{ParameterError, SegmentError},
};

/// What can go wrong, as callers see it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum ErrorKind {
    /// The request has no bytes of a cloud.
    EmptyBody,
    /// The cloud cannot be read.
    MalformedCloud,
    /// No coordinate triple is finite.
    NoFinitePoints,
    /// The cloud has too few points for any region.
    TooFewPoints,
    /// The points do not determine the feature that is to be fitted.
    NotDetermined,
    /// A coordinate is too large, or the points are too close together, to be worked with.
    ExtentOutOfRange,
    /// The format is not known or not to be told.
    UnknownFormat,
    /// The cloud has more points than the limit.
    TooManyPoints,
    /// The body is longer than the limit.
    BodyTooLarge,
    /// The Content-Encoding is not known.
    UnsupportedEncoding,
    /// The body does not keep to its Content-Encoding or its multipart form.
    MalformedBody,
    /// The head of the request does not say which host it is for, or says it twice.
    MalformedRequest,
    /// No parameter has this name.
    UnknownParameter,
    /// A parameter's value is not one it takes.
    InvalidParameter,
    /// None of the accepted media types can be given.
    NotAcceptable,
    /// No such path.
    NotFound,
    /// The path has no such method.
    MethodNotAllowed,
    /// No key, or not a valid one.
    Unauthenticated,
    /// No such job, or not this caller's.
    JobNotFound,
    /// The job has no result yet.
    JobNotFinished,
    /// The job ended without a result.
    JobFailed,
    /// The idempotency key stands for another submission.
    IdempotencyKeyReused,
    /// Too much work at hand.
    Overloaded,
    /// One key takes more than its share.
    QuotaExceeded,
    /// The upload took too long.
    UploadTimeout,
    /// The work took longer than its deadline.
    DeadlineExceeded,
    /// The answer is longer than the caller takes in one message.
    AnswerTooLarge,
    /// The work was cancelled.
    Cancelled,
    /// The service is shutting down.
    ShuttingDown,
    /// The disk that keeps the jobs is full.
    StorageFull,
    /// The store of the jobs fails.
    StorageFailed,
    /// What the store has of a job is not what was written.
    StorageDamaged,
    /// The process of the service ended each time it ran the job.
    RunCrashed,
    /// A fault of the service.
    Internal,
}

/// An error as it is told to callers, in the same terms by every transport and by the library.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{detail}")]
pub struct AnswerError {
    /// What kind of error.
    pub kind: ErrorKind,
    /// What happened, with the offending value, and what to do.
    pub detail: String,
}

impl AnswerError {
    /// An error of `kind`.
    pub fn new(kind: ErrorKind, detail: impl Into<String>) -> Self {
        Self { kind, detail: detail.into() }
    }

    /// The caller cancelled the work.
    pub fn cancelled() -> Self {
        Self::new(ErrorKind::Cancelled, "the work was cancelled")
    }

    /// The work took longer than its deadline.
    pub fn deadline_exceeded() -> Self {
        Self::new(
            ErrorKind::DeadlineExceeded,
            "the work took longer than its deadline: raise deadline, or thin out the cloud",
        )
    }
}

impl From<FormatError> for AnswerError {
    fn from(error: FormatError) -> Self {
        let kind = match &error {
            FormatError::Empty => ErrorKind::EmptyBody,
            FormatError::Unknown { .. }
            | FormatError::Foreign { .. }
            | FormatError::Compressed { .. } => ErrorKind::UnknownFormat,
            FormatError::ParameterOfText { .. }
            | FormatError::NoFaces
            | FormatError::ThinTooSmall { .. }
            | FormatError::TooManySamples { .. } => ErrorKind::InvalidParameter,
            FormatError::OutOfMemory { .. } | FormatError::NoMemoryToUnpack { .. } => {
                ErrorKind::Overloaded
            }
            FormatError::NoPoints { .. } => ErrorKind::TooFewPoints,
            FormatError::NoFinitePoints { .. } => ErrorKind::NoFinitePoints,
            FormatError::TooManyPoints { .. }
            | FormatError::TooManyFaces { .. }
            | FormatError::ThinTakesMemory { .. } => ErrorKind::TooManyPoints,
            FormatError::Stopped => ErrorKind::Cancelled,
            _ => ErrorKind::MalformedCloud,
        };
        Self::new(kind, error.to_string())
    }
}

impl From<ParameterError> for AnswerError {
    fn from(error: ParameterError) -> Self {
        let kind = match &error {
            ParameterError::Unknown(_) => ErrorKind::UnknownParameter,
            _ => ErrorKind::InvalidParameter,
        };
        Self::new(kind, error.to_string())
    }
}

impl From<SegmentError> for AnswerError {
    fn from(error: SegmentError) -> Self {
        match &error {
            SegmentError::Cancelled(_) => Self::cancelled(),
            SegmentError::TooManyPoints(_) => {
                Self::new(ErrorKind::TooManyPoints, error.to_string())
            }
            SegmentError::CroppedToFew { .. } => {
                Self::new(ErrorKind::TooFewPoints, error.to_string())
            }
            SegmentError::TooFewPoints { .. } => Self::new(
                ErrorKind::TooFewPoints,
                format!(
                    "{error}: send more points, lower min_points, or fit one feature to all of them (conicoid fit, \
                     /v1/fits)"
                ),
            ),
            SegmentError::CoordinateTooLarge(_) | SegmentError::ExtentTooSmall(_) => {
                Self::new(ErrorKind::ExtentOutOfRange, error.to_string())
            }
        }
    }
}
