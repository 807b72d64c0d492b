use std::{
    sync::Arc,
    time::{Duration, Instant},
};

use bytes::Bytes;
use uuid::Uuid;

use super::{
    Answer, Caller, Document, ErrorKind, Needs, Representation, Request, Service, ServiceError,
    Upload,
    announced::Announced,
    compute, sha256,
    tiles::{Cut, Cutting, label_part},
};
use crate::{
    formats::{self, Fields, Format, Limits},
    jobs::{
        BytesHeld, Control, Fault, IdempotencyKey, Job, JobRecord, JobState, Outcome, Parts,
        PoolError, Runner, StoreError, Submission,
        trace::{self, Facts},
    },
};

/// Longest idempotency key.
const MAX_KEY_BYTES: usize = 255;
/// Longest time that a request waits for a job's end: below the hours after which systems between forget a silent
/// connection, and enough that nobody asks more than a few times.
pub const MAX_WAIT: Duration = Duration::from_secs(600);

/// How a job is done: its result is the document as JSON, with its labels.
#[derive(Debug)]
pub struct SegmentationRunner {
    /// Limits of the cloud.
    pub limits: Limits,
    /// Longest time a job may run.
    pub max_deadline: Duration,
    /// Clouds of more points are cut into parts of so many, where other processes can work on them; 0 cuts none.
    pub tile_points: usize,
}

impl Runner for SegmentationRunner {
    fn run(
        &self,
        record: &JobRecord,
        input: Bytes,
        control: &Control,
        parts: Option<&dyn Parts>,
    ) -> Outcome {
        let begin = Instant::now();
        trace::note(|facts| facts.caller.clone_from(&record.owner));
        let done = request_of(record)
            .and_then(|request| self.answer(input, &request, control, parts))
            .and_then(|answer| super::render(Representation::Json, answer, true));
        let Facts { caller, format, bytes, points, regions, .. } = trace::Scope::current().facts();
        let seconds = begin.elapsed().as_secs_f64();
        match &done {
            Ok(_) => tracing::info!(caller, format, bytes, points, regions, seconds, "done"),
            Err(error) => {
                let code = error.kind.row().code;
                tracing::info!(caller, format, bytes, points, seconds, code, "{error}");
            }
        }
        done.map(Bytes::from).map_err(|error| fault(&error))
    }

    fn run_part(
        &self,
        guide: &[u8],
        part: &[u8],
        is_over: &(dyn Fn() -> bool + Sync),
    ) -> Result<Bytes, String> {
        label_part(guide, part, is_over)
    }

    fn time_for(&self, record: &JobRecord) -> Duration {
        let asked = request_of(record).ok().and_then(|request| request.deadline);
        asked.unwrap_or(self.max_deadline).min(self.max_deadline)
    }

    fn fault(&self, error: &PoolError) -> Fault {
        fault(&error.clone().into())
    }

    fn store_fault(&self, error: &StoreError) -> Fault {
        fault(&error.clone().into())
    }
}

impl SegmentationRunner {
    /// The answer of a job, by other processes too where the cloud is too large for one.
    fn answer(
        &self,
        input: Bytes,
        request: &Request,
        control: &Control,
        parts: Option<&dyn Parts>,
    ) -> Result<Answer, ServiceError> {
        let cut = parts.map(|parts| Cut { parts, points: self.tile_points });
        let input = match cut.filter(|cut| cut.is_for(&input, request)) {
            None => input,
            Some(cut) => match cut.answer(input, request, &self.limits, control)? {
                Cutting::Done(answer) => return Ok(*answer),
                Cutting::Whole(input) => input,
            },
        };
        compute(&input, request, &self.limits, control)
    }
}

fn fault(error: &ServiceError) -> Fault {
    Fault { code: error.kind.row().code.to_owned(), detail: error.detail.clone() }
}

fn request_of(record: &JobRecord) -> Result<Request, ServiceError> {
    Request::from_pairs(record.request.iter().map(|(n, v)| (n.as_str(), v.as_str())))
}

impl Service {
    /// Takes a cloud in as a job, kept before this returns; `true` where the job is new.
    ///
    /// # Errors
    /// There is no room, the idempotency key is too long or taken, or the store fails.
    pub async fn submit(
        &self,
        caller: Caller,
        key: Option<String>,
        upload: Upload,
        request: Request,
    ) -> Result<(Arc<Job>, bool), ServiceError> {
        if upload.bytes().is_empty() {
            return Err(formats::FormatError::Empty.into());
        }
        let format = request.format.map(Format::name);
        trace::note(|facts| (facts.format, facts.bytes) = (format, Some(upload.bytes().len())));
        let idempotency =
            key.map(|key| idempotency_key(key, &request, upload.bytes())).transpose()?;
        let announced = self.announced(upload, &request, Needs::Nothing).await?;
        let (upload, Announced { points, decoded }) = announced;
        let (bytes, held) = upload.into_parts();
        // taken now: a job that is accepted has the room it needs
        held.grow_to(bytes.len() as u64 + decoded)?;
        let submission = Submission { owner: caller, idempotency, request: request.given, points };
        let (job, is_new) = self.book().submit(submission, bytes.into(), held).await?;
        trace::note(|facts| facts.job = Some(job.record().id.to_string()));
        Ok((job, is_new))
    }

    /// The job of that name.
    ///
    /// # Errors
    /// There is none, it has expired, or it is another caller's.
    pub fn job(&self, caller: &Caller, id: &str) -> Result<Arc<Job>, ServiceError> {
        let parsed = Uuid::parse_str(id).ok();
        let job = parsed.and_then(|id| self.book().find(id, caller.as_deref()));
        job.ok_or_else(|| {
            let detail = format!("no job '{id}': it never was, has expired, or is not yours");
            ServiceError::new(ErrorKind::JobNotFound, detail)
        })
    }

    /// Waits until the job has ended, but no longer than `time`, nor than the service runs where another process goes
    /// on with the job.
    pub async fn wait_for(&self, job: &Job, time: Duration) {
        let closed = self.book().closed();
        let ended = async {
            tokio::select! {
                () = job.ended() => {}
                () = closed => {}
            }
        };
        // whichever comes first, the job is told as it then is
        let _ = tokio::time::timeout(time.min(MAX_WAIT), ended).await;
    }

    /// Cancels a job under way; forgets one that has ended. Returns the job as it then is.
    ///
    /// # Errors
    /// There is no such job, or the store fails.
    pub async fn cancel(&self, caller: &Caller, id: &str) -> Result<Arc<Job>, ServiceError> {
        let job = self.job(caller, id)?;
        self.book().cancel(Arc::clone(&job)).await?;
        Ok(job)
    }

    /// The result of a job as it is kept, the document as JSON with its labels, and what was asked.
    /// `held` counts its bytes.
    ///
    /// # Errors
    /// There is no such job, it has no result (yet), there is no room, or the store fails.
    pub async fn kept_result(
        &self,
        caller: &Caller,
        id: &str,
        held: &BytesHeld,
    ) -> Result<(Bytes, Request), ServiceError> {
        let record = self.job(caller, id)?.record();
        check_ended(&record)?;
        held.grow_to(record.result_bytes)?;
        let result = self.book().result(record.id).await?;
        Ok((result.ok_or_else(|| expired(id))?, request_of(&record)?))
    }

    /// The result of a job, written by `tell`; it gets whether the submitter wanted labels.
    ///
    /// # Errors
    /// There is no such job, it has no result (yet), there is no room, or the store fails.
    pub async fn job_result<T: Send + 'static>(
        &self,
        caller: &Caller,
        id: &str,
        held: &BytesHeld,
        needs: Needs,
        tell: impl FnOnce(Answer, bool) -> Result<T, ServiceError> + Send + 'static,
    ) -> Result<T, ServiceError> {
        let (result, request) = self.kept_result(caller, id, held).await?;
        let record = self.job(caller, id)?.record();
        let input = if needs != Needs::Nothing {
            let decoded = record.points.saturating_mul(formats::BYTES_PER_POINT);
            held.grow_to(record.result_bytes + record.input_bytes + decoded)?;
            Some(self.book().input(record.id).await?.ok_or_else(|| expired(id))?)
        } else {
            None
        };
        self.write_kept((result, input), request, needs, tell).await
    }

    /// A kept result, written by `tell`, with the points of its input where they are needed.
    pub(super) async fn write_kept<T: Send + 'static>(
        &self,
        (result, input): (Bytes, Option<Bytes>),
        request: Request,
        needs: Needs,
        tell: impl FnOnce(Answer, bool) -> Result<T, ServiceError> + Send + 'static,
    ) -> Result<T, ServiceError> {
        let limits = self.limits();
        let write = move || {
            let document: Document = serde_json::from_slice(&result)?;
            let hints = request.hints();
            // all points do where each is told of
            let hints = if needs == Needs::EachPoint { hints.whole() } else { hints };
            let (cloud, fields) = match &input {
                Some(bytes) => (formats::read(bytes, hints, &limits)?, Fields::of(bytes)),
                None => Default::default(),
            };
            let cloud = Arc::new(cloud);
            let answer = Answer { document, cloud, whole: None, fields, name: request.name };
            tell(answer, request.labels)
        };
        let written = tokio::task::spawn_blocking(write).await;
        written.map_err(|_| ServiceError::from(PoolError::Closed))?
    }
}

fn expired(id: &str) -> ServiceError {
    ServiceError::new(ErrorKind::JobNotFound, format!("job '{id}' has expired"))
}

fn check_ended(record: &JobRecord) -> Result<(), ServiceError> {
    match (record.state, &record.fault) {
        (JobState::Succeeded, _) => Ok(()),
        (JobState::Queued | JobState::Running, _) => Err(ServiceError::new(
            ErrorKind::JobNotFinished,
            "the job has no result yet: watch its events, or ask again later",
        )),
        (JobState::Cancelled, _) => {
            Err(ServiceError::new(ErrorKind::JobFailed, "the job was cancelled"))
        }
        (JobState::Failed, fault) => {
            let detail = fault.as_ref().map(|f| format!("{}: {}", f.code, f.detail));
            Err(ServiceError::new(ErrorKind::JobFailed, detail.unwrap_or_default()))
        }
    }
}

fn idempotency_key(
    key: String,
    request: &Request,
    bytes: &[u8],
) -> Result<IdempotencyKey, ServiceError> {
    if !(1..=MAX_KEY_BYTES).contains(&key.len()) || !key.bytes().all(|b| b.is_ascii_graphic()) {
        let told = key.escape_default().take(MAX_KEY_BYTES).collect::<String>();
        return Err(ServiceError::new(
            ErrorKind::InvalidParameter,
            format!(
                "the idempotency key '{told}' of {} bytes is not 1 to {MAX_KEY_BYTES} visible ASCII \
                 characters without spaces",
                key.len()
            ),
        ));
    }
    let given = format!("{:?}", request.given);
    let fingerprint = format!("{}-{}", sha256(bytes), sha256(given.as_bytes()));
    Ok(IdempotencyKey { key, fingerprint })
}
