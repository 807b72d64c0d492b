use std::{sync::Arc, time::Instant};

use axum::{
    body::Body,
    extract::{Request, State},
    http::HeaderMap,
    middleware::Next,
    response::Response,
};
use http_body_util::BodyExt;
use tonic::{Code, Status};
use tracing::Span;

use super::intake::Intake;
use crate::{
    jobs::{
        BytesHeld,
        trace::{self, Facts},
    },
    service::{ErrorKind, Service, ServiceError, request_id},
};

/// Gives each call its id, its spans in log and trace, its line in the log, its place in the metrics
/// and its share of the budget.
pub async fn wrap(
    State(service): State<Arc<Service>>,
    mut request: Request,
    next: Next,
) -> Response {
    let begin = Instant::now();
    let id = request_id(request.headers().get("x-request-id").and_then(|id| id.to_str().ok()));
    let method = request.uri().path().trim_start_matches('/').to_owned();
    if let Ok(value) = id.parse() {
        request.headers_mut().insert("x-request-id", value);
    }
    let log = tracing::info_span!("grpc", request_id = id, method);
    let span = traced(&log, &request, &method);
    let held = service.share();
    let call = next.run(counted(request, &service, &held));
    let scope = trace::Scope::new(log.clone(), span.clone());
    let response = scope.clone().cover(call).await;
    let mut response = in_our_terms(response);
    if let Ok(value) = id.parse() {
        response.headers_mut().insert("x-request-id", value);
    }
    // calls that fail at once say so in their head; a good one says so at its end
    let code = status(response.headers()).unwrap_or(Code::Ok);
    tell(&span, code);
    // a method that nobody knows would be a new label at every call
    let method = if code == Code::Unimplemented { "_OTHER".to_owned() } else { method };
    let labels = [("rpc_method", method), ("rpc_response_status_code", name(code).to_owned())];
    metrics::histogram!("rpc_server_call_duration_seconds", &labels).record(begin.elapsed());
    let seconds = begin.elapsed().as_secs_f64();
    let Facts { caller, format, bytes, points, regions, job } = scope.facts();
    let code = name(code);
    log.in_scope(|| {
        tracing::info!(caller, format, bytes, points, regions, job, code, seconds, "answered");
    });
    carried(response, held)
}

/// The call with its messages counted as they come in. Reflection and health are small, and may stay
/// open as long as their callers like.
fn counted(mut request: Request, service: &Service, held: &BytesHeld) -> Request {
    if !request.uri().path().starts_with("/conicoid.v1.") {
        return request;
    }
    request.extensions_mut().insert(held.clone());
    let time = service.config().upload_timeout;
    request.map(|body| Body::new(Intake::new(body, held.clone(), time)))
}

/// The response, with the error of the table where tonic refused a message for its length: it says
/// OUT_OF_RANGE, which nothing else here does.
fn in_our_terms(response: Response) -> Response {
    if status(response.headers()) != Some(Code::OutOfRange) {
        return response;
    }
    let told = Status::from_header_map(response.headers());
    let told = told.as_ref().map_or("the message is too long", |status| status.message());
    let error = ServiceError::new(
        ErrorKind::BodyTooLarge,
        format!("{told}: send the cloud in chunks below the limit, by SegmentUpload or SubmitJob"),
    );
    Status::from(error).into_http()
}

/// The response, whose bytes hold the call's share of the budget until they are sent.
fn carried(response: Response, held: BytesHeld) -> Response {
    response.map(|body| {
        Body::new(body.map_frame(move |frame| frame.map_data(|data| held.carried_by(data))))
    })
}

/// The call's span in its trace, by the conventions of RPC servers.
fn traced(log: &Span, request: &Request, method: &str) -> Span {
    let header = |name: &str| Some(request.headers().get(name)?.to_str().ok()?.to_owned());
    let span = trace::server(log, method, header);
    trace::set(&span, "rpc.system.name", "grpc");
    trace::set(&span, "rpc.method", method.to_owned());
    span
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
