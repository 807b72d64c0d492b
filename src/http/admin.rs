use std::sync::Arc;

use axum::{Router, extract::State, http::StatusCode, routing::get};
use futures::future::BoxFuture;
use tokio_util::sync::CancellationToken;

use super::server::Connections;

/// Writes the metrics in Prometheus' text form.
pub type Gauges = Arc<dyn Fn() -> String + Send + Sync>;

/// Says why the service cannot take all requests now, if it cannot.
pub type Readiness = Arc<dyn Fn() -> BoxFuture<'static, Option<String>> + Send + Sync>;

/// The listener for operators: `/livez` says that the process answers, `/readyz` that it takes
/// requests, which ends when `stop` begins the drain and is broken off while newcomers wait for one of
/// the `connections` or `readiness` says why, and `/metrics` what it has done.
pub fn admin_router(
    stop: CancellationToken,
    connections: Connections,
    metrics: Gauges,
    readiness: Readiness,
) -> Router {
    Router::new()
        .route("/livez", get(async || "live\n"))
        .route("/readyz", get(readyz).with_state((stop, connections, readiness)))
        .route("/metrics", get(async move || metrics()))
}

async fn readyz(
    State((stop, connections, readiness)): State<(CancellationToken, Connections, Readiness)>,
) -> (StatusCode, String) {
    let not = |why: &str| (StatusCode::SERVICE_UNAVAILABLE, format!("{why}\n"));
    if stop.is_cancelled() {
        return not("draining");
    }
    if connections.exhausted() {
        return not("not ready: every connection has a request at work");
    }
    match readiness().await {
        None => (StatusCode::OK, "ready\n".to_owned()),
        Some(why) => not(&format!("not ready: {why}")),
    }
}
