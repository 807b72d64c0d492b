use std::{
    pin::Pin,
    task::{Context, Poll},
    time::Duration,
};

use axum::{
    body::{Body, Bytes, HttpBody},
    extract::Request,
    http::header,
    middleware::Next,
    response::Response,
};
use futures::StreamExt;
use http_body::{Frame, SizeHint};
use tokio::sync::oneshot;

use crate::service::{ErrorKind, ServiceError};

/// Longest time the rest of a refused upload is read.
const LINGER: Duration = Duration::from_secs(5);

/// Reads what a handler left of a body before its answer goes out.
///
/// A connection that is closed on unread bytes is reset, and the caller may lose the answer with it:
/// it would see a broken connection where it was told to come again later.
pub async fn read_to_the_end(request: Request, next: Next) -> Response {
    // such a caller sends nothing before it is told to go on
    if request.headers().contains_key(header::EXPECT) {
        return next.run(request).await;
    }
    let (give_back, mut left) = oneshot::channel();
    let request =
        request.map(|body| Body::new(Lent { body: Some(body), give_back: Some(give_back) }));
    let response = next.run(request).await;
    // a body that is too slow is not waited for any longer
    let error = response.extensions().get::<ServiceError>();
    let late = error.is_some_and(|error| error.kind == ErrorKind::UploadTimeout);
    if let (Ok(rest), false) = (left.try_recv(), late) {
        let discard = async {
            let mut rest = rest.into_data_stream();
            while let Some(Ok(_)) = rest.next().await {}
        };
        // whoever is not done by then may lose the answer
        let _ = tokio::time::timeout(LINGER, discard).await;
    }
    response
}

/// A body that is given back when its reader drops it before its end.
struct Lent {
    body: Option<Body>,
    give_back: Option<oneshot::Sender<Body>>,
}

impl HttpBody for Lent {
    type Data = Bytes;
    type Error = axum::Error;

    fn poll_frame(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
    ) -> Poll<Option<Result<Frame<Bytes>, axum::Error>>> {
        match &mut self.body {
            Some(body) => Pin::new(body).poll_frame(context),
            None => Poll::Ready(None),
        }
    }

    fn is_end_stream(&self) -> bool {
        self.body.as_ref().is_none_or(HttpBody::is_end_stream)
    }

    fn size_hint(&self) -> SizeHint {
        self.body.as_ref().map(HttpBody::size_hint).unwrap_or_default()
    }
}

impl Drop for Lent {
    fn drop(&mut self) {
        if let (Some(body), Some(give_back)) = (self.body.take(), self.give_back.take())
            && !body.is_end_stream()
        {
            // nobody waits for it where the request was dropped
            let _ = give_back.send(body);
        }
    }
}
