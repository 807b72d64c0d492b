//! Work done on a scene.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

/// How much work was done on a scene, in points visited, and whether some was left.
///
/// It is counted, not timed, and asked for between steps that come in the same order on any number of threads: where
/// work ends depends on the cloud alone.
#[derive(Debug, Default)]
pub struct Work {
    done: AtomicU64,
    left: AtomicBool,
}

impl Work {
    /// Adds what took as long as visiting so many points.
    pub fn spend(&self, points: u64) {
        self.done.fetch_add(points, Ordering::Relaxed);
    }

    /// What was done so far.
    pub fn done(&self) -> u64 {
        self.done.load(Ordering::Relaxed)
    }

    /// Notes that something was left undone.
    pub fn leave(&self) {
        self.left.store(true, Ordering::Relaxed);
    }

    /// Whether something was left undone.
    pub fn is_left(&self) -> bool {
        self.left.load(Ordering::Relaxed)
    }
}
