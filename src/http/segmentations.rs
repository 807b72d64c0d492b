use axum::{
    Extension,
    extract::{Request as HttpRequest, State},
    response::Response,
};

use super::{
    accept,
    answer::answered,
    app::App,
    body, jobs,
    media_type::FormMessage,
    prefer::Preferences,
    query::{Pairs, from_query},
};
use crate::service::{Caller, Document, Needs, Representation, ServiceError, render};

/// Find the quadric surfaces in a cloud
///
/// The cloud is the body, its format named by `format` or `Content-Type` (such as `model/ply`) or told
/// from its bytes; or it is the part `cloud` of a multipart body, whose part `parameters` is a JSON
/// object. A parameter stands once: in the query, or in that object. The body may be compressed
/// (`Content-Encoding: gzip` or `zstd`). A caller that goes away cancels the work.
/// Coordinates may be up to 1e50 in size, and must extend over at least 1e-50.
///
/// With `Prefer: respond-async` the answer is that of `POST /v1/jobs`, 202 with the job; with `wait` beside it
/// (`Prefer: respond-async, wait=10`) the surfaces, where they are found within so many seconds.
#[utoipa::path(
    post,
    path = "/v1/segmentations",
    operation_id = "createSegmentation",
    tag = "segmentations",
    responses(
        (status = 200, description = "The surfaces found, in the form that `Accept` asks for", body = Document),
    ),
)]
pub async fn create(
    State(app): State<App>,
    Extension(caller): Extension<Caller>,
    query: Pairs,
    message: HttpRequest,
) -> Result<Response, ServiceError> {
    let preferences = Preferences::of(message.headers());
    let form = accept::negotiate(message.headers(), &Representation::ALL);
    let (mut request, key) = (from_query(query)?, jobs::idempotency_key(message.headers())?);
    if preferences.respond_async {
        let upload = body::read(&app.service, message, &mut request).await?;
        let (job, _) = app.service.submit(caller.clone(), key, upload, request).await?;
        let Some(time) = preferences.wait else {
            return Ok(jobs::preferred(jobs::accepted(job.view())));
        };
        app.service.wait_for(&job, time).await;
        let id = job.peek(|record| record.id);
        if !job.peek(|record| record.state.is_final()) {
            return Ok(jobs::preferred(jobs::accepted(job.view())));
        }
        return jobs::told(&app, &caller, &id.to_string(), form?, None).await;
    }
    let form = form?;
    let upload = body::read(&app.service, message, &mut request).await?;
    let held = upload.held().clone();
    let room = app.service.room_for(form, &caller)?;
    let write = move |answer, labels| {
        let _room = room;
        render(form, answer, labels)
    };
    let bytes = app.service.segment(upload, request, Needs::of(form), write).await?;
    Ok(answered(form, held.carrying(bytes)))
}

/// Find the quadric surfaces in a cloud of a form
///
/// `POST /v1/segmentations` for clients that know one kind of body for each path: a multipart body with the
/// part `cloud` and a part for each parameter, or all of them as a JSON object in the part `parameters`.
#[utoipa::path(
    post,
    path = "/v1/segmentations/form",
    operation_id = "createSegmentationFromForm",
    tag = "segmentations",
    responses(
        (status = 200, description = "The surfaces found, in the form that `Accept` asks for", body = Document),
    ),
)]
pub async fn create_from_form(
    app: State<App>,
    caller: Extension<Caller>,
    query: Pairs,
    FormMessage(message): FormMessage,
) -> Result<Response, ServiceError> {
    create(app, caller, query, message).await
}
