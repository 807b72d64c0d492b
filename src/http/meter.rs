use std::{
    pin::Pin,
    sync::{
        Arc, Mutex, PoisonError,
        atomic::{AtomicU64, Ordering},
    },
    task::{Context, Poll},
};

use axum::{
    body::{Body, BodyDataStream, Bytes},
    extract::Request,
};
use futures::{Stream, StreamExt};

use super::encoding::broken_off;
use crate::{
    jobs::BytesHeld,
    service::{Allowance, ErrorKind, ServiceError, WINDOW},
};

/// Most bytes of a multipart body from which its parser makes nothing: a part's head, a boundary.
const UNUSED: u64 = 256 << 10;

/// Counts the bytes of one body as they come, unpacked.
pub struct Meter {
    allowance: Allowance,
    came: u64,
    /// What unpacking keeps beside them; given back when the body has come.
    window: Option<BytesHeld>,
}

impl Meter {
    /// Counts against `allowance`, and the window of the unpacking against `window`.
    pub fn new(allowance: &Allowance, window: Option<BytesHeld>) -> Self {
        Self { allowance: allowance.clone(), came: 0, window }
    }

    /// Counts the next `bytes`.
    ///
    /// # Errors
    /// The body is over its limit, or the budget is used up.
    pub fn count(&mut self, bytes: usize) -> Result<(), ServiceError> {
        self.came += bytes as u64;
        self.allowance.count(self.came)?;
        let window = self.window.as_ref();
        Ok(window.map_or(Ok(()), |held| held.grow_to(self.came.min(WINDOW)))?)
    }
}

/// What is known of a body that a parser reads.
#[derive(Default)]
pub struct Gauge {
    came: AtomicU64,
    used: AtomicU64,
    refused: Mutex<Option<ServiceError>>,
}

impl Gauge {
    /// The parser has made something of all that has come.
    pub fn used(&self) {
        self.used.store(self.came.load(Ordering::Relaxed), Ordering::Relaxed);
    }

    /// Why no more was given to the parser, which has words of its own for it.
    pub fn refused(&self) -> Option<ServiceError> {
        self.refused.lock().unwrap_or_else(PoisonError::into_inner).take()
    }

    fn count(&self, bytes: usize, meter: &mut Meter) -> Result<(), ServiceError> {
        meter.count(bytes)?;
        let came = self.came.fetch_add(bytes as u64, Ordering::Relaxed);
        if came.saturating_sub(self.used.load(Ordering::Relaxed)) > UNUSED {
            let detail = format!(
                "the multipart body is broken: {UNUSED} bytes came without a boundary, or with a part's \
                 head that does not end"
            );
            return Err(ServiceError::new(ErrorKind::MalformedBody, detail));
        }
        Ok(())
    }
}

/// The request with its body counted before its parser has it.
pub fn metered(request: Request, meter: Meter) -> (Request, Arc<Gauge>) {
    let gauge = Arc::new(Gauge::default());
    let read = |body: Body| {
        let chunks = body.into_data_stream();
        Body::from_stream(Metered { chunks, meter, gauge: Arc::clone(&gauge), given: false })
    };
    (request.map(read), gauge)
}

/// The chunks of a body, counted, and one at a time: the parser of multipart bodies reads as long as
/// there is anything to read before it looks at it, and what is unpacked is always there.
struct Metered {
    chunks: BodyDataStream,
    meter: Meter,
    gauge: Arc<Gauge>,
    given: bool,
}

impl Stream for Metered {
    type Item = Result<Bytes, axum::Error>;

    fn poll_next(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<Option<Self::Item>> {
        if std::mem::take(&mut self.given) {
            context.waker().wake_by_ref();
            return Poll::Pending;
        }
        let chunk = match self.chunks.poll_next_unpin(context) {
            Poll::Ready(Some(chunk)) => chunk.map_err(broken_off),
            Poll::Ready(None) => return Poll::Ready(None),
            Poll::Pending => return Poll::Pending,
        };
        let Self { meter, gauge, given, .. } = &mut *self;
        *given = true;
        let counted = chunk.and_then(|chunk| gauge.count(chunk.len(), meter).map(|()| chunk));
        Poll::Ready(Some(counted.map_err(|error| {
            let told = axum::Error::new(error.clone());
            *gauge.refused.lock().unwrap_or_else(PoisonError::into_inner) = Some(error);
            told
        })))
    }
}
