//! Files packed by gzip or zstd, told by their first bytes.

use std::io::Read;

use super::FormatError;

/// Bytes unpacked between two counts.
const BLOCK: usize = 256 << 10;

/// What packed some bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Packing {
    /// RFC 1952; several members follow each other.
    Gzip,
    /// RFC 8878; several frames follow each other.
    Zstd,
}

impl Packing {
    /// What packed the bytes; `None` where neither did. No format read here begins as packed bytes do.
    pub fn of(bytes: &[u8]) -> Option<Self> {
        match bytes {
            [0x1f, 0x8b, 8, ..] => Some(Self::Gzip),
            [0x28, 0xb5, 0x2f, 0xfd, ..] => Some(Self::Zstd),
            _ => None,
        }
    }

    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Gzip => "gzip",
            Self::Zstd => "zstd",
        }
    }

    /// Unpacks all of `bytes`. `count` is told, before they are kept, how many there are so far; what it refuses is not
    /// unpacked any further.
    ///
    /// # Errors
    /// The bytes are damaged or cut off, the system has no memory, or `count` refuses.
    pub fn unpack<E: From<FormatError>>(
        self,
        bytes: &[u8],
        mut count: impl FnMut(u64) -> Result<(), E>,
    ) -> Result<Vec<u8>, E> {
        let damaged =
            |e: std::io::Error| FormatError::Packed { with: self.name(), reason: e.to_string() };
        let mut reader: Box<dyn Read> = match self {
            Self::Gzip => Box::new(flate2::bufread::MultiGzDecoder::new(bytes)),
            Self::Zstd => {
                Box::new(zstd::stream::read::Decoder::with_buffer(bytes).map_err(damaged)?)
            }
        };
        let (mut block, mut all) = (vec![0; BLOCK], Vec::new());
        loop {
            let n = reader.read(&mut block).map_err(damaged)?;
            if n == 0 {
                return Ok(all);
            }
            count((all.len() + n) as u64)?;
            let made = all.try_reserve(n);
            made.map_err(|_| FormatError::NoMemoryToUnpack { bytes: (all.len() + n) as u64 })?;
            all.extend_from_slice(&block[..n]);
        }
    }
}

#[cfg(test)]
pub(super) mod tests {
    use std::io::Write;

    use super::*;

    fn gzip(bytes: &[u8]) -> Vec<u8> {
        let mut packed = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::default());
        packed.write_all(bytes).unwrap();
        packed.finish().unwrap()
    }

    fn zstd(bytes: &[u8]) -> Vec<u8> {
        zstd::encode_all(bytes, 3).unwrap()
    }

    fn unpack(packing: Packing, packed: &[u8], most: u64) -> Result<Vec<u8>, FormatError> {
        packing.unpack(packed, |total| match total > most {
            true => Err(FormatError::Stopped),
            false => Ok(()),
        })
    }

    #[test]
    fn all_members_and_frames_are_unpacked() {
        let text = b"1 2 3\n".repeat(100_000);
        for (packing, pack) in
            [(Packing::Gzip, gzip as fn(&[u8]) -> Vec<u8>), (Packing::Zstd, zstd)]
        {
            let packed = [pack(&text), pack(b"4 5 6\n")].concat();
            assert_eq!(Packing::of(&packed), Some(packing));
            let all = unpack(packing, &packed, u64::MAX).unwrap();
            assert_eq!(all, [&text[..], b"4 5 6\n"].concat());
        }
        assert_eq!(Packing::of(b"1 2 3\n"), None);
    }

    #[test]
    fn no_more_is_unpacked_than_may_be() {
        let zeros = vec![0; 3 * BLOCK];
        for (packing, packed) in [(Packing::Gzip, gzip(&zeros)), (Packing::Zstd, zstd(&zeros))] {
            let most = zeros.len() as u64;
            assert_eq!(unpack(packing, &packed, most).map(|all| all.len()), Ok(zeros.len()));
            assert_eq!(unpack(packing, &packed, most - 1), Err(FormatError::Stopped));
        }
    }

    #[test]
    fn cut_and_changed_files_are_damaged() {
        let text = b"1 2 3\n".repeat(1000);
        for (packing, packed) in [(Packing::Gzip, gzip(&text)), (Packing::Zstd, zstd(&text))] {
            for end in [4, 12, packed.len() / 2, packed.len() - 1] {
                let error = unpack(packing, &packed[..end], u64::MAX);
                assert!(matches!(error, Err(FormatError::Packed { .. })), "{packing:?} {end}");
            }
        }
        let mut changed = gzip(&text);
        let end = changed.len() - 6;
        changed[end] ^= 1;
        assert!(matches!(
            unpack(Packing::Gzip, &changed, u64::MAX),
            Err(FormatError::Packed { .. })
        ));
    }
}
