//! Unpacking of LZF blocks (M. Lehmann's LibLZF): literal runs and references to earlier output.

/// Three bytes of a block unpack to 264 at most.
pub(super) const MAX_RATIO: usize = 88;

/// The `len` bytes that `block` unpacks to; `None` where it does not.
pub(super) fn decompress(block: &[u8], len: usize) -> Option<Vec<u8>> {
    let mut output = Vec::with_capacity(len);
    let mut input = block.iter();
    while let Some(&control) = input.next() {
        let control = usize::from(control);
        if control < 32 {
            let run = input.as_slice().get(..=control)?;
            output.extend_from_slice(run);
            input = input.as_slice()[run.len()..].iter();
        } else {
            let mut length = control >> 5;
            if length == 7 {
                length += usize::from(*input.next()?);
            }
            let back = ((control & 31) << 8) + usize::from(*input.next()?) + 1;
            copy_back(&mut output, back, length + 2)?;
        }
        if output.len() > len {
            return None;
        }
    }
    (output.len() == len).then_some(output)
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

    #[test]
    fn literals_and_overlapping_references_unpack() {
        // "ab", then 6 bytes from 2 back, then 9 + 2 + 1 bytes from 1 back
        let block = [1, b'a', b'b', 0b100_00000, 1, 0b111_00000, 3, 0];
        assert_eq!(decompress(&block, 20).unwrap(), b"ababababbbbbbbbbbbbb");
    }

    #[test]
    fn damaged_blocks_are_refused() {
        assert_eq!(decompress(&[5, b'a'], 6), None);
        assert_eq!(decompress(&[0, b'a', 0b001_00000, 1], 4), None);
        assert_eq!(decompress(&[0, b'a'], 2), None);
        assert_eq!(decompress(&[1, b'a', b'b'], 1), None);
    }
}
