use std::{
    pin::Pin,
    task::{Context, Poll, ready},
    time::Duration,
};

use axum::body::{Body, Bytes, HttpBody};
use http_body::Frame;
use tokio::time::Sleep;
use tonic::Status;

use super::frames::Frames;
use crate::{jobs::BytesHeld, service::ServiceError};

/// The messages of a call coming in: their bytes are counted against the budget before they are put
/// together, and they must have come when the time for an upload is over.
pub struct Intake {
    body: Body,
    seen: u64,
    held: BytesHeld,
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
        let frames = Frames::new(limit);
        Self { body, seen: 0, held, frames, copy, trailers: None, ended: false, time, end }
    }

    fn count(&mut self, bytes: usize) -> Result<(), Status> {
        self.seen += bytes as u64;
        self.held.grow_to(self.seen).map_err(ServiceError::from)?;
        self.copy.grow_to(self.frames.message()).map_err(ServiceError::from)?;
        Ok(())
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
                let rest = self.frames.rest().map(Frame::data);
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
                    let bytes = data.len();
                    let whole = self.frames.pass(data);
                    self.count(bytes)?;
                    if let Some(data) = whole {
                        return Poll::Ready(Some(Ok(Frame::data(data))));
                    }
                }
                Err(trailers) => (self.trailers, self.ended) = (Some(trailers), true),
            }
        }
    }

    fn is_end_stream(&self) -> bool {
        self.body.is_end_stream() && self.trailers.is_none() && self.frames.is_empty()
    }
}
