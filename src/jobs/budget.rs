use std::sync::{
    Arc,
    atomic::{AtomicU64, Ordering},
};

use super::Overloaded;

/// How many bytes of uploads may be held at one time, over all requests.
#[derive(Clone, Debug)]
pub struct ByteBudget {
    limit: u64,
    held: Arc<AtomicU64>,
}

/// Bytes taken from a budget; dropping them gives them back.
#[derive(Debug)]
pub struct BytesHeld {
    bytes: u64,
    budget: ByteBudget,
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

    /// An empty share, to grow as an upload comes in.
    pub fn share(&self) -> BytesHeld {
        BytesHeld { bytes: 0, budget: self.clone() }
    }
}

impl BytesHeld {
    /// Grows the share to `bytes`; a share never shrinks before it is dropped.
    ///
    /// # Errors
    /// The budget has not that much left.
    pub fn grow_to(&mut self, bytes: u64) -> Result<(), Overloaded> {
        let more = bytes.saturating_sub(self.bytes);
        let limit = self.budget.limit;
        self.budget
            .held
            .fetch_update(Ordering::Relaxed, Ordering::Relaxed, |held| {
                held.checked_add(more).filter(|sum| *sum <= limit)
            })
            .map_err(|_| Overloaded::Bytes { limit })?;
        self.bytes += more;
        Ok(())
    }
}

impl Drop for BytesHeld {
    fn drop(&mut self) {
        self.budget.held.fetch_sub(self.bytes, Ordering::Relaxed);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_budget_is_spent_to_the_byte_and_given_back() {
        let budget = ByteBudget::new(10);
        let (mut a, mut b) = (budget.share(), budget.share());
        assert!(a.grow_to(6).is_ok() && a.grow_to(4).is_ok() && b.grow_to(4).is_ok());
        assert_eq!(b.grow_to(5), Err(Overloaded::Bytes { limit: 10 }));
        assert_eq!(budget.held(), 10);
        drop(a);
        assert_eq!(budget.held(), 4);
        assert!(b.grow_to(10).is_ok() && b.grow_to(11).is_err());
    }
}
