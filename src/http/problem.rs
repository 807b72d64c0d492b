use axum::{
    body::Body,
    http::{HeaderValue, StatusCode, header},
    response::{IntoResponse, Response},
};
use serde::Serialize;
use utoipa::ToSchema;

use crate::service::{ErrorKind, ServiceError};

/// The media type of problem documents (RFC 9457).
pub const MEDIA_TYPE: &str = "application/problem+json";

/// What went wrong, after RFC 9457.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, ToSchema)]
pub struct Problem {
    /// Where the code is explained.
    #[serde(rename = "type")]
    #[schema(example = "/docs#too_few_points")]
    pub problem_type: String,
    /// What the code means.
    pub title: String,
    /// The HTTP status.
    #[schema(example = 422)]
    pub status: u16,
    /// What happened, with the offending value, and what to do.
    pub detail: String,
    /// The path of the request.
    pub instance: String,
    /// The stable code, for programs: one of `x-error-codes`.
    #[schema(example = "too_few_points")]
    pub code: String,
    /// The request's id, as in the log and in the `x-request-id` header.
    pub request_id: String,
}

/// The error of a handler. It travels in the response's extensions until [`complete`] knows the
/// request and writes the document.
impl IntoResponse for ServiceError {
    fn into_response(self) -> Response {
        let mut response = Response::new(Body::empty());
        *response.status_mut() = status(self.kind);
        response.extensions_mut().insert(self);
        response
    }
}

fn status(kind: ErrorKind) -> StatusCode {
    StatusCode::from_u16(kind.row().status).unwrap_or(StatusCode::INTERNAL_SERVER_ERROR)
}

/// Turns an error response, whoever made it, into a problem document; leaves others alone.
pub fn complete(mut response: Response, path: &str, request_id: &str) -> Response {
    let error = response.extensions_mut().remove::<ServiceError>();
    let Some(error) = error.or_else(|| foreign(response.status(), path)) else { return response };
    let row = error.kind.row();
    let problem = Problem {
        problem_type: format!("/docs#{}", row.code),
        title: row.title.to_owned(),
        status: row.status,
        detail: error.detail.clone(),
        instance: path.to_owned(),
        code: row.code.to_owned(),
        request_id: request_id.to_owned(),
    };
    let body = serde_json::to_vec(&problem).unwrap_or_default();
    let mut told = (status(error.kind), body).into_response();
    let headers = told.headers_mut();
    // what the first response said beyond its body stays, Allow and Accept-Encoding for two
    for name in [header::ALLOW, header::ACCEPT_ENCODING] {
        if let Some(value) = response.headers_mut().remove(&name) {
            headers.insert(name, value);
        }
    }
    headers.insert(header::CONTENT_TYPE, HeaderValue::from_static(MEDIA_TYPE));
    if error.kind == ErrorKind::Unauthenticated {
        headers.insert(header::WWW_AUTHENTICATE, HeaderValue::from_static("Bearer"));
    }
    if let Some(seconds) = error.retry_after() {
        headers.insert(header::RETRY_AFTER, HeaderValue::from(seconds));
    }
    told
}

/// The error behind a response that a library made.
fn foreign(status: StatusCode, path: &str) -> Option<ServiceError> {
    let (kind, detail) = match status {
        StatusCode::NOT_FOUND => {
            (ErrorKind::NotFound, format!("nothing is at {path}: /docs lists what there is"))
        }
        StatusCode::METHOD_NOT_ALLOWED => (
            ErrorKind::MethodNotAllowed,
            format!("{path} has no such method: the Allow header lists those it has"),
        ),
        StatusCode::UNSUPPORTED_MEDIA_TYPE => (
            ErrorKind::UnsupportedEncoding,
            "the Content-Encoding is not known: send gzip, zstd or none".to_owned(),
        ),
        StatusCode::NOT_ACCEPTABLE => (
            ErrorKind::NotAcceptable,
            "Accept-Encoding allows none of gzip, zstd and identity: leave it out, or allow one of them".to_owned(),
        ),
        StatusCode::INTERNAL_SERVER_ERROR => {
            (ErrorKind::Internal, "the request failed by a fault of the service".to_owned())
        }
        status if status.is_client_error() => {
            (ErrorKind::MalformedBody, format!("the request cannot be read ({status})"))
        }
        _ => return None,
    };
    Some(ServiceError::new(kind, detail))
}
