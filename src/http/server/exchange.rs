use std::{
    pin::Pin,
    sync::Arc,
    task::{Context, Poll},
    time::Duration,
};

use axum::{
    Router,
    body::{Body, HttpBody},
};
use bytes::Bytes;
use http_body::{Frame, SizeHint};
use hyper::body::Incoming;
use hyper_util::service::TowerToHyperService;
use tokio::time::{Instant, Sleep};

use super::line::{Line, Ticket};

/// Answers are handed to a connection in parts of at most this many bytes, so that it shows whether they
/// are taken.
const PART: usize = 32 << 10;

/// `router` for the requests of one connection, each of which is known to its line.
pub struct Exchanges {
    router: TowerToHyperService<Router>,
    line: Arc<Line>,
    beat: Duration,
}

impl Exchanges {
    /// Answers that have nothing to say ask every `beat` whether their caller would take anything.
    pub fn new(router: Router, line: Arc<Line>, beat: Duration) -> Self {
        Self { router: TowerToHyperService::new(router), line, beat }
    }
}

type Answer = hyper::Response<Outgoing>;

impl hyper::service::Service<hyper::Request<Incoming>> for Exchanges {
    type Response = Answer;
    type Error = std::convert::Infallible;
    type Future = Pin<Box<dyn Future<Output = Result<Answer, Self::Error>> + Send>>;

    fn call(&self, request: hyper::Request<Incoming>) -> Self::Future {
        let (ticket, beat) = (Ticket::new(&self.line), self.beat);
        let coming = ticket.clone();
        let answer =
            self.router.call(request.map(|body| Body::new(Coming { body, ticket: coming })));
        Box::pin(async move {
            let answer = answer.await?;
            ticket.answers();
            Ok(answer.map(|body| Outgoing { body, rest: Bytes::new(), ticket, beat, next: None }))
        })
    }
}

/// The body of a request, which tells the line what has come of it.
struct Coming {
    body: Incoming,
    ticket: Ticket,
}

impl HttpBody for Coming {
    type Data = Bytes;
    type Error = hyper::Error;

    fn poll_frame(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
    ) -> Poll<Option<Result<Frame<Bytes>, hyper::Error>>> {
        let frame = Pin::new(&mut self.body).poll_frame(context);
        match &frame {
            Poll::Pending => self.ticket.wants(true),
            Poll::Ready(Some(Ok(frame))) => {
                self.ticket.came(frame.data_ref().map_or(0, Bytes::len))
            }
            Poll::Ready(_) => self.ticket.wants(false),
        }
        frame
    }

    fn is_end_stream(&self) -> bool {
        self.body.is_end_stream()
    }

    fn size_hint(&self) -> SizeHint {
        self.body.size_hint()
    }
}

impl Drop for Coming {
    fn drop(&mut self) {
        self.ticket.wants(false);
    }
}

/// The body of an answer, in parts that tell the line when they are sent.
pub struct Outgoing {
    body: Body,
    /// What is left of a frame.
    rest: Bytes,
    ticket: Ticket,
    beat: Duration,
    /// While there is nothing to say: when to ask again whether anything would be taken. HTTP/2 asks for
    /// a body only where the caller has given a window.
    next: Option<Pin<Box<Sleep>>>,
}

impl Outgoing {
    fn part(&mut self) -> Frame<Bytes> {
        let part = self.rest.split_to(self.rest.len().min(PART));
        Frame::data(self.ticket.carried(part))
    }

    fn ask_again(&mut self, context: &mut Context<'_>) {
        let beat = self.beat;
        let next = self.next.get_or_insert_with(|| Box::pin(tokio::time::sleep(beat)));
        while next.as_mut().poll(context).is_ready() {
            next.as_mut().reset(Instant::now() + beat);
        }
    }
}

impl HttpBody for Outgoing {
    type Data = Bytes;
    type Error = axum::Error;

    fn poll_frame(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
    ) -> Poll<Option<Result<Frame<Bytes>, axum::Error>>> {
        self.ticket.asked();
        if !self.rest.is_empty() {
            return Poll::Ready(Some(Ok(self.part())));
        }
        let frame = match Pin::new(&mut self.body).poll_frame(context) {
            Poll::Pending => {
                self.ask_again(context);
                return Poll::Pending;
            }
            Poll::Ready(frame) => frame,
        };
        self.next = None;
        let Some(Ok(frame)) = frame else { return Poll::Ready(frame) };
        Poll::Ready(Some(Ok(match frame.into_data() {
            Ok(data) => {
                self.rest = data;
                self.part()
            }
            Err(trailers) => trailers,
        })))
    }

    fn is_end_stream(&self) -> bool {
        self.rest.is_empty() && self.body.is_end_stream()
    }

    fn size_hint(&self) -> SizeHint {
        let (left, mut hint) = (self.rest.len() as u64, self.body.size_hint());
        if let Some(upper) = hint.upper() {
            hint.set_upper(upper + left);
        }
        hint.set_lower(hint.lower() + left);
        hint
    }
}
