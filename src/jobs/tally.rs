use std::{
    collections::HashMap,
    sync::{Arc, Mutex, MutexGuard, PoisonError},
};

/// The part of each limit that one key may take, above 0 and up to 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KeyShare(pub f64);

impl KeyShare {
    /// One key may take all.
    pub const ALL: Self = Self(1.0);

    /// The part of `limit`; one at least, where there is any.
    pub fn of(self, limit: u64) -> u64 {
        if self.0 >= 1.0 { limit } else { ((limit as f64 * self.0) as u64).max(limit.min(1)) }
    }
}

/// How much each key has taken of something. Callers without a key share what there is.
#[derive(Debug)]
pub struct Tally {
    limit: u64,
    taken: Mutex<HashMap<String, u64>>,
}

impl Tally {
    /// A tally that lets each key take up to `limit`.
    pub fn new(limit: u64) -> Arc<Self> {
        Arc::new(Self { limit, taken: Mutex::default() })
    }

    /// The most that one key may take.
    pub fn limit(&self) -> u64 {
        self.limit
    }

    fn taken(&self) -> MutexGuard<'_, HashMap<String, u64>> {
        self.taken.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Takes `more` for `owner`; `false`, and nothing is taken, where that is more than it may have.
    pub fn take(&self, owner: Option<&str>, more: u64) -> bool {
        let Some(owner) = owner.filter(|_| more > 0) else { return true };
        let mut taken = self.taken();
        let sum = taken.get(owner).unwrap_or(&0).saturating_add(more);
        if sum <= self.limit {
            taken.insert(owner.to_owned(), sum);
        }
        sum <= self.limit
    }

    /// Gives back what was taken.
    pub fn give_back(&self, owner: Option<&str>, less: u64) {
        let Some(owner) = owner else { return };
        let mut taken = self.taken();
        if let Some(sum) = taken.get_mut(owner) {
            *sum -= less;
            if *sum == 0 {
                taken.remove(owner);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_key_takes_up_to_its_share_whatever_others_take() {
        let tally = Tally::new(3);
        assert!(tally.take(Some("a"), 3) && !tally.take(Some("a"), 1));
        assert!(tally.take(Some("b"), 3) && tally.take(None, 100));
        tally.give_back(Some("a"), 1);
        assert!(!tally.take(Some("a"), 2) && tally.take(Some("a"), 1));
        tally.give_back(Some("a"), 3);
        tally.give_back(Some("b"), 3);
        assert!(tally.taken().is_empty());
    }

    #[test]
    fn a_share_is_one_at_least_and_all_at_most() {
        let of = |share, limit| KeyShare(share).of(limit);
        assert_eq!((of(0.5, 64), of(0.5, 1), of(0.001, 64), of(0.5, 0)), (32, 1, 1, 0));
        assert_eq!(KeyShare::ALL.of(u64::MAX), u64::MAX);
    }
}
