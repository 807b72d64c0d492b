use std::sync::Arc;

use axum::{Router, extract::State, http::StatusCode, routing::get};
use tokio_util::sync::CancellationToken;

use super::Connections;

/// Writes the metrics in Prometheus' text form.
pub type Gauges = Arc<dyn Fn() -> String + Send + Sync>;

/// The listener for operators: `/livez` says that the process answers, `/readyz` that it takes
/// requests, which ends when `stop` begins the drain and is broken off while newcomers wait for one of
/// the `connections`, and `/metrics` what it has done.
pub fn admin_router(stop: CancellationToken, connections: Connections, metrics: Gauges) -> Router {
    Router::new()
        .route("/livez", get(async || "live\n"))
        .route("/readyz", get(readyz).with_state((stop, connections)))
        .route("/metrics", get(async move || metrics()))
}

async fn readyz(
    State((stop, connections)): State<(CancellationToken, Connections)>,
) -> (StatusCode, &'static str) {
    if stop.is_cancelled() {
        (StatusCode::SERVICE_UNAVAILABLE, "draining\n")
    } else if connections.exhausted() {
        (StatusCode::SERVICE_UNAVAILABLE, "every connection has a request at work\n")
    } else {
        (StatusCode::OK, "ready\n")
    }
}
