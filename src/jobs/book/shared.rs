//! What processes that share their jobs have beside them.

use std::{
    collections::HashMap,
    sync::{Arc, Mutex, MutexGuard, PoisonError},
};

use tokio::sync::oneshot;
use uuid::Uuid;

use crate::jobs::{Job, Nats, SubmitError};

/// What is decided of a new job when its record comes back in the order that all processes see.
pub type Verdict = Result<Option<Arc<Job>>, SubmitError>;

/// What processes that share their jobs have beside them.
#[derive(Debug)]
pub struct Shared {
    nats: Arc<Nats>,
    // jobs whose record has not come back
    asked: Mutex<HashMap<Uuid, oneshot::Sender<Verdict>>>,
    // jobs that could not be withdrawn when servers were away
    left: Mutex<Vec<Uuid>>,
}

impl Shared {
    pub(super) fn new(nats: Arc<Nats>) -> Self {
        Self { nats, asked: Mutex::default(), left: Mutex::default() }
    }

    /// The servers.
    pub(super) fn nats(&self) -> &Arc<Nats> {
        &self.nats
    }

    /// The jobs whose record has not come back, with those who wait for it.
    pub(super) fn asked(&self) -> MutexGuard<'_, HashMap<Uuid, oneshot::Sender<Verdict>>> {
        self.asked.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The jobs that could not be withdrawn.
    pub(super) fn left(&self) -> MutexGuard<'_, Vec<Uuid>> {
        self.left.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
