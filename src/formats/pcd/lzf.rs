//! Unpacking of LZF blocks (M. Lehmann's LibLZF): literal runs and references to earlier output.

/// Three bytes of a block unpack to 264 at most.
pub(super) const MAX_RATIO: usize = 88;
/// How far back a reference reaches.
const REACH: usize = 1 << 13;
/// What is unpacked at a time.
const STEP: usize = 1 << 16;

/// A part of what a block unpacks to.
#[derive(Debug, Default)]
pub(super) struct Window {
    /// Where in the whole it begins.
    pub(super) start: usize,
    /// The part; its end has not been given before, its beginning has.
    pub(super) bytes: Vec<u8>,
}

impl Window {
    /// Where in the whole it ends.
    pub(super) fn end(&self) -> usize {
        self.start + self.bytes.len()
    }
}

/// Unpacks a block in steps, with a few pages of memory.
pub(super) struct Unpacker<'a> {
    input: std::slice::Iter<'a, u8>,
    len: usize,
    window: Window,
}

impl<'a> Unpacker<'a> {
    /// Of a `block` that unpacks to `len` bytes.
    pub(super) fn new(block: &'a [u8], len: usize) -> Self {
        Self { input: block.iter(), len, window: Window::default() }
    }

    /// The next part; `None` at the end, or where the block does not unpack to its length.
    pub(super) fn next(&mut self) -> Option<&Window> {
        let old = self.window.bytes.len().saturating_sub(REACH);
        self.window.bytes.drain(..old);
        self.window.start += old;
        let begin = self.window.bytes.len();
        while self.window.bytes.len() < begin + STEP && self.window.end() < self.len {
            self.unpack_one()?;
        }
        let more = self.window.bytes.len() > begin && self.window.end() <= self.len;
        more.then_some(&self.window)
    }

    /// Unpacks one run or reference.
    fn unpack_one(&mut self) -> Option<()> {
        let (input, output) = (&mut self.input, &mut self.window.bytes);
        let control = usize::from(*input.next()?);
        if control < 32 {
            let run = input.as_slice().get(..=control)?;
            output.extend_from_slice(run);
            *input = input.as_slice()[run.len()..].iter();
            return Some(());
        }
        let mut length = control >> 5;
        if length == 7 {
            length += usize::from(*input.next()?);
        }
        let back = ((control & 31) << 8) + usize::from(*input.next()?) + 1;
        copy_back(output, back, length + 2)
    }
}

/// Appends `length` bytes from `back` bytes before the end; they may overlap what they make.
fn copy_back(output: &mut Vec<u8>, back: usize, length: usize) -> Option<()> {
    let start = output.len().checked_sub(back)?;
    if back >= length {
        output.extend_from_within(start..start + length);
    } else {
        for i in start..start + length {
            output.push(output[i]);
        }
    }
    Some(())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// All parts together, where the block unpacks to its length.
    fn unpack(block: &[u8], len: usize) -> Option<Vec<u8>> {
        let (mut unpacker, mut whole) = (Unpacker::new(block, len), Vec::new());
        while whole.len() < len {
            let window = unpacker.next()?;
            whole.truncate(window.start);
            whole.extend_from_slice(&window.bytes);
        }
        Some(whole)
    }

    #[test]
    fn literals_and_overlapping_references_unpack() {
        // "ab", then 6 bytes from 2 back, then 9 + 2 + 1 bytes from 1 back
        let block = [1, b'a', b'b', 0b100_00000, 1, 0b111_00000, 3, 0];
        assert_eq!(unpack(&block, 20).unwrap(), b"ababababbbbbbbbbbbbb");
    }

    #[test]
    fn damaged_blocks_are_refused() {
        assert_eq!(unpack(&[5, b'a'], 6), None);
        assert_eq!(unpack(&[0, b'a', 0b001_00000, 1], 4), None);
        assert_eq!(unpack(&[0, b'a'], 2), None);
        assert_eq!(unpack(&[1, b'a', b'b'], 1), None);
    }

    #[test]
    fn a_block_of_many_steps_takes_the_memory_of_one() {
        let mut block = vec![3, 1, 2, 3, 4];
        // each makes 264 bytes from 4 back, the last from as far back as there is
        block.extend([0b111_00000, 255, 3].repeat(3000));
        block.extend([0b111_11111, 255, 255]);
        let len = 4 + 3001 * 264;
        let whole = unpack(&block, len).unwrap();
        assert!(whole.chunks(4).all(|chunk| chunk == [1, 2, 3, 4]));
        let mut unpacker = Unpacker::new(&block, len);
        while unpacker.window.end() < len {
            assert!(unpacker.next().unwrap().bytes.len() <= REACH + STEP + 264);
        }
        assert!(unpacker.next().is_none());
    }
}
