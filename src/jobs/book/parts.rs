//! Working on parts of jobs that other processes run.

use std::{sync::Arc, time::Duration};

use bytes::Bytes;
use tokio_util::sync::CancellationToken;

use super::{Book, shared::Shared};
use crate::jobs::{
    JobState, Lane, StoreError,
    nats::{Delivery, Task},
};

/// Pause before a part is handed out again that could not be read, or whose end was not heard.
const PAUSE: Duration = Duration::from_millis(500);

/// What became of a part at this worker.
enum Part {
    /// Its end is told, or nobody wants to hear of it any more.
    Over,
    /// Another worker is to try it, or this one later.
    Later,
}

impl Book {
    /// Sees a part through that was handed to this worker.
    pub(super) async fn work_on_part(
        self: &Arc<Self>,
        shared: &Shared,
        delivery: Delivery,
        cut: &CancellationToken,
    ) {
        let Some(task) = delivery.task() else { return delivery.refuse().await };
        let kept = delivery.keep();
        let ended = tokio::select! {
            ended = self.see_part_through(shared, &task) => ended,
            () = cut.cancelled() => Ok(Part::Later),
        };
        drop(kept);
        match ended {
            Ok(Part::Over) => delivery.done().await,
            Ok(Part::Later) => delivery.later(PAUSE).await,
            Err(error) => {
                tracing::debug!(%error, job_id = %task.job, part = task.part, "a part waits");
                delivery.later(PAUSE).await;
            }
        }
    }

    async fn see_part_through(
        self: &Arc<Self>,
        shared: &Shared,
        task: &Task,
    ) -> Result<Part, StoreError> {
        let nats = shared.nats();
        if !task.is_of_this_build() {
            return Ok(Part::Later);
        }
        if nats.state(task.job).await? != Some(JobState::Running) {
            return Ok(Part::Over);
        }
        let Some((guide, points)) = nats.task(task).await? else { return Ok(Part::Over) };
        nats.begin_task(task).await?;
        let came = self.run_part(task, guide, points).await;
        nats.end_task(task, came).await?;
        Ok(Part::Over)
    }

    /// The work itself, on a thread of the pool.
    async fn run_part(
        self: &Arc<Self>,
        task: &Task,
        guide: Bytes,
        points: Bytes,
    ) -> Result<Bytes, String> {
        let (book, id) = (Arc::clone(self), task.job);
        let work = move || {
            let job = book.jobs().get(id);
            // one that is not known here any more is forgotten
            let is_over = || job.as_ref().is_none_or(|job| job.peek(|r| r.state.is_final()));
            book.runner.run_part(&guide, &points, &is_over)
        };
        let done = self.pool.run(None, Lane::Small, work).await;
        done.unwrap_or_else(|error| Err(error.to_string()))
    }
}
