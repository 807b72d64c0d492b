//! The HTTP interface: routes, payloads, problems and the OpenAPI document.

mod accept;
mod admin;
mod answer;
mod app;
mod auth;
mod body;
mod compress;
mod context;
mod encoding;
mod fits;
mod form;
mod host;
mod job;
mod jobs;
mod linger;
mod media_type;
mod meter;
mod multipart;
mod openapi;
mod pages;
mod prefer;
mod problem;
mod query;
mod segmentations;
mod seldom;
mod server;

use std::sync::Arc;

use axum::{
    Router,
    extract::{DefaultBodyLimit, State},
    http::{HeaderName, HeaderValue, Method, header},
    middleware,
    response::IntoResponse,
    routing::get,
};
use tower_http::{catch_panic::CatchPanicLayer, cors::CorsLayer};
use utoipa::openapi::OpenApi;
use utoipa_axum::{router::OpenApiRouter, routes};

pub use admin::{Gauges, Readiness, admin_router};
pub use app::App;
pub use problem::Problem;
pub use server::{Connections, Patience, Tls, serve};

use crate::service::Service;

/// How the HTTP interface takes requests.
#[derive(Clone, Debug)]
pub struct HttpConfig {
    /// Web pages of these origins may call; none by default.
    pub cors_origins: Vec<HeaderValue>,
}

/// The HTTP interface of `service`.
pub fn router(service: Arc<Service>, config: HttpConfig) -> Router {
    let (cases, mut openapi) = use_cases().split_for_parts();
    let (contract, described) = contract().split_for_parts();
    openapi.merge(described);
    let openapi = openapi::complete(openapi).to_json().unwrap_or_default().into();
    let cors = cors(&config.cors_origins);
    let app = App { service, openapi };
    cases
        .layer(middleware::map_request(encoding::unpacked))
        .layer(DefaultBodyLimit::disable()) // uploads are limited as they are read
        .route_layer(middleware::from_fn_with_state(app.clone(), auth::identify))
        .merge(contract)
        .route("/viewer/{file}", get(pages::file))
        .layer(compress::layer())
        .layer(CatchPanicLayer::new())
        .layer(middleware::from_fn(host::check))
        .layer(middleware::from_fn(linger::read_to_the_end))
        .layer(cors)
        .layer(middleware::from_fn(context::wrap))
        .with_state(app)
}

/// The OpenAPI document of the HTTP interface.
pub fn openapi() -> OpenApi {
    let mut openapi = use_cases().into_openapi();
    openapi.merge(contract().into_openapi());
    openapi::complete(openapi)
}

/// The routes that ask for a key where the service has any.
fn use_cases() -> OpenApiRouter<App> {
    OpenApiRouter::with_openapi(openapi::base())
        .routes(routes!(segmentations::create))
        .routes(routes!(segmentations::create_from_form))
        .routes(routes!(fits::create))
        .routes(routes!(fits::create_from_form))
        .routes(routes!(jobs::create, jobs::list))
        .routes(routes!(jobs::create_from_form))
        .routes(routes!(jobs::get, jobs::delete))
        .routes(routes!(jobs::result))
        .routes(routes!(jobs::events))
}

/// The routes open to everybody.
fn contract() -> OpenApiRouter<App> {
    OpenApiRouter::new()
        .routes(routes!(openapi_json))
        .routes(routes!(pages::docs))
        .routes(routes!(pages::viewer))
}

fn cors(origins: &[HeaderValue]) -> CorsLayer {
    if origins.is_empty() {
        return CorsLayer::new();
    }
    let sent = ["authorization", "content-type", "content-encoding", "prefer", "idempotency-key"];
    let shown = ["location", "retry-after", "x-request-id"];
    CorsLayer::new()
        .allow_origin(origins.to_vec())
        .allow_methods([Method::GET, Method::POST, Method::DELETE])
        .allow_headers(sent.map(HeaderName::from_static))
        .expose_headers(shown.map(HeaderName::from_static))
}

/// The OpenAPI document
///
/// This interface, in the OpenAPI 3.1 form that generators of clients read.
#[utoipa::path(
    get, path = "/openapi.json", operation_id = "getOpenApi", tag = "contract",
    responses((
        status = 200, description = "The document", body = Object, content_type = "application/json"
    )),
)]
async fn openapi_json(State(app): State<App>) -> impl IntoResponse {
    ([(header::CONTENT_TYPE, "application/json")], app.openapi)
}
