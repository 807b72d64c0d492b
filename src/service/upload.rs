use super::{Caller, ErrorKind, Representation, Service, ServiceError};
use crate::{formats::Packing, jobs::BytesHeld};

/// Room made at once for a body that says how long it will be.
const FIRST: u64 = 1 << 20;
/// Most bytes of a window that zstd keeps of what it has unpacked.
pub const WINDOW: u64 = 128 << 20;
/// Afterwards room is made for at most this many times what has come: nobody's word is taken for more.
const TIMES: u64 = 8;

/// How many bytes of one request are taken in: so many each, and so many over all requests.
#[derive(Clone, Debug)]
pub struct Allowance {
    held: BytesHeld,
    limit: u64,
}

impl Allowance {
    /// Refuses a body of `bytes` where that is over the limit; nothing is taken from the budget.
    ///
    /// # Errors
    /// It is.
    pub fn check(&self, bytes: u64) -> Result<(), ServiceError> {
        let detail = || format!("the body has more than {} bytes: thin the cloud out", self.limit);
        if bytes <= self.limit {
            Ok(())
        } else {
            Err(ServiceError::new(ErrorKind::BodyTooLarge, detail()))
        }
    }

    /// Counts `total` bytes that have come by now.
    ///
    /// # Errors
    /// They are over the limit, or the budget is used up.
    pub fn count(&self, total: u64) -> Result<(), ServiceError> {
        self.check(total)?;
        Ok(self.held.grow_to(total)?)
    }
}

/// A cloud coming in: its bytes, counted against the budget of all requests.
#[derive(Debug)]
pub struct Upload {
    bytes: Vec<u8>,
    announced: u64,
    allowance: Allowance,
}

impl Upload {
    /// An empty upload of at most `limit` bytes, which `held` counts.
    pub fn new(held: BytesHeld, limit: u64) -> Self {
        Self { bytes: Vec::new(), announced: 0, allowance: Allowance { held, limit } }
    }

    /// Notes that `bytes` are said to come.
    ///
    /// # Errors
    /// They are over the limit.
    pub fn announce(&mut self, bytes: u64) -> Result<(), ServiceError> {
        self.announced = bytes;
        self.allowance.check(bytes)
    }

    /// Adds the next bytes.
    ///
    /// # Errors
    /// The upload is over its limit, the budget is used up, or the system gives no memory.
    pub fn push(&mut self, chunk: &[u8]) -> Result<(), ServiceError> {
        let total = self.bytes.len() as u64 + chunk.len() as u64;
        self.allowance.count(total)?;
        self.make_room(total)?;
        self.bytes.extend_from_slice(chunk);
        Ok(())
    }

    /// Adds `chunk`, without a copy where it is the first.
    ///
    /// # Errors
    /// As those of [`push`](Self::push).
    pub fn put(&mut self, chunk: Vec<u8>) -> Result<(), ServiceError> {
        if !self.bytes.is_empty() {
            return self.push(&chunk);
        }
        self.allowance.count(chunk.len() as u64)?;
        self.bytes = chunk;
        Ok(())
    }

    /// Makes room for `total` bytes: that fails as an error and not as the end of the process.
    fn make_room(&mut self, total: u64) -> Result<(), ServiceError> {
        let (length, capacity) = (self.bytes.len(), self.bytes.capacity() as u64);
        if total <= capacity {
            return Ok(());
        }
        let room = if self.announced >= total {
            self.announced.min((TIMES * total).max(FIRST))
        } else {
            total.max(2 * capacity)
        };
        let more = usize::try_from(room).ok().map(|room| room - length);
        let made = more.map(|more| self.bytes.try_reserve_exact(more));
        if matches!(made, Some(Ok(()))) {
            return Ok(());
        }
        let detail = format!("the system gives no memory for {room} bytes; try again later");
        Err(ServiceError::new(ErrorKind::Overloaded, detail))
    }

    /// Whether gzip or zstd packed the bytes themselves: it takes long to unpack them.
    pub fn is_packed(&self) -> bool {
        Packing::of(&self.bytes).is_some()
    }

    /// The upload with its bytes unpacked, where they are packed themselves; both are counted, and what zstd keeps of them.
    ///
    /// # Errors
    /// The bytes are damaged, or what comes out of them is over the limit or the budget.
    pub fn unpacked(self) -> Result<Self, ServiceError> {
        let Some(packing) = Packing::of(&self.bytes) else { return Ok(self) };
        let packed = self.bytes.len() as u64;
        let count = |total: u64| {
            self.allowance.check(total)?;
            let window = if packing == Packing::Zstd { total.min(WINDOW) } else { 0 };
            Ok::<_, ServiceError>(self.allowance.held.grow_to(packed + total + window)?)
        };
        let bytes = packing.unpack(&self.bytes, count)?;
        Ok(Self { bytes, announced: 0, allowance: self.allowance })
    }

    /// The bytes that have come.
    pub fn bytes(&self) -> &[u8] {
        &self.bytes
    }

    /// What counts its bytes.
    pub fn allowance(&self) -> &Allowance {
        &self.allowance
    }

    /// The share of the budget its bytes hold.
    pub fn held(&self) -> &BytesHeld {
        &self.allowance.held
    }

    /// The bytes, and the budget they hold.
    pub fn into_parts(self) -> (Vec<u8>, BytesHeld) {
        (self.bytes, self.allowance.held)
    }
}

impl Service {
    /// Takes room in the budget for writing a result in that form, until it is dropped.
    ///
    /// # Errors
    /// There is none.
    pub fn room_for(
        &self,
        form: Representation,
        caller: &Caller,
    ) -> Result<BytesHeld, ServiceError> {
        let room = self.share();
        room.charge(caller.as_deref())?;
        room.grow_to(form.bytes_beside())?;
        Ok(room)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::jobs::{ByteBudget, KeyShare};

    #[test]
    fn what_is_announced_is_neither_held_nor_reserved() {
        let budget = ByteBudget::new(1 << 40, KeyShare::ALL);
        let mut upload = Upload::new(budget.share(), 1 << 40);
        upload.announce(1 << 40).unwrap();
        assert_eq!((budget.held(), upload.bytes.capacity()), (0, 0));
        upload.push(b"1").unwrap();
        assert_eq!((budget.held(), upload.bytes.capacity()), (1, 1 << 20));
        assert_eq!(upload.announce((1 << 40) + 1).unwrap_err().kind, ErrorKind::BodyTooLarge);
    }

    #[test]
    fn a_body_that_is_as_long_as_it_says_takes_no_more_room_than_that() {
        let budget = ByteBudget::new(1 << 30, KeyShare::ALL);
        for (announced, chunks) in [(3 << 20, 3), (0, 3), (100, 3)] {
            let mut upload = Upload::new(budget.share(), 1 << 30);
            upload.announce(announced).unwrap();
            for _ in 0..chunks {
                upload.push(&vec![1; 1 << 20]).unwrap();
            }
            assert!(upload.bytes.capacity() <= if announced > 100 { 3 << 20 } else { 4 << 20 });
            assert_eq!((upload.bytes.len(), budget.held()), (3 << 20, 3 << 20));
        }
    }

    #[test]
    fn a_packed_cloud_may_be_as_long_as_any_once_unpacked() {
        let text = b"1 2 3\n".repeat(50_000);
        let packed = zstd::encode_all(&text[..], 3).unwrap();
        let budget = ByteBudget::new(1 << 30, KeyShare::ALL);
        let unpacked = |limit| {
            let mut upload = Upload::new(budget.share(), limit);
            upload.push(&packed).unwrap();
            assert!(upload.is_packed());
            upload.unpacked()
        };
        let whole = unpacked(text.len() as u64).unwrap();
        assert_eq!((whole.bytes(), whole.is_packed()), (&text[..], false));
        assert!(budget.held() >= text.len() as u64);
        assert_eq!(unpacked(text.len() as u64 - 1).unwrap_err().kind, ErrorKind::BodyTooLarge);
        drop(whole);
        assert_eq!(budget.held(), 0);
    }

    #[test]
    fn memory_that_the_system_does_not_give_is_no_end_of_the_process() {
        let budget = ByteBudget::new(u64::MAX, KeyShare::ALL);
        let mut upload = Upload::new(budget.share(), u64::MAX);
        assert_eq!(upload.make_room(1 << 62).unwrap_err().kind, ErrorKind::Overloaded);
    }
}
