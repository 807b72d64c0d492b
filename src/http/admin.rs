use std::sync::Arc;

use axum::{Router, extract::State, http::StatusCode, routing::get};
use futures::future::BoxFuture;
use tokio_util::sync::CancellationToken;

/// Writes the metrics in Prometheus' text form.
pub type Gauges = Arc<dyn Fn() -> String + Send + Sync>;

/// Says why the service cannot take all requests now, if it cannot.
pub type Readiness = Arc<dyn Fn() -> BoxFuture<'static, Option<String>> + Send + Sync>;

/// The listener for operators: `/livez` says that the process answers, `/readyz` that it takes
/// requests, which ends when `stop` begins the drain and while `readiness` says why, and `/metrics` what
/// it has done.
pub fn admin_router(stop: CancellationToken, metrics: Gauges, readiness: Readiness) -> Router {
    Router::new()
        .route("/livez", get(async || "live\n"))
        .route("/readyz", get(readyz).with_state((stop, readiness)))
        .route("/metrics", get(async move || metrics()))
}

async fn readyz(
    State((stop, readiness)): State<(CancellationToken, Readiness)>,
) -> (StatusCode, String) {
    if stop.is_cancelled() {
        return (StatusCode::SERVICE_UNAVAILABLE, "draining\n".to_owned());
    }
    match readiness().await {
        None => (StatusCode::OK, "ready\n".to_owned()),
        Some(why) => (StatusCode::SERVICE_UNAVAILABLE, format!("not ready: {why}\n")),
    }
}
