//! The marks that forgotten jobs leave among the records, taken away after a while.
//!
//! A mark tells those who follow the records that a job is gone. Every process that starts reads them all.

use std::{
    collections::{HashSet, VecDeque},
    sync::{Arc, Mutex, MutexGuard, PoisonError, Weak},
    time::{Duration, Instant},
};

use async_nats::jetstream::stream::{DeleteMessageErrorKind, Stream};
use uuid::Uuid;

/// A mark stays for so long. Whoever is told nothing for that time has lost the connection, sees that after some
/// ten seconds, and is told anew of all that is kept.
const MARK_TIME: Duration = Duration::from_millis(if cfg!(test) { 300 } else { 300_000 });
/// Pause between two looks at the marks.
const PAUSE: Duration = Duration::from_millis(if cfg!(test) { 50 } else { 10_000 });
/// What servers say that have no leader for the moment.
const NO_LEADER: usize = 503;

/// The marks that this process takes away: of the jobs that it has forgotten itself, and those it found when it
/// began, whose processes may have ended.
#[derive(Debug, Default)]
pub struct Marks(Mutex<State>);

#[derive(Debug, Default)]
struct State {
    forgotten: HashSet<Uuid>,
    // when they were seen, and their numbers in the stream
    seen: VecDeque<(Instant, u64)>,
}

impl Marks {
    fn state(&self) -> MutexGuard<'_, State> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// This process forgets a job.
    pub fn forgotten(&self, id: Uuid) {
        self.state().forgotten.insert(id);
    }

    /// A mark is seen, among those that were there before this process, or new.
    pub fn saw(&self, id: Uuid, sequence: u64, was_there: bool) {
        let mut state = self.state();
        if state.forgotten.remove(&id) || was_there {
            state.seen.push_back((Instant::now(), sequence));
        }
    }

    /// The next mark whose time has passed.
    fn due(&self) -> Option<(Instant, u64)> {
        let mut state = self.state();
        let is_due = state.seen.front().is_some_and(|(seen, _)| seen.elapsed() >= MARK_TIME);
        if is_due { state.seen.pop_front() } else { None }
    }

    fn put_back(&self, mark: (Instant, u64)) {
        self.state().seen.push_front(mark);
    }
}

/// Takes marks away from the stream as long as somebody else keeps them. Message by message: after a purge, of
/// one subject as well, servers of the 2.9 line leave those who watch the bucket standing.
pub async fn take_away(marks: Weak<Marks>, stream: Stream) {
    loop {
        tokio::time::sleep(PAUSE).await;
        let Some(marks) = marks.upgrade() else { return };
        take_away_due(&marks, &stream).await;
    }
}

async fn take_away_due(marks: &Arc<Marks>, stream: &Stream) {
    while let Some(mark) = marks.due() {
        let Err(error) = stream.delete_message(mark.1).await else { continue };
        match error.kind() {
            // another process was faster, or the stream was made by an earlier version, which forbids it
            DeleteMessageErrorKind::JetStream(error) if error.code() != NO_LEADER => {}
            _ => return marks.put_back(mark),
        }
    }
}
