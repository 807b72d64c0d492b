use std::{io, net::SocketAddr, sync::Arc, time::Duration};

use tokio::{net::TcpListener, signal, task::JoinSet};
use tokio_util::sync::CancellationToken;

use super::{AnyError, Settings, logging};
use crate::{grpc, http, service::Service};

/// Why the service does not start.
#[derive(Debug, thiserror::Error)]
pub enum ServeError {
    /// An address cannot be listened on.
    #[error("cannot listen on {address} ({setting}): {error}")]
    Listen {
        /// The setting.
        setting: &'static str,
        /// The address.
        address: SocketAddr,
        /// Why.
        error: io::Error,
    },
    /// The system gives no threads.
    #[error("cannot start the threads: {0}")]
    Threads(#[from] rayon::ThreadPoolBuildError),
    /// The built-in gRPC descriptor is damaged.
    #[error("cannot read the gRPC descriptor: {0}")]
    Reflection(#[from] tonic_reflection::server::Error),
}

/// Where a server listens.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Addresses {
    /// The HTTP interface.
    pub http: SocketAddr,
    /// The gRPC interface.
    pub grpc: SocketAddr,
    /// The operators' listener.
    pub admin: SocketAddr,
}

/// A service that has its listeners and is ready to run.
#[derive(Debug)]
pub struct Server {
    service: Arc<Service>,
    settings: Settings,
    http: TcpListener,
    grpc: TcpListener,
    admin: TcpListener,
}

impl Server {
    /// Takes the addresses and starts the threads.
    ///
    /// # Errors
    /// An address is taken or not this machine's, or the system gives no threads.
    pub async fn bind(settings: Settings) -> Result<Self, ServeError> {
        Ok(Self {
            service: Service::new(settings.service())?,
            http: listen("http", settings.http).await?,
            grpc: listen("grpc", settings.grpc).await?,
            admin: listen("admin", settings.admin).await?,
            settings,
        })
    }

    /// The use cases it serves.
    pub fn service(&self) -> &Arc<Service> {
        &self.service
    }

    /// Where it listens.
    ///
    /// # Errors
    /// The system does not say.
    pub fn addresses(&self) -> io::Result<Addresses> {
        Ok(Addresses {
            http: self.http.local_addr()?,
            grpc: self.grpc.local_addr()?,
            admin: self.admin.local_addr()?,
        })
    }

    /// Serves until `stop`, then until the requests under way have ended or the drain deadline has
    /// passed.
    ///
    /// # Errors
    /// The built-in gRPC descriptor is damaged.
    pub async fn run(self, stop: CancellationToken) -> Result<(), ServeError> {
        let routes = http::router(Arc::clone(&self.service), self.settings.http());
        let (calls, health) = grpc::router(self.service, self.settings.grpc()).await?;
        // the operators' listener outlives the drain, so that it can tell of it
        let ended = CancellationToken::new();
        let admin = http::serve(self.admin, http::admin_router(stop.clone()), None, ended.clone());
        let admin = tokio::spawn(admin);
        let mut listeners = JoinSet::new();
        listeners.spawn(http::serve(self.http, routes, None, stop.clone()));
        listeners.spawn(http::serve(self.grpc, calls, None, stop.clone()));
        stop.cancelled().await;
        tracing::info!("draining");
        health.set_service_status("", tonic_health::ServingStatus::NotServing).await;
        drain(listeners, self.settings.drain_deadline).await;
        ended.cancel();
        let _ = tokio::time::timeout(Duration::from_secs(1), admin).await;
        Ok(())
    }
}

async fn drain(mut listeners: JoinSet<()>, deadline: Duration) {
    let all = async { while listeners.join_next().await.is_some() {} };
    if tokio::time::timeout(deadline, all).await.is_err() {
        tracing::warn!("the drain deadline passed with requests under way");
    }
}

async fn listen(setting: &'static str, address: SocketAddr) -> Result<TcpListener, ServeError> {
    let listener = TcpListener::bind(address).await;
    listener.map_err(|error| ServeError::Listen { setting, address, error })
}

/// Serves until the process is told to stop.
pub fn run(settings: &Settings) -> Result<(), AnyError> {
    logging::start(settings)?;
    let runtime = tokio::runtime::Builder::new_multi_thread().enable_all().build()?;
    runtime.block_on(async {
        let server = Server::bind(settings.clone()).await?;
        let Addresses { http, grpc, admin } = server.addresses()?;
        println!("http://{http}\ngrpc://{grpc}\nadmin://{admin}");
        let stop = CancellationToken::new();
        tokio::spawn(stop_on_signal(stop.clone()));
        Ok(server.run(stop).await?)
    })
}

/// Begins the drain at SIGTERM or SIGINT.
async fn stop_on_signal(stop: CancellationToken) {
    let terminated = async {
        match signal::unix::signal(signal::unix::SignalKind::terminate()) {
            Ok(mut signal) => signal.recv().await,
            Err(_) => std::future::pending().await,
        }
    };
    tokio::select! {
        _ = terminated => {}
        _ = signal::ctrl_c() => {}
    }
    stop.cancel();
}
