use std::time::Instant;

use axum::{
    extract::{MatchedPath, Request},
    http::{HeaderName, HeaderValue, Method, StatusCode},
    middleware::Next,
    response::Response,
};
use tracing::Span;

use super::problem;
use crate::{
    jobs::trace::{self, Facts},
    service::{ServiceError, request_id},
};

const REQUEST_ID: HeaderName = HeaderName::from_static("x-request-id");

/// Gives each request its id, its spans in log and trace and its line in the log, and each error its
/// document.
pub async fn wrap(request: Request, next: Next) -> Response {
    let begin = Instant::now();
    let id = request_id(text(&request, REQUEST_ID.as_str()));
    let route = request.extensions().get::<MatchedPath>().map(|path| path.as_str().to_owned());
    let (method, path) = (request.method().clone(), request.uri().path().to_owned());
    let log = tracing::info_span!("http", request_id = id, %method, path);
    let span = traced(&log, &request, route.as_deref());
    let scope = trace::Scope::new(log.clone(), span.clone());
    let response = scope.clone().cover(next.run(request)).await;
    let error = response.extensions().get::<ServiceError>().cloned();
    let mut response = problem::complete(response, &path, &id);
    if let Ok(value) = HeaderValue::from_str(&id) {
        response.headers_mut().insert(REQUEST_ID, value);
    }
    let status = response.status();
    measure(&method, &route, status, error.as_ref(), begin);
    tell(&span, status, error.as_ref());
    let (status, seconds) = (status.as_u16(), begin.elapsed().as_secs_f64());
    let Facts { caller, format, bytes, points, regions, job } = scope.facts();
    log.in_scope(|| match error {
        Some(error) => {
            let code = error.kind.row().code;
            tracing::info!(caller, format, bytes, points, status, seconds, code, "{error}");
        }
        None => {
            tracing::info!(
                caller, format, bytes, points, regions, job, status, seconds, "answered"
            );
        }
    });
    response
}

/// The request's span in its trace, by the conventions of HTTP servers.
fn traced(log: &Span, request: &Request, route: Option<&str>) -> Span {
    let method = request.method().as_str();
    let name = route.map_or_else(|| method.to_owned(), |route| format!("{method} {route}"));
    let header = |name: &str| text(request, name).map(str::to_owned);
    let span = trace::server(log, &name, header);
    trace::set(&span, "http.request.method", method.to_owned());
    trace::set(&span, "url.path", request.uri().path().to_owned());
    trace::set(&span, "url.scheme", request.uri().scheme_str().unwrap_or("http").to_owned());
    if let Some(route) = route {
        trace::set(&span, "http.route", route.to_owned());
    }
    span
}

fn tell(span: &Span, status: StatusCode, error: Option<&ServiceError>) {
    trace::set(span, "http.response.status_code", i64::from(status.as_u16()));
    // an error of the caller's is none of the server's
    if status.is_server_error() {
        let code = error.map(|error| error.kind.row().code.to_owned());
        trace::fail(span, code.unwrap_or_else(|| status.as_u16().to_string()));
    }
}

/// Counts the request and its time, by route and not by path: there are few routes.
fn measure(
    method: &Method,
    route: &Option<String>,
    status: StatusCode,
    error: Option<&ServiceError>,
    begin: Instant,
) {
    let labels = [
        ("http_request_method", known(method)),
        ("http_route", route.clone().unwrap_or_default()),
        ("http_response_status_code", status.as_u16().to_string()),
    ];
    metrics::histogram!("http_server_request_duration_seconds", &labels).record(begin.elapsed());
    if let Some(error) = error {
        error.count();
    }
}

/// The method where it is one of HTTP's own, so that strangers make no new labels.
fn known(method: &Method) -> String {
    const KNOWN: [Method; 8] = [
        Method::GET,
        Method::HEAD,
        Method::POST,
        Method::PUT,
        Method::DELETE,
        Method::OPTIONS,
        Method::PATCH,
        Method::TRACE,
    ];
    if KNOWN.contains(method) { method.to_string() } else { "_OTHER".to_owned() }
}

/// A header, where it is there and text.
fn text<'a>(request: &'a Request, name: &str) -> Option<&'a str> {
    request.headers().get(name)?.to_str().ok()
}
