use std::time::Instant;

use axum::{
    extract::{MatchedPath, Request},
    http::{HeaderName, HeaderValue, Method},
    middleware::Next,
    response::Response,
};
use tracing::Instrument;
use uuid::Uuid;

use super::problem;
use crate::service::ServiceError;

const REQUEST_ID: HeaderName = HeaderName::from_static("x-request-id");
/// Longest request id taken over from a caller.
const MAX_REQUEST_ID: usize = 128;

/// Gives each request its id, its span and its line in the log, and each error its document.
pub async fn wrap(request: Request, next: Next) -> Response {
    let begin = Instant::now();
    let id = request_id(&request);
    let route = request.extensions().get::<MatchedPath>().map(|path| path.as_str().to_owned());
    let (method, path) = (request.method().clone(), request.uri().path().to_owned());
    let span = tracing::info_span!("http", request_id = id, %method, path);
    let response = next.run(request).instrument(span.clone()).await;
    let error = response.extensions().get::<ServiceError>().cloned();
    let mut response = problem::complete(response, &path, &id);
    if let Ok(value) = HeaderValue::from_str(&id) {
        response.headers_mut().insert(REQUEST_ID, value);
    }
    measure(&method, &route, &response, error.as_ref(), begin);
    let (status, seconds) = (response.status().as_u16(), begin.elapsed().as_secs_f64());
    span.in_scope(|| match error {
        Some(error) => tracing::info!(status, seconds, code = error.kind.row().code, "{error}"),
        None => tracing::info!(status, seconds, "answered"),
    });
    response
}

/// Counts the request and its time, by route and not by path: there are few routes.
fn measure(
    method: &Method,
    route: &Option<String>,
    response: &Response,
    error: Option<&ServiceError>,
    begin: Instant,
) {
    let labels = [
        ("method", method.to_string()),
        ("route", route.clone().unwrap_or_else(|| "none".to_owned())),
        ("status", response.status().as_u16().to_string()),
    ];
    metrics::histogram!("http_server_request_duration_seconds", &labels).record(begin.elapsed());
    if let Some(error) = error {
        error.count();
    }
}

/// The caller's id where it sent a decent one, a new one otherwise.
fn request_id(request: &Request) -> String {
    let sent = request.headers().get(REQUEST_ID).and_then(|value| value.to_str().ok());
    let decent = |id: &&str| {
        !id.is_empty() && id.len() <= MAX_REQUEST_ID && id.bytes().all(|b| b.is_ascii_graphic())
    };
    sent.filter(decent).map_or_else(|| Uuid::now_v7().to_string(), str::to_owned)
}
