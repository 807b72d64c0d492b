use std::{
    pin::Pin,
    task::{Context, Poll},
    time::Instant,
};

use axum::{
    body::{Body, Bytes, HttpBody},
    http::{HeaderMap, StatusCode},
    response::Response,
};
use http_body::{Frame, SizeHint};
use tonic::Code;
use tracing::Span;

use crate::jobs::{
    BytesHeld,
    trace::{self, Facts},
};

/// The calls of the contract, and those of health and reflection: strangers name others.
const METHODS: [&str; 19] = [
    "conicoid.v1.Segmentations/Segment",
    "conicoid.v1.Segmentations/SegmentUpload",
    "conicoid.v1.Fits/Fit",
    "conicoid.v1.Fits/FitFile",
    "conicoid.v1.Segmentations/SegmentStream",
    "conicoid.v1.Segmentations/SegmentFile",
    "conicoid.v1.Jobs/SubmitJob",
    "conicoid.v1.Jobs/ListJobs",
    "conicoid.v1.Jobs/GetJob",
    "conicoid.v1.Jobs/WatchJob",
    "conicoid.v1.Jobs/GetJobResult",
    "conicoid.v1.Jobs/StreamJobResult",
    "conicoid.v1.Jobs/GetJobFile",
    "conicoid.v1.Jobs/CancelJob",
    "grpc.health.v1.Health/Check",
    "grpc.health.v1.Health/List",
    "grpc.health.v1.Health/Watch",
    "grpc.reflection.v1.ServerReflection/ServerReflectionInfo",
    "grpc.reflection.v1alpha.ServerReflection/ServerReflectionInfo",
];

/// The method as a label of metrics: one of few.
fn label(method: &str) -> &'static str {
    METHODS.into_iter().find(|known| *known == method).unwrap_or("_OTHER")
}

/// How a call ends. What is told of it is told when it has ended: a call that is dropped before was
/// cancelled.
pub struct Outcome {
    begin: Instant,
    method: &'static str,
    code: Option<Code>,
    log: Span,
    span: Span,
    scope: trace::Scope,
}

impl Outcome {
    /// The outcome of a call of `method` that begins now, to be told in both spans with what is known of
    /// the call by `scope`.
    pub fn new(method: &str, log: Span, span: Span, scope: trace::Scope) -> Self {
        Self { begin: Instant::now(), method: label(method), code: None, log, span, scope }
    }

    /// The response of the call, which tells how it ends, and whose bytes hold the call's share of the
    /// budget until they are sent.
    pub fn follow(mut self, response: Response, held: BytesHeld) -> Response {
        // calls that fail at once say so in their head; a good one says so at its end
        self.code = match response.status() {
            StatusCode::OK => status(response.headers()),
            StatusCode::NOT_FOUND | StatusCode::METHOD_NOT_ALLOWED => Some(Code::Unimplemented),
            _ => Some(Code::Unknown),
        };
        response.map(|body| Body::new(Told { body, held, outcome: self }))
    }
}

impl Drop for Outcome {
    fn drop(&mut self) {
        let name = name(self.code.unwrap_or(Code::Cancelled));
        tell(&self.span, self.code.unwrap_or(Code::Cancelled));
        let labels = [("rpc_method", self.method), ("rpc_response_status_code", name)];
        let time = self.begin.elapsed();
        metrics::histogram!("rpc_server_call_duration_seconds", &labels).record(time);
        let seconds = time.as_secs_f64();
        let Facts { caller, format, bytes, points, regions, job } = self.scope.facts();
        self.log.in_scope(|| {
            tracing::info!(
                caller,
                format,
                bytes,
                points,
                regions,
                job,
                code = name,
                seconds,
                "answered"
            );
        });
    }
}

/// The body of a response, at whose end stands how the call ended.
struct Told {
    body: Body,
    held: BytesHeld,
    outcome: Outcome,
}

impl HttpBody for Told {
    type Data = Bytes;
    type Error = axum::Error;

    fn poll_frame(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
    ) -> Poll<Option<Result<Frame<Bytes>, axum::Error>>> {
        let frame = Pin::new(&mut self.body).poll_frame(context);
        let Poll::Ready(Some(Ok(frame))) = frame else {
            if matches!(frame, Poll::Ready(_)) {
                // it ended without a word
                self.outcome.code.get_or_insert(Code::Unknown);
            }
            return frame;
        };
        if let Some(trailers) = frame.trailers_ref() {
            self.outcome.code = self.outcome.code.or(status(trailers));
        }
        Poll::Ready(Some(Ok(frame.map_data(|data| self.held.carried_by(data)))))
    }

    fn is_end_stream(&self) -> bool {
        self.body.is_end_stream()
    }

    fn size_hint(&self) -> SizeHint {
        self.body.size_hint()
    }
}

fn tell(span: &Span, code: Code) {
    trace::set(span, "rpc.response.status_code", name(code));
    // the others are errors of the caller's
    if matches!(
        code,
        Code::Unknown
            | Code::DeadlineExceeded
            | Code::Unimplemented
            | Code::Internal
            | Code::Unavailable
            | Code::DataLoss
    ) {
        trace::fail(span, name(code).to_owned());
    }
}

/// The code in a head or in trailers.
fn status(headers: &HeaderMap) -> Option<Code> {
    Some(Code::from_bytes(headers.get("grpc-status")?.as_bytes()))
}

/// The code as the conventions write it.
fn name(code: Code) -> &'static str {
    match code {
        Code::Ok => "OK",
        Code::Cancelled => "CANCELLED",
        Code::Unknown => "UNKNOWN",
        Code::InvalidArgument => "INVALID_ARGUMENT",
        Code::DeadlineExceeded => "DEADLINE_EXCEEDED",
        Code::NotFound => "NOT_FOUND",
        Code::AlreadyExists => "ALREADY_EXISTS",
        Code::PermissionDenied => "PERMISSION_DENIED",
        Code::ResourceExhausted => "RESOURCE_EXHAUSTED",
        Code::FailedPrecondition => "FAILED_PRECONDITION",
        Code::Aborted => "ABORTED",
        Code::OutOfRange => "OUT_OF_RANGE",
        Code::Unimplemented => "UNIMPLEMENTED",
        Code::Internal => "INTERNAL",
        Code::Unavailable => "UNAVAILABLE",
        Code::DataLoss => "DATA_LOSS",
        Code::Unauthenticated => "UNAUTHENTICATED",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_call_of_the_contract_has_a_label_of_its_own() {
        let proto = include_str!("../../proto/conicoid/v1/conicoid.proto");
        let mut service = "";
        for line in proto.lines() {
            let word = |line: &'static str| line.split([' ', '(']).next().unwrap_or_default();
            if let Some(rest) = line.strip_prefix("service ") {
                service = word(rest);
            } else if let Some(rest) = line.trim_start().strip_prefix("rpc ") {
                let method = format!("conicoid.v1.{service}/{}", word(rest));
                assert_eq!(label(&method), method);
            }
        }
        assert_eq!(label("conicoid.v1.Jobs/Stranger"), "_OTHER");
    }
}
