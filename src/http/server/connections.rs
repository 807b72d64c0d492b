use std::{
    collections::HashMap,
    num::NonZeroUsize,
    sync::{
        Arc, Mutex, MutexGuard, PoisonError,
        atomic::{AtomicU64, Ordering},
    },
    time::{Duration, Instant},
};

use tokio::sync::{OwnedSemaphorePermit, Semaphore};

use super::{line::Line, patience::Patience};

/// A newcomer that finds no room looks again this often whether a connection may be ended by now.
const LOOK_AGAIN: Duration = Duration::from_millis(50);

/// The connections that are served at one time, over all listeners that share these.
///
/// Where they are as many as there may be, a newcomer takes the place of the one that has kept the
/// service waiting longest. One whose request is being worked on is never ended for it; while all are
/// such, the newcomer waits: it is accepted, but nothing of it is read.
#[derive(Clone, Debug)]
pub struct Connections {
    places: Arc<Semaphore>,
    most: usize,
    patience: Patience,
    lines: Arc<Mutex<HashMap<u64, Arc<Line>>>>,
    next: Arc<AtomicU64>,
    /// Newcomers that wait although none could be ended for them.
    waiting: Arc<AtomicU64>,
}

impl Connections {
    /// Room for `most` connections.
    pub fn new(most: NonZeroUsize, patience: Patience) -> Self {
        let most = most.get().min(Semaphore::MAX_PERMITS);
        Self {
            places: Arc::new(Semaphore::new(most)),
            most,
            patience,
            lines: Arc::default(),
            next: Arc::default(),
            waiting: Arc::default(),
        }
    }

    /// Connections served now.
    pub fn open(&self) -> usize {
        self.most - self.places.available_permits()
    }

    /// Whether a newcomer waits, for every connection has a request that is being worked on.
    pub fn exhausted(&self) -> bool {
        self.waiting.load(Ordering::Relaxed) > 0 && self.places.available_permits() == 0
    }

    /// Waits for room, and makes it where it can.
    pub(super) async fn place(&self) -> Place {
        if let Ok(permit) = Arc::clone(&self.places).try_acquire_owned() {
            return self.taken(Some(permit));
        }
        metrics::counter!("conicoid_connections_delayed_total").increment(1);
        loop {
            let made = self.end_longest();
            let _waits = (!made).then(|| Waits::begin(&self.waiting));
            let next = Arc::clone(&self.places).acquire_owned();
            // places are never closed, so there is always one in the end
            if let Ok(permit) = tokio::time::timeout(LOOK_AGAIN, next).await {
                return self.taken(permit.ok());
            }
        }
    }

    fn taken(&self, permit: Option<OwnedSemaphorePermit>) -> Place {
        let id = self.next.fetch_add(1, Ordering::Relaxed);
        let line = Arc::new(Line::new(Instant::now()));
        self.lines().insert(id, Arc::clone(&line));
        Place { line, id, connections: self.clone(), _permit: permit }
    }

    /// Ends the connection that has kept the service waiting longest; whether any did.
    pub(super) fn end_longest(&self) -> bool {
        let mut lines = self.lines();
        let waits = lines.iter().filter_map(|(id, line)| Some((line.waits_since()?, *id)));
        let longest = waits.min().and_then(|(_, id)| lines.remove(&id));
        if let Some(line) = &longest {
            line.end();
            metrics::counter!("conicoid_connections_ended_total", "cause" => "room").increment(1);
        }
        longest.is_some()
    }

    fn lines(&self) -> MutexGuard<'_, HashMap<u64, Arc<Line>>> {
        self.lines.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// One connection's place, given back when it is dropped.
pub(super) struct Place {
    /// What is known of the connection.
    pub(super) line: Arc<Line>,
    id: u64,
    connections: Connections,
    _permit: Option<OwnedSemaphorePermit>,
}

impl Place {
    /// How long the service waits for its callers.
    pub(super) fn patience(&self) -> &Patience {
        &self.connections.patience
    }
}

impl Drop for Place {
    fn drop(&mut self) {
        self.connections.lines().remove(&self.id);
    }
}

/// Counts a newcomer for as long as it waits.
struct Waits<'a>(&'a AtomicU64);

impl<'a> Waits<'a> {
    fn begin(count: &'a AtomicU64) -> Self {
        count.fetch_add(1, Ordering::Relaxed);
        Self(count)
    }
}

impl Drop for Waits<'_> {
    fn drop(&mut self) {
        self.0.fetch_sub(1, Ordering::Relaxed);
    }
}
