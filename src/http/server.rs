use std::{io, num::NonZeroUsize, sync::Arc, time::Duration};

use axum::Router;
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

/// Serves `router` on `listener` until `stop`, then ends after the last request under way.
///
/// HTTP/1 and HTTP/2, over TLS where `tls` is given.
pub async fn serve(
    listener: TcpListener,
    router: Router,
    tls: Option<TlsAcceptor>,
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

async fn connection(stream: TcpStream, router: Router, tls: Option<TlsAcceptor>, watch: Watcher) {
    // answers are written whole, so waiting to fill packets only costs time
    let _ = stream.set_nodelay(true);
    let served = match tls {
        None => exchange(stream, router, watch).await,
        Some(tls) => match handshake(stream, tls).await {
            Some(stream) => exchange(stream, router, watch).await,
            None => return,
        },
    };
    if let Err(error) = served {
        tracing::debug!(%error, "a connection broke off");
    }
}

/// Begins TLS; says in the log why it cannot, for the caller is told next to nothing.
async fn handshake(stream: TcpStream, tls: TlsAcceptor) -> Option<TlsStream<TcpStream>> {
    let peer = stream.peer_addr().map(|peer| peer.to_string()).unwrap_or_default();
    match tokio::time::timeout(HANDSHAKE_TIMEOUT, tls.accept(stream)).await {
        Ok(Ok(stream)) => return Some(stream),
        // whoever only looks whether the port is open hangs up without a word
        Ok(Err(error)) if error.kind() == io::ErrorKind::UnexpectedEof => {
            tracing::debug!(peer, %error, "a TLS handshake broke off");
        }
        Ok(Err(error)) => tracing::warn!(peer, %error, "a TLS handshake failed"),
        Err(_) => tracing::warn!(peer, "a TLS handshake took too long"),
    }
    None
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
