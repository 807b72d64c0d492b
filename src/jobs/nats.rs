//! Jobs that many processes share over NATS with JetStream: front ends take them in, workers run them.
//!
//! A key-value bucket has one record a job; every process follows it and so knows all jobs, in one order.
//! Clouds and results are blobs, written once. A work queue hands each job to one worker after another
//! until one says that it is done. Nothing but the record says what has become of a job: its last state
//! is written by whoever is first, on the state before it, and a message of the queue proves nothing.

mod blobs;
mod config;
mod follow;
mod login;
mod marks;
mod parts;
mod queue;
mod records;
#[cfg(test)]
#[path = "../../tests/support/nats.rs"]
#[allow(dead_code, reason = "what it has for other tests is not all needed here")]
mod server;
mod streams;
mod task;
#[cfg(test)]
mod tests;
mod trouble;

use std::{
    collections::HashSet,
    future::Future,
    sync::{Arc, Mutex, MutexGuard, PoisonError},
    time::{Duration, Instant},
};

use async_nats::{Client, RequestErrorKind, connection::State, jetstream};
use bytes::Bytes;
use futures::StreamExt;
use tokio::{runtime::Handle, sync::mpsc};
use uuid::Uuid;

use self::{
    blobs::Blobs,
    marks::Marks,
    queue::Queue,
    records::{Kept, Records},
    trouble::trouble,
};
use super::{JobRecord, JobState, Progress, Store, StoreError, record::now_ms};

pub use blobs::Blob;
pub use config::{NatsConfig, NatsStorage};
pub use follow::Change;
pub use queue::Delivery;
#[cfg(test)]
pub use server::NatsServer;
pub use streams::NatsError;
pub use task::{PARTS_LANE, Task};

/// A worker that does not say within this time that it runs a job has ended: the longest pause between its
/// tries to reach servers that were away, and as much again.
const ALIVE_TIME: Duration = login::LONGEST_PAUSE.saturating_mul(2);
/// Pause before a worker that is not there is asked again.
const ALIVE_PAUSE: Duration = Duration::from_millis(200);

/// What is to be done with a job that the queue has handed out.
#[derive(Clone, Debug, PartialEq)]
pub enum Claim {
    /// It is to be run.
    Run(Box<JobRecord>),
    /// It has ended, or is forgotten.
    Over,
    /// Another worker runs it.
    Elsewhere,
}

/// The jobs on NATS.
#[derive(Debug)]
pub struct Nats {
    config: NatsConfig,
    client: Client,
    records: Records,
    marks: Arc<Marks>,
    blobs: Blobs,
    queue: Queue,
    // this process, for the others
    me: Uuid,
    runtime: Handle,
    running: Mutex<HashSet<Uuid>>,
}

/// A job at work here, as long as this is kept.
#[derive(Debug)]
pub struct AtWork<'n> {
    nats: &'n Nats,
    id: Uuid,
}

impl Drop for AtWork<'_> {
    fn drop(&mut self) {
        self.nats.running().remove(&self.id);
    }
}

impl Nats {
    /// Connects, makes what is missing of streams and buckets, and compares what is there with the
    /// settings.
    ///
    /// # Errors
    /// No server can be reached, or they make or have something else.
    pub async fn connect(config: NatsConfig) -> Result<Arc<Self>, NatsError> {
        let client = login::connect(&config).await?;
        let context = jetstream::new(client.clone());
        let streams::Places { records, blobs, queue } = streams::make(&context, &config).await?;
        let nats = Arc::new(Self {
            records: Records::new(records),
            marks: Arc::default(),
            blobs: Blobs::new(context.clone(), blobs, config.blob_prefix()),
            queue: Queue::new(config.clone(), context, queue),
            client,
            config,
            me: Uuid::now_v7(),
            runtime: Handle::current(),
            running: Mutex::default(),
        });
        let (marks, stream) = (Arc::downgrade(&nats.marks), nats.records.bucket().stream.clone());
        tokio::spawn(marks::take_away(marks, stream));
        tokio::spawn(say_what_runs(Arc::downgrade(&nats), nats.client.clone()));
        Ok(nats)
    }

    /// The settings.
    pub fn config(&self) -> &NatsConfig {
        &self.config
    }

    /// The queue.
    pub fn queue(&self) -> &Queue {
        &self.queue
    }

    /// Every change of a job from now on; see [`Change`].
    pub fn follow(&self) -> mpsc::Receiver<Change> {
        follow::follow(follow::Source {
            client: self.client.clone(),
            records: self.records.clone(),
            marks: Arc::clone(&self.marks),
            progress: self.config.progress_subject("*"),
        })
    }

    fn running(&self) -> MutexGuard<'_, HashSet<Uuid>> {
        self.running.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Whether this process runs the job.
    pub fn runs(&self, id: Uuid) -> bool {
        self.running().contains(&id)
    }

    /// Notes that this process runs a job; nothing where it does so already.
    pub fn at_work(&self, id: Uuid) -> Option<AtWork<'_>> {
        let is_new = self.running().insert(id);
        // made where it is new alone: dropping it takes the job away
        is_new.then(|| AtWork { nats: self, id })
    }

    /// At once, where there is no connection: what is sent then would come later, whatever has been
    /// said meanwhile.
    fn check(&self) -> Result<(), StoreError> {
        let away = || StoreError::Away("no NATS server can be reached".to_owned());
        self.is_connected().then_some(()).ok_or_else(away)
    }

    /// Whether the record of a job is kept.
    ///
    /// # Errors
    /// The servers are away, or the record is damaged.
    pub async fn knows(&self, id: Uuid) -> Result<bool, StoreError> {
        self.check()?;
        Ok(self.records.get(id).await?.is_some())
    }

    /// Whether a server can be reached.
    pub fn is_connected(&self) -> bool {
        self.client.connection_state() == State::Connected
    }

    /// Runs a call from a thread that may wait.
    fn wait<T>(&self, call: impl Future<Output = Result<T, StoreError>>) -> Result<T, StoreError> {
        self.check()?;
        self.runtime.block_on(call)
    }

    /// Looks at a job that the queue has handed out. One that says it is at work, while its worker does
    /// not, has ended that worker: this is counted.
    ///
    /// # Errors
    /// The servers are away, or the record is damaged.
    pub async fn claim(&self, id: Uuid) -> Result<Claim, StoreError> {
        self.check()?;
        let Some((kept, _)) = self.records.get(id).await? else { return Ok(Claim::Over) };
        if kept.record.state.is_final() {
            return Ok(Claim::Over);
        }
        let Some(worker) = kept.worker.filter(|_| kept.record.state == JobState::Running) else {
            return Ok(Claim::Run(Box::new(kept.record)));
        };
        if worker == self.me {
            // handed out anew after an answer to it was lost, or given up here
            return Ok(if self.runs(id) {
                Claim::Elsewhere
            } else {
                Claim::Run(Box::new(kept.released().record))
            });
        }
        if self.says_it_runs(worker, id).await? {
            return Ok(Claim::Elsewhere);
        }
        let counted = self.records.change(id, |now| {
            // another worker may have counted it
            Ok((now.worker == Some(worker)).then(|| {
                let mut new = now.released();
                new.record.crashes += 1;
                new
            }))
        });
        match counted.await {
            Ok(kept) if kept.record.state.is_final() => Ok(Claim::Over),
            Ok(kept) if kept.worker.is_some() => Ok(Claim::Elsewhere),
            Ok(kept) => Ok(Claim::Run(Box::new(kept.record))),
            Err(StoreError::Ended(_)) => Ok(Claim::Over),
            Err(error) => Err(error),
        }
    }

    /// The state of a job as it is kept; nothing where it is forgotten.
    ///
    /// # Errors
    /// The servers are away, or the record is damaged.
    pub async fn state(&self, id: Uuid) -> Result<Option<JobState>, StoreError> {
        self.check()?;
        Ok(self.records.get(id).await?.map(|(kept, _)| kept.record.state))
    }

    /// Whether a worker says that it runs a job.
    async fn says_it_runs(&self, worker: Uuid, id: Uuid) -> Result<bool, StoreError> {
        let subject = self.config.runs_subject(&worker.to_string());
        let begin = Instant::now();
        loop {
            let asked = self.client.request(subject.clone(), id.to_string().into());
            match tokio::time::timeout(ALIVE_TIME, asked).await {
                Ok(Ok(answer)) => return Ok(&answer.payload[..] == b"yes"),
                Ok(Err(error)) if error.kind() == RequestErrorKind::NoResponders => {
                    if begin.elapsed() >= ALIVE_TIME {
                        return Ok(false);
                    }
                    // servers that were away may not have it back yet
                    tokio::time::sleep(ALIVE_PAUSE).await;
                }
                // where the connection is lost nothing is known
                _ => return self.check().map(|()| false),
            }
        }
    }

    /// A job that was begun here is to be run by another worker.
    ///
    /// # Errors
    /// The servers are away.
    pub async fn give_back(&self, id: Uuid) -> Result<(), StoreError> {
        self.check()?;
        let given = self.records.change(id, |now| {
            let mine = now.worker == Some(self.me) && !now.record.state.is_final();
            Ok(mine.then(|| now.released()))
        });
        match given.await {
            Ok(_) | Err(StoreError::Ended(_)) => Ok(()),
            Err(error) => Err(error),
        }
    }

    /// Tells the others how far a job is.
    pub async fn tell_progress(&self, id: Uuid, progress: Progress) {
        if self.check().is_ok() {
            let subject = self.config.progress_subject(&id.to_string());
            // the next one says more
            let _ = self.client.publish(subject, follow::progress_text(progress).into()).await;
        }
    }

    async fn keep(&self, record: &JobRecord, input: &Bytes) -> Result<(), StoreError> {
        let input = self.blobs.put(record.id, "cloud", input).await?;
        let kept = Kept { record: record.clone(), input, result: None, worker: None };
        self.records.create(&kept).await
    }

    /// What becomes of a job that begins here.
    fn begun(&self, now: &Kept, started_ms: u64) -> Result<Option<Kept>, StoreError> {
        if now.record.state.is_final() {
            return Err(StoreError::Ended(Some(Box::new(now.record.clone()))));
        }
        let mut new = now.clone();
        (new.record.state, new.record.started_ms) = (JobState::Running, Some(started_ms));
        new.worker = Some(self.me);
        Ok(Some(new))
    }

    async fn end(&self, record: &JobRecord, result: Option<Bytes>) -> Result<(), StoreError> {
        let id = record.id;
        let blob = match &result {
            Some(bytes) => Some(self.blobs.put(id, "result", bytes).await?),
            None => None,
        };
        let ended = self.records.change(id, |now| {
            if now.record.state.is_final() {
                // an earlier try of this very end may have come through
                let own = (now.record.state, now.record.finished_ms)
                    == (record.state, record.finished_ms)
                    && now.result == blob;
                let other = || StoreError::Ended(Some(Box::new(now.record.clone())));
                return if own { Ok(None) } else { Err(other()) };
            }
            let mut new = now.clone();
            new.record = JobRecord {
                crashes: now.record.crashes,
                started_ms: now.record.started_ms.or(record.started_ms),
                ..record.clone()
            };
            (new.result, new.worker) = (blob.clone(), None);
            Ok(Some(new))
        });
        let ended = ended.await;
        if let (Err(StoreError::Ended(_)), Some(blob)) = (&ended, &blob) {
            // unless it is the result that is kept, nobody will ask for it
            let kept = self.records.get(id).await?.and_then(|(kept, _)| kept.result);
            if kept.as_ref() != Some(blob) {
                self.blobs.delete(blob).await?;
            }
        }
        ended.map(drop)
    }

    async fn forget(&self, id: Uuid) -> Result<(), StoreError> {
        while let Some((_, revision)) = self.records.get(id).await? {
            self.marks.forgotten(id);
            if self.records.delete(id, revision).await? {
                return self.blobs.delete_all(id).await;
            }
        }
        Ok(())
    }

    /// Takes up a job that waits and may be about to be withdrawn: from then on it is not. `false` where it is gone, or
    /// its cloud is.
    ///
    /// # Errors
    /// The servers are away, or the record is damaged.
    pub async fn take_up(&self, id: Uuid) -> Result<bool, StoreError> {
        self.check()?;
        // the same record again, of another revision
        let taken = self
            .records
            .change(id, |now| Ok((now.record.state == JobState::Queued).then(|| now.clone())));
        let kept = match taken.await {
            Ok(kept) => kept,
            Err(StoreError::Ended(_)) => return Ok(false),
            Err(error) => return Err(error),
        };
        if kept.record.state != JobState::Queued || self.blobs.has(&kept.input).await? {
            return Ok(true);
        }
        // its record came through after its cloud was taken back
        self.forget(id).await?;
        Ok(false)
    }

    /// Forgets a job that nobody was told of, or what there is of its cloud.
    ///
    /// # Errors
    /// The servers are away.
    pub async fn withdraw(&self, id: Uuid) -> Result<(), StoreError> {
        self.check()?;
        if let Some((_, revision)) = self.records.get(id).await? {
            self.marks.forgotten(id);
            if !self.records.delete(id, revision).await? {
                // somebody has taken it up
                return Ok(());
            }
        }
        self.blobs.delete_all(id).await
    }

    /// Forgets what there is of the cloud of a job whose record was not kept.
    ///
    /// # Errors
    /// The servers are away.
    pub async fn clear(&self, id: Uuid) -> Result<(), StoreError> {
        if self.knows(id).await? { Ok(()) } else { self.blobs.delete_all(id).await }
    }

    async fn blob(
        &self,
        id: Uuid,
        part: &'static str,
        which: impl Fn(Kept) -> Option<blobs::Blob>,
    ) -> Result<Option<Bytes>, StoreError> {
        let Some((kept, _)) = self.records.get(id).await? else { return Ok(None) };
        match which(kept) {
            Some(blob) => self.blobs.get(id, part, &blob).await,
            None => Ok(None),
        }
    }
}

impl Store for Nats {
    fn durable(&self) -> bool {
        true
    }

    fn insert(&self, record: &JobRecord, input: Bytes) -> Result<(), StoreError> {
        self.wait(self.keep(record, &input))
    }

    fn begin(&self, record: &JobRecord) -> Result<(), StoreError> {
        let started = now_ms();
        self.wait(async {
            self.records.change(record.id, |now| self.begun(now, started)).await.map(drop)
        })
    }

    fn finish(&self, record: &JobRecord, result: Option<Bytes>) -> Result<(), StoreError> {
        self.wait(self.end(record, result))
    }

    fn remove(&self, id: Uuid) -> Result<(), StoreError> {
        self.wait(self.forget(id))
    }

    fn records(&self) -> Result<Vec<JobRecord>, StoreError> {
        self.wait(async {
            let keys = self.records.bucket().keys().await.map_err(trouble)?;
            let mut keys = std::pin::pin!(keys);
            let mut records = Vec::new();
            while let Some(key) = keys.next().await {
                let Ok(id) = key.map_err(trouble)?.parse() else { continue };
                match self.records.get(id).await {
                    Ok(kept) => records.extend(kept.map(|(kept, _)| kept.record)),
                    Err(StoreError::Damaged { .. }) => {}
                    Err(error) => return Err(error),
                }
            }
            records.sort_by_key(|record| record.id);
            Ok(records)
        })
    }

    fn input(&self, id: Uuid) -> Result<Option<Bytes>, StoreError> {
        self.wait(self.blob(id, "input", |kept| Some(kept.input)))
    }

    fn result(&self, id: Uuid) -> Result<Option<Bytes>, StoreError> {
        self.wait(self.blob(id, "result", |kept| kept.result))
    }

    fn probe(&self) -> Result<(), StoreError> {
        self.wait(async { self.queue.stream().get_info().await.map(drop).map_err(trouble) })
    }
}

/// Answers those who ask whether this process runs a job, as long as it is there.
async fn say_what_runs(nats: std::sync::Weak<Nats>, client: Client) {
    let subject = match nats.upgrade() {
        Some(nats) => nats.config.runs_subject(&nats.me.to_string()),
        None => return,
    };
    let Ok(mut questions) = client.subscribe(subject).await else { return };
    while let Some(question) = questions.next().await {
        let Some(nats) = nats.upgrade() else { return };
        let id = std::str::from_utf8(&question.payload).ok().and_then(|id| id.parse().ok());
        let answer = if id.is_some_and(|id| nats.runs(id)) { "yes" } else { "no" };
        if let Some(reply) = question.reply {
            // whoever asks takes silence for a no
            let _ = client.publish(reply, answer.into()).await;
        }
    }
}
