use std::sync::{
    Arc, Mutex, PoisonError,
    atomic::{AtomicU64, Ordering},
};

use bytes::Bytes;

use super::Overloaded;

/// How many bytes of uploads and answers may be held at one time, over all requests.
#[derive(Clone, Debug)]
pub struct ByteBudget {
    limit: u64,
    held: Arc<AtomicU64>,
}

/// Bytes taken from a budget by one request; they are given back when its last handle is dropped.
#[derive(Clone, Debug)]
pub struct BytesHeld(Arc<Share>);

#[derive(Debug)]
struct Share {
    bytes: Mutex<u64>,
    budget: ByteBudget,
    /// Shares of the same request that are given back with this one.
    _others: Vec<BytesHeld>,
}

impl ByteBudget {
    /// A budget of `limit` bytes.
    pub fn new(limit: u64) -> Self {
        Self { limit, held: Arc::default() }
    }

    /// Bytes held now.
    pub fn held(&self) -> u64 {
        self.held.load(Ordering::Relaxed)
    }

    /// The most there may be held.
    pub fn limit(&self) -> u64 {
        self.limit
    }

    /// An empty share, to grow as an upload comes in.
    pub fn share(&self) -> BytesHeld {
        BytesHeld(Arc::new(Share { bytes: Mutex::new(0), budget: self.clone(), _others: vec![] }))
    }
}

impl BytesHeld {
    /// Grows the share to `bytes`; a share never shrinks before it is dropped, so those who count the
    /// same bytes may each say how many they have seen.
    ///
    /// # Errors
    /// The budget has not that much left.
    pub fn grow_to(&self, bytes: u64) -> Result<(), Overloaded> {
        let budget = &self.0.budget;
        let mut taken = self.0.bytes.lock().unwrap_or_else(PoisonError::into_inner);
        let more = bytes.saturating_sub(*taken);
        let fits = |held: u64| held.checked_add(more).filter(|sum| *sum <= budget.limit);
        let grown = budget.held.fetch_update(Ordering::Relaxed, Ordering::Relaxed, fits);
        grown.map_err(|_| Overloaded::Bytes { limit: budget.limit })?;
        *taken += more;
        Ok(())
    }

    /// This share and another one, given back together.
    pub fn and(self, other: Self) -> Self {
        let (bytes, budget) = (Mutex::new(0), self.0.budget.clone());
        Self(Arc::new(Share { bytes, budget, _others: vec![self, other] }))
    }

    /// `bytes` that hold the share until the last of them is dropped: sent, as a rule.
    pub fn carried_by(&self, bytes: impl AsRef<[u8]> + Send + 'static) -> Bytes {
        Bytes::from_owner(Carrier { bytes, _held: self.clone() })
    }
}

impl Drop for Share {
    fn drop(&mut self) {
        let bytes = self.bytes.get_mut().unwrap_or_else(PoisonError::into_inner);
        self.budget.held.fetch_sub(*bytes, Ordering::Relaxed);
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
        let budget = ByteBudget::new(10);
        let (a, b) = (budget.share(), budget.share());
        assert!(a.grow_to(6).is_ok() && a.grow_to(4).is_ok() && b.grow_to(4).is_ok());
        assert_eq!(b.grow_to(5), Err(Overloaded::Bytes { limit: 10 }));
        assert_eq!(budget.held(), 10);
        drop(a);
        assert_eq!(budget.held(), 4);
        assert!(b.grow_to(10).is_ok() && b.grow_to(11).is_err());
    }

    #[test]
    fn joined_shares_are_given_back_together() {
        let budget = ByteBudget::new(10);
        let (a, b) = (budget.share(), budget.share());
        assert!(a.grow_to(6).is_ok() && b.grow_to(3).is_ok());
        let both = a.and(b);
        assert_eq!(budget.held(), 9);
        drop(both);
        assert_eq!(budget.held(), 0);
    }

    #[test]
    fn bytes_on_their_way_hold_the_share_until_the_last_is_sent() {
        let budget = ByteBudget::new(10);
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
