use std::{convert::Infallible, time::Duration};

use axum::{
    Extension, Json,
    extract::{Path, Request as HttpRequest, State},
    http::{HeaderMap, HeaderValue, StatusCode, header},
    response::{
        IntoResponse, Response, Sse,
        sse::{Event, KeepAlive},
    },
};
use futures::{Stream, StreamExt};

use super::{
    accept,
    answer::answered,
    app::App,
    body,
    job::{JobDocument, JobList},
    media_type::FormMessage,
    prefer::{self, Preferences},
    query::{self, Pairs},
};
use crate::{
    jobs::JobView,
    service::{Caller, ErrorKind, JobPage, Listing, Needs, Representation, ServiceError, render},
};

/// A silent event stream says this often that it lives.
const KEEP_ALIVE: Duration = Duration::from_secs(15);

/// The answer to an accepted job.
pub fn accepted(view: JobView) -> Response {
    let location = format!("/v1/jobs/{}", view.record.id);
    let headers = [(header::LOCATION, location)];
    (StatusCode::ACCEPTED, headers, Json(JobDocument::from(view))).into_response()
}

/// Says that a job is what the caller preferred.
pub fn preferred(mut response: Response) -> Response {
    let applied = HeaderValue::from_static("respond-async");
    response.headers_mut().insert("preference-applied", applied);
    response
}

/// Segment a cloud as a job
///
/// The cloud comes as to `POST /v1/segmentations`, whose parameters apply. The job outlives the request. A retried
/// submission with the same `Idempotency-Key` and the same content is the same job. With `wait`, or `Prefer: wait=10`,
/// the answer comes when the job has ended, or after so many seconds.
#[utoipa::path(
    post, path = "/v1/jobs", operation_id = "createJob", tag = "jobs",
    responses((status = 202, description = "The job", body = JobDocument)),
)]
pub async fn create(
    State(app): State<App>,
    Extension(caller): Extension<Caller>,
    query: Pairs,
    message: HttpRequest,
) -> Result<Response, ServiceError> {
    let (pairs, wait) = prefer::take_wait(query)?;
    let mut request = query::from_pairs(pairs)?;
    let (preferences, key) =
        (Preferences::of(message.headers()), idempotency_key(message.headers())?);
    let upload = body::read(&app.service, message, &mut request).await?;
    let (job, _) = app.service.submit(caller, key, upload, request).await?;
    if let Some(time) = wait.or(preferences.wait) {
        app.service.wait_for(&job, time).await;
    }
    let response = accepted(job.view());
    Ok(if preferences.respond_async { preferred(response) } else { response })
}

/// Segment a cloud in a form as a job
///
/// `POST /v1/jobs` for clients that know one kind of body for each path: a multipart body with the part `cloud`
/// and a part for each parameter, or all of them as a JSON object in the part `parameters`.
#[utoipa::path(
    post, path = "/v1/jobs/form", operation_id = "createJobFromForm", tag = "jobs",
    responses((status = 202, description = "The job", body = JobDocument)),
)]
pub async fn create_from_form(
    app: State<App>,
    caller: Extension<Caller>,
    query: Pairs,
    FormMessage(message): FormMessage,
) -> Result<Response, ServiceError> {
    create(app, caller, query, message).await
}

/// The idempotency key of a submission.
///
/// # Errors
/// It is no text.
pub fn idempotency_key(headers: &HeaderMap) -> Result<Option<String>, ServiceError> {
    let Some(value) = headers.get("idempotency-key") else { return Ok(None) };
    let text = value.to_str().map_err(|_| {
        ServiceError::new(ErrorKind::InvalidParameter, "Idempotency-Key is not visible ASCII")
    })?;
    Ok(Some(text.to_owned()))
}

/// The caller's jobs
///
/// The newest first, in pages. They are those that the API key, or else the client certificate, has submitted; where
/// the service asks nobody who they are, those of all callers.
#[utoipa::path(
    get, path = "/v1/jobs", operation_id = "listJobs", tag = "jobs",
    responses((status = 200, description = "A page of the list", body = JobList)),
)]
pub async fn list(
    State(app): State<App>,
    Extension(caller): Extension<Caller>,
    query: Pairs,
) -> Result<Json<JobList>, ServiceError> {
    let listing = Listing::from_pairs(query::pairs(query)?)?;
    let JobPage { jobs, next_page_token } = app.service.jobs(&caller, &listing);
    Ok(Json(JobList { jobs: jobs.into_iter().map(Into::into).collect(), next_page_token }))
}

/// The state of a job
///
/// A job is visible only to the API key, or else the client certificate, that submitted it. With `wait`, or
/// `Prefer: wait=10`, the answer comes when the job has ended, or after so many seconds.
#[utoipa::path(
    get, path = "/v1/jobs/{id}", operation_id = "getJob", tag = "jobs",
    params(("id" = String, Path, description = "The job's id")),
    responses((status = 200, description = "The job", body = JobDocument)),
)]
pub async fn get(
    State(app): State<App>,
    Extension(caller): Extension<Caller>,
    Path(id): Path<String>,
    query: Pairs,
    headers: HeaderMap,
) -> Result<Json<JobDocument>, ServiceError> {
    let wait = prefer::wait_alone(query, &headers)?;
    let job = app.service.job(&caller, &id)?;
    if let Some(time) = wait {
        app.service.wait_for(&job, time).await;
    }
    Ok(Json(job.view().into()))
}

/// Cancel or forget a job
///
/// A job that is queued or running is cancelled and stays visible as such; one that has ended is
/// forgotten, with its result.
#[utoipa::path(
    delete, path = "/v1/jobs/{id}", operation_id = "deleteJob", tag = "jobs",
    params(("id" = String, Path, description = "The job's id")),
    responses((status = 200, description = "The job as it was left", body = JobDocument)),
)]
pub async fn delete(
    State(app): State<App>,
    Extension(caller): Extension<Caller>,
    Path(id): Path<String>,
    query: Pairs,
) -> Result<Json<JobDocument>, ServiceError> {
    prefer::nothing(query, "the end of a job")?;
    Ok(Json(app.service.cancel(&caller, &id).await?.view().into()))
}

/// The result of a job
///
/// In the form that `Accept` asks for. 409 until the job has succeeded; with `wait`, or `Prefer: wait=10`, the answer
/// comes when the job has ended, or after so many seconds.
#[utoipa::path(
    get, path = "/v1/jobs/{id}/result", operation_id = "getJobResult", tag = "jobs",
    params(("id" = String, Path, description = "The job's id")),
    responses((
        status = 200, description = "The surfaces found, in the form that `Accept` asks for",
        body = crate::service::Document
    )),
)]
pub async fn result(
    State(app): State<App>,
    Extension(caller): Extension<Caller>,
    Path(id): Path<String>,
    query: Pairs,
    headers: HeaderMap,
) -> Result<Response, ServiceError> {
    let (pairs, wait) = prefer::take_wait(query)?;
    let asked = asked_labels(pairs)?;
    let form = accept::negotiate(&headers, &Representation::ALL)?;
    if let Some(time) = wait.or(Preferences::of(&headers).wait) {
        app.service.wait_for(&*app.service.job(&caller, &id)?, time).await;
    }
    told(&app, &caller, &id, form, asked).await
}

/// The result of a job in one of its forms; `asked` says of JSON and protobuf whether they have the labels, where it is
/// not to be as the submitter wanted.
///
/// # Errors
/// The job has no result, there is no room, or the store fails.
pub async fn told(
    app: &App,
    caller: &Caller,
    id: &str,
    form: Representation,
    asked: Option<bool>,
) -> Result<Response, ServiceError> {
    let held = app.service.share();
    held.charge(caller.as_deref())?;
    if form == Representation::Json {
        let (kept, request) = app.service.kept_result(caller, id, &held).await?;
        if asked.unwrap_or(request.labels) {
            return Ok(answered(form, held.carried_by(kept)));
        }
    }
    let needs = Needs::of(form);
    let room = app.service.room_for(form, caller)?;
    let write = move |answer, labels| {
        let _room = room;
        render(form, answer, asked.unwrap_or(labels))
    };
    let bytes = app.service.job_result(caller, id, &held, needs, write).await?;
    Ok(answered(form, held.carrying(bytes)))
}

/// What the query says of the labels; nothing else may stand in it.
fn asked_labels(query: Vec<(String, String)>) -> Result<Option<bool>, ServiceError> {
    if let Some((name, _)) = query.iter().find(|(name, _)| name != "labels") {
        return Err(ServiceError::new(
            ErrorKind::UnknownParameter,
            format!("unknown parameter '{name}' of a result; known ones: labels, wait"),
        ));
    }
    let request = query::from_pairs(query)?;
    Ok((!request.given.is_empty()).then_some(request.labels))
}

/// The progress of a job as server-sent events
///
/// One event `job` now and at each change, whose data is a `JobDocument` as JSON on one line; the
/// stream ends with the job.
#[utoipa::path(
    get, path = "/v1/jobs/{id}/events", operation_id = "getJobEvents", tag = "jobs",
    params(("id" = String, Path, description = "The job's id")),
    responses((
        status = 200, description = "Lines `event: job` and `data: {…}`, an empty one behind each event",
        body = String, content_type = "text/event-stream"
    )),
)]
pub async fn events(
    State(app): State<App>,
    Extension(caller): Extension<Caller>,
    Path(id): Path<String>,
    query: Pairs,
) -> Result<Sse<impl Stream<Item = Result<Event, Infallible>>>, ServiceError> {
    prefer::nothing(query, "the events of a job")?;
    let job = app.service.job(&caller, &id)?;
    let watch = job.watch().take_until(app.service.book().closed());
    let events = watch.map(|view| {
        let event = Event::default().event("job").json_data(JobDocument::from(view));
        Ok(event.unwrap_or_default())
    });
    Ok(Sse::new(events).keep_alive(KeepAlive::new().interval(KEEP_ALIVE)))
}
