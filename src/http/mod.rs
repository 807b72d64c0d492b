//! The HTTP interface: routes, payloads, problems and the OpenAPI document.

mod accept;
mod admin;
mod body;
mod context;
mod openapi;
mod problem;
mod segmentations;
mod server;

use std::{sync::Arc, time::Duration};

use axum::{
    Router,
    extract::{DefaultBodyLimit, State},
    http::header,
    middleware,
    response::{Html, IntoResponse},
};
use tower_http::{catch_panic::CatchPanicLayer, decompression::RequestDecompressionLayer};
use utoipa::openapi::OpenApi;
use utoipa_axum::{router::OpenApiRouter, routes};

pub use admin::admin_router;
pub use problem::Problem;
pub use server::serve;

use crate::service::Service;

/// How the HTTP interface takes requests.
#[derive(Clone, Debug)]
pub struct HttpConfig {
    /// Longest time an upload may take.
    pub upload_timeout: Duration,
}

/// What every handler can reach.
#[derive(Clone, Debug)]
pub struct App {
    service: Arc<Service>,
    config: Arc<HttpConfig>,
    /// The OpenAPI document, as it is sent.
    openapi: Arc<str>,
}

/// The HTTP interface of `service`.
pub fn router(service: Arc<Service>, config: HttpConfig) -> Router {
    let (routes, openapi) = routes_and_openapi();
    let app = App {
        service,
        config: Arc::new(config),
        openapi: openapi.to_json().unwrap_or_default().into(),
    };
    routes
        .layer(DefaultBodyLimit::disable()) // uploads are limited as they are read
        .layer(RequestDecompressionLayer::new())
        .layer(CatchPanicLayer::new())
        .layer(middleware::from_fn(context::wrap))
        .with_state(app)
}

/// The OpenAPI document of the HTTP interface.
pub fn openapi() -> OpenApi {
    routes_and_openapi().1
}

fn routes_and_openapi() -> (Router<App>, OpenApi) {
    let (routes, described) = OpenApiRouter::with_openapi(openapi::base())
        .routes(routes!(segmentations::create))
        .routes(routes!(openapi_json))
        .routes(routes!(docs))
        .split_for_parts();
    (routes, openapi::complete(described))
}

/// The OpenAPI document
///
/// This interface, in the OpenAPI 3.1 form that generators of clients read.
#[utoipa::path(get, path = "/openapi.json", tag = "contract", responses(
    (status = 200, description = "The document", body = Object, content_type = "application/json")
))]
async fn openapi_json(State(app): State<App>) -> impl IntoResponse {
    ([(header::CONTENT_TYPE, "application/json")], app.openapi.to_string())
}

/// The reference as a page
///
/// Written from the OpenAPI document; needs nothing from elsewhere.
#[utoipa::path(get, path = "/docs", tag = "contract", responses(
    (status = 200, description = "The page", body = String, content_type = "text/html")
))]
async fn docs() -> impl IntoResponse {
    let policy = "default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'; connect-src 'self'";
    ([(header::CONTENT_SECURITY_POLICY, policy)], Html(include_str!("docs.html")))
}
