use bytes::{Buf, Bytes, BytesMut};

/// Before each message: whether it is compressed, and its length in four bytes.
pub const HEAD: usize = 5;
/// Messages up to this long are passed on as they come.
const SMALL: usize = 64 << 10;
/// Of longer ones this share must have come first: their reader makes room for all of a message at once.
const SHARE: usize = 8;

/// Looks through the messages of a call for their lengths, and holds back the beginning of a long one
/// until so much of it has come that its length can be believed.
pub struct Frames {
    /// Longest message that its reader takes.
    limit: usize,
    /// What has come and was not passed on.
    kept: BytesMut,
    /// Bytes of the current message that are still to come and will be passed on at once.
    left: usize,
    /// The current message, as far as it has come, and the longest so far.
    come: usize,
    longest: usize,
}

impl Frames {
    /// Looks through messages of at most `limit` bytes.
    pub fn new(limit: usize) -> Self {
        Self { limit, kept: BytesMut::new(), left: 0, come: 0, longest: 0 }
    }

    /// Takes what came next; gives what may be passed on.
    pub fn pass(&mut self, data: Bytes) -> Option<Bytes> {
        if self.kept.is_empty() && data.len() <= self.left {
            self.go_on(data.len());
            return Some(data).filter(|data| !data.is_empty());
        }
        self.kept.extend_from_slice(&data);
        let mut ready = 0;
        loop {
            let there = self.left.min(self.kept.len() - ready);
            self.go_on(there);
            ready += there;
            let Some(length) = self.next_length(ready) else { break };
            ready += HEAD;
            (self.left, self.come) = (length, 0);
        }
        (ready > 0).then(|| self.kept.split_to(ready).freeze())
    }

    /// The length of the message that begins at `place`, where enough of it has come.
    fn next_length(&mut self, place: usize) -> Option<usize> {
        let mut next =
            self.kept.get(place..).filter(|next| self.left == 0 && next.len() >= HEAD)?;
        next.advance(1);
        let length = usize::try_from(next.get_u32()).unwrap_or(usize::MAX);
        // one that is too long is refused at its head
        let believed = length <= SMALL || length > self.limit || next.len() >= length / SHARE;
        if !believed {
            self.longest = self.longest.max(next.len());
        }
        believed.then_some(length)
    }

    fn go_on(&mut self, bytes: usize) {
        (self.left, self.come) = (self.left - bytes, self.come + bytes);
        self.longest = self.longest.max(self.come);
    }

    /// Bytes of the longest message, as far as it has come.
    pub fn message(&self) -> u64 {
        self.longest as u64
    }

    /// What is held back, where nothing more comes.
    pub fn rest(&mut self) -> Option<Bytes> {
        (!self.kept.is_empty()).then(|| std::mem::take(&mut self.kept).freeze())
    }

    /// Whether nothing is held back.
    pub fn is_empty(&self) -> bool {
        self.kept.is_empty()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn message(length: u32, there: usize) -> Vec<u8> {
        let mut bytes = vec![0];
        bytes.extend(length.to_be_bytes());
        bytes.resize(HEAD + there, 7);
        bytes
    }

    #[test]
    fn whole_messages_pass_whatever_their_pieces() {
        let mut sent = Vec::new();
        for length in [0, 3, SMALL, SMALL + 1, 5, 3 * SMALL] {
            sent.extend(message(u32::try_from(length).unwrap(), length));
        }
        for piece in [1, 4, 5, 1000, SMALL, sent.len()] {
            let mut frames = Frames::new(1 << 20);
            let passed = sent.chunks(piece);
            let passed = passed.filter_map(|data| frames.pass(Bytes::copy_from_slice(data)));
            assert_eq!(passed.collect::<Vec<_>>().concat(), sent, "{piece}");
            assert!(frames.is_empty());
            assert_eq!(frames.message(), 3 * SMALL as u64);
        }
    }

    #[test]
    fn a_long_message_is_held_back_until_an_eighth_of_it_has_come() {
        let length = 8 * SMALL;
        let mut frames = Frames::new(length);
        let begun = message(u32::try_from(length).unwrap(), SMALL - 1);
        assert_eq!(frames.pass(begun.into()), None);
        assert_eq!(frames.message(), SMALL as u64 - 1);
        assert_eq!(frames.pass(vec![7].into()).map(|data| data.len()), Some(HEAD + SMALL));
    }

    #[test]
    fn a_message_above_the_limit_passes_at_once_to_be_refused() {
        let mut frames = Frames::new(SMALL + 1);
        let begun = message(u32::try_from(SMALL + 2).unwrap(), 1);
        assert_eq!(frames.pass(begun.clone().into()), Some(begun.into()));
        let begun = message(u32::try_from(SMALL + 1).unwrap(), 1);
        let mut frames = Frames::new(SMALL + 1);
        assert_eq!(frames.pass(begun.clone().into()), None);
        assert_eq!(frames.rest(), Some(begun.into()));
    }
}
