//! Compressed messages, unpacked before they are taken in: so what they hold is counted as it appears.

use std::io::{self, Read};

use bytes::{Buf, BufMut, Bytes, BytesMut};
use flate2::read::MultiGzDecoder;

use super::frames::HEAD;
use crate::service::{ErrorKind, ServiceError};

/// How messages are compressed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Packing {
    /// By gzip.
    Gzip,
    /// By Zstandard.
    Zstd,
}

/// The largest window of zstd, as a power of two: what RFC 9659 lets senders ask for. It is memory that a message of
/// a few bytes may claim.
const ZSTD_WINDOW_LOG: u32 = 23;

impl Packing {
    /// The packing of that name in `grpc-encoding`.
    pub fn from_name(name: &str) -> Option<Self> {
        match name {
            "gzip" => Some(Self::Gzip),
            "zstd" => Some(Self::Zstd),
            _ => None,
        }
    }

    /// Memory that unpacking takes beside what goes in and comes out, in bytes.
    pub fn bytes_beside(self) -> u64 {
        match self {
            Self::Gzip => 1 << 16,
            Self::Zstd => 1 << ZSTD_WINDOW_LOG,
        }
    }

    fn reader<'a>(self, packed: &'a [u8]) -> io::Result<Box<dyn Read + 'a>> {
        Ok(match self {
            Self::Gzip => Box::new(MultiGzDecoder::new(packed)),
            Self::Zstd => {
                let mut decoder = zstd::Decoder::with_buffer(packed)?;
                decoder.window_log_max(ZSTD_WINDOW_LOG)?;
                Box::new(decoder)
            }
        })
    }
}

/// Unpacks the messages of a call as they come, each once all of it has come.
pub struct Unpacking {
    packing: Packing,
    /// Longest message, packed or not.
    limit: usize,
    kept: BytesMut,
}

impl Unpacking {
    /// Unpacks messages of at most `limit` bytes.
    pub fn new(packing: Packing, limit: usize) -> Self {
        Self { packing, limit, kept: BytesMut::new() }
    }

    /// Takes what came next; gives the messages that are whole by now, unpacked. `count` is told how many bytes there
    /// are, as there are more.
    ///
    /// # Errors
    /// A message is too long, or is not what it says, or `count` has no room for it.
    pub fn pass(
        &mut self,
        data: &[u8],
        mut count: impl FnMut(usize) -> Result<(), ServiceError>,
    ) -> Result<Bytes, ServiceError> {
        self.kept.extend_from_slice(data);
        count(self.kept.len())?;
        let mut out = BytesMut::new();
        while let Some(head) = self.kept.get(..HEAD) {
            let (packed, length) = (head[0] == 1, (&head[1..]).get_u32() as usize);
            if length > self.limit {
                return Err(too_long(self.limit));
            }
            if self.kept.len() < HEAD + length {
                break;
            }
            let message = self.kept.split_to(HEAD + length);
            if packed {
                let beside = out.len() + message.len() + self.kept.len();
                let unpacked = self.unpacked(&message[HEAD..], |bytes| count(beside + bytes))?;
                out.put_u8(0);
                out.put_u32(u32::try_from(unpacked.len()).unwrap_or(u32::MAX));
                out.extend_from_slice(&unpacked);
            } else {
                out.unsplit(message);
            }
        }
        Ok(out.freeze())
    }

    fn unpacked(
        &self,
        packed: &[u8],
        mut count: impl FnMut(usize) -> Result<(), ServiceError>,
    ) -> Result<Vec<u8>, ServiceError> {
        /// Bytes unpacked between two counts.
        const BLOCK: u64 = 64 << 10;
        let mut reader = self.packing.reader(packed).map_err(|error| broken(&error))?;
        let mut bytes = Vec::new();
        loop {
            let block = reader.by_ref().take(BLOCK).read_to_end(&mut bytes);
            let came = block.map_err(|error| broken(&error))?;
            if bytes.len() > self.limit {
                return Err(too_long(self.limit));
            }
            count(bytes.len())?;
            if came == 0 {
                return Ok(bytes);
            }
        }
    }

    /// What is held back of a message, where nothing more comes.
    pub fn rest(&mut self) -> Option<Bytes> {
        (!self.kept.is_empty()).then(|| std::mem::take(&mut self.kept).freeze())
    }

    /// Whether nothing is held back.
    pub fn is_empty(&self) -> bool {
        self.kept.is_empty()
    }
}

/// The error for a message above the limit.
pub fn too_long(limit: usize) -> ServiceError {
    ServiceError::new(
        ErrorKind::BodyTooLarge,
        format!(
            "the message has more than {limit} bytes, unpacked: send the cloud in chunks below the limit, by \
             SegmentUpload, SegmentStream or SubmitJob"
        ),
    )
}

fn broken(error: &io::Error) -> ServiceError {
    ServiceError::new(
        ErrorKind::MalformedBody,
        format!("a message cannot be unpacked as grpc-encoding says: {error}"),
    )
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use super::*;

    fn packed(packing: Packing, bytes: &[u8]) -> Vec<u8> {
        let packed = match packing {
            Packing::Gzip => {
                let mut gzip = flate2::write::GzEncoder::new(Vec::new(), Default::default());
                gzip.write_all(bytes).unwrap();
                gzip.finish().unwrap()
            }
            Packing::Zstd => zstd::encode_all(bytes, 0).unwrap(),
        };
        framed(1, &packed)
    }

    fn framed(flag: u8, bytes: &[u8]) -> Vec<u8> {
        let length = u32::try_from(bytes.len()).unwrap().to_be_bytes();
        [&[flag], length.as_slice(), bytes].concat()
    }

    #[test]
    fn messages_are_unpacked_whatever_their_pieces() {
        let texts = [vec![], b"short".to_vec(), vec![7; 300_000]];
        let plain: Vec<u8> = texts.iter().flat_map(|text| framed(0, text)).collect();
        for packing in [Packing::Gzip, Packing::Zstd] {
            let mut sent: Vec<u8> = texts.iter().flat_map(|text| packed(packing, text)).collect();
            sent.extend(framed(0, b"as it is"));
            let expected = [plain.clone(), framed(0, b"as it is")].concat();
            for piece in [1, 5, 1000, sent.len()] {
                let mut unpacking = Unpacking::new(packing, 1 << 20);
                let passed = sent.chunks(piece).map(|data| unpacking.pass(data, |_| Ok(())));
                let passed: Result<Vec<_>, _> = passed.collect();
                assert_eq!(passed.unwrap().concat(), expected, "{packing:?} {piece}");
                assert!(unpacking.is_empty());
            }
        }
    }

    #[test]
    fn a_message_is_as_long_as_its_limit_unpacked_and_no_longer() {
        for packing in [Packing::Gzip, Packing::Zstd] {
            let pass = |length: usize| {
                let sent = packed(packing, &vec![7; length]);
                Unpacking::new(packing, 1 << 20).pass(&sent, |_| Ok(())).map_err(|e| e.kind)
            };
            assert!(pass(1 << 20).is_ok());
            assert_eq!(pass((1 << 20) + 1), Err(ErrorKind::BodyTooLarge));
            assert_eq!(pass(1 << 28), Err(ErrorKind::BodyTooLarge));
        }
        let head = [1, 0, 16, 0, 1];
        let refused = Unpacking::new(Packing::Gzip, 1 << 20).pass(&head, |_| Ok(()));
        assert_eq!(refused.unwrap_err().kind, ErrorKind::BodyTooLarge);
    }

    #[test]
    fn what_is_unpacked_is_counted_before_more_of_it_is() {
        let sent = packed(Packing::Zstd, &vec![7; 1 << 24]);
        let mut most = 0;
        let refused = Unpacking::new(Packing::Zstd, 1 << 30).pass(&sent, |bytes| {
            most = most.max(bytes);
            let full = || ServiceError::new(ErrorKind::Overloaded, "full");
            if bytes > 1 << 20 { Err(full()) } else { Ok(()) }
        });
        assert_eq!(refused.unwrap_err().kind, ErrorKind::Overloaded);
        assert!(most < (1 << 20) + (1 << 18), "{most}");
    }

    #[test]
    fn a_window_is_as_large_as_its_limit_and_no_larger() {
        let pass = |window_log| {
            let mut encoder = zstd::Encoder::new(Vec::new(), 1).unwrap();
            encoder.window_log(window_log).unwrap();
            encoder.write_all(&vec![7; 1 << 25]).unwrap();
            let sent = framed(1, &encoder.finish().unwrap());
            Unpacking::new(Packing::Zstd, 1 << 26).pass(&sent, |_| Ok(())).map_err(|e| e.kind)
        };
        assert!(pass(ZSTD_WINDOW_LOG).is_ok());
        assert_eq!(pass(ZSTD_WINDOW_LOG + 1), Err(ErrorKind::MalformedBody));
    }

    #[test]
    fn what_is_not_packed_as_it_says_is_an_error() {
        for packing in [Packing::Gzip, Packing::Zstd] {
            let sent = framed(1, b"not packed at all");
            let refused = Unpacking::new(packing, 1 << 20).pass(&sent, |_| Ok(()));
            assert_eq!(refused.unwrap_err().kind, ErrorKind::MalformedBody);
        }
    }
}
