//! Segmentations that a caller waits for and another process runs.

use std::{
    sync::Arc,
    time::{Duration, Instant},
};

use bytes::Bytes;

use super::{Answer, ERRORS, ErrorKind, Needs, Request, Service, ServiceError, Upload};
use crate::jobs::{Book, Job, JobState, Stop, Submission, trace};

/// The worker keeps the deadline; its answer gets this time to come.
const WAY_BACK: Duration = Duration::from_secs(5);

/// Cancels and forgets a job when its caller has the answer, or has gone.
struct ForgetOnDrop {
    book: Arc<Book>,
    job: Arc<Job>,
}

impl Drop for ForgetOnDrop {
    fn drop(&mut self) {
        let (book, job) = (Arc::clone(&self.book), Arc::clone(&self.job));
        tokio::spawn(async move {
            let ended = book.cancel(Arc::clone(&job)).await;
            // what was under way is now cancelled, and forgotten as well
            let forgotten = if ended.is_ok() { book.cancel(job).await } else { ended };
            if let Err(error) = forgotten {
                tracing::warn!(%error, "an answered request is forgotten when it expires");
            }
        });
    }
}

impl Service {
    /// Segments a cloud on any worker while the caller waits; else as [`Service::segment`].
    pub(super) async fn segment_elsewhere<T: Send + 'static>(
        &self,
        upload: Upload,
        request: Request,
        needs: Needs,
        tell: impl FnOnce(Answer, bool) -> Result<T, ServiceError> + Send + 'static,
    ) -> Result<T, ServiceError> {
        trace::note(|facts| facts.bytes = Some(upload.bytes().len()));
        let time = self.time_for(&request);
        let deadline = Instant::now() + time + WAY_BACK;
        let (upload, announced) = self.announced(upload, &request, needs).await?;
        let (bytes, held) = upload.into_parts();
        let bytes = Bytes::from(bytes);
        let submission = Submission {
            owner: held.owner(),
            idempotency: None,
            request: request.given.clone(),
            points: announced.points,
        };
        let (job, _) = self.book().submit(submission, bytes.clone(), held.clone()).await?;
        let job_id = job.peek(|record| record.id);
        trace::note(|facts| facts.job = Some(job_id.to_string()));
        let forget = ForgetOnDrop { book: Arc::clone(self.book()), job: Arc::clone(&job) };
        let in_time = tokio::time::timeout_at(deadline.into(), job.ended()).await;
        in_time.map_err(|_| ServiceError::from(Stop::Deadline))?;
        let record = job.record();
        if record.state != JobState::Succeeded {
            return Err(told_by(record.fault.as_ref().map(|f| (&*f.code, &*f.detail))));
        }
        held.grow_to(bytes.len() as u64 + announced.decoded + record.result_bytes)?;
        let result = self.book().result(job_id).await?;
        let result = result.ok_or_else(|| ServiceError::from(Stop::Cancelled))?;
        drop(forget);
        let input = (needs != Needs::Nothing).then_some(bytes);
        self.write_kept((result, input), request, needs, tell).await
    }
}

/// The error that a worker has written down.
fn told_by(fault: Option<(&str, &str)>) -> ServiceError {
    let Some((code, detail)) = fault else { return Stop::Cancelled.into() };
    let kind = ERRORS.iter().find(|row| row.code == code).map(|row| row.kind);
    ServiceError::new(kind.unwrap_or(ErrorKind::Internal), detail)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_kind_comes_back_from_a_worker_as_it_is() {
        for row in ERRORS {
            let told = told_by(Some((row.code, "why")));
            assert_eq!((told.kind, &*told.detail), (row.kind, "why"));
        }
        assert_eq!(told_by(None).kind, ErrorKind::Cancelled);
        assert_eq!(told_by(Some(("no code", ""))).kind, ErrorKind::Internal);
    }
}
