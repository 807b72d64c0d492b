use std::{
    sync::{Mutex, PoisonError},
    time::{Duration, Instant},
};

/// Time between two lines.
const PAUSE: Duration = Duration::from_secs(1);

/// Lines of the log that strangers can cause: one a second is written, and says how many were not.
#[derive(Debug)]
pub struct Seldom(Mutex<(Option<Instant>, u64)>);

impl Seldom {
    /// None has been written yet.
    pub const fn new() -> Self {
        Self(Mutex::new((None, 0)))
    }

    /// Whether the line of now is written: then it gets the number of those before it that were not.
    pub fn turn(&self) -> Option<u64> {
        self.turn_at(Instant::now())
    }

    fn turn_at(&self, now: Instant) -> Option<u64> {
        let mut state = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let (last, untold) = &mut *state;
        if last.is_some_and(|last| now.saturating_duration_since(last) < PAUSE) {
            *untold += 1;
            return None;
        }
        *last = Some(now);
        Some(std::mem::take(untold))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_flood_is_one_line_a_second_and_a_count() {
        let (lines, begin) = (Seldom::new(), Instant::now());
        let at = |seconds| lines.turn_at(begin + Duration::from_secs_f64(seconds));
        assert_eq!((at(0.0), at(0.1), at(0.999)), (Some(0), None, None));
        assert_eq!((at(1.0), at(1.5), at(2.0), at(60.0)), (Some(2), None, Some(1), Some(0)));
    }
}
