use std::{
    fmt::Debug,
    sync::{Arc, Mutex, MutexGuard, PoisonError},
    time::Duration,
};

use bytes::Bytes;
use tokio::sync::watch;
use tokio_util::{sync::CancellationToken, task::TaskTracker};
use uuid::Uuid;

use super::{
    BytesHeld, Control, Ending, Fault, Job, JobRecord, JobState, KeyShare, Nats, Outcome,
    Overloaded, Parts, Pool, PoolError, Store, StoreError, Submission,
    pool::message,
    record::now_ms,
    register::{Keep, Register},
};

mod drive;
mod parts;
mod resume;
mod share;
mod shared;
#[cfg(test)]
mod tests;
mod work;

pub use work::Work;

use shared::Shared;

/// Shared by the runs of jobs, unless one is to be alone.
type Company = Arc<tokio::sync::RwLock<()>>;

/// A store that takes longer to say how it is does not work.
const LONGEST_PROBE: Duration = Duration::from_secs(5);

/// What jobs do: from input to result.
pub trait Runner: Send + Sync + Debug {
    /// Does the job of `record` on the calling thread's pool until done or until `control` stops it.
    ///
    /// Where there are `parts`, other processes can work on some.
    fn run(
        &self,
        record: &JobRecord,
        input: Bytes,
        control: &Control,
        parts: Option<&dyn Parts>,
    ) -> Outcome;
    /// Works on a part of a job by a guide until done or until it `is_over`. Why it cannot be done is an error's text.
    ///
    /// # Errors
    /// It cannot be done.
    fn run_part(
        &self,
        guide: &[u8],
        part: &[u8],
        is_over: &(dyn Fn() -> bool + Sync),
    ) -> Result<Bytes, String>;
    /// Longest time the job may run.
    fn time_for(&self, record: &JobRecord) -> Duration;
    /// How a run that gave no answer is told.
    fn fault(&self, error: &PoolError) -> Fault;
    /// How a store that fails is told.
    fn store_fault(&self, error: &StoreError) -> Fault;
}

/// How long ended jobs are kept.
#[derive(Clone, Copy, Debug)]
pub struct BookConfig {
    /// After this time an ended job is forgotten.
    pub result_ttl: Duration,
    /// Above this many bytes of ended jobs, with all they hold, some are forgotten.
    pub result_bytes: u64,
    /// The part of that which one key's jobs may take.
    pub key_share: KeyShare,
    /// A job that so many processes ended on is not run again.
    pub max_crashes: u32,
}

/// Where a book keeps its jobs.
#[derive(Clone, Debug)]
pub enum Keeping {
    /// In a store of this process.
    Own(Arc<dyn Store>),
    /// On servers that other processes use as well.
    Shared(Arc<Nats>),
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
    // where other processes have the same jobs
    shared: Option<Shared>,
    runner: Arc<dyn Runner>,
    jobs: Mutex<Register>,
    tasks: TaskTracker,
    // held while the store is probed
    probing: Arc<tokio::sync::Mutex<()>>,
    closing: CancellationToken,
    // ended runs whose end the store does not take; while there are any, no other begins
    unwritten: watch::Sender<usize>,
    // runs share it; one that may end the process has it alone
    company: Company,
}

impl Book {
    fn jobs(&self) -> MutexGuard<'_, Register> {
        self.jobs.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Takes a job in: returns when it is kept, with `true` where it is new. A caller that goes away
    /// meanwhile leaves a whole job or none.
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
        if record.idempotency.is_some() {
            // a job that nobody can find any more is no answer to a retry
            self.expire().await;
        }
        if self.shared.is_some() {
            return self.submit_shared(record, input, held).await;
        }
        let (job, place) = {
            let mut jobs = self.jobs();
            match jobs.same(&record)? {
                Some(first) => (first, None),
                None => {
                    let place = self.pool.admit(record.owner.as_deref())?;
                    let job = Job::new(record);
                    jobs.add(Arc::clone(&job));
                    (job, Some(place))
                }
            }
        };
        let is_new = place.is_some();
        if let Some(place) = place {
            let kept = Arc::clone(self).take_in(Arc::clone(&job), input, place, held);
            self.spawn(&job, kept);
        }
        // a retry waits for the same answer
        job.admitted().await?;
        Ok((job, is_new))
    }

    /// The job of that name, if `owner` may see it and it has not expired.
    pub fn find(&self, id: Uuid, owner: Option<&str>) -> Option<Arc<Job>> {
        let job = self.jobs().get(id).filter(|job| job.is_admitted())?;
        let record = job.record();
        (record.owner.as_deref() == owner && !self.expired(&record)).then_some(job)
    }

    /// Up to `most` jobs of `owner` that are `wanted`, older than `before`, the newest first.
    pub fn list(
        &self,
        owner: Option<&str>,
        mut before: Option<Uuid>,
        most: usize,
        wanted: impl Fn(JobState) -> bool,
    ) -> Vec<Arc<Job>> {
        /// Jobs looked at while others wait: some tens of microseconds.
        const BLOCK: usize = 1000;
        let mut found = Vec::new();
        loop {
            let block = self.jobs().of_owner(owner, before, BLOCK);
            let Some(last) = block.last() else { return found };
            before = Some(last.peek(|record| record.id));
            let listed = |job: &Arc<Job>| {
                job.is_admitted()
                    && job.peek(|record| wanted(record.state) && !self.expired(record))
            };
            found.extend(block.into_iter().filter(listed).take(most - found.len()));
            if found.len() == most {
                return found;
            }
        }
    }

    /// Cancels a job under way; forgets one that has ended.
    ///
    /// # Errors
    /// The store fails; then the job stops all the same, and is shown as cancelled once that is kept.
    pub async fn cancel(self: &Arc<Self>, job: Arc<Job>) -> Result<(), StoreError> {
        if job.record().state.is_final() {
            return self.forget(job.record().id).await;
        }
        job.control().cancel();
        self.write_end(&job, Ending::Cancelled).await
    }

    /// The result of a job that has one; nothing where the job has been forgotten.
    ///
    /// # Errors
    /// The store fails, or has lost it.
    pub async fn result(&self, id: Uuid) -> Result<Option<Bytes>, StoreError> {
        let store = Arc::clone(&self.store);
        self.there("result", id, blocking(move || store.result(id)).await?)
    }

    /// The input of a job; nothing where the job has been forgotten.
    ///
    /// # Errors
    /// The store fails, or has lost it.
    pub async fn input(&self, id: Uuid) -> Result<Option<Bytes>, StoreError> {
        let store = Arc::clone(&self.store);
        self.there("input", id, blocking(move || store.input(id)).await?)
    }

    /// What is missing of a job that is known is an error.
    fn there(
        &self,
        part: &'static str,
        id: Uuid,
        found: Option<Bytes>,
    ) -> Result<Option<Bytes>, StoreError> {
        if found.is_none() && self.jobs().get(id).is_some() {
            return Err(StoreError::Missing { part, id });
        }
        Ok(found)
    }

    /// Forgets an ended job; one that the store does not let go stays.
    async fn forget(&self, id: Uuid) -> Result<(), StoreError> {
        // first here, so that nobody misses what the store has no more
        let Some(job) = self.jobs().remove(id) else { return Ok(()) };
        let store = Arc::clone(&self.store);
        let removed = blocking(move || store.remove(id)).await;
        if removed.is_err() {
            let record = job.record();
            let mut jobs = self.jobs();
            jobs.add(job);
            jobs.ended(&record);
            if self.shared.is_some() {
                jobs.note(&record);
            }
        }
        removed
    }

    /// Jobs that ended by this time, in milliseconds since 1970, have expired.
    fn latest_expired(&self) -> u64 {
        let ttl = u64::try_from(self.config.result_ttl.as_millis()).unwrap_or(u64::MAX);
        now_ms().saturating_sub(ttl)
    }

    fn keep(&self) -> Keep {
        let bytes = self.config.result_bytes;
        let bytes_per_key = self.config.key_share.of(bytes);
        Keep { latest_expired_ms: self.latest_expired(), bytes, bytes_per_key }
    }

    fn expired(&self, record: &JobRecord) -> bool {
        record.finished_ms.is_some_and(|ended| ended <= self.latest_expired())
    }

    /// Forgets the ended jobs that are too old, and the oldest ones above the byte budgets.
    pub async fn expire(&self) {
        loop {
            let expired = self.jobs().expired(&self.keep());
            let Some(id) = expired else { return };
            if let Err(error) = self.forget(id).await {
                tracing::error!(%error, job_id = %id, "an expired job could not be removed");
                return;
            }
        }
    }

    /// Whether the store could keep a job now.
    ///
    /// # Errors
    /// It could not, or does not say so in time.
    pub async fn probe(&self) -> Result<(), StoreError> {
        let (store, probing) = (Arc::clone(&self.store), Arc::clone(&self.probing));
        let probe = async {
            // one at a time: a disk that hangs must not take thread after thread
            let alone = probing.lock_owned().await;
            blocking(move || {
                let _alone = alone;
                store.probe()
            })
            .await
        };
        let told = tokio::time::timeout(LONGEST_PROBE, probe).await;
        told.unwrap_or_else(|_| Err(StoreError::Failed("its disk does not answer".to_owned())))
    }

    /// The service ends: nobody need wait here for jobs that the next process does, and what it cuts
    /// short has not crashed.
    pub fn close(&self) {
        self.store.close();
        if self.store.durable() {
            self.closing.cancel();
        }
    }

    /// Waits until those who watch a job are to wait for it no longer.
    pub fn closed(&self) -> impl Future<Output = ()> + Send + use<> {
        self.closing.clone().cancelled_owned()
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
async fn blocking<T: Send + 'static>(
    call: impl FnOnce() -> Result<T, StoreError> + Send + 'static,
) -> Result<T, StoreError> {
    let done = tokio::task::spawn_blocking(call).await;
    done.unwrap_or_else(|error| match error.try_into_panic() {
        Ok(panic) => Err(StoreError::Failed(format!("it panicked: {}", message(&*panic)))),
        Err(_) => Err(StoreError::Closed),
    })
}
