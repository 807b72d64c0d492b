//! Jobs that processes share: taken in by any, seen by all, run by those that work.

use std::{sync::Arc, time::Duration};

use bytes::Bytes;
use tokio::sync::oneshot;
use uuid::Uuid;

use super::{
    Book, SubmitError, blocking,
    shared::{Shared, Verdict},
};
use crate::jobs::{BytesHeld, Job, JobRecord, JobState, Overloaded, StoreError, nats::Change};

/// The record of a job is seen by its own front end within this time.
const LONGEST_ECHO: Duration = Duration::from_secs(5);
/// All jobs are known within this time after the start.
const LONGEST_START: Duration = Duration::from_secs(60);
/// A front end may have ended between the record of a job and its message in the queue: jobs that wait are
/// looked for there, after so many times the silence that workers are allowed, and so often.
const UNSEEN: u32 = 6;
const SEARCH: u32 = 3;
/// Jobs looked for at one time.
const MOST_SEARCHED: usize = 100;

impl Book {
    /// Follows what all processes do with the jobs; returns when all that are kept are known.
    ///
    /// # Errors
    /// They are not told in time.
    pub(super) async fn follow(self: &Arc<Self>, shared: &Shared) -> Result<(), StoreError> {
        let (mut changes, book) = (shared.nats().follow(), Arc::downgrade(self));
        let (known, all_known) = oneshot::channel();
        tokio::spawn(async move {
            let mut known = Some(known);
            while let Some(change) = changes.recv().await {
                let Some(book) = book.upgrade() else { return };
                let is_all = matches!(change, Change::All(_));
                book.take_up(change);
                if let Some(known) = known.take_if(|_| is_all) {
                    let _ = known.send(());
                }
            }
        });
        let book = Arc::downgrade(self);
        let pause = SEARCH * shared.nats().config().ack_wait;
        tokio::spawn(async move {
            loop {
                tokio::time::sleep(pause).await;
                let Some(book) = book.upgrade() else { return };
                book.search_lost().await;
            }
        });
        let in_time = tokio::time::timeout(LONGEST_START, all_known).await;
        let late = || StoreError::Away("the jobs that are kept are not told".to_owned());
        in_time.ok().and_then(Result::ok).ok_or_else(late)
    }

    /// Takes up what a process has done, which may be this one.
    fn take_up(&self, change: Change) {
        let Some(shared) = &self.shared else { return };
        match change {
            Change::Kept(record) => self.take_up_record(shared, record),
            Change::Gone(id) => self.take_up_end(id),
            Change::All(ids) => {
                // one that has begun here since they were told is not among them
                let is_gone = |id: &Uuid| !ids.contains(id) && !shared.nats().runs(*id);
                let gone: Vec<_> = self.jobs().ids().filter(is_gone).collect();
                gone.into_iter().for_each(|id| self.take_up_end(id));
            }
            Change::Progress(id, progress) => {
                let job = self.jobs().get(id).filter(|_| !shared.nats().runs(id));
                job.into_iter().for_each(|job| job.control().show(progress));
            }
        }
    }

    fn take_up_record(&self, shared: &Shared, record: JobRecord) {
        if let Some(asked) = shared.asked().remove(&record.id) {
            let verdict = self.judge(shared, record);
            // whoever asked waits only so long, and then the job is withdrawn
            let _ = asked.send(verdict);
            return;
        }
        let mut jobs = self.jobs();
        let job = match jobs.get(record.id) {
            Some(job) => job,
            None => {
                let job = Job::new(record.clone());
                job.admit(Ok(()));
                jobs.add(Arc::clone(&job));
                job
            }
        };
        jobs.note(&record);
        if record.state.is_final() {
            jobs.ended(&record);
        }
        drop(jobs);
        // what is told of a job that runs here is behind what is known here, but for its end
        if record.state.is_final() || !shared.nats().runs(record.id) {
            job.follow(Some(&record));
        }
    }

    fn take_up_end(&self, id: Uuid) {
        let job = self.jobs().remove(id);
        job.into_iter().for_each(|job| job.follow(None));
    }

    /// Whether a new job is taken: all before it are known now, whoever took them in.
    fn judge(&self, shared: &Shared, record: JobRecord) -> Verdict {
        let mut jobs = self.jobs();
        if let Some(first) = jobs.same(&record)? {
            return Ok(Some(first));
        }
        self.check_shared_room(shared, &jobs, record.owner.as_deref(), record.kept_bytes())?;
        let job = Job::new(record.clone());
        jobs.add(job);
        jobs.note(&record);
        Ok(None)
    }

    fn check_shared_room(
        &self,
        shared: &Shared,
        jobs: &super::Register,
        owner: Option<&str>,
        bytes: u64,
    ) -> Result<(), Overloaded> {
        let queue = self.pool.config().queue;
        let (all, own) = jobs.waiting(owner);
        if all >= queue {
            return Err(Overloaded::Queue { limit: queue });
        }
        let limit = self.config.key_share.of(queue as u64);
        if owner.is_some() && own as u64 >= limit {
            return Err(Overloaded::KeyQueue { limit });
        }
        // a tenth is left to the results, which nobody refuses
        let limit = shared.nats().config().bytes / 10 * 9;
        if jobs.all_bytes().saturating_add(bytes) > limit {
            return Err(Overloaded::Storage { limit });
        }
        Ok(())
    }

    /// Whether a job of `owner` would have a place now.
    ///
    /// # Errors
    /// It would not.
    pub fn check_room(&self, owner: Option<&str>) -> Result<(), Overloaded> {
        match &self.shared {
            Some(shared) => self.check_shared_room(shared, &self.jobs(), owner, 0),
            None => self.pool.admit(owner).map(drop),
        }
    }

    /// Jobs that wait for their turn, at any process.
    pub fn waiting(&self) -> usize {
        if self.shared.is_some() { self.jobs().waiting(None).0 } else { self.pool.queued() }
    }

    /// Jobs that run, at any process, where processes share them.
    pub fn running_anywhere(&self) -> Option<usize> {
        self.shared.is_some().then(|| self.jobs().running())
    }

    /// Takes a shared job in. A caller that goes away meanwhile leaves a whole job or none.
    ///
    /// # Errors
    /// As [`Self::submit`].
    pub(super) async fn submit_shared(
        self: &Arc<Self>,
        record: JobRecord,
        input: Bytes,
        held: BytesHeld,
    ) -> Result<(Arc<Job>, bool), SubmitError> {
        let first = self.jobs().same(&record)?;
        if let Some(first) = first {
            // a retry waits for the same answer
            first.admitted().await?;
            if self.take_up_first(&first).await? {
                return Ok((first, false));
            }
        }
        self.check_room(record.owner.as_deref())?;
        let book = Arc::clone(self);
        let taken = tokio::spawn(async move {
            let taken = book.share(record, input).await;
            drop(held);
            taken
        });
        taken.await.unwrap_or(Err(SubmitError::Store(StoreError::Closed)))
    }

    /// Keeps a job where all see it, has it judged, and puts it into the queue.
    async fn share(
        self: &Arc<Self>,
        record: JobRecord,
        input: Bytes,
    ) -> Result<(Arc<Job>, bool), SubmitError> {
        let Some(shared) = &self.shared else { return Err(StoreError::Closed.into()) };
        let id = record.id;
        let (asked, verdict) = oneshot::channel();
        shared.asked().insert(id, asked);
        let (store, new) = (Arc::clone(&self.store), record.clone());
        let limit = shared.nats().config().bytes;
        let full = |error| match error {
            StoreError::Full(_) => SubmitError::Overloaded(Overloaded::Storage { limit }),
            other => SubmitError::Store(other),
        };
        let kept = blocking(move || store.insert(&new, input)).await;
        let judged = match kept {
            Ok(()) => match tokio::time::timeout(LONGEST_ECHO, verdict).await {
                Ok(Ok(verdict)) => verdict,
                _ => Err(StoreError::Away("the job is not told of".to_owned()).into()),
            },
            Err(error) => Err(full(error)),
        };
        match judged {
            Ok(None) => {}
            Ok(Some(first)) => {
                self.withdraw(shared, id).await;
                first.admitted().await?;
                if self.take_up_first(&first).await? {
                    return Ok((first, false));
                }
                return Err(StoreError::Away("the first try is being forgotten".to_owned()).into());
            }
            Err(error) => {
                self.withdraw(shared, id).await;
                return Err(error);
            }
        }
        let job = self.jobs().get(id);
        let Some(job) = job else { return Err(StoreError::Closed.into()) };
        let lane = self.pool.lane(record.points);
        if let Err(error) = shared.nats().queue().put(lane, id, 1).await {
            // a retry waits for the same answer
            job.admit(Err(error.clone()));
            self.withdraw(shared, id).await;
            return Err(full(error));
        }
        job.admit(Ok(()));
        Ok((job, true))
    }

    /// Takes back a job that nobody was told of. Where the servers are away and its record has come through, it
    /// is run for the next who asks with the same idempotency key, or for nobody, and forgotten with the others.
    async fn withdraw(&self, shared: &Shared, id: Uuid) {
        shared.asked().remove(&id);
        self.jobs().remove(id);
        if let Err(error) = shared.nats().withdraw(id).await {
            tracing::warn!(%error, job_id = %id, "a job that is not taken cannot be forgotten yet");
            shared.left().push(id);
        }
    }

    /// Puts those jobs into the queue again that have not ended and are not there.
    async fn search_lost(&self) {
        let Some(shared) = &self.shared else { return };
        self.clear_left(shared).await;
        let now = super::now_ms();
        let unseen = UNSEEN * shared.nats().config().ack_wait;
        let unseen_ms = u64::try_from(unseen.as_millis()).unwrap_or(u64::MAX);
        let under_way = self.jobs().under_way_since(now.saturating_sub(unseen_ms));
        for job in under_way.into_iter().take(MOST_SEARCHED) {
            if self.see_queued(&job).await.is_err() {
                // at the next time
                return;
            }
        }
    }

    /// Forgets the clouds of jobs that could not be withdrawn, but for those that others may know by now.
    async fn clear_left(&self, shared: &Shared) {
        let left = std::mem::take(&mut *shared.left());
        for (at, id) in left.iter().enumerate() {
            if shared.nats().clear(*id).await.is_err_and(|error| error.may_pass()) {
                shared.left().extend(&left[at..]);
                return;
            }
        }
    }

    /// Takes up the job that a retry is to be told of; `false` where that is withdrawn, and the retry a try of its own.
    async fn take_up_first(&self, first: &Job) -> Result<bool, StoreError> {
        let Some(shared) = &self.shared else { return Ok(true) };
        let (id, is_waiting) = first.peek(|r| (r.id, r.state == JobState::Queued));
        if is_waiting && !shared.nats().take_up(id).await? {
            self.take_up_end(id);
            return Ok(false);
        }
        self.see_queued(first).await?;
        Ok(true)
    }

    /// Puts a job into the queue that has not ended and is not there: it was withdrawn while the servers that
    /// were to forget it were away, or its front end ended before it came to that.
    async fn see_queued(&self, job: &Job) -> Result<(), StoreError> {
        let Some(shared) = &self.shared else { return Ok(()) };
        let is_over = || job.peek(|record| record.state.is_final());
        let (id, points) = job.peek(|record| (record.id, record.points));
        let lane = self.pool.lane(points);
        // it may end while the servers are asked
        if is_over() || shared.nats().queue().has(lane, id).await? || is_over() {
            return Ok(());
        }
        if !shared.nats().knows(id).await? {
            // nobody is told of what is dropped after nats_max_age
            self.take_up_end(id);
            return Ok(());
        }
        tracing::warn!(job_id = %id, "a job that has not ended was not in the queue");
        shared.nats().queue().put(lane, id, super::now_ms()).await
    }
}
