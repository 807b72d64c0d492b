use std::time::Duration;

use tonic::Code;

use crate::jobs::{Overloaded, PoolError, Stop, StoreError, SubmitError};

pub use crate::answer::{AnswerError as ServiceError, ErrorKind};

/// How one kind of error is told.
#[derive(Clone, Copy, Debug)]
pub struct ErrorRow {
    /// The kind.
    pub kind: ErrorKind,
    /// The stable code.
    pub code: &'static str,
    /// HTTP status.
    pub status: u16,
    /// gRPC status.
    pub grpc: Code,
    /// What the kind means, for people.
    pub title: &'static str,
}

const fn row(
    kind: ErrorKind,
    code: &'static str,
    status: u16,
    grpc: Code,
    title: &'static str,
) -> ErrorRow {
    ErrorRow { kind, code, status, grpc, title }
}

/// The one table of errors, read by every transport.
pub const ERRORS: &[ErrorRow] = {
    use Code::*;
    use ErrorKind as K;
    &[
        row(K::EmptyBody, "empty_body", 400, InvalidArgument, "The request has no cloud"),
        row(K::MalformedCloud, "malformed_cloud", 422, InvalidArgument, "The cloud cannot be read"),
        row(K::NoFinitePoints, "no_finite_points", 422, InvalidArgument, "No point is finite"),
        row(K::TooFewPoints, "too_few_points", 422, InvalidArgument, "The cloud is too small"),
        row(
            K::NotDetermined,
            "not_determined",
            422,
            InvalidArgument,
            "The points do not determine the feature",
        ),
        row(
            K::ExtentOutOfRange,
            "extent_out_of_range",
            422,
            InvalidArgument,
            "A coordinate above 1e50, or an extent below 1e-50",
        ),
        row(K::UnknownFormat, "unknown_format", 415, InvalidArgument, "The format is not known"),
        row(K::TooManyPoints, "too_many_points", 413, ResourceExhausted, "The cloud is too large"),
        row(K::BodyTooLarge, "body_too_large", 413, ResourceExhausted, "The body is too large"),
        row(
            K::UnsupportedEncoding,
            "unsupported_encoding",
            415,
            InvalidArgument,
            "The Content-Encoding is not known",
        ),
        row(K::MalformedBody, "malformed_body", 400, InvalidArgument, "The body cannot be read"),
        row(
            K::MalformedRequest,
            "malformed_request",
            400,
            InvalidArgument,
            "The head of the request cannot be taken",
        ),
        row(K::UnknownParameter, "unknown_parameter", 400, InvalidArgument, "Unknown parameter"),
        row(K::InvalidParameter, "invalid_parameter", 400, InvalidArgument, "Invalid parameter"),
        row(K::NotAcceptable, "not_acceptable", 406, InvalidArgument, "No such representation"),
        row(K::NotFound, "not_found", 404, Unimplemented, "Nothing is here"),
        row(K::MethodNotAllowed, "method_not_allowed", 405, Unimplemented, "Method not allowed"),
        row(K::Unauthenticated, "unauthenticated", 401, Unauthenticated, "No valid API key"),
        row(K::JobNotFound, "job_not_found", 404, NotFound, "No such job"),
        row(
            K::JobNotFinished,
            "job_not_finished",
            409,
            FailedPrecondition,
            "The job is not done yet",
        ),
        row(K::JobFailed, "job_failed", 409, FailedPrecondition, "The job ended without a result"),
        row(
            K::IdempotencyKeyReused,
            "idempotency_key_reused",
            422,
            FailedPrecondition,
            "The idempotency key is taken",
        ),
        row(K::Overloaded, "overloaded", 503, ResourceExhausted, "Too much work at hand"),
        row(
            K::QuotaExceeded,
            "quota_exceeded",
            429,
            ResourceExhausted,
            "This key has its share of what there is",
        ),
        row(K::UploadTimeout, "upload_timeout", 408, DeadlineExceeded, "The upload was too slow"),
        row(K::DeadlineExceeded, "deadline_exceeded", 504, DeadlineExceeded, "Out of time"),
        row(
            K::AnswerTooLarge,
            "answer_too_large",
            413,
            ResourceExhausted,
            "The answer is longer than a gRPC message may be",
        ),
        row(K::Cancelled, "cancelled", 409, Cancelled, "The work was cancelled"),
        row(K::ShuttingDown, "shutting_down", 503, Unavailable, "The service is shutting down"),
        row(
            K::StorageFull,
            "storage_full",
            507,
            ResourceExhausted,
            "The disk that keeps the jobs is full",
        ),
        row(
            K::StorageFailed,
            "storage_failed",
            503,
            Unavailable,
            "The jobs cannot be kept or read",
        ),
        row(
            K::StorageDamaged,
            "storage_damaged",
            500,
            DataLoss,
            "What is kept of the job is damaged",
        ),
        row(
            K::RunCrashed,
            "run_crashed",
            500,
            Internal,
            "The service ended each time it ran the job",
        ),
        row(K::Internal, "internal", 500, Internal, "A fault of the service"),
    ]
};

impl ErrorKind {
    /// The row of this kind.
    pub fn row(self) -> &'static ErrorRow {
        // a test shows that every kind has its row
        ERRORS.iter().find(|row| row.kind == self).unwrap_or(&ERRORS[ERRORS.len() - 1])
    }
}

impl ServiceError {
    /// An upload took longer than `limit`.
    pub fn upload_timeout(limit: Duration) -> Self {
        let detail = format!("the upload took longer than {} s", limit.as_secs_f64());
        Self::new(ErrorKind::UploadTimeout, detail)
    }

    /// An answer has `bytes` bytes, or more, and its caller takes `most`.
    pub fn answer_too_large(bytes: u64, most: u64) -> Self {
        Self::new(
            ErrorKind::AnswerTooLarge,
            format!(
                "the answer has {bytes} bytes or more and the caller takes {most}: call SegmentStream, or \
                 StreamJobResult for a job, which send it in pieces; leave out the labels with omit_labels; or raise \
                 the client's own limit, and max_answer_bytes with it"
            ),
        )
    }

    /// Counts a request that was refused for this.
    pub fn count(&self) {
        metrics::counter!("conicoid_rejections_total", "cause" => self.kind.row().code)
            .increment(1);
    }

    /// Seconds after which the same request may succeed, where waiting helps.
    pub fn retry_after(&self) -> Option<u32> {
        match self.kind {
            ErrorKind::Overloaded | ErrorKind::QuotaExceeded => Some(1),
            ErrorKind::ShuttingDown => Some(5),
            ErrorKind::JobNotFinished => Some(1),
            ErrorKind::StorageFull => Some(10),
            ErrorKind::StorageFailed => Some(5),
            _ => None,
        }
    }
}

impl From<Overloaded> for ServiceError {
    fn from(error: Overloaded) -> Self {
        let kind = match error {
            Overloaded::KeyQueue { .. } | Overloaded::KeyBytes { .. } => ErrorKind::QuotaExceeded,
            Overloaded::Queue { .. } | Overloaded::Bytes { .. } | Overloaded::Storage { .. } => {
                ErrorKind::Overloaded
            }
        };
        Self::new(kind, format!("{error}; try again later"))
    }
}

impl From<Stop> for ServiceError {
    fn from(stop: Stop) -> Self {
        match stop {
            Stop::Cancelled => Self::cancelled(),
            Stop::Deadline => Self::deadline_exceeded(),
        }
    }
}

impl From<SubmitError> for ServiceError {
    fn from(error: SubmitError) -> Self {
        match error {
            SubmitError::Overloaded(error) => error.into(),
            SubmitError::KeyReused(_) => Self::new(
                ErrorKind::IdempotencyKeyReused,
                format!("{error}: take a new key for a new submission"),
            ),
            SubmitError::Store(error) => error.into(),
        }
    }
}

impl From<StoreError> for ServiceError {
    fn from(error: StoreError) -> Self {
        if error == StoreError::Closed {
            return PoolError::Closed.into();
        }
        tracing::error!(%error, "the job store failed");
        match error {
            StoreError::Full(_) => Self::new(
                ErrorKind::StorageFull,
                "the disk that keeps the jobs is full: try again later, or ask without respond-async",
            ),
            StoreError::Damaged { .. } | StoreError::Missing { .. } => {
                Self::new(ErrorKind::StorageDamaged, format!("{error}: submit the cloud again"))
            }
            _ => Self::new(
                ErrorKind::StorageFailed,
                "the job store fails: try again later; the request id finds it in the log",
            ),
        }
    }
}

impl From<PoolError> for ServiceError {
    fn from(error: PoolError) -> Self {
        match error {
            PoolError::Closed => Self::new(ErrorKind::ShuttingDown, "the service is shutting down"),
            PoolError::Crashed { times } => Self::new(
                ErrorKind::RunCrashed,
                format!(
                    "the service ended suddenly {times} times while it ran this job, and does not run it \
                     again: send fewer points, or give the service more memory; if neither helps, \
                     report the cloud as a fault of the service"
                ),
            ),
            PoolError::Panicked(message) => {
                tracing::error!(panic = message, "a segmentation panicked");
                Self::new(
                    ErrorKind::Internal,
                    "the segmentation failed by a fault of the service; the request id finds it in \
                     the log",
                )
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use std::collections::HashSet;

    use super::*;

    #[test]
    fn every_kind_has_one_row_and_one_code() {
        let codes: HashSet<_> = ERRORS.iter().map(|row| row.code).collect();
        let kinds: HashSet<_> = ERRORS.iter().map(|row| row.kind).collect();
        assert_eq!((codes.len(), kinds.len()), (ERRORS.len(), ERRORS.len()));
        // the enum's last variant numbers them all
        assert_eq!(ERRORS.len(), ErrorKind::Internal as usize + 1);
        // the library tells the same codes without the table
        let code = |row: &ErrorRow| serde_json::to_value(row.kind).unwrap();
        assert!(ERRORS.iter().all(|row| row.kind.row().code == row.code && code(row) == row.code));
    }
}
