use std::sync::Arc;

use axum::{
    body::Body,
    extract::{Request, State},
    http::{HeaderMap, header::AUTHORIZATION},
    middleware::Next,
    response::Response,
};
use tonic::{Code, Status};
use tracing::Span;

use super::{config::GrpcConfig, intake::Intake, outcome::Outcome, unpack::Packing};
use crate::{
    jobs::{BytesHeld, trace},
    service::{ErrorKind, Peer, Service, ServiceError, request_id},
};

/// How tonic begins to tell of bytes that are no message.
const UNDECODED: &str = "failed to decode Protobuf message";
/// How it begins to tell of messages in a packing that is not taken.
const PACKED_OTHERWISE: &str = "Content is compressed with";
/// The header that says which are.
const ACCEPTED: &str = "grpc-accept-encoding";

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
    // nothing of a stranger's messages is taken in
    let counted = scope.enter(|| counted(request, &service, config, &held));
    let mut response = match counted {
        Ok(request) => in_our_terms(scope.cover(next.run(request)).await),
        Err(error) => Status::from(error).into_http(),
    };
    if let Ok(value) = id.parse() {
        response.headers_mut().insert("x-request-id", value);
    }
    outcome.follow(response, held)
}

/// The call with its messages counted as they come in, as its caller's. Reflection and health are small,
/// and may stay open as long as their callers like.
///
/// # Errors
/// The caller is not known, or holds too much already.
fn counted(
    mut request: Request,
    service: &Service,
    config: GrpcConfig,
    held: &BytesHeld,
) -> Result<Request, ServiceError> {
    if !request.uri().path().starts_with("/conicoid.v1.") {
        return Ok(request);
    }
    let header = request.headers().get(AUTHORIZATION).and_then(|value| value.to_str().ok());
    let caller = service.caller(header, request.extensions().get::<Peer>())?;
    let copy = service.share();
    for share in [held, &copy] {
        share.charge(caller.as_deref())?;
    }
    request.extensions_mut().insert(held.clone());
    let encoding = request.headers().get("grpc-encoding").and_then(|value| value.to_str().ok());
    let packing = encoding.and_then(Packing::from_name);
    if let Some(packing) = packing {
        // given back with the body, which holds it
        copy.grow_to(packing.bytes_beside())?;
    }
    let time = service.config().upload_timeout;
    let (held, limit) = (held.clone(), config.max_message_bytes);
    let intake = |body| Intake::new(body, held, copy, limit, time).unpacking(packing, limit);
    Ok(request.map(|body| Body::new(intake(body))))
}

/// The response, with the error of the table where tonic itself refused the call.
fn in_our_terms(response: Response) -> Response {
    let Some(told) = Status::from_header_map(response.headers()) else { return response };
    let (kind, detail) = match (told.code(), told.message()) {
        // a message that is too long; nothing else here says so
        (Code::OutOfRange, told) => (
            ErrorKind::BodyTooLarge,
            format!(
                "{told}: send the cloud in chunks below the limit, by SegmentUpload or SubmitJob"
            ),
        ),
        // a fault of the caller's, not of the service
        (Code::Internal, told) if told.starts_with(UNDECODED) => {
            (ErrorKind::MalformedBody, format!("the message is none of the contract's: {told}"))
        }
        // the code is what the protocol asks for, with the encodings that are taken in a header
        (Code::Unimplemented, told) if told.starts_with(PACKED_OTHERWISE) => {
            let detail = format!("{told}: send gzip, zstd or identity");
            return unsupported(detail, response.headers());
        }
        (Code::Unimplemented, "") => {
            (ErrorKind::NotFound, "no such call: server reflection lists what there is".to_owned())
        }
        _ => return response,
    };
    Status::from(ServiceError::new(kind, detail)).into_http()
}

/// The answer to messages whose packing is not known.
fn unsupported(detail: String, told: &HeaderMap) -> Response {
    let error = ServiceError::new(ErrorKind::UnsupportedEncoding, detail);
    let mut response = super::status::with_code(error, Code::Unimplemented).into_http();
    if let Some(encodings) = told.get(ACCEPTED) {
        response.headers_mut().insert(ACCEPTED, encodings.clone());
    }
    response
}

/// The call's span in its trace, by the conventions of RPC servers.
fn traced(log: &Span, request: &Request, method: &str) -> Span {
    let header = |name: &str| Some(request.headers().get(name)?.to_str().ok()?.to_owned());
    let span = trace::server(log, method, header);
    trace::set(&span, "rpc.system.name", "grpc");
    trace::set(&span, "rpc.method", method.to_owned());
    span
}
