use std::{
    sync::{Mutex, MutexGuard, PoisonError},
    time::{Duration, Instant},
};

use crate::jobs::StoreError;

/// After a failed write nothing is tried for this long: each failure has the database opened again.
pub const PAUSE: Duration = Duration::from_millis(if cfg!(test) { 20 } else { 1000 });
/// A write that went well stands for this long.
const GOOD_FOR: Duration = Duration::from_secs(10);
/// Most bytes that are written to try whether there is room again.
const MOST_TRIED: u64 = 64 << 20;

/// How the latest writes went.
#[derive(Debug, Default)]
pub struct Room(Mutex<State>);

#[derive(Debug, Default)]
struct State {
    good: Option<Instant>,
    failure: Option<Failure>,
}

#[derive(Debug)]
struct Failure {
    error: StoreError,
    // what did not find room
    bytes: u64,
    when: Instant,
}

impl Room {
    fn state(&self) -> MutexGuard<'_, State> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Whether a write may be tried now.
    ///
    /// # Errors
    /// The error of one that has just failed.
    pub fn may_try(&self) -> Result<(), StoreError> {
        match &self.state().failure {
            Some(failure) if failure.when.elapsed() < PAUSE => Err(failure.error.clone()),
            _ => Ok(()),
        }
    }

    /// A write of `bytes` went so. One that is smaller than what failed shows nothing of the room.
    pub fn note(&self, bytes: u64, done: &Result<(), StoreError>) {
        let mut state = self.state();
        match done {
            Ok(()) => {
                state.good = Some(Instant::now());
                state.failure.take_if(|failure| failure.bytes <= bytes);
            }
            Err(error) => {
                let before = state.failure.as_ref().map_or(0, |failure| failure.bytes);
                let bytes = bytes.min(MOST_TRIED).max(before);
                state.failure = Some(Failure { error: error.clone(), bytes, when: Instant::now() });
            }
        }
    }

    /// How many bytes are to be written to see how things stand; `None` where that is known.
    pub fn to_try(&self) -> Option<u64> {
        let state = self.state();
        match (&state.failure, state.good) {
            (Some(failure), _) => Some(failure.bytes),
            (None, Some(good)) if good.elapsed() < GOOD_FOR => None,
            _ => Some(0),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_smaller_write_does_not_show_that_there_is_room_again() {
        let (room, full) = (Room::default(), StoreError::Full("full".to_owned()));
        assert_eq!(room.to_try(), Some(0));
        room.note(10, &Ok(()));
        assert_eq!((room.to_try(), room.may_try()), (None, Ok(())));
        room.note(1000, &Err(full.clone()));
        assert_eq!((room.to_try(), room.may_try()), (Some(1000), Err(full.clone())));
        room.note(999, &Ok(()));
        room.note(1, &Err(full));
        assert_eq!(room.to_try(), Some(1000));
        room.note(1000, &Ok(()));
        assert_eq!((room.to_try(), room.may_try()), (None, Ok(())));
    }

    #[test]
    fn what_is_tried_is_bounded() {
        let room = Room::default();
        room.note(u64::MAX, &Err(StoreError::Closed));
        assert_eq!(room.to_try(), Some(MOST_TRIED));
    }
}
