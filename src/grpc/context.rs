use std::sync::Arc;

use axum::{
    body::Body,
    extract::{Request, State},
    middleware::Next,
    response::Response,
};
use tonic::{Code, Status};
use tracing::Span;

use super::{
    GrpcConfig,
    intake::Intake,
    outcome::{Outcome, status},
};
use crate::{
    jobs::{BytesHeld, trace},
    service::{ErrorKind, Service, ServiceError, request_id},
};

/// Gives each call its id, its spans in log and trace, its line in the log, its place in the metrics
/// and its share of the budget.
pub async fn wrap(
    State((service, config)): State<(Arc<Service>, GrpcConfig)>,
    mut request: Request,
    next: Next,
) -> Response {
    let id = request_id(request.headers().get("x-request-id").and_then(|id| id.to_str().ok()));
    let method = request.uri().path().trim_start_matches('/').to_owned();
    if let Ok(value) = id.parse() {
        request.headers_mut().insert("x-request-id", value);
    }
    let log = tracing::info_span!("grpc", request_id = id, method);
    let span = traced(&log, &request, &method);
    let scope = trace::Scope::new(log.clone(), span.clone());
    let outcome = Outcome::new(&method, log, span, scope.clone());
    let held = service.share();
    let call = next.run(counted(request, &service, config, &held));
    let response = scope.cover(call).await;
    let mut response = in_our_terms(response);
    if let Ok(value) = id.parse() {
        response.headers_mut().insert("x-request-id", value);
    }
    outcome.follow(response, held)
}

/// The call with its messages counted as they come in. Reflection and health are small, and may stay
/// open as long as their callers like.
fn counted(
    mut request: Request,
    service: &Service,
    config: GrpcConfig,
    held: &BytesHeld,
) -> Request {
    if !request.uri().path().starts_with("/conicoid.v1.") {
        return request;
    }
    request.extensions_mut().insert(held.clone());
    let time = service.config().upload_timeout;
    let (held, copy, limit) = (held.clone(), service.share(), config.max_message_bytes);
    request.map(|body| Body::new(Intake::new(body, held, copy, limit, time)))
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

/// The call's span in its trace, by the conventions of RPC servers.
fn traced(log: &Span, request: &Request, method: &str) -> Span {
    let header = |name: &str| Some(request.headers().get(name)?.to_str().ok()?.to_owned());
    let span = trace::server(log, method, header);
    trace::set(&span, "rpc.system.name", "grpc");
    trace::set(&span, "rpc.method", method.to_owned());
    span
}
