//! What other processes do with the jobs, as it happens.

use std::{
    collections::HashSet,
    sync::{Arc, atomic::Ordering},
    time::Duration,
};

use async_nats::{Client, jetstream::kv::Operation};
use futures::StreamExt;
use serde::{Deserialize, Serialize};
use tokio::sync::mpsc;
use uuid::Uuid;

use super::{
    marks::Marks,
    records::{Kept, Records},
    trouble::told,
};
use crate::{
    jobs::{JobRecord, Progress},
    segment::Stage,
};

/// Something has changed.
#[derive(Clone, Debug, PartialEq)]
pub enum Change {
    /// A job is kept, or what is kept of it has changed.
    Kept(JobRecord),
    /// A job is forgotten.
    Gone(Uuid),
    /// Everything that is kept has been told; these are all.
    All(HashSet<Uuid>),
    /// How far a job is that another process runs.
    Progress(Uuid, Progress),
}

/// Changes that wait to be taken up; above it the servers wait.
const WAITING_CHANGES: usize = 1024;
/// Pause before a broken watch is begun anew.
const PAUSE: Duration = Duration::from_millis(500);
/// Where nothing comes for so long, all that is kept has come.
const SILENCE: Duration = Duration::from_secs(2);

/// Progress as it is sent.
#[derive(Debug, Serialize, Deserialize)]
struct StoredProgress {
    stage: String,
    fraction: f64,
}

/// The text that tells a progress.
pub fn progress_text(progress: Progress) -> Vec<u8> {
    let Progress { stage, fraction } = progress;
    let told = StoredProgress { stage: stage.name().to_owned(), fraction };
    serde_json::to_vec(&told).unwrap_or_default()
}

fn read_progress(text: &[u8]) -> Option<Progress> {
    let StoredProgress { stage, fraction } = serde_json::from_slice(text).ok()?;
    let stage = Stage::ALL.into_iter().find(|known| known.name() == stage)?;
    Some(Progress { stage, fraction })
}

/// What is followed.
#[derive(Clone, Debug)]
pub struct Source {
    /// The connection.
    pub client: Client,
    /// The records.
    pub records: Records,
    /// What forgotten jobs leave there.
    pub marks: Arc<Marks>,
    /// The subject of all progress.
    pub progress: String,
}

/// Every change from now on, what is kept already first. After a loss of the connection all is told
/// again.
pub fn follow(source: Source) -> mpsc::Receiver<Change> {
    let (changes, told) = mpsc::channel(WAITING_CHANGES);
    tokio::spawn(follow_records(source.clone(), changes.clone()));
    tokio::spawn(follow_progress(source, changes));
    told
}

/// Watches the records until nobody wants to know.
async fn follow_records(source: Source, changes: mpsc::Sender<Change>) {
    let (mut last, mut is_first) = (None, true);
    while !changes.is_closed() {
        let ended = watch_records(&source, &changes, &mut is_first).await.err();
        // once for each trouble
        if let Some(error) = ended.as_ref().filter(|_| ended != last) {
            tracing::warn!(error, "the jobs of other processes cannot be seen for a moment");
        }
        last = ended;
        tokio::time::sleep(PAUSE).await;
    }
}

/// Tells all that is kept, and then what changes, until the watch ends; `is_first` until all was told once.
async fn watch_records(
    source: &Source,
    changes: &mpsc::Sender<Change>,
    is_first: &mut bool,
) -> Result<(), String> {
    let bucket = source.records.bucket();
    let made = || source.client.statistics().connects.load(Ordering::Relaxed);
    let connections = made();
    let kept = bucket.stream.get_info().await.map_err(|error| told(&error))?.state.messages;
    let mut watch = bucket.watch_with_history(">").await.map_err(|error| told(&error))?;
    let mut seen = Some(HashSet::new());
    let mut all = kept == 0;
    loop {
        if all && let Some(seen) = seen.take() {
            changes.send(Change::All(seen)).await.map_err(|_| "nobody listens")?;
            *is_first = false;
        }
        let entry = tokio::select! {
            entry = watch.next() => Some(entry.ok_or("the watch has ended")?),
            () = tokio::time::sleep(SILENCE) => None,
        };
        // a watch does not outlive every loss of a connection, and marks may have come and gone meanwhile
        if made() != connections {
            return Err("the connection was lost".to_owned());
        }
        let Some(entry) = entry else {
            all = true;
            continue;
        };
        let entry = entry.map_err(|error| told(&error))?;
        all = entry.delta == 0;
        let Ok(id) = entry.key.parse::<Uuid>() else { continue };
        let change = match entry.operation {
            Operation::Put => match Kept::of(&entry.value) {
                Some(kept) => {
                    if let Some(seen) = &mut seen {
                        seen.insert(id);
                    }
                    Change::Kept(kept.record)
                }
                None => {
                    tracing::error!(job_id = %id, "the record of a job is damaged");
                    continue;
                }
            },
            Operation::Delete | Operation::Purge => {
                source.marks.saw(id, entry.revision, *is_first);
                Change::Gone(id)
            }
        };
        changes.send(change).await.map_err(|_| "nobody listens")?;
    }
}

/// Listens to the progress of the jobs until nobody wants to know.
async fn follow_progress(source: Source, changes: mpsc::Sender<Change>) {
    while !changes.is_closed() {
        if let Ok(mut told) = source.client.subscribe(source.progress.clone()).await {
            while let Some(message) = told.next().await {
                let id = message.subject.rsplit('.').next().and_then(|id| id.parse().ok());
                let progress = read_progress(&message.payload);
                if let (Some(id), Some(progress)) = (id, progress)
                    && changes.send(Change::Progress(id, progress)).await.is_err()
                {
                    return;
                }
            }
        }
        tokio::time::sleep(PAUSE).await;
    }
}
