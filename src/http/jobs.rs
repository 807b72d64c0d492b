use std::{convert::Infallible, time::Duration};

use axum::{
    Extension, Json,
    extract::{Path, Query, State},
    http::{HeaderMap, StatusCode, header},
    response::{
        IntoResponse, Response, Sse,
        sse::{Event, KeepAlive},
    },
};
use futures::{Stream, StreamExt};
use serde::Serialize;
use utoipa::ToSchema;

use super::{
    accept,
    answer::{answered, carried, room_for},
    app::App,
    query::{Pairs, from_query},
};
use crate::{
    jobs::{JobState, JobView},
    service::{Caller, ErrorKind, Representation, ServiceError},
};

/// A silent event stream says this often that it lives.
const KEEP_ALIVE: Duration = Duration::from_secs(15);

/// A job.
#[derive(Clone, Debug, PartialEq, Serialize, ToSchema)]
pub struct JobDocument {
    /// Its name.
    #[schema(example = "01890a5d-ac96-774b-bcce-b302099a8057")]
    pub id: String,
    /// Where it stands.
    pub state: JobState,
    /// How far it is; only while it runs.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub progress: Option<JobProgress>,
    /// When it was accepted, in milliseconds since 1970-01-01 UTC.
    pub created_ms: u64,
    /// When it began to run; absent before.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub started_ms: Option<u64>,
    /// When it ended; absent before.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub finished_ms: Option<u64>,
    /// Why it failed; absent otherwise.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub problem: Option<JobProblem>,
}

/// How far a job is.
#[derive(Clone, Debug, PartialEq, Serialize, ToSchema)]
pub struct JobProgress {
    /// The stage of the method.
    #[schema(example = "grow")]
    pub stage: String,
    /// How much of the whole work is done, 0 to 1.
    pub fraction: f64,
}

/// Why a job failed.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, ToSchema)]
pub struct JobProblem {
    /// The stable code.
    #[schema(example = "too_few_points")]
    pub code: String,
    /// What happened and what to do.
    pub detail: String,
}

impl From<JobView> for JobDocument {
    fn from(JobView { record, progress }: JobView) -> Self {
        let progress = progress
            .map(|p| JobProgress { stage: p.stage.name().to_owned(), fraction: p.fraction });
        Self {
            id: record.id.to_string(),
            state: record.state,
            progress,
            created_ms: record.created_ms,
            started_ms: record.started_ms,
            finished_ms: record.finished_ms,
            problem: record.fault.map(|f| JobProblem { code: f.code, detail: f.detail }),
        }
    }
}

/// The answer to an accepted job.
pub fn accepted(view: JobView) -> Response {
    let location = format!("/v1/jobs/{}", view.record.id);
    let headers =
        [(header::LOCATION.as_str(), location.as_str()), ("preference-applied", "respond-async")];
    (StatusCode::ACCEPTED, headers, Json(JobDocument::from(view))).into_response()
}

/// The state of a job
///
/// A job is visible only to the API key, or else the client certificate, that submitted it.
#[utoipa::path(
    get, path = "/v1/jobs/{id}", operation_id = "getJob", tag = "jobs",
    params(("id" = String, Path, description = "The job's id")),
    responses((status = 200, description = "The job", body = JobDocument)),
)]
pub async fn get(
    State(app): State<App>,
    Extension(caller): Extension<Caller>,
    Path(id): Path<String>,
) -> Result<Json<JobDocument>, ServiceError> {
    Ok(Json(app.service.job(&caller, &id)?.view().into()))
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
) -> Result<Json<JobDocument>, ServiceError> {
    Ok(Json(app.service.cancel(&caller, &id).await?.view().into()))
}

/// The result of a job
///
/// In the form that `Accept` asks for. 409 until the job has succeeded.
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
    let asked = asked_labels(query)?;
    let form = accept::negotiate(&headers, Representation::ALL)?;
    let held = app.service.share();
    held.charge(caller.as_deref())?;
    if form == Representation::Json {
        let (kept, request) = app.service.kept_result(&caller, &id, &held).await?;
        if asked.unwrap_or(request.labels) {
            return Ok(answered(form, held.carried_by(kept)));
        }
    }
    let with_cloud = form.has_points();
    let room = room_for(form, &app, &caller)?;
    let write = move |answer, labels| {
        let _room = room;
        form.render(answer, asked.unwrap_or(labels))
    };
    let bytes = app.service.job_result(&caller, &id, &held, with_cloud, write).await?;
    Ok(answered(form, carried(bytes, &held)))
}

/// What the query says of the labels; nothing else may stand in it.
fn asked_labels(query: Pairs) -> Result<Option<bool>, ServiceError> {
    if let Ok(Query(pairs)) = &query
        && let Some((name, _)) = pairs.iter().find(|(name, _)| name != "labels")
    {
        return Err(ServiceError::new(
            ErrorKind::UnknownParameter,
            format!("unknown parameter '{name}' of a result; known ones: labels"),
        ));
    }
    let request = from_query(query)?;
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
) -> Result<Sse<impl Stream<Item = Result<Event, Infallible>>>, ServiceError> {
    let job = app.service.job(&caller, &id)?;
    let watch = job.watch().take_until(app.service.book().closed());
    let events = watch.map(|view| {
        let event = Event::default().event("job").json_data(JobDocument::from(view));
        Ok(event.unwrap_or_default())
    });
    Ok(Sse::new(events).keep_alive(KeepAlive::new().interval(KEEP_ALIVE)))
}
