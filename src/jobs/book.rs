use std::{
    fmt::Debug,
    sync::{Arc, Mutex, MutexGuard, PoisonError},
    time::{Duration, Instant},
};

use bytes::Bytes;
use tokio_util::task::TaskTracker;
use uuid::Uuid;

use super::{
    BytesHeld, Control, Fault, Job, JobRecord, JobState, Outcome, Overloaded, Place, Pool,
    PoolError, Stop, Store, StoreError, Submission, record::now_ms, register::Register, trace,
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
    jobs: Mutex<Register>,
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
        let records = store.records()?;
        let mut register = Register::default();
        let mut unfinished = Vec::new();
        for record in records {
            let job = Job::new(record.clone());
            register.add(Arc::clone(&job));
            if record.state.is_final() {
                register.ended(&record);
            } else {
                unfinished.push(job);
            }
        }
        let (jobs, tasks) = (Mutex::new(register), TaskTracker::new());
        let book = Arc::new(Self { config, pool, store, runner, jobs, tasks });
        for job in unfinished {
            // accepted by an earlier process, so it needs no place in the queue
            book.start(job, None, None);
        }
        Ok(book)
    }

    fn jobs(&self) -> MutexGuard<'_, Register> {
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
            if let Some(first) = jobs.same(&record)? {
                return Ok((first, false));
            }
            let place = self.pool.admit()?;
            jobs.add(Arc::clone(&job));
            place
        };
        let store = Arc::clone(&self.store);
        let kept = tokio::task::spawn_blocking(move || store.insert(&record, input)).await;
        if let Ok(Err(error)) = kept {
            self.jobs().remove(job.record().id);
            return Err(error.into());
        }
        self.start(Arc::clone(&job), Some(place), Some(held));
        Ok((job, true))
    }

    /// Sees the job through in a task and a trace of its own, which names the request it came by.
    fn start(self: &Arc<Self>, job: Arc<Job>, place: Option<Place>, held: Option<BytesHeld>) {
        let id = job.record().id;
        let log = tracing::info_span!(parent: None, "job", job_id = %id);
        let span = trace::job(&log);
        trace::set(&span, "conicoid.job.id", id.to_string());
        let run = Arc::clone(self).drive(job, place, held);
        self.tasks.spawn(trace::Scope::new(log, span).cover(run));
    }

    /// Sees a job through: waits for its turn, runs it and writes down its end.
    async fn drive(self: Arc<Self>, job: Arc<Job>, place: Option<Place>, held: Option<BytesHeld>) {
        let lane = self.pool.lane(job.record().size());
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
        self.write_end(job, state, outcome);
    }

    /// Writes down how a job ended; this may wait for a disk.
    fn write_end(&self, job: &Job, state: JobState, outcome: Option<Outcome>) {
        let id = job.record().id;
        // whoever sees that the job has ended may count on its expiry
        let written = job.end(&*self.store, state, outcome, |record| self.jobs().ended(record));
        if let Err(error) = written {
            tracing::error!(%error, job_id = %id, "the end of a job could not be kept");
        }
    }

    async fn end(self: &Arc<Self>, job: Arc<Job>, state: JobState, outcome: Option<Outcome>) {
        let book = Arc::clone(self);
        let ended = move || book.write_end(&job, state, outcome);
        // a runtime that ends leaves the job to the next process
        let _ = tokio::task::spawn_blocking(ended).await;
    }

    /// The job of that name, if `owner` may see it and it has not expired.
    pub fn find(&self, id: Uuid, owner: Option<&str>) -> Option<Arc<Job>> {
        let job = self.jobs().get(id)?;
        let record = job.record();
        (record.owner.as_deref() == owner && !self.expired(&record)).then_some(job)
    }

    /// Cancels a job under way; forgets one that has ended.
    ///
    /// # Errors
    /// The store fails.
    pub async fn cancel(self: &Arc<Self>, job: Arc<Job>) -> Result<(), StoreError> {
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
        self.jobs().remove(id);
        let store = Arc::clone(&self.store);
        blocking(move || store.remove(id)).await
    }

    /// Jobs that ended by this time, in milliseconds since 1970, have expired.
    fn latest_expired(&self) -> u64 {
        let ttl = u64::try_from(self.config.result_ttl.as_millis()).unwrap_or(u64::MAX);
        now_ms().saturating_sub(ttl)
    }

    fn expired(&self, record: &JobRecord) -> bool {
        record.finished_ms.is_some_and(|ended| ended <= self.latest_expired())
    }

    /// Forgets the ended jobs that are too old, and the oldest ones above the byte budget.
    pub async fn expire(&self) {
        loop {
            let expired = self.jobs().expired(self.latest_expired(), self.config.result_bytes);
            let Some(id) = expired else { return };
            if let Err(error) = self.forget(id).await {
                tracing::error!(%error, job_id = %id, "an expired job could not be removed");
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

/// Runs a call that may wait for the disk beside the asynchronous threads.
async fn blocking<T: Default + Send + 'static>(
    call: impl FnOnce() -> Result<T, StoreError> + Send + 'static,
) -> Result<T, StoreError> {
    // a call whose runtime ends has no answer
    tokio::task::spawn_blocking(call).await.unwrap_or_else(|_| Ok(T::default()))
}
