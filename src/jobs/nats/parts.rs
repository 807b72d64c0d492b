//! Parts of a job, given to the workers through the queue.
//!
//! A task stands in the queue until the process that runs the job has heard of its end: a worker that ends
//! on the way, and an answer that is lost, bring it to another one.

use std::{
    sync::{Arc, Mutex, MutexGuard, PoisonError},
    time::{Duration, Instant},
};

use async_nats::Subscriber;
use bytes::Bytes;
use futures::StreamExt;
use serde::{Deserialize, Serialize};
use uuid::Uuid;

use super::{
    Nats,
    blobs::Blob,
    task::{PARTS_LANE, Task},
    trouble::trouble,
};
use crate::{
    answer::BUILD,
    jobs::{Control, Parts, PartsError, StoreError, record::now_ms},
};

/// Pause between two looks at whether the job is to stop.
const LOOK: Duration = Duration::from_millis(100);
/// Time after which tasks that have not ended are looked for in the queue.
const SEARCH: Duration = Duration::from_secs(30);
/// The process that runs the job answers within this time.
const HEARD: Duration = Duration::from_secs(5);

/// What is told of a task.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Told {
    round: u32,
    part: usize,
    came: Came,
}

/// What has come of a task.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
enum Came {
    /// A worker has begun it.
    Begun,
    /// It is done.
    Done(Blob),
    /// It cannot be done.
    Failed(String),
}

/// The parts of one job.
#[derive(Debug)]
pub struct NatsParts<'n> {
    nats: &'n Arc<Nats>,
    job: Uuid,
    // a part that so many workers ended on is given up
    crashes: u32,
    kept: Mutex<Vec<Blob>>,
    rounds: Mutex<u32>,
}

impl Nats {
    /// The parts of a job that this process runs; one that so many workers end on is given up.
    pub fn parts(self: &Arc<Self>, job: Uuid, crashes: u32) -> NatsParts<'_> {
        NatsParts { nats: self, job, crashes, kept: Mutex::default(), rounds: Mutex::default() }
    }

    /// What a task is about: the guide, and the part; nothing where they are gone with the job.
    ///
    /// # Errors
    /// The servers are away, or what is kept is damaged.
    pub async fn task(&self, task: &Task) -> Result<Option<(Bytes, Bytes)>, StoreError> {
        let guide = self.blobs.get(task.job, "guide", &task.guide).await?;
        let points = self.blobs.get(task.job, "tile", &task.points).await?;
        Ok(guide.zip(points))
    }

    /// Tells the process that runs the job that a task is begun.
    ///
    /// # Errors
    /// The servers are away.
    pub async fn begin_task(&self, task: &Task) -> Result<(), StoreError> {
        self.check()?;
        let (subject, text) = self.told(task, Came::Begun)?;
        self.client.publish(subject, text).await.map_err(trouble)
    }

    /// Tells the process that runs the job what has come of a task. One that does not listen has ended, or looks for
    /// the task in the queue later.
    ///
    /// # Errors
    /// The servers are away or full.
    pub async fn end_task(
        &self,
        task: &Task,
        came: Result<Bytes, String>,
    ) -> Result<(), StoreError> {
        let came = match came {
            Ok(bytes) => Came::Done(self.blobs.put(task.job, "labels", &bytes).await?),
            Err(why) => Came::Failed(why),
        };
        let (subject, text) = self.told(task, came)?;
        let _ = tokio::time::timeout(HEARD, self.client.request(subject, text)).await;
        self.check()
    }

    fn told(&self, task: &Task, came: Came) -> Result<(String, Bytes), StoreError> {
        let told = Told { round: task.round, part: task.part, came };
        let text = serde_json::to_vec(&told).map_err(|e| StoreError::Failed(e.to_string()))?;
        Ok((self.config.parts_subject(&task.job.to_string()), text.into()))
    }
}

fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl NatsParts<'_> {
    fn put(&self, part: &str, bytes: &Bytes) -> Result<Blob, StoreError> {
        let blob = self.nats.wait(self.nats.blobs.put(self.job, part, bytes))?;
        locked(&self.kept).push(blob.clone());
        Ok(blob)
    }

    /// Takes what is told next of a task, if anything is soon.
    fn next(&self, told: &mut Subscriber) -> Option<Told> {
        let next = async {
            let message = tokio::time::timeout(LOOK, told.next()).await.ok()??;
            let said = serde_json::from_slice(&message.payload).ok();
            if let Some(reply) = message.reply {
                // one that is lost brings the task to a worker once more
                let _ = self.nats.client.publish(reply, Bytes::new()).await;
            }
            said
        };
        self.nats.runtime.block_on(next)
    }

    /// Puts those tasks into the queue that are not there.
    fn put_tasks(&self, tasks: &[&Task]) -> Result<(), StoreError> {
        self.nats.wait(async {
            for task in tasks {
                let name = task.name();
                if !self.nats.queue.has_named(PARTS_LANE, &name).await? {
                    let text = serde_json::to_vec(task);
                    let text = text.map_err(|e| StoreError::Failed(e.to_string()))?;
                    self.nats.queue.put_named(PARTS_LANE, &name, text.into(), now_ms()).await?;
                }
            }
            Ok(())
        })
    }
}

impl Parts for NatsParts<'_> {
    fn keep(&self, part: Bytes) -> Result<Blob, StoreError> {
        self.put("tile", &part)
    }

    fn each(
        &self,
        guide: Bytes,
        parts: &[Blob],
        control: &Control,
        take: &mut dyn FnMut(usize, Bytes) -> Result<(), PartsError>,
    ) -> Result<(), PartsError> {
        let round = {
            let mut rounds = locked(&self.rounds);
            *rounds += 1;
            *rounds
        };
        let guide = self.put("guide", &guide)?;
        let task = |(part, points): (usize, &Blob)| Task {
            job: self.job,
            round,
            part,
            build: BUILD.to_owned(),
            guide: guide.clone(),
            points: points.clone(),
        };
        let tasks: Vec<Task> = parts.iter().enumerate().map(task).collect();
        let subject = self.nats.config.parts_subject(&self.job.to_string());
        let subscribed = async { self.nats.client.subscribe(subject).await.map_err(trouble) };
        let mut told = self.nats.wait(subscribed)?;
        self.put_tasks(&tasks.iter().collect::<Vec<_>>())?;
        let mut open: Vec<bool> = vec![true; tasks.len()];
        let mut begun = vec![0; tasks.len()];
        let mut searched = Instant::now();
        while open.iter().any(|open| *open) {
            if control.stop().is_some() {
                return Err(PartsError::Stopped);
            }
            if searched.elapsed() > SEARCH {
                searched = Instant::now();
                let left = tasks.iter().filter(|task| open[task.part]).collect::<Vec<_>>();
                // where the servers are away it is tried again
                let _ = self.put_tasks(&left);
            }
            let Some(Told { round: of, part, came }) = self.next(&mut told) else { continue };
            // an earlier round's, or one that came twice
            if of != round || !open.get(part).copied().unwrap_or_default() {
                continue;
            }
            let blob = match came {
                Came::Begun => {
                    begun[part] += 1;
                    if begun[part] <= self.crashes {
                        continue;
                    }
                    let why = format!("{} workers ended on it", self.crashes);
                    return Err(PartsError::Failed { part, why });
                }
                Came::Failed(why) => return Err(PartsError::Failed { part, why }),
                Came::Done(blob) => blob,
            };
            open[part] = false;
            locked(&self.kept).push(blob.clone());
            let bytes = self.nats.wait(self.nats.blobs.get(self.job, "labels", &blob))?;
            let bytes = bytes.ok_or(StoreError::Missing { part: "labels", id: self.job })?;
            take(part, bytes)?;
        }
        Ok(())
    }
}

impl Drop for NatsParts<'_> {
    fn drop(&mut self) {
        let kept = std::mem::take(&mut *locked(&self.kept));
        if kept.is_empty() {
            return;
        }
        let forgotten = self.nats.wait(async {
            for blob in &kept {
                self.nats.blobs.delete(blob).await?;
            }
            Ok(())
        });
        if let Err(error) = forgotten {
            tracing::warn!(%error, job_id = %self.job, "parts of a job are forgotten when they expire");
        }
    }
}
