use std::time::Instant;

use axum::{extract::Request, http::HeaderMap, middleware::Next, response::Response};
use tracing::Instrument;
use uuid::Uuid;

/// Gives each call its id, its span, its line in the log and its place in the metrics.
pub async fn wrap(mut request: Request, next: Next) -> Response {
    let begin = Instant::now();
    let sent = request.headers().get("x-request-id").and_then(|id| id.to_str().ok());
    let id = sent.filter(|id| !id.is_empty() && id.len() <= 128).map(str::to_owned);
    let id = id.unwrap_or_else(|| Uuid::now_v7().to_string());
    let call = request.uri().path().to_owned();
    if let Ok(value) = id.parse() {
        request.headers_mut().insert("x-request-id", value);
    }
    let span = tracing::info_span!("grpc", request_id = id, call);
    let mut response = next.run(request).instrument(span.clone()).await;
    if let Ok(value) = id.parse() {
        response.headers_mut().insert("x-request-id", value);
    }
    // calls that fail at once say so in their head; a good one says so at its end
    let code = status(response.headers()).unwrap_or(0);
    let labels = [("call", known(&call)), ("code", code.to_string())];
    metrics::histogram!("rpc_server_duration_seconds", &labels).record(begin.elapsed());
    span.in_scope(|| tracing::info!(code, seconds = begin.elapsed().as_secs_f64(), "answered"));
    response
}

fn status(headers: &HeaderMap) -> Option<i32> {
    headers.get("grpc-status")?.to_str().ok()?.parse().ok()
}

/// The call's path where it is one of the contract's, so that strangers make no new labels.
fn known(call: &str) -> String {
    let ours = ["/conicoid.v1.", "/grpc.health.v1.", "/grpc.reflection.v1"];
    if ours.iter().any(|start| call.starts_with(start)) { call } else { "none" }.to_owned()
}
