use std::{
    collections::BTreeMap,
    time::{Duration, Instant},
};

use crate::segment::Stage;

/// Seconds spent in each stage, by the stage's name.
pub type StageTimes = BTreeMap<String, f64>;

/// How long each stage of a run takes.
#[derive(Debug, Default)]
pub struct StageClock {
    current: Option<(Stage, Instant)>,
    times: StageTimes,
}

impl StageClock {
    /// The run is in `stage` now.
    pub fn enter(&mut self, stage: Stage) {
        if self.current.is_none_or(|(current, _)| current != stage) {
            let now = Instant::now();
            self.leave(now);
            self.current = Some((stage, now));
        }
    }

    /// Ends the timing of the current stage and returns the times of all.
    pub fn finish(&mut self) -> StageTimes {
        self.leave(Instant::now());
        std::mem::take(&mut self.times)
    }

    fn leave(&mut self, now: Instant) {
        if let Some((stage, since)) = self.current.take() {
            *self.times.entry(stage.name().to_owned()).or_default() += seconds(now - since);
        }
    }
}

fn seconds(duration: Duration) -> f64 {
    // microseconds are all that a reader of timings needs
    (duration.as_secs_f64() * 1e6).round() / 1e6
}
