use std::{
    pin::Pin,
    task::{Context, Poll, ready},
    time::Duration,
};

use axum::body::{Body, Bytes, HttpBody};
use http_body::Frame;
use tokio::time::Sleep;
use tonic::Status;

use super::{
    frames::Frames,
    unpack::{Packing, Unpacking},
};
use crate::{jobs::BytesHeld, service::ServiceError};

/// The messages of a call coming in: their bytes are counted against the budget before they are put
/// together, and they must have come when the time for an upload is over.
pub struct Intake {
    body: Body,
    /// Bytes that were passed on to the frames.
    seen: u64,
    held: BytesHeld,
    unpacking: Option<Unpacking>,
    frames: Frames,
    /// A message is there twice while it is read: as it came, and as what it says.
    copy: BytesHeld,
    trailers: Option<Frame<Bytes>>,
    ended: bool,
    time: Duration,
    end: Pin<Box<Sleep>>,
}

impl Intake {
    /// Takes in `body`; `held` grows with it, and `copy` with its longest message until it has come.
    pub fn new(body: Body, held: BytesHeld, copy: BytesHeld, limit: usize, time: Duration) -> Self {
        let end = Box::pin(tokio::time::sleep(time));
        let (frames, unpacking) = (Frames::new(limit), None);
        Self {
            body,
            seen: 0,
            held,
            unpacking,
            frames,
            copy,
            trailers: None,
            ended: false,
            time,
            end,
        }
    }

    /// Takes in messages that are packed, with what unpacking takes counted in `aside`.
    pub fn unpacking(mut self, packing: Option<Packing>, limit: usize) -> Self {
        self.unpacking = packing.map(|packing| Unpacking::new(packing, limit));
        self
    }

    /// Counts what came; what may be passed on of it.
    fn take(&mut self, data: Bytes) -> Result<Option<Bytes>, ServiceError> {
        let data = match &mut self.unpacking {
            None => data,
            Some(unpacking) => {
                let (held, seen) = (&self.held, self.seen);
                unpacking.pass(&data, |bytes| Ok(held.grow_to(seen + bytes as u64)?))?
            }
        };
        self.seen += data.len() as u64;
        let whole = self.frames.pass(data);
        self.held.grow_to(self.seen)?;
        self.copy.grow_to(self.frames.message())?;
        Ok(whole)
    }

    /// What is held back of a message whose end does not come.
    fn rest(&mut self) -> Option<Bytes> {
        let packed = self.unpacking.as_mut().and_then(Unpacking::rest);
        self.frames.rest().or(packed)
    }
}

impl HttpBody for Intake {
    type Data = Bytes;
    type Error = Status;

    fn poll_frame(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
    ) -> Poll<Option<Result<Frame<Bytes>, Status>>> {
        loop {
            if self.ended {
                // what is held back of a message goes before its end, which comes too early
                let rest = self.rest().map(Frame::data);
                let frame = rest.or_else(|| self.trailers.take());
                return Poll::Ready(frame.map(Ok));
            }
            let Poll::Ready(frame) = Pin::new(&mut self.body).poll_frame(context) else {
                ready!(self.end.as_mut().poll(context));
                return Poll::Ready(Some(Err(ServiceError::upload_timeout(self.time).into())));
            };
            let Some(frame) = frame else {
                self.ended = true;
                continue;
            };
            let frame = frame.map_err(|error| Status::from_error(error.into()))?;
            match frame.into_data() {
                Ok(data) => {
                    if let Some(data) = self.take(data)? {
                        return Poll::Ready(Some(Ok(Frame::data(data))));
                    }
                }
                Err(trailers) => (self.trailers, self.ended) = (Some(trailers), true),
            }
        }
    }

    fn is_end_stream(&self) -> bool {
        let packed = self.unpacking.as_ref().is_some_and(|unpacking| !unpacking.is_empty());
        self.body.is_end_stream() && self.trailers.is_none() && self.frames.is_empty() && !packed
    }
}
