//! Bodies unpacked as their Content-Encoding says, as they come.

use std::{
    error::Error,
    io::{self, Write},
};

use axum::{
    BoxError,
    body::{Body, BodyDataStream, Bytes},
    extract::Request,
    http::{StatusCode, header},
    response::{IntoResponse, Response},
};
use flate2::write::MultiGzDecoder;
use futures::{StreamExt, stream};
use zstd::stream::raw::{self, Operation};

use super::media_type::malformed;
use crate::service::ServiceError;

/// Most bytes that are unpacked from zstd between two counts; from gzip as many at most.
const BLOCK: usize = 32 << 10;

/// Marks a request whose body is unpacked by zstd, which keeps a window of what it has unpacked.
#[derive(Clone, Copy, Debug)]
pub struct Unpacks;

/// The codings that bodies may have.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Coding {
    Gzip,
    Zstd,
}

impl Coding {
    /// The coding of that name. Names of codings know no case, and `x-gzip` is `gzip` (RFC 9110, 8.4.1).
    fn from_name(name: &[u8]) -> Option<Self> {
        match name.to_ascii_lowercase().as_slice() {
            b"gzip" | b"x-gzip" => Some(Self::Gzip),
            b"zstd" => Some(Self::Zstd),
            _ => None,
        }
    }

    fn name(self) -> &'static str {
        match self {
            Self::Gzip => "gzip",
            Self::Zstd => "zstd",
        }
    }
}

/// A body that is not what its Content-Encoding says.
#[derive(Debug, thiserror::Error)]
#[error(
    "the body cannot be unpacked as Content-Encoding says, by {coding}: {error}. Pack it by {coding}, or leave the header \
     out"
)]
struct NotPacked {
    coding: &'static str,
    error: io::Error,
}

/// The request with its body unpacked, all members or frames of it.
///
/// # Errors
/// Its Content-Encoding is not known.
pub async fn unpacked(mut request: Request) -> Result<Request, Response> {
    let Some(value) = request.headers().get(header::CONTENT_ENCODING) else { return Ok(request) };
    let name = value.as_bytes().trim_ascii();
    if name.eq_ignore_ascii_case(b"identity") {
        return Ok(request);
    }
    let only = request.headers().get_all(header::CONTENT_ENCODING).iter().count() == 1;
    let Some(coding) = Coding::from_name(name).filter(|_| only) else {
        let known = [(header::ACCEPT_ENCODING, "gzip, zstd")];
        return Err((StatusCode::UNSUPPORTED_MEDIA_TYPE, known).into_response());
    };
    // both are of the packed body
    request.headers_mut().remove(header::CONTENT_ENCODING);
    request.headers_mut().remove(header::CONTENT_LENGTH);
    if coding == Coding::Zstd {
        request.extensions_mut().insert(Unpacks);
    }
    Ok(request.map(|body| {
        let unpacking = Unpacking {
            coding,
            chunks: body.into_data_stream(),
            came: Bytes::new(),
            unpacker: None,
            is_over: false,
        };
        Body::from_stream(stream::try_unfold(unpacking, Unpacking::next))
    }))
}

/// The error for a body that its reader gets no more of.
pub fn broken_off(error: axum::Error) -> ServiceError {
    // every layer that a body goes through wraps its errors once more
    let mut cause: Option<&(dyn Error + 'static)> = Some(&error);
    while let Some(told) = cause {
        if let Some(error) = told.downcast_ref::<NotPacked>() {
            return malformed(&error.to_string());
        }
        cause = told.source();
    }
    malformed(&format!("the body broke off: {error}"))
}

/// A packed body on its way.
struct Unpacking {
    coding: Coding,
    chunks: BodyDataStream,
    /// What came and is not unpacked yet.
    came: Bytes,
    /// Made with the first bytes: a body without any is none, packed or not.
    unpacker: Option<Unpacker>,
    is_over: bool,
}

impl Unpacking {
    /// The next bytes, at most a block, and what is left.
    async fn next(mut self) -> Result<Option<(Bytes, Self)>, BoxError> {
        while !self.is_over {
            if self.came.is_empty() {
                match self.chunks.next().await.transpose()? {
                    Some(chunk) => self.came = chunk,
                    None => self.is_over = true,
                }
            }
            let coding = self.coding.name();
            let bytes = self.step().map_err(|error| NotPacked { coding, error })?;
            if !bytes.is_empty() {
                return Ok(Some((bytes.into(), self)));
            }
        }
        Ok(None)
    }

    fn step(&mut self) -> io::Result<Vec<u8>> {
        if self.is_over {
            return self.unpacker.as_mut().map_or(Ok(Vec::new()), Unpacker::finish);
        }
        if self.came.is_empty() {
            return Ok(Vec::new());
        }
        let unpacker = match &mut self.unpacker {
            Some(unpacker) => unpacker,
            none => none.insert(Unpacker::new(self.coding)?),
        };
        let (taken, bytes) = unpacker.step(&self.came)?;
        drop(self.came.split_to(taken));
        Ok(bytes)
    }
}

enum Unpacker {
    Gzip(Box<MultiGzDecoder<Vec<u8>>>),
    Zstd { decoder: raw::Decoder<'static>, is_whole: bool },
}

impl Unpacker {
    fn new(coding: Coding) -> io::Result<Self> {
        Ok(match coding {
            Coding::Gzip => Self::Gzip(Box::new(MultiGzDecoder::new(Vec::new()))),
            Coding::Zstd => Self::Zstd { decoder: raw::Decoder::new()?, is_whole: true },
        })
    }

    /// Unpacks some of `packed`: how much of it, and what is in there.
    fn step(&mut self, packed: &[u8]) -> io::Result<(usize, Vec<u8>)> {
        match self {
            Self::Gzip(decoder) => {
                let taken = decoder.write(packed)?;
                Ok((taken, std::mem::take(decoder.get_mut())))
            }
            Self::Zstd { decoder, is_whole } => {
                let mut block = vec![0; BLOCK];
                let done = decoder.run_on_buffers(packed, &mut block)?;
                *is_whole = done.remaining == 0;
                block.truncate(done.bytes_written);
                Ok((done.bytes_read, block))
            }
        }
    }

    /// What is left where no more comes.
    fn finish(&mut self) -> io::Result<Vec<u8>> {
        match self {
            Self::Gzip(decoder) => {
                decoder.try_finish()?;
                Ok(std::mem::take(decoder.get_mut()))
            }
            Self::Zstd { .. } => {
                let mut rest = Vec::new();
                while let Self::Zstd { is_whole: false, .. } = self {
                    let (_, block) = self.step(&[])?;
                    if block.is_empty() && matches!(self, Self::Zstd { is_whole: false, .. }) {
                        return Err(io::Error::new(io::ErrorKind::UnexpectedEof, "it is cut off"));
                    }
                    rest.extend(block);
                }
                Ok(rest)
            }
        }
    }
}
