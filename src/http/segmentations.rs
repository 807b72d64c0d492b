use axum::{
    extract::{Query, Request as HttpRequest, State, rejection::QueryRejection},
    http::header,
    response::{IntoResponse, Response},
};

use super::{App, accept, body};
use crate::service::{Document, ErrorKind, Representation, Request, ServiceError};

/// Name and value pairs of a query, in its order.
pub type Pairs = Result<Query<Vec<(String, String)>>, QueryRejection>;

/// Find the quadric surfaces in a cloud
///
/// The cloud is the body, its format named by `Content-Type` or `format` or told from its bytes; or
/// it is the part `cloud` of a multipart body, whose part `parameters` is a JSON object. The body may
/// be compressed (`Content-Encoding: gzip` or `zstd`). A caller that goes away cancels the work.
#[utoipa::path(
    post,
    path = "/v1/segmentations",
    operation_id = "createSegmentation",
    tag = "segmentations",
    responses((status = 200, description = "The surfaces found", body = Document)),
)]
pub async fn create(
    State(app): State<App>,
    query: Pairs,
    message: HttpRequest,
) -> Result<Response, ServiceError> {
    let mut request = from_query(query)?;
    let form = accept::negotiate(message.headers(), Representation::ALL)?;
    let timeout = app.config.upload_timeout;
    let upload = body::read(&app.service, message, &mut request, timeout).await?;
    let answer = app.service.segment(upload, request, move |d| form.render(d)).await?;
    let answer = answer.map_err(|e| ServiceError::new(ErrorKind::Internal, e.to_string()))?;
    Ok(answered(form, answer))
}

/// A result in one of its forms.
pub fn answered(form: Representation, bytes: Vec<u8>) -> Response {
    let headers = [(header::CONTENT_TYPE, form.media_type()), (header::VARY, "Accept")];
    (headers, bytes).into_response()
}

fn from_query(query: Pairs) -> Result<Request, ServiceError> {
    let Query(pairs) = query.map_err(|e| {
        ServiceError::new(ErrorKind::InvalidParameter, format!("the query cannot be read: {e}"))
    })?;
    Request::from_pairs(pairs.iter().map(|(name, value)| (name.as_str(), value.as_str())))
}
