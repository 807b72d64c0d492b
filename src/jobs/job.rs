use std::sync::{Arc, Mutex, PoisonError};

use tokio::sync::watch;

use super::{Control, Fault, JobRecord, JobState, Progress, Store, StoreError, record::now_ms};

/// What a watcher of a job sees.
#[derive(Clone, Debug, PartialEq)]
pub struct JobView {
    /// The job.
    pub record: JobRecord,
    /// How far it is; only while it runs.
    pub progress: Option<Progress>,
}

impl JobView {
    fn new(record: JobRecord, progress: Option<Progress>) -> Self {
        Self { progress: progress.filter(|_| record.state == JobState::Running), record }
    }
}

/// How a job's run ended.
pub type Outcome = Result<bytes::Bytes, Fault>;

/// A job of this process: its state, which only moves forward, and the handle on its run.
#[derive(Debug)]
pub struct Job {
    state: watch::Sender<JobRecord>,
    control: Arc<Control>,
    // held while an end is written down, so that a job ends once
    ending: Mutex<()>,
}

impl Job {
    /// The job of a record.
    pub fn new(record: JobRecord) -> Arc<Self> {
        let state = watch::Sender::new(record);
        Arc::new(Self { state, control: Control::new(None), ending: Mutex::new(()) })
    }

    /// The job now.
    pub fn record(&self) -> JobRecord {
        self.state.borrow().clone()
    }

    /// The handle on its run.
    pub fn control(&self) -> &Arc<Control> {
        &self.control
    }

    /// The job now, with its progress.
    pub fn view(&self) -> JobView {
        JobView::new(self.record(), *self.control.watch().borrow())
    }

    /// The job has got its turn; `false` where it has ended before.
    pub fn begin(&self) -> bool {
        self.state.send_if_modified(|record| {
            let first = record.state == JobState::Queued;
            if first {
                record.state = JobState::Running;
                record.started_ms = Some(now_ms());
            }
            first
        })
    }

    /// Writes down the end of the job, tells `ended` and then everybody, unless it has ended before.
    ///
    /// # Errors
    /// The store fails; then the job is shown as failed, and a durable store runs it again.
    pub fn end(
        &self,
        store: &dyn Store,
        state: JobState,
        outcome: Option<Outcome>,
        ended: impl FnOnce(&JobRecord),
    ) -> Result<bool, StoreError> {
        let _alone = self.ending.lock().unwrap_or_else(PoisonError::into_inner);
        let mut record = self.record();
        if record.state.is_final() {
            return Ok(false);
        }
        (record.state, record.finished_ms) = (state, Some(now_ms()));
        let result = match outcome {
            Some(Ok(result)) => Some(result),
            Some(Err(fault)) => {
                record.fault = Some(fault);
                None
            }
            None => None,
        };
        record.result_bytes = result.as_ref().map_or(0, |r| r.len() as u64);
        let written = store.finish(&record, result);
        if let Err(error) = &written {
            record.state = JobState::Failed;
            record.fault = Some(Fault { code: "internal".to_owned(), detail: error.to_string() });
        }
        ended(&record);
        self.state.send_replace(record);
        written.map(|()| true)
    }

    /// The job now and after each change, up to its last state.
    pub fn watch(self: &Arc<Self>) -> impl futures::Stream<Item = JobView> + Send + use<> {
        let seen = (self.state.subscribe(), self.control.watch());
        let job = Arc::clone(self);
        futures::stream::unfold(Some((job, seen, true)), |watching| async {
            let (job, (mut state, mut progress), first) = watching?;
            if !first {
                tokio::select! {
                    _ = state.changed() => {}
                    _ = progress.changed() => {}
                }
            }
            let record = state.borrow_and_update().clone();
            let view = JobView::new(record, *progress.borrow_and_update());
            let next = (!view.record.state.is_final()).then_some((job, (state, progress), false));
            Some((view, next))
        })
    }
}

#[cfg(test)]
mod tests {
    use bytes::Bytes;
    use futures::StreamExt;

    use super::*;
    use crate::{
        jobs::{MemoryStore, Submission},
        segment::{Monitor, Stage},
    };

    fn job() -> (Arc<Job>, MemoryStore) {
        let (record, store) = (JobRecord::new(Submission::default(), 3), MemoryStore::default());
        store.insert(&record, Bytes::from_static(b"abc")).unwrap();
        (Job::new(record), store)
    }

    #[test]
    fn a_job_ends_once() {
        let (job, store) = job();
        assert!(job.begin());
        assert!(job.end(&store, JobState::Cancelled, None, |_| ()).unwrap());
        let late = Some(Ok(Bytes::from_static(b"late")));
        assert!(!job.end(&store, JobState::Succeeded, late, |_| ()).unwrap());
        assert!(!job.begin());
        assert_eq!(job.record().state, JobState::Cancelled);
        assert_eq!(store.result(job.record().id).unwrap(), None);
    }

    #[tokio::test]
    async fn a_watch_shows_every_step_and_ends_with_the_job() {
        let (job, store) = job();
        let mut watch = Box::pin(job.watch());
        assert_eq!(watch.next().await.unwrap().record.state, JobState::Queued);
        job.begin();
        assert_eq!(watch.next().await.unwrap().record.state, JobState::Running);
        job.control().progress(Stage::Grow, 0.5);
        assert_eq!(watch.next().await.unwrap().progress.unwrap().fraction, 0.5);
        job.end(&store, JobState::Succeeded, Some(Ok(Bytes::from_static(b"done"))), |_| ())
            .unwrap();
        let last = watch.next().await.unwrap().record;
        assert_eq!((last.state, last.result_bytes), (JobState::Succeeded, 4));
        assert!(watch.next().await.is_none());
    }
}
