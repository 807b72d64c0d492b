use std::{io, num::NonZeroUsize, sync::Arc, time::Duration};

use axum::{Extension, Router};
use hyper_util::{
    rt::{TokioExecutor, TokioIo, TokioTimer},
    server::{conn::auto::Builder, graceful::GracefulShutdown},
    service::TowerToHyperService,
};
use tokio::{
    io::{AsyncRead, AsyncWrite},
    net::{TcpListener, TcpStream},
    sync::{OwnedSemaphorePermit, Semaphore},
};
use tokio_io_timeout::TimeoutStream;
use tokio_rustls::{TlsAcceptor, server::TlsStream};
use tokio_util::sync::CancellationToken;

use super::seldom::Seldom;
use crate::service::Peer;

/// Bytes read ahead or written behind on one connection: hundreds of uploads come in at a time when the
/// service is overloaded, and what they read ahead counts against no budget.
const BUFFER: usize = 64 << 10;
/// Longest time for a TLS handshake.
const HANDSHAKE_TIMEOUT: Duration = Duration::from_secs(10);
/// By this time the head of an HTTP/1 connection's next request must have come. It is longer than callers
/// and proxies usually keep a silent connection, so that it is they who close it.
const HEAD_TIMEOUT: Duration = Duration::from_secs(90);
/// Longest time a connection may take no byte of an answer.
const WRITE_TIMEOUT: Duration = Duration::from_secs(30);
/// A silent HTTP/2 connection is asked this often whether it lives.
const PING_INTERVAL: Duration = Duration::from_secs(20);
/// The pause after the system gave no connection, for example for want of file handles.
const ACCEPT_PAUSE: Duration = Duration::from_millis(50);

/// The connections that are served at one time, over all listeners that share these.
///
/// One more waits until another ends: it is accepted, but nothing of it is read.
#[derive(Clone, Debug)]
pub struct Connections {
    places: Arc<Semaphore>,
    most: usize,
}

impl Connections {
    /// Room for `most` connections.
    pub fn new(most: NonZeroUsize) -> Self {
        let most = most.get().min(Semaphore::MAX_PERMITS);
        Self { places: Arc::new(Semaphore::new(most)), most }
    }

    /// Connections served now.
    pub fn open(&self) -> usize {
        self.most - self.places.available_permits()
    }

    /// Waits for room, which is given back when the place is dropped.
    async fn place(&self) -> Option<OwnedSemaphorePermit> {
        if self.places.available_permits() == 0 {
            metrics::counter!("conicoid_connections_delayed_total").increment(1);
        }
        // places are never closed, so there is always one in the end
        Arc::clone(&self.places).acquire_owned().await.ok()
    }
}

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
    loop {
        let accepted = tokio::select! {
            accepted = next() => accepted,
            () = stop.cancelled() => break,
        };
        match accepted {
            Ok((stream, place)) => {
                let (router, tls, watcher) = (router.clone(), tls.clone(), under_way.watcher());
                tokio::spawn(async move {
                    connection(stream, router, tls, watcher).await;
                    drop(place);
                });
            }
            Err(error) => {
                tracing::warn!(%error, "no connection could be accepted");
                tokio::time::sleep(ACCEPT_PAUSE).await;
            }
        }
    }
    drop(listener);
    under_way.shutdown().await;
}

type Watcher = hyper_util::server::graceful::Watcher;

async fn connection(stream: TcpStream, router: Router, tls: Option<Tls>, watch: Watcher) {
    // answers are written whole, so waiting to fill packets only costs time
    let _ = stream.set_nodelay(true);
    let served = match tls {
        None => exchange(stream, router, watch).await,
        Some(tls) => match handshake(stream, tls()).await {
            Some(stream) => {
                let router = identified(router, &stream);
                exchange(stream, router, watch).await
            }
            None => return,
        },
    };
    if let Err(error) = served {
        tracing::debug!(%error, "a connection broke off");
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
) -> Result<(), Box<dyn std::error::Error + Send + Sync>> {
    let mut builder = Builder::new(TokioExecutor::new());
    let http1 = &mut builder.http1();
    http1.timer(TokioTimer::new()).header_read_timeout(HEAD_TIMEOUT).max_buf_size(BUFFER);
    builder.http2().timer(TokioTimer::new()).keep_alive_interval(PING_INTERVAL);
    let mut stream = TimeoutStream::new(stream);
    stream.set_write_timeout(Some(WRITE_TIMEOUT));
    let service = TowerToHyperService::new(router);
    let connection = builder.serve_connection(TokioIo::new(Box::pin(stream)), service);
    let connection = connection.into_owned();
    watch.watch(connection).await
}
