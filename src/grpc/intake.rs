use std::{
    pin::Pin,
    task::{Context, Poll, ready},
    time::Duration,
};

use axum::body::{Body, Bytes, HttpBody};
use http_body::{Frame, SizeHint};
use tokio::time::Sleep;
use tonic::Status;

use crate::{jobs::BytesHeld, service::ServiceError};

/// The messages of a call coming in: their bytes are counted against the budget before they are put
/// together, and they must have come when the time for an upload is over.
pub struct Intake {
    body: Body,
    seen: u64,
    held: BytesHeld,
    time: Duration,
    end: Pin<Box<Sleep>>,
}

impl Intake {
    /// Takes in `body`; `held` grows with it.
    pub fn new(body: Body, held: BytesHeld, time: Duration) -> Self {
        Self { body, seen: 0, held, time, end: Box::pin(tokio::time::sleep(time)) }
    }
}

impl HttpBody for Intake {
    type Data = Bytes;
    type Error = Status;

    fn poll_frame(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
    ) -> Poll<Option<Result<Frame<Bytes>, Status>>> {
        let Poll::Ready(frame) = Pin::new(&mut self.body).poll_frame(context) else {
            ready!(self.end.as_mut().poll(context));
            return Poll::Ready(Some(Err(ServiceError::upload_timeout(self.time).into())));
        };
        let Some(frame) = frame else { return Poll::Ready(None) };
        let frame = frame.map_err(|error| Status::from_error(error.into()))?;
        self.seen += frame.data_ref().map_or(0, |data| data.len() as u64);
        self.held.grow_to(self.seen).map_err(ServiceError::from)?;
        Poll::Ready(Some(Ok(frame)))
    }

    fn is_end_stream(&self) -> bool {
        self.body.is_end_stream()
    }

    fn size_hint(&self) -> SizeHint {
        self.body.size_hint()
    }
}
