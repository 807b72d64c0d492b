use axum::{
    Extension,
    extract::{Request as HttpRequest, State},
    http::HeaderMap,
    response::Response,
};

use super::{
    accept,
    answer::{answered, carried, room_for},
    app::App,
    body, jobs,
    query::{Pairs, from_query},
};
use crate::service::{Caller, Document, ErrorKind, Representation, ServiceError};

/// Find the quadric surfaces in a cloud
///
/// The cloud is the body, its format named by `format` or `Content-Type` (such as `model/ply`) or told
/// from its bytes; or it is the part `cloud` of a multipart body, whose part `parameters` is a JSON
/// object. A parameter stands once: in the query, or in that object. The body may be compressed
/// (`Content-Encoding: gzip` or `zstd`). A caller that goes away cancels the work.
/// Coordinates may be up to 1e50 in size, and must extend over at least 1e-50.
///
/// With `Prefer: respond-async` the cloud becomes a job that outlives the request. A retried
/// submission with the same `Idempotency-Key` and the same content is the same job; without
/// `respond-async` the key has no effect, for the same request has the same answer.
#[utoipa::path(
    post,
    path = "/v1/segmentations",
    operation_id = "createSegmentation",
    tag = "segmentations",
    responses(
        (status = 200, description = "The surfaces found, in the form that `Accept` asks for", body = Document),
        (status = 202, description = "The job", body = jobs::JobDocument),
    ),
)]
pub async fn create(
    State(app): State<App>,
    Extension(caller): Extension<Caller>,
    query: Pairs,
    message: HttpRequest,
) -> Result<Response, ServiceError> {
    let mut request = from_query(query)?;
    let (later, key) = (respond_async(message.headers()), idempotency_key(message.headers())?);
    let form = accept::negotiate(message.headers(), Representation::ALL);
    // a job's result is negotiated when it is fetched
    let form = if later { form.unwrap_or(Representation::Json) } else { form? };
    let upload = body::read(&app.service, message, &mut request).await?;
    if later {
        let (job, _) = app.service.submit(caller, key, upload, request).await?;
        return Ok(jobs::accepted(job.view()));
    }
    let held = upload.held().clone();
    let room = room_for(form, &app, &caller)?;
    let write = move |answer, labels| {
        let _room = room;
        form.render(answer, labels)
    };
    let bytes = app.service.segment(upload, request, form.has_points(), write).await?;
    Ok(answered(form, carried(bytes, &held)))
}

/// Whether the caller prefers a job (RFC 7240).
fn respond_async(headers: &HeaderMap) -> bool {
    let values = headers.get_all("prefer").iter().filter_map(|value| value.to_str().ok());
    let mut preferences = values.flat_map(|value| value.split([',', ';'])).map(str::trim);
    preferences.any(|preference| preference.eq_ignore_ascii_case("respond-async"))
}

fn idempotency_key(headers: &HeaderMap) -> Result<Option<String>, ServiceError> {
    let Some(value) = headers.get("idempotency-key") else { return Ok(None) };
    let text = value.to_str().map_err(|_| {
        ServiceError::new(ErrorKind::InvalidParameter, "Idempotency-Key is not visible ASCII")
    })?;
    Ok(Some(text.to_owned()))
}
