use std::{
    collections::HashMap,
    fmt::Debug,
    sync::{Arc, Mutex, MutexGuard, PoisonError},
    time::{Duration, Instant},
};

use bytes::Bytes;
use tokio_util::task::TaskTracker;
use uuid::Uuid;

use super::{
    BytesHeld, Control, Fault, Job, JobRecord, JobState, Outcome, Overloaded, Place, Pool,
    PoolError, Stop, Store, StoreError, Submission, record::now_ms,
};

/// What jobs do: from input to result.
pub trait Runner: Send + Sync + Debug {
    /// Does the job of `record` on the calling thread's pool until done or until `control` stops it.
    fn run(&self, record: &JobRecord, input: &[u8], control: &Control) -> Outcome;
    /// Longest time the job may run.
    fn time_for(&self, record: &JobRecord) -> Duration;
    /// How a run that gave no answer is told.
    fn fault(&self, error: &PoolError) -> Fault;
}

/// How long ended jobs are kept.
#[derive(Clone, Copy, Debug)]
pub struct BookConfig {
    /// After this time an ended job is forgotten.
    pub result_ttl: Duration,
    /// Above this many bytes of inputs and results of ended jobs the oldest are forgotten.
    pub result_bytes: u64,
}

/// Why a job is not taken.
#[derive(Debug, thiserror::Error)]
pub enum SubmitError {
    /// There is no room.
    #[error(transparent)]
    Overloaded(#[from] Overloaded),
    /// The key stands for another submission.
    #[error("the idempotency key '{0}' was used for another cloud or request")]
    KeyReused(String),
    /// The store fails.
    #[error(transparent)]
    Store(#[from] StoreError),
}

/// Every job: takes them in, runs them, keeps them until they expire.
#[derive(Debug)]
pub struct Book {
    config: BookConfig,
    pool: Arc<Pool>,
    store: Arc<dyn Store>,
    runner: Arc<dyn Runner>,
    jobs: Mutex<HashMap<Uuid, Arc<Job>>>,
    tasks: TaskTracker,
}

impl Book {
    /// The jobs of `store`; those that had not ended are queued again.
    ///
    /// # Errors
    /// The store fails.
    pub fn open(
        config: BookConfig,
        pool: Arc<Pool>,
        store: Arc<dyn Store>,
        runner: Arc<dyn Runner>,
    ) -> Result<Arc<Self>, StoreError> {
        let jobs: Vec<_> = store.records()?.into_iter().map(Job::new).collect();
        let index = jobs.iter().map(|job| (job.record().id, Arc::clone(job))).collect();
        let (jobs_by_id, tasks) = (Mutex::new(index), TaskTracker::new());
        let book = Arc::new(Self { config, pool, store, runner, jobs: jobs_by_id, tasks });
        for job in jobs.into_iter().filter(|job| !job.record().state.is_final()) {
            // accepted by an earlier process, so it needs no place in the queue
            book.tasks.spawn(Arc::clone(&book).drive(job, None, None));
        }
        Ok(book)
    }

    fn jobs(&self) -> MutexGuard<'_, HashMap<Uuid, Arc<Job>>> {
        self.jobs.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Takes a job in: returns when it is kept, with `true` where it is new.
    ///
    /// # Errors
    /// There is no room, the idempotency key stands for something else, or the store fails.
    pub async fn submit(
        self: &Arc<Self>,
        submission: Submission,
        input: Bytes,
        held: BytesHeld,
    ) -> Result<(Arc<Job>, bool), SubmitError> {
        let record = JobRecord::new(submission, input.len() as u64);
        let job = Job::new(record.clone());
        let place = {
            let mut jobs = self.jobs();
            if let Some(first) = same_key(&jobs, &record)? {
                return Ok((first, false));
            }
            let place = self.pool.admit()?;
            jobs.insert(record.id, Arc::clone(&job));
            place
        };
        let store = Arc::clone(&self.store);
        let kept = tokio::task::spawn_blocking(move || store.insert(&record, input)).await;
        if let Ok(Err(error)) = kept {
            self.jobs().remove(&job.record().id);
            return Err(error.into());
        }
        let run = Arc::clone(self).drive(Arc::clone(&job), Some(place), Some(held));
        self.tasks.spawn(run);
        Ok((job, true))
    }

    /// Sees a job through: waits for its turn, runs it and writes down its end.
    async fn drive(self: Arc<Self>, job: Arc<Job>, place: Option<Place>, held: Option<BytesHeld>) {
        let lane = self.pool.lane(usize::try_from(job.record().input_bytes).unwrap_or(usize::MAX));
        let work = {
            let (book, job) = (Arc::clone(&self), Arc::clone(&job));
            move || book.run(&job)
        };
        tokio::select! {
            done = self.pool.run(place, lane, work) => if let Err(error) = done {
                let fault = self.runner.fault(&error);
                self.end(job, JobState::Failed, Some(Err(fault))).await;
            },
            // the cancelled job gives up its place; a run already begun stops by itself
            () = job.control().cancelled_by_caller() => {}
        }
        drop(held);
        self.expire().await;
    }

    /// The run itself, on a thread of the pool.
    fn run(&self, job: &Job) {
        if !job.begin() {
            return;
        }
        let record = job.record();
        job.control().set_deadline(Instant::now() + self.runner.time_for(&record));
        let outcome = match self.store.input(record.id) {
            Ok(input) => self.runner.run(&record, &input.unwrap_or_default(), job.control()),
            Err(error) => Err(Fault { code: "internal".to_owned(), detail: error.to_string() }),
        };
        let (state, outcome) = match outcome {
            Ok(result) => (JobState::Succeeded, Some(Ok(result))),
            Err(_) if job.control().stop() == Some(Stop::Cancelled) => (JobState::Cancelled, None),
            Err(fault) => (JobState::Failed, Some(Err(fault))),
        };
        if let Err(error) = job.end(&*self.store, state, outcome) {
            tracing::error!(%error, job = %record.id, "the end of a job could not be kept");
        }
    }

    async fn end(&self, job: Arc<Job>, state: JobState, outcome: Option<Outcome>) {
        let store = Arc::clone(&self.store);
        let ended = tokio::task::spawn_blocking(move || job.end(&*store, state, outcome)).await;
        if let Ok(Err(error)) = ended {
            tracing::error!(%error, "the end of a job could not be kept");
        }
    }

    /// The job of that name, if `owner` may see it and it has not expired.
    pub fn find(&self, id: Uuid, owner: Option<&str>) -> Option<Arc<Job>> {
        let job = self.jobs().get(&id).map(Arc::clone)?;
        let record = job.record();
        (record.owner.as_deref() == owner && !self.expired(&record)).then_some(job)
    }

    /// Cancels a job under way; forgets one that has ended.
    ///
    /// # Errors
    /// The store fails.
    pub async fn cancel(&self, job: Arc<Job>) -> Result<(), StoreError> {
        if job.record().state.is_final() {
            return self.forget(job.record().id).await;
        }
        job.control().cancel();
        self.end(job, JobState::Cancelled, None).await;
        Ok(())
    }

    /// The result of a job.
    ///
    /// # Errors
    /// The store fails.
    pub async fn result(&self, id: Uuid) -> Result<Option<Bytes>, StoreError> {
        let store = Arc::clone(&self.store);
        blocking(move || store.result(id)).await
    }

    /// The input of a job.
    ///
    /// # Errors
    /// The store fails.
    pub async fn input(&self, id: Uuid) -> Result<Option<Bytes>, StoreError> {
        let store = Arc::clone(&self.store);
        blocking(move || store.input(id)).await
    }

    async fn forget(&self, id: Uuid) -> Result<(), StoreError> {
        self.jobs().remove(&id);
        let store = Arc::clone(&self.store);
        blocking(move || store.remove(id)).await
    }

    fn expired(&self, record: &JobRecord) -> bool {
        let ttl = u64::try_from(self.config.result_ttl.as_millis()).unwrap_or(u64::MAX);
        record.finished_ms.is_some_and(|ended| ended.saturating_add(ttl) <= now_ms())
    }

    /// Forgets the ended jobs that are too old, and the oldest ones above the byte budget.
    pub async fn expire(&self) {
        let mut ended: Vec<_> = self.jobs().values().map(|job| job.record()).collect();
        ended.retain(|record| record.state.is_final());
        ended.sort_by_key(|record| std::cmp::Reverse(record.finished_ms));
        let mut kept = 0_u64;
        for record in ended {
            kept = kept.saturating_add(record.kept_bytes());
            let over = self.expired(&record) || kept > self.config.result_bytes;
            if over && let Err(error) = self.forget(record.id).await {
                tracing::error!(%error, "an expired job could not be removed");
            }
        }
    }

    /// Waits for the jobs under way where they would be lost with the process.
    pub async fn drain(&self) {
        if !self.store.durable() {
            self.tasks.close();
            self.tasks.wait().await;
        }
    }
}

/// The job its owner has submitted under the same key, where there is one.
fn same_key(
    jobs: &HashMap<Uuid, Arc<Job>>,
    new: &JobRecord,
) -> Result<Option<Arc<Job>>, SubmitError> {
    let Some(wanted) = &new.idempotency else { return Ok(None) };
    for job in jobs.values() {
        let record = job.record();
        match &record.idempotency {
            Some(known) if known.key == wanted.key && record.owner == new.owner => {
                let same = known.fingerprint == wanted.fingerprint;
                return if same {
                    Ok(Some(Arc::clone(job)))
                } else {
                    Err(SubmitError::KeyReused(wanted.key.clone()))
                };
            }
            _ => {}
        }
    }
    Ok(None)
}

/// Runs a call that may wait for the disk beside the asynchronous threads.
async fn blocking<T: Default + Send + 'static>(
    call: impl FnOnce() -> Result<T, StoreError> + Send + 'static,
) -> Result<T, StoreError> {
    // a call whose runtime ends has no answer
    tokio::task::spawn_blocking(call).await.unwrap_or_else(|_| Ok(T::default()))
}
