use std::{
    sync::{
        Arc, Mutex, OnceLock, PoisonError,
        atomic::{AtomicBool, Ordering},
    },
    time::Instant,
};

use tokio::sync::watch;
use tokio_util::sync::CancellationToken;

use crate::answer::{StageClock, StageTimes};
use crate::segment::{Monitor, Stage};

/// How far a run is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Progress {
    /// The stage it is in.
    pub stage: Stage,
    /// How much of the whole work is done, 0 to 1.
    pub fraction: f64,
}

/// Why a run stopped before its end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stop {
    /// Its caller cancelled it or went away.
    Cancelled,
    /// Its deadline passed.
    Deadline,
}

/// The handle on one run: cancels it, ends it at its deadline, tells how far it is, and times its
/// stages.
#[derive(Debug)]
pub struct Control {
    // the method asks often, so a plain flag stands beside the token that futures wait for
    cancelled: AtomicBool,
    cancellation: CancellationToken,
    deadline: OnceLock<Instant>,
    progress: watch::Sender<Option<Progress>>,
    clock: Mutex<StageClock>,
}

/// Progress is published when it has grown by this much, not at every call.
const PROGRESS_STEP: f64 = 0.01;

impl Control {
    /// A run that must end by `deadline`, if one is given.
    pub fn new(deadline: Option<Instant>) -> Arc<Self> {
        Arc::new(Self {
            cancelled: AtomicBool::new(false),
            cancellation: CancellationToken::new(),
            deadline: deadline.map(OnceLock::from).unwrap_or_default(),
            progress: watch::Sender::new(None),
            clock: Mutex::default(),
        })
    }

    /// Asks the run to stop; it does so within milliseconds.
    pub fn cancel(&self) {
        self.cancelled.store(true, Ordering::Relaxed);
        self.cancellation.cancel();
    }

    /// Waits until the run is cancelled.
    pub async fn cancelled_by_caller(&self) {
        self.cancellation.cancelled().await;
    }

    /// Sets when the run must have ended, where it has no deadline yet.
    pub fn set_deadline(&self, deadline: Instant) {
        // the first one stays
        let _ = self.deadline.set(deadline);
    }

    /// Why the run must stop, if it must.
    pub fn stop(&self) -> Option<Stop> {
        if self.cancelled.load(Ordering::Relaxed) {
            Some(Stop::Cancelled)
        } else if self.deadline.get().is_some_and(|deadline| Instant::now() >= *deadline) {
            Some(Stop::Deadline)
        } else {
            None
        }
    }

    /// The latest progress, and each one after it.
    pub fn watch(&self) -> watch::Receiver<Option<Progress>> {
        self.progress.subscribe()
    }

    /// Shows how far the run is where another process does it.
    pub fn show(&self, progress: Progress) {
        self.progress.send_replace(Some(progress));
    }

    /// Ends the timing of the current stage and returns the times of all.
    pub fn finish(&self) -> StageTimes {
        self.clock.lock().unwrap_or_else(PoisonError::into_inner).finish()
    }

    /// Cancels this run when the returned guard is dropped.
    pub fn cancel_on_drop(self: &Arc<Self>) -> CancelOnDrop {
        CancelOnDrop(Some(Arc::clone(self)))
    }
}

impl Monitor for Control {
    fn progress(&self, stage: Stage, fraction: f64) {
        self.clock.lock().unwrap_or_else(PoisonError::into_inner).enter(stage);
        self.progress.send_if_modified(|last| {
            // a stage that is entered again, on more points, takes nothing back
            let fraction = last.map_or(fraction, |last| last.fraction.max(fraction));
            let news = last.is_none_or(|last| {
                last.stage != stage || fraction - last.fraction >= PROGRESS_STEP
            });
            if news {
                *last = Some(Progress { stage, fraction });
            }
            news
        });
    }

    fn cancelled(&self) -> bool {
        self.stop().is_some()
    }
}

/// Cancels its run when dropped, unless the run was let go.
#[derive(Debug)]
pub struct CancelOnDrop(Option<Arc<Control>>);

impl CancelOnDrop {
    /// The run has ended, or may go on alone.
    pub fn release(mut self) {
        self.0 = None;
    }
}

impl Drop for CancelOnDrop {
    fn drop(&mut self) {
        if let Some(control) = &self.0 {
            control.cancel();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_dropped_guard_cancels_and_a_released_one_does_not() {
        let control = Control::new(None);
        control.cancel_on_drop().release();
        assert!(!control.cancelled());
        drop(control.cancel_on_drop());
        assert_eq!(control.stop(), Some(Stop::Cancelled));
    }

    #[test]
    fn a_passed_deadline_stops_the_run() {
        assert_eq!(Control::new(Some(Instant::now())).stop(), Some(Stop::Deadline));
    }

    #[test]
    fn each_stage_entered_is_timed_once() {
        let control = Control::new(None);
        control.progress(Stage::Grow, 0.1);
        control.progress(Stage::Grow, 0.2);
        control.progress(Stage::Report, 1.0);
        let times = control.finish();
        assert_eq!(times.keys().collect::<Vec<_>>(), ["grow", "report"]);
    }

    #[test]
    fn progress_is_published_in_steps() {
        let control = Control::new(None);
        let mut watch = control.watch();
        control.progress(Stage::Grow, 0.5);
        assert!(watch.has_changed().unwrap());
        assert_eq!(watch.borrow_and_update().unwrap().fraction, 0.5);
        control.progress(Stage::Grow, 0.501);
        assert!(!watch.has_changed().unwrap());
    }

    #[test]
    fn progress_never_goes_back() {
        let control = Control::new(None);
        let fractions = [(Stage::Grow, 0.1), (Stage::Merge, 0.5), (Stage::Grow, 0.1)];
        let seen = fractions.map(|(stage, fraction)| {
            control.progress(stage, fraction);
            let told = *control.watch().borrow();
            told.map(|told| (told.stage, told.fraction))
        });
        let last = Some((Stage::Grow, 0.5));
        assert_eq!(seen, [Some((Stage::Grow, 0.1)), Some((Stage::Merge, 0.5)), last]);
    }
}
