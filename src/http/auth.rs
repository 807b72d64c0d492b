use axum::{
    extract::{Request, State},
    http::header,
    middleware::Next,
    response::{IntoResponse, Response},
};

use super::app::App;
use crate::service::Peer;

/// Finds out who calls, for the handlers behind it; by key or by the certificate of the
/// connection; refuses those who have no valid key.
pub async fn identify(State(app): State<App>, mut request: Request, next: Next) -> Response {
    let header = request.headers().get(header::AUTHORIZATION).and_then(|value| value.to_str().ok());
    match app.service.caller(header, request.extensions().get::<Peer>()) {
        Ok(caller) => {
            request.extensions_mut().insert(caller);
            next.run(request).await
        }
        Err(error) => error.into_response(),
    }
}
