use std::sync::{Arc, Mutex, PoisonError};

use bytes::Bytes;
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
pub type Outcome = Result<Bytes, Fault>;

/// The end of a job.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Ending {
    /// It has this result.
    Succeeded(Bytes),
    /// It has none, for this.
    Failed(Fault),
    /// Its owner cancelled it.
    Cancelled,
}

impl Ending {
    /// The record of a job that ends so, now, and its result.
    fn of(self, mut record: JobRecord) -> (JobRecord, Option<Bytes>) {
        record.finished_ms = Some(now_ms());
        match self {
            Self::Succeeded(result) => {
                record.state = JobState::Succeeded;
                record.result_bytes = result.len() as u64;
                (record, Some(result))
            }
            Self::Failed(fault) => {
                (record.state, record.fault) = (JobState::Failed, Some(fault));
                (record, None)
            }
            Self::Cancelled => {
                record.state = JobState::Cancelled;
                (record, None)
            }
        }
    }
}

/// A job of this process: its state, which only moves forward, and the handle on its run.
#[derive(Debug)]
pub struct Job {
    state: watch::Sender<JobRecord>,
    control: Arc<Control>,
    // whether the store has it; nothing while it is being kept
    admission: watch::Sender<Option<Result<(), StoreError>>>,
    // held while an end is written down, so that a job ends once
    ending: Mutex<()>,
}

impl Job {
    /// The job of a record, which is yet to be kept.
    pub fn new(record: JobRecord) -> Arc<Self> {
        Arc::new(Self {
            state: watch::Sender::new(record),
            control: Control::new(None),
            admission: watch::Sender::new(None),
            ending: Mutex::new(()),
        })
    }

    /// Says to all who wait for it whether the job is kept.
    pub fn admit(&self, kept: Result<(), StoreError>) {
        self.admission.send_replace(Some(kept));
    }

    /// Whether the job is kept.
    pub fn is_admitted(&self) -> bool {
        matches!(*self.admission.borrow(), Some(Ok(())))
    }

    /// Waits until the job is kept.
    ///
    /// # Errors
    /// The store fails; then there is no such job.
    pub async fn admitted(&self) -> Result<(), StoreError> {
        let mut admission = self.admission.subscribe();
        let known = admission.wait_for(Option::is_some).await;
        known.ok().and_then(|kept| kept.clone()).unwrap_or(Err(StoreError::Closed))
    }

    /// The job now.
    pub fn record(&self) -> JobRecord {
        self.state.borrow().clone()
    }

    /// The handle on its run.
    pub fn control(&self) -> &Arc<Control> {
        &self.control
    }

    /// What `look` sees in the job's record as it is now.
    pub fn peek<T>(&self, look: impl FnOnce(&JobRecord) -> T) -> T {
        look(&self.state.borrow())
    }

    /// Waits until the job has ended.
    pub async fn ended(&self) {
        // the sender lives as long as the job
        let _ = self.state.subscribe().wait_for(|record| record.state.is_final()).await;
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

    /// Writes down the end of the job, tells `ended` and then everybody; `false` where it has ended
    /// before.
    ///
    /// # Errors
    /// The store fails; then the job has not ended.
    pub fn end(
        &self,
        store: &dyn Store,
        ending: Ending,
        ended: impl FnOnce(&JobRecord),
    ) -> Result<bool, StoreError> {
        let write = |record: &JobRecord, result| store.finish(record, result);
        self.conclude(ending, write, ended)
    }

    /// Shows the job as failed without writing it down: a store that keeps it runs it again after a
    /// restart. Tells `ended` and then everybody, unless the job has ended before.
    pub fn give_up(&self, fault: Fault, ended: impl FnOnce(&JobRecord)) {
        // nothing is written, so nothing fails
        let _ = self.conclude(Ending::Failed(fault), |_, _| Ok(()), ended);
    }

    /// Takes up what another process has made of the job; nothing where it is forgotten. A job that has
    /// ended stays as it is. Where it runs here it stops.
    pub fn follow(&self, other: Option<&JobRecord>) {
        let ended = self.state.send_if_modified(|record| {
            if record.state.is_final() || other == Some(&*record) {
                return false;
            }
            *record = match other {
                Some(other) => other.clone(),
                None => Ending::Cancelled.of(record.clone()).0,
            };
            true
        });
        if ended && self.peek(|record| record.state.is_final()) {
            self.control.cancel();
        }
    }

    fn conclude(
        &self,
        ending: Ending,
        write: impl FnOnce(&JobRecord, Option<Bytes>) -> Result<(), StoreError>,
        ended: impl FnOnce(&JobRecord),
    ) -> Result<bool, StoreError> {
        let _alone = self.ending.lock().unwrap_or_else(PoisonError::into_inner);
        let record = self.record();
        if record.state.is_final() {
            return Ok(false);
        }
        let before = record.clone();
        let (record, result) = ending.of(record);
        match write(&record, result) {
            Ok(()) => {}
            Err(StoreError::Ended(other)) => {
                let record = other.map_or_else(|| Ending::Cancelled.of(before).0, |other| *other);
                ended(&record);
                self.state.send_replace(record);
                return Ok(false);
            }
            Err(error) => return Err(error),
        }
        ended(&record);
        self.state.send_replace(record);
        Ok(true)
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
        assert!(job.end(&store, Ending::Cancelled, |_| ()).unwrap());
        let late = Ending::Succeeded(Bytes::from_static(b"late"));
        assert!(!job.end(&store, late, |_| ()).unwrap());
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
        job.end(&store, Ending::Succeeded(Bytes::from_static(b"done")), |_| ()).unwrap();
        let last = watch.next().await.unwrap().record;
        assert_eq!((last.state, last.result_bytes), (JobState::Succeeded, 4));
        assert!(watch.next().await.is_none());
    }
}
