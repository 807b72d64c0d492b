use std::{
    io::{self, IsTerminal, Write},
    net::SocketAddr,
    sync::Arc,
    time::Duration,
};

use tokio::{
    net::TcpListener,
    signal::{self, unix::SignalKind},
    task::JoinSet,
};
use tokio_util::sync::CancellationToken;

use super::{
    error::AnyError,
    greeting::greeting,
    handles, logging, measure, memory,
    settings::Settings,
    tls::{self, TlsError},
    traces::Traces,
};
use crate::{
    grpc, http,
    service::{Keys, KeysError, Service, StartError},
};

/// Expired jobs are looked for this often; nobody sees one in between.
const EXPIRY_INTERVAL: Duration = Duration::from_secs(10);

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
    /// Anybody could call from elsewhere.
    #[error(
        "{setting} = {address} listens beyond this machine and nobody is asked who they are: set keys \
         or client_ca, or allow it with --allow-anonymous"
    )]
    Anonymous {
        /// The setting.
        setting: &'static str,
        /// The address.
        address: SocketAddr,
    },
    /// Jobs cannot be kept in two places.
    #[error("nats and data_dir both say where jobs are kept: name one of them")]
    TwoStores,
    /// There are no shared jobs to run.
    #[error("no NATS server is named whose jobs are to be run: give its address by --nats")]
    NothingShared,
    /// The key file is not usable.
    #[error(transparent)]
    Keys(#[from] KeysError),
    /// The certificates are not usable.
    #[error(transparent)]
    Tls(#[from] TlsError),
    /// The threads or the store.
    #[error(transparent)]
    Start(#[from] StartError),
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
pub struct Server {
    service: Arc<Service>,
    settings: Settings,
    front: Option<Front>,
    admin: TcpListener,
}

/// Where callers come in.
struct Front {
    tls: Option<(http::Tls, http::Tls)>,
    http: TcpListener,
    grpc: TcpListener,
}

impl Server {
    /// Takes the addresses and starts the threads.
    ///
    /// # Errors
    /// A setting cannot be used: an address is taken or open to strangers, a file is missing or wrong,
    /// or the system gives no threads.
    pub async fn bind(settings: Settings) -> Result<Self, ServeError> {
        check_access(&settings)?;
        let keys = settings.keys.as_deref().map(Keys::open).transpose()?;
        check_store(&settings)?;
        Ok(Self {
            service: Service::new(settings.service(), keys).await?,
            front: Some(Front {
                tls: tls::acceptors(&settings)?,
                http: listen("http", settings.http).await?,
                grpc: listen("grpc", settings.grpc).await?,
            }),
            admin: listen("admin", settings.admin).await?,
            settings,
        })
    }

    /// A worker: it runs shared jobs and takes none in, and has the operators' listener alone.
    ///
    /// # Errors
    /// As [`Self::bind`]; no NATS server is named.
    pub async fn bind_worker(mut settings: Settings) -> Result<Self, ServeError> {
        settings.work = true;
        check_store(&settings)?;
        Ok(Self {
            service: Service::new(settings.service(), None).await?,
            front: None,
            admin: listen("admin", settings.admin).await?,
            settings,
        })
    }

    /// The use cases it serves.
    pub fn service(&self) -> &Arc<Service> {
        &self.service
    }

    /// Where it listens for callers and operators; nothing of a worker, which has no callers.
    ///
    /// # Errors
    /// The system does not say.
    pub fn addresses(&self) -> io::Result<Option<Addresses>> {
        let Some(front) = &self.front else { return Ok(None) };
        Ok(Some(Addresses {
            http: front.http.local_addr()?,
            grpc: front.grpc.local_addr()?,
            admin: self.admin.local_addr()?,
        }))
    }

    /// Where it listens for operators.
    ///
    /// # Errors
    /// The system does not say.
    pub fn admin(&self) -> io::Result<SocketAddr> {
        self.admin.local_addr()
    }

    /// Serves until `stop`, then until the requests under way have ended or the drain deadline has
    /// passed.
    ///
    /// # Errors
    /// The built-in gRPC descriptor is damaged.
    pub async fn run(self, stop: CancellationToken) -> Result<(), ServeError> {
        let service = self.service;
        let most = handles::connections(self.settings.max_connections);
        let connections = http::Connections::new(most, self.settings.patience());
        let metrics = measure::start(Arc::clone(&service), connections.clone());
        // the operators' listener outlives the drain, so that it can tell of it
        let ended = CancellationToken::new();
        let answers =
            http::admin_router(stop.clone(), connections.clone(), metrics, readiness(&service));
        // and it answers when callers have taken all connections
        let own = http::Connections::new(handles::OPERATORS, self.settings.patience());
        let admin = tokio::spawn(http::serve(self.admin, answers, None, own, ended.clone()));
        let mut listeners = JoinSet::new();
        let mut health = None;
        if let Some(Front { tls, http, grpc }) = self.front {
            let routes = http::router(Arc::clone(&service), self.settings.http());
            let (calls, of_calls) =
                grpc::router(Arc::clone(&service), self.settings.grpc()).await?;
            health = Some(of_calls);
            let (http_tls, grpc_tls) = tls.unzip();
            for (listener, router, tls) in [(http, routes, http_tls), (grpc, calls, grpc_tls)] {
                let (connections, stop) = (connections.clone(), stop.clone());
                listeners.spawn(http::serve(listener, router, tls, connections, stop));
            }
        }
        let expiry = tokio::spawn(expire(Arc::clone(&service)));
        let upkeep = tokio::spawn(measure::keep_up());
        let memory = tokio::spawn(memory::give_back(Arc::clone(&service)));
        let work = service.work();
        stop.cancelled().await;
        tracing::info!("draining");
        if let Some(health) = health {
            grpc::end(&health).await;
        }
        service.book().close();
        let deadline = self.settings.drain_deadline;
        let worked = async {
            if let Some(work) = work {
                work.end(deadline).await;
            }
        };
        tokio::join!(drain(listeners, &service, deadline), worked);
        expiry.abort();
        memory.abort();
        upkeep.abort();
        ended.cancel();
        let _ = tokio::time::timeout(Duration::from_secs(1), admin).await;
        Ok(())
    }
}

/// Jobs are kept in one place, and those that are to be run for others are shared.
fn check_store(settings: &Settings) -> Result<(), ServeError> {
    match (settings.nats.is_empty(), &settings.data_dir) {
        (false, Some(_)) => Err(ServeError::TwoStores),
        (true, _) if settings.work => Err(ServeError::NothingShared),
        _ => Ok(()),
    }
}

/// Refuses to listen beyond this machine where nobody is asked who they are.
fn check_access(settings: &Settings) -> Result<(), ServeError> {
    let asked = settings.keys.is_some() || settings.client_ca.is_some();
    if asked || settings.allow_anonymous {
        return Ok(());
    }
    let open = [("http", settings.http), ("grpc", settings.grpc)];
    let open = open.into_iter().find(|(_, address)| !address.ip().is_loopback());
    open.map_or(Ok(()), |(setting, address)| Err(ServeError::Anonymous { setting, address }))
}

/// Whether the service takes jobs, as its store says.
fn readiness(service: &Arc<Service>) -> http::Readiness {
    let service = Arc::clone(service);
    Arc::new(move || {
        let service = Arc::clone(&service);
        Box::pin(async move { service.not_ready().await })
    })
}

/// Forgets expired jobs from time to time.
async fn expire(service: Arc<Service>) {
    let mut time = tokio::time::interval(EXPIRY_INTERVAL);
    loop {
        time.tick().await;
        service.book().expire().await;
    }
}

/// Waits for the requests under way, and for the jobs that would be lost with the process.
async fn drain(mut listeners: JoinSet<()>, service: &Service, deadline: Duration) {
    let all = async {
        while listeners.join_next().await.is_some() {}
        service.book().drain().await;
    };
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
    run_server(settings, false)
}

/// Runs shared jobs until the process is told to stop.
pub fn work(settings: &Settings) -> Result<(), AnyError> {
    run_server(settings, true)
}

fn run_server(settings: &Settings, is_worker: bool) -> Result<(), AnyError> {
    memory::keep();
    let runtime = tokio::runtime::Builder::new_multi_thread().enable_all().build()?;
    let traces = {
        let _within = runtime.enter();
        Traces::start(settings)?
    };
    logging::start(settings, traces.as_ref())?;
    let served = runtime.block_on(async {
        let settings = settings.clone();
        let s = if settings.tls_cert.is_some() { "s" } else { "" };
        let server = match is_worker {
            true => Server::bind_worker(settings).await?,
            false => Server::bind(settings).await?,
        };
        // whoever started the service may not care where it is
        if let Some(Addresses { http, grpc, .. }) = server.addresses()? {
            let _ = writeln!(io::stdout(), "http{s}://{http}\ngrpc{s}://{grpc}");
            if io::stderr().is_terminal() {
                let _ = write!(io::stderr(), "{}", greeting(&format!("http{s}"), http));
            }
        }
        let _ = writeln!(io::stdout(), "admin://{}", server.admin()?);
        let stop = CancellationToken::new();
        tokio::spawn(stop_on_signal(stop.clone()));
        Ok(server.run(stop).await?)
    });
    // the runtime sends the last spans
    drop(traces);
    served
}

/// Begins the drain at SIGTERM, SIGINT or, when the terminal goes away, SIGHUP.
async fn stop_on_signal(stop: CancellationToken) {
    let told = async |kind| match signal::unix::signal(kind) {
        Ok(mut signal) => signal.recv().await,
        Err(_) => std::future::pending().await,
    };
    tokio::select! {
        _ = told(SignalKind::terminate()) => {}
        _ = told(SignalKind::hangup()) => {}
        _ = signal::ctrl_c() => {}
    }
    stop.cancel();
}
