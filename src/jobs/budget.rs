use std::sync::{
    Arc, Mutex, MutexGuard, PoisonError,
    atomic::{AtomicU64, Ordering},
};

use bytes::Bytes;

use super::{KeyShare, Overloaded, tally::Tally};

/// How many bytes of uploads and answers may be held at one time, over all requests.
#[derive(Clone, Debug)]
pub struct ByteBudget {
    limit: u64,
    held: Arc<AtomicU64>,
    // how often a share has grown
    grown: Arc<AtomicU64>,
    // bytes that each key holds
    keys: Arc<Tally>,
}

/// Bytes taken from a budget by one request; they are given back when its last handle is dropped.
#[derive(Clone, Debug)]
pub struct BytesHeld(Arc<Share>);

#[derive(Debug)]
struct Share {
    taken: Mutex<Taken>,
    budget: ByteBudget,
}

#[derive(Debug, Default)]
struct Taken {
    bytes: u64,
    owner: Option<String>,
}

impl ByteBudget {
    /// A budget of `limit` bytes, of which one key may hold `share`.
    pub fn new(limit: u64, share: KeyShare) -> Self {
        Self {
            limit,
            held: Arc::default(),
            grown: Arc::default(),
            keys: Tally::new(share.of(limit)),
        }
    }

    /// Bytes held now.
    pub fn held(&self) -> u64 {
        self.held.load(Ordering::Relaxed)
    }

    /// How often bytes have been taken since the start: it changes with everything that takes memory.
    pub fn grown(&self) -> u64 {
        self.grown.load(Ordering::Relaxed)
    }

    /// The most there may be held.
    pub fn limit(&self) -> u64 {
        self.limit
    }

    /// An empty share, to grow as an upload comes in.
    pub fn share(&self) -> BytesHeld {
        BytesHeld(Arc::new(Share { taken: Mutex::default(), budget: self.clone() }))
    }
}

impl BytesHeld {
    fn taken(&self) -> MutexGuard<'_, Taken> {
        self.0.taken.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Counts the share, and what it grows by, as `owner`'s; the first owner stays.
    ///
    /// # Errors
    /// The owner holds too much already.
    pub fn charge(&self, owner: Option<&str>) -> Result<(), Overloaded> {
        let keys = &self.0.budget.keys;
        let mut taken = self.taken();
        if taken.owner.is_none() {
            if !keys.take(owner, taken.bytes) {
                return Err(Overloaded::KeyBytes { limit: keys.limit() });
            }
            taken.owner = owner.map(str::to_owned);
        }
        Ok(())
    }

    /// Whose the share is, where the service asks for keys.
    pub fn owner(&self) -> Option<String> {
        self.taken().owner.clone()
    }

    /// Grows the share to `bytes`; a share never shrinks before it is dropped, so those who count the
    /// same bytes may each say how many they have seen.
    ///
    /// # Errors
    /// The budget, or its owner's part of it, has not that much left.
    pub fn grow_to(&self, bytes: u64) -> Result<(), Overloaded> {
        let budget = &self.0.budget;
        let mut taken = self.taken();
        let more = bytes.saturating_sub(taken.bytes);
        if !budget.keys.take(taken.owner.as_deref(), more) {
            return Err(Overloaded::KeyBytes { limit: budget.keys.limit() });
        }
        let fits = |held: u64| held.checked_add(more).filter(|sum| *sum <= budget.limit);
        let grown = budget.held.fetch_update(Ordering::Relaxed, Ordering::Relaxed, fits);
        if grown.is_err() {
            budget.keys.give_back(taken.owner.as_deref(), more);
            return Err(Overloaded::Bytes { limit: budget.limit });
        }
        budget.grown.fetch_add(u64::from(more > 0), Ordering::Relaxed);
        taken.bytes += more;
        Ok(())
    }

    /// The bytes of an answer, which hold the share until they are sent: callers that read slowly take their part of the
    /// budget.
    pub fn carrying(&self, answer: Vec<u8>) -> Bytes {
        // the work is done, so an answer that the budget has no room for goes out all the same
        let _ = self.grow_to(answer.len() as u64);
        self.carried_by(answer)
    }

    /// `bytes` that hold the share until the last of them is dropped: sent, as a rule.
    pub fn carried_by(&self, bytes: impl AsRef<[u8]> + Send + 'static) -> Bytes {
        Bytes::from_owner(Carrier { bytes, _held: self.clone() })
    }
}

impl Drop for Share {
    fn drop(&mut self) {
        let taken = self.taken.get_mut().unwrap_or_else(PoisonError::into_inner);
        self.budget.held.fetch_sub(taken.bytes, Ordering::Relaxed);
        self.budget.keys.give_back(taken.owner.as_deref(), taken.bytes);
    }
}

struct Carrier<T> {
    bytes: T,
    _held: BytesHeld,
}

impl<T: AsRef<[u8]>> AsRef<[u8]> for Carrier<T> {
    fn as_ref(&self) -> &[u8] {
        self.bytes.as_ref()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_budget_is_spent_to_the_byte_and_given_back() {
        let budget = ByteBudget::new(10, KeyShare(0.5));
        let (a, b) = (budget.share(), budget.share());
        assert!(a.grow_to(6).is_ok() && a.grow_to(4).is_ok() && b.grow_to(4).is_ok());
        assert_eq!(b.grow_to(5), Err(Overloaded::Bytes { limit: 10 }));
        assert_eq!(budget.grown(), 2);
        assert_eq!(budget.held(), 10);
        drop(a);
        assert_eq!(budget.held(), 4);
        assert!(b.grow_to(10).is_ok() && b.grow_to(11).is_err());
    }

    #[test]
    fn a_key_holds_its_share_of_the_budget_and_leaves_the_rest() {
        let budget = ByteBudget::new(10, KeyShare(0.5));
        let shares = [Some("a"), Some("a"), Some("b")].map(|owner| {
            let share = budget.share();
            share.charge(owner).unwrap();
            share
        });
        assert!(shares[0].grow_to(3).is_ok() && shares[1].grow_to(2).is_ok());
        assert_eq!(shares[1].grow_to(3), Err(Overloaded::KeyBytes { limit: 5 }));
        assert!(shares[2].grow_to(5).is_ok());
        // what came before its owner was known is counted too
        let [late, early] = [budget.share(), shares[0].clone()];
        drop(shares);
        late.grow_to(3).unwrap();
        assert_eq!(late.charge(Some("a")), Err(Overloaded::KeyBytes { limit: 5 }));
        drop(early);
        late.charge(Some("a")).unwrap();
        assert_eq!((late.owner().as_deref(), budget.held()), (Some("a"), 3));
    }

    #[test]
    fn bytes_on_their_way_hold_the_share_until_the_last_is_sent() {
        let budget = ByteBudget::new(10, KeyShare(0.5));
        let held = budget.share();
        held.grow_to(7).unwrap();
        let mut sent = held.carried_by(vec![1, 2, 3]);
        drop(held);
        let first = sent.split_to(1);
        drop(sent);
        assert_eq!((first.as_ref(), budget.held()), ([1].as_slice(), 7));
        drop(first);
        assert_eq!(budget.held(), 0);
    }
}
