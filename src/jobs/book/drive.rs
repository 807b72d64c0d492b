//! From admission to the end that is written down: tasks that no caller owns.

use std::{
    sync::Arc,
    time::{Duration, Instant},
};

use bytes::Bytes;
use tokio::sync::{OwnedRwLockReadGuard, OwnedRwLockWriteGuard, watch};
use uuid::Uuid;

use super::{Book, blocking};
use crate::jobs::{
    BytesHeld, Ending, Job, JobRecord, Parts, Place, Stop, Store, StoreError, trace,
};

/// Pause after the first failure of the store; each further one doubles it.
const FIRST_PAUSE: Duration = Duration::from_millis(if cfg!(test) { 1 } else { 100 });
/// Longest pause between two tries.
const LONGEST_PAUSE: Duration = Duration::from_millis(if cfg!(test) { 4 } else { 2000 });
/// Tries of a store that fails; a full disk, and servers that are away, are waited for as long as it takes.
const TRIES: u32 = 6;

/// What became of a job's turn.
enum Ran {
    /// The run ended.
    Ended(Ending),
    /// The job had ended before its turn.
    Before,
    /// It is to have another turn: the store takes no ends at present.
    Later,
    /// Its input cannot be read, or its beginning not be noted.
    Unread(StoreError),
}

/// How often and how long a failing store is tried again.
#[derive(Default)]
struct Patience {
    tries: u32,
}

impl Patience {
    /// Waits before the next try; `false` at once where there is to be none.
    async fn wait(&mut self, error: &StoreError) -> bool {
        self.tries += 1;
        if !error.may_pass() || (!error.is_waited_for() && self.tries >= TRIES) {
            return false;
        }
        let pause = FIRST_PAUSE * 2_u32.pow(self.tries.min(10) - 1);
        tokio::time::sleep(pause.min(LONGEST_PAUSE)).await;
        true
    }
}

/// Counts an end that waits for the store.
struct Unwritten<'b>(&'b watch::Sender<usize>);

impl<'b> Unwritten<'b> {
    fn new(count: &'b watch::Sender<usize>) -> Self {
        count.send_modify(|count| *count += 1);
        Self(count)
    }
}

impl Drop for Unwritten<'_> {
    fn drop(&mut self) {
        self.0.send_modify(|count| *count -= 1);
    }
}

/// A run that the store has a note of.
struct Noted<'s> {
    store: &'s dyn Store,
    id: Uuid,
}

impl<'s> Noted<'s> {
    fn new(store: &'s dyn Store, record: &JobRecord) -> Result<Self, StoreError> {
        store.begin(record)?;
        Ok(Self { store, id: record.id })
    }
}

impl Drop for Noted<'_> {
    fn drop(&mut self) {
        self.store.leave(self.id);
    }
}

/// How a job is among the others while it runs.
#[expect(dead_code, reason = "the guards are held, not read")]
enum Presence {
    /// Beside others.
    Shared(OwnedRwLockReadGuard<()>),
    /// Alone.
    Alone(OwnedRwLockWriteGuard<()>),
}

/// What the work on a job is told under.
pub(super) fn scope(job: &Job) -> trace::Scope {
    let id = job.peek(|record| record.id);
    let log = tracing::info_span!(parent: None, "job", job_id = %id);
    let span = trace::job(&log);
    trace::set(&span, "conicoid.job.id", id.to_string());
    trace::Scope::of_job(log, span)
}

impl Book {
    /// Waits until the job may run beside the others, or alone where a process ended while it ran:
    /// should that happen again, it was this job and none of its neighbours.
    async fn presence(&self, job: &Job) -> Presence {
        let company = Arc::clone(&self.company);
        if job.record().crashes == 0 {
            Presence::Shared(company.read_owned().await)
        } else {
            Presence::Alone(company.write_owned().await)
        }
    }

    /// Lets `work` on a job be done in a task and a trace of its own, which names the request it came
    /// by.
    pub(super) fn spawn(&self, job: &Job, work: impl Future<Output = ()> + Send + 'static) {
        self.tasks.spawn(scope(job).cover(work));
    }

    /// Keeps a new job, tells those who wait for that, and sees the job through.
    pub(super) async fn take_in(
        self: Arc<Self>,
        job: Arc<Job>,
        input: Bytes,
        place: Place,
        held: BytesHeld,
    ) {
        let (store, record) = (Arc::clone(&self.store), job.record());
        let id = record.id;
        match blocking(move || store.insert(&record, input)).await {
            Ok(()) => {
                job.admit(Ok(()));
                self.drive(job, Some(place), Some(held)).await;
            }
            Err(error) => {
                // its caller may not be there any more
                tracing::warn!(%error, "the job could not be kept");
                // gone before anybody is told, so that the next retry begins anew
                self.jobs().remove(id);
                job.admit(Err(error));
            }
        }
    }

    /// Sees a job through: waits for its turn, runs it and writes down its end. Its share of the budget
    /// is held until then, and until its run has left the threads.
    pub(super) async fn drive(
        self: Arc<Self>,
        job: Arc<Job>,
        place: Option<Place>,
        held: Option<BytesHeld>,
    ) {
        if let Some(ending) = self.run_in_turn(&job, place, held.as_ref()).await {
            if let (Ending::Succeeded(result), Some(held)) = (&ending, &held) {
                // the work is done, so a result that the budget has no room for is kept all the same
                let _ = held.grow_to(job.record().input_bytes + result.len() as u64);
            }
            self.see_ended(&job, ending).await;
        }
        drop(held);
        self.expire().await;
    }

    /// Waits for a turn until the job has run; how it is to end, unless it has ended already.
    async fn run_in_turn(
        self: &Arc<Self>,
        job: &Arc<Job>,
        mut place: Option<Place>,
        held: Option<&BytesHeld>,
    ) -> Option<Ending> {
        let lane = self.pool.lane(job.record().points);
        let mut patience = Patience::default();
        loop {
            let (book, own, share) = (Arc::clone(self), Arc::clone(job), held.cloned());
            let turn = async {
                self.all_written().await;
                let presence = self.presence(job).await;
                let work = move || {
                    let ran = book.run(&own);
                    drop((share, presence));
                    ran
                };
                self.pool.run(place.take(), lane, work).await
            };
            let ran = tokio::select! {
                ran = turn => ran,
                // the cancelled job gives up its place; a run already begun stops by itself
                () = job.control().cancelled_by_caller() => return Some(Ending::Cancelled),
            };
            match ran {
                Ok(Ran::Ended(ending)) => return Some(ending),
                Ok(Ran::Before) => return None,
                Ok(Ran::Later) => {}
                Ok(Ran::Unread(error)) if patience.wait(&error).await => {}
                Ok(Ran::Unread(error)) => return self.unread(job, &error),
                Err(error) => return Some(Ending::Failed(self.runner.fault(&error))),
            }
        }
    }

    /// The run itself, on a thread of the pool.
    fn run(&self, job: &Job) -> Ran {
        let record = job.record();
        if record.state.is_final() {
            return Ran::Before;
        }
        if *self.unwritten.borrow() > 0 {
            return Ran::Later;
        }
        let _noted = match Noted::new(&*self.store, &record) {
            Ok(noted) => noted,
            Err(StoreError::Ended(other)) => {
                job.follow(other.as_deref());
                return Ran::Before;
            }
            Err(error) => return Ran::Unread(error),
        };
        let input = match self.store.input(record.id) {
            Ok(Some(input)) => input,
            Ok(None) => return Ran::Unread(StoreError::Missing { part: "input", id: record.id }),
            Err(error) => return Ran::Unread(error),
        };
        if !job.begin() {
            return Ran::Before;
        }
        job.control().set_deadline(Instant::now() + self.runner.time_for(&record));
        let parts = self
            .shared
            .as_ref()
            .map(|shared| shared.nats().parts(record.id, self.config.max_crashes));
        let parts = parts.as_ref().map(|parts| parts as &dyn Parts);
        Ran::Ended(match self.runner.run(&record, input, job.control(), parts) {
            Ok(result) => Ending::Succeeded(result),
            Err(_) if job.control().stop() == Some(Stop::Cancelled) => Ending::Cancelled,
            Err(fault) => Ending::Failed(fault),
        })
    }

    /// The end of a job whose input cannot be read, or that cannot be begun. A store that fails may have it after a restart.
    fn unread(&self, job: &Job, error: &StoreError) -> Option<Ending> {
        let id = job.record().id;
        tracing::error!(%error, job_id = %id, "a job cannot be begun");
        let fault = self.runner.store_fault(error);
        if !error.may_pass() {
            return Some(Ending::Failed(fault));
        }
        job.give_up(fault, |record| self.jobs().ended(record));
        None
    }

    /// Writes down how a job ended, again and again where the disk is full; the job is at work until
    /// then. Where the store fails otherwise the job is shown as failed.
    pub(super) async fn see_ended(self: &Arc<Self>, job: &Arc<Job>, ending: Ending) {
        let (mut patience, mut waiting) = (Patience::default(), None);
        while let Err(error) = self.write_end(job, ending.clone()).await {
            let id = job.record().id;
            if waiting.is_none() {
                tracing::error!(%error, job_id = %id, "the end of a job cannot be kept yet");
                waiting = Some(Unwritten::new(&self.unwritten));
            }
            if !patience.wait(&error).await {
                tracing::error!(%error, job_id = %id, "the end of a job is not kept");
                let fault = self.runner.store_fault(&error);
                return job.give_up(fault, |record| self.jobs().ended(record));
            }
        }
    }

    /// Writes down how a job ended, unless it has ended before.
    pub(super) async fn write_end(
        self: &Arc<Self>,
        job: &Arc<Job>,
        ending: Ending,
    ) -> Result<(), StoreError> {
        let (book, job) = (Arc::clone(self), Arc::clone(job));
        // whoever sees that the job has ended may count on its expiry
        let end = move || job.end(&*book.store, ending, |record| book.jobs().ended(record));
        blocking(end).await.map(drop)
    }

    /// Waits while the store takes no ends: a run would only add one more to keep in memory.
    async fn all_written(&self) {
        let mut unwritten = self.unwritten.subscribe();
        // the sender lives as long as the book
        let _ = unwritten.wait_for(|count| *count == 0).await;
    }
}
