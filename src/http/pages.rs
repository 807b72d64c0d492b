//! The pages for people: the viewer with its files, and the reference. They load nothing from elsewhere.
//!
//! The viewer draws its points itself (`render.js`). Of the crates that carry a script with a 3D view, plotly 0.14 is the one
//! that is kept up, and its view took 3 s to begin with 100 000 points and minutes with a million, without a graphics
//! card; this one shows a part of a million at once and the rest in the next frames.

use axum::{
    extract::Path,
    http::{HeaderName, StatusCode, header},
    response::{Html, IntoResponse, Response},
};

/// What a page may use: files of this service alone, no text of its own as script or style.
const PAGE_POLICY: &str = "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; \
    img-src data:; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";
const SCRIPT: &str = "text/javascript; charset=utf-8";
const STYLE: &str = "text/css; charset=utf-8";

macro_rules! files {
    ($($name:literal: $kind:expr),* $(,)?) => {
        &[$(($name, $kind, include_str!(concat!("pages/viewer/", $name)))),*]
    };
}

/// The files of the pages: name, media type, text.
const FILES: &[(&str, &str, &str)] = files! {
    "app.js": SCRIPT,
    "camera.js": SCRIPT,
    "card.js": SCRIPT,
    "cloud.js": SCRIPT,
    "docs.css": STYLE,
    "docs.js": SCRIPT,
    "dom.js": SCRIPT,
    "edit.js": SCRIPT,
    "example.js": SCRIPT,
    "file.js": SCRIPT,
    "form.js": SCRIPT,
    "histogram.js": SCRIPT,
    "key.js": SCRIPT,
    "keys.js": SCRIPT,
    "list.js": SCRIPT,
    "overlay.js": SCRIPT,
    "palette.js": SCRIPT,
    "relations.js": SCRIPT,
    "render.js": SCRIPT,
    "saves.js": SCRIPT,
    "service.js": SCRIPT,
    "steps.js": SCRIPT,
    "surfaces.js": SCRIPT,
    "telling.js": SCRIPT,
    "text.js": SCRIPT,
    "view.js": SCRIPT,
    "viewer.css": STYLE,
};

/// The reference as a page
///
/// Written from the OpenAPI document; needs nothing from elsewhere.
#[utoipa::path(
    get, path = "/docs", operation_id = "getDocs", tag = "contract",
    responses((status = 200, description = "The page", body = String, content_type = "text/html")),
)]
pub async fn docs() -> impl IntoResponse {
    page(include_str!("pages/docs.html"), PAGE_POLICY)
}

/// The viewer
///
/// A page that segments a cloud dropped on it and shows its points in the colours of their surfaces.
#[utoipa::path(
    get, path = "/", operation_id = "getViewer", tag = "contract",
    responses((status = 200, description = "The page", body = String, content_type = "text/html")),
)]
pub async fn viewer() -> impl IntoResponse {
    page(include_str!("pages/viewer/viewer.html"), PAGE_POLICY)
}

/// One of the pages' files. They are no part of the contract.
pub async fn file(Path(name): Path<String>) -> Response {
    let Some((_, kind, text)) = FILES.iter().find(|(known, ..)| *known == name) else {
        return StatusCode::NOT_FOUND.into_response();
    };
    ([(header::CONTENT_TYPE, *kind), UNCHANGED, AS_SAID], *text).into_response()
}

/// The files of one version belong together: each is asked for again.
const UNCHANGED: (HeaderName, &str) = (header::CACHE_CONTROL, "no-cache");
/// Nothing is taken for another kind than it is said to be.
const AS_SAID: (HeaderName, &str) = (header::X_CONTENT_TYPE_OPTIONS, "nosniff");

fn page(text: &'static str, policy: &'static str) -> impl IntoResponse {
    ([(header::CONTENT_SECURITY_POLICY, policy), UNCHANGED, AS_SAID], Html(text))
}
