//! Connections: how they are accepted, how many there are, and how long their callers are waited for.

mod connections;
mod exchange;
mod line;
mod patience;

use std::{io, sync::Arc, time::Duration};

use axum::{Extension, Router};
use hyper_util::{
    rt::{TokioExecutor, TokioIo, TokioTimer},
    server::{conn::auto::Builder, graceful::GracefulShutdown},
};
use tokio::{
    io::{AsyncRead, AsyncWrite},
    net::{TcpListener, TcpStream},
};
use tokio_io_timeout::TimeoutStream;
use tokio_rustls::{TlsAcceptor, server::TlsStream};
use tokio_util::sync::CancellationToken;

use super::seldom::Seldom;
use crate::service::Peer;

pub use connections::Connections;
pub use patience::Patience;

use connections::Place;
use exchange::Exchanges;
use line::Line;

/// Bytes read ahead or written behind on one connection, and on one HTTP/2 stream: hundreds of uploads come
/// in at a time when the service is overloaded, and what they read ahead counts against no budget.
const BUFFER: usize = 64 << 10;
/// Longest time for a TLS handshake.
const HANDSHAKE_TIMEOUT: Duration = Duration::from_secs(10);
/// A silent HTTP/2 connection is asked this often whether it lives.
const PING_INTERVAL: Duration = Duration::from_secs(20);
/// Requests under way at one time on one HTTP/2 connection. One whose answer is not taken keeps some 4 kB,
/// and connections are counted with 0.13 MB each.
const STREAMS: u32 = 32;
/// The pause after the system gave no connection, for example for want of file handles.
const ACCEPT_PAUSE: Duration = Duration::from_millis(50);

/// What speaks TLS with the next connection: the files behind it may have changed since the last.
pub type Tls = Arc<dyn Fn() -> TlsAcceptor + Send + Sync>;

/// Serves `router` on `listener` until `stop`, then ends after the last request under way.
///
/// HTTP/1 and HTTP/2, over TLS where `tls` is given.
pub async fn serve(
    listener: TcpListener,
    router: Router,
    tls: Option<Tls>,
    connections: Connections,
    stop: CancellationToken,
) {
    let under_way = GracefulShutdown::new();
    let next = async || {
        let (stream, _) = listener.accept().await?;
        io::Result::Ok((stream, connections.place().await))
    };
    // the system is asked again and again; the log is told once
    let mut refused = false;
    loop {
        let accepted = tokio::select! {
            accepted = next() => accepted,
            () = stop.cancelled() => break,
        };
        match accepted {
            Ok((stream, place)) => {
                refused = false;
                let (router, tls, watcher) = (router.clone(), tls.clone(), under_way.watcher());
                tokio::spawn(connection(stream, router, tls, watcher, place));
            }
            Err(error) => {
                if !std::mem::replace(&mut refused, true) {
                    tracing::warn!(%error, "no connection can be accepted");
                }
                // their handles may be what is missing
                connections.end_longest();
                tokio::time::sleep(ACCEPT_PAUSE).await;
            }
        }
    }
    drop(listener);
    under_way.shutdown().await;
}

type Watcher = hyper_util::server::graceful::Watcher;

/// Serves one connection until it ends or its caller has kept the service waiting for too long.
async fn connection(
    stream: TcpStream,
    router: Router,
    tls: Option<Tls>,
    watch: Watcher,
    place: Place,
) {
    // answers are written whole, so waiting to fill packets only costs time
    let _ = stream.set_nodelay(true);
    let (line, patience) = (Arc::clone(&place.line), *place.patience());
    let served = async {
        match tls {
            None => exchange(stream, router, watch, &line, &patience).await,
            Some(tls) => match handshake(stream, tls()).await {
                Some(stream) => {
                    let router = identified(router, &stream);
                    exchange(stream, router, watch, &line, &patience).await
                }
                None => Ok(()),
            },
        }
    };
    tokio::select! {
        served = served => if let Err(error) = served {
            tracing::debug!(%error, "a connection broke off");
        },
        () = line.overdue(&patience) => tracing::debug!("a connection kept the service waiting"),
    }
}

/// Begins TLS; says in the log why it cannot, for the caller is told next to nothing.
async fn handshake(stream: TcpStream, tls: TlsAcceptor) -> Option<TlsStream<TcpStream>> {
    /// Whoever wants to may fail a thousand times a second.
    static LINES: Seldom = Seldom::new();
    let peer = stream.peer_addr().map(|peer| peer.to_string()).unwrap_or_default();
    let failed = match tokio::time::timeout(HANDSHAKE_TIMEOUT, tls.accept(stream)).await {
        Ok(Ok(stream)) => return Some(stream),
        // whoever only looks whether the port is open hangs up without a word
        Ok(Err(error)) if error.kind() == io::ErrorKind::UnexpectedEof => {
            tracing::debug!(peer, %error, "a TLS handshake broke off");
            return None;
        }
        Ok(Err(error)) => error.to_string(),
        Err(_) => format!("not done after {} s", HANDSHAKE_TIMEOUT.as_secs()),
    };
    metrics::counter!("conicoid_tls_handshakes_failed_total").increment(1);
    if let Some(untold) = LINES.turn() {
        tracing::warn!(peer, error = %failed, untold, "a TLS handshake failed");
    }
    None
}

/// `router` for this connection alone, whose requests tell of the client certificate, if there is one.
fn identified(router: Router, stream: &TlsStream<TcpStream>) -> Router {
    let certificates = stream.get_ref().1.peer_certificates();
    match certificates.and_then(|chain| chain.first()) {
        Some(certificate) => router.layer(Extension(Peer::of(certificate))),
        None => router,
    }
}

async fn exchange(
    stream: impl AsyncRead + AsyncWrite + Unpin + Send + 'static,
    router: Router,
    watch: Watcher,
    line: &Arc<Line>,
    patience: &Patience,
) -> Result<(), Box<dyn std::error::Error + Send + Sync>> {
    let mut builder = Builder::new(TokioExecutor::new());
    // the line knows when a head is late
    builder.http1().timer(TokioTimer::new()).header_read_timeout(None).max_buf_size(BUFFER);
    let http2 = &mut builder.http2();
    http2.timer(TokioTimer::new()).keep_alive_interval(PING_INTERVAL);
    http2.max_concurrent_streams(STREAMS).max_send_buf_size(BUFFER);
    let mut stream = TimeoutStream::new(stream);
    stream.set_write_timeout(Some(patience.write));
    let service = Exchanges::new(router, Arc::clone(line), patience.write / 3);
    let connection = builder.serve_connection(TokioIo::new(Box::pin(stream)), service);
    let connection = connection.into_owned();
    watch.watch(connection).await
}
