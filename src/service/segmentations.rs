use std::{
    path::PathBuf,
    sync::Arc,
    time::{Duration, Instant},
};

use super::{
    Answer, Caller, ErrorKind, FitDocument, FitRequest, Keys, Needs, Peer, Request, ServiceError,
    Upload,
    announced::{Announced, advice, decoded},
    compute, compute_fit,
    jobs::SegmentationRunner,
    keys,
};
use crate::{
    formats::{self, Fields, Limits},
    jobs::{
        Book, BookConfig, ByteBudget, BytesHeld, Control, DiskStore, Keeping, KeyShare,
        MemoryStore, Nats, NatsConfig, NatsError, Pool, PoolConfig, PoolError, Stop, Store,
        StoreError, Work, trace,
    },
};

/// The limits of the service.
#[derive(Clone, Debug)]
pub struct ServiceConfig {
    /// Threads, queue and lanes.
    pub pool: PoolConfig,
    /// Longest body, after decompression.
    pub max_body_bytes: u64,
    /// Bytes of uploads held at one time.
    pub max_bytes_in_flight: u64,
    /// The part of queue, bytes in flight and kept results that one key may take.
    pub key_share: KeyShare,
    /// Most points of one cloud.
    pub max_points: usize,
    /// Longest time a segmentation may take, whatever the request says.
    pub max_deadline: Duration,
    /// How long ended jobs are kept.
    pub book: BookConfig,
    /// Longest time an upload may take.
    pub upload_timeout: Duration,
    /// Where jobs are kept on disk; in memory when absent.
    pub data_dir: Option<PathBuf>,
    /// Bytes of the file in `data_dir` that are kept in memory.
    pub data_cache_bytes: usize,
    /// The servers over which processes share the jobs; this one has its own when absent.
    pub nats: Option<NatsConfig>,
    /// Whether this process runs the jobs that are shared.
    pub work: bool,
    /// Clouds of more points are cut into parts of so many, which all that work share; 0 cuts none.
    pub tile_points: usize,
}

/// Why the service cannot start.
#[derive(Debug, thiserror::Error)]
pub enum StartError {
    /// The system gives no threads.
    #[error("cannot start the threads: {0}")]
    Threads(#[from] rayon::ThreadPoolBuildError),
    /// The data directory cannot be made.
    #[error("cannot use the data directory {path}: {error}")]
    Directory {
        /// The directory.
        path: PathBuf,
        /// Why.
        error: std::io::Error,
    },
    /// Another process has the data directory.
    #[error(
        "the data directory {0} is in use by another process: stop that, or give this one a data_dir of \
         its own"
    )]
    DirectoryInUse(PathBuf),
    /// The jobs cannot be read.
    #[error("cannot open the jobs that are kept: {0}")]
    Store(#[from] StoreError),
    /// The servers over which jobs are shared cannot be used.
    #[error(transparent)]
    Nats(#[from] NatsError),
}

/// Longest upload whose points are counted on the thread that took it in: a fraction of a millisecond.
const LOOKED_AT_IN_PLACE: usize = 1 << 20;

/// The use cases, and what they share.
#[derive(Debug)]
pub struct Service {
    config: ServiceConfig,
    pool: Arc<Pool>,
    budget: ByteBudget,
    book: Arc<Book>,
    keys: Option<Keys>,
}

impl Service {
    /// Starts the threads, opens the store and takes up the jobs that had not ended.
    ///
    /// # Errors
    /// The system gives no threads, or the store cannot be used.
    pub async fn new(config: ServiceConfig, keys: Option<Keys>) -> Result<Arc<Self>, StartError> {
        let pool = Arc::new(Pool::new(config.pool, config.key_share)?);
        let budget = ByteBudget::new(config.max_bytes_in_flight, config.key_share);
        let limits = limits(&config);
        let runner = Arc::new(SegmentationRunner {
            limits,
            max_deadline: config.max_deadline,
            tile_points: config.tile_points,
        });
        let keeping = match &config.nats {
            Some(nats) => Keeping::Shared(Nats::connect(nats.clone()).await?),
            None => Keeping::Own(open_store(&config)?),
        };
        let book = Book::open(config.book, Arc::clone(&pool), keeping, runner).await?;
        Ok(Arc::new(Self { config, pool, budget, book, keys }))
    }

    /// The limits.
    pub fn config(&self) -> &ServiceConfig {
        &self.config
    }

    /// The pool that segments.
    pub fn pool(&self) -> &Pool {
        &self.pool
    }

    /// The jobs.
    pub fn book(&self) -> &Arc<Book> {
        &self.book
    }

    /// Why the service cannot take jobs now, if it cannot.
    pub async fn not_ready(&self) -> Option<String> {
        self.book.probe().await.err().map(|error| error.to_string())
    }

    /// A number that changes whenever something has been done that takes memory.
    pub fn activity(&self) -> u64 {
        self.pool.begun().wrapping_add(self.budget.grown())
    }

    /// Bytes of uploads held now.
    pub fn bytes_in_flight(&self) -> u64 {
        self.budget.held()
    }

    /// The limits of a cloud.
    pub fn limits(&self) -> Limits {
        limits(&self.config)
    }

    /// Who sends this `Authorization` header over a connection of `peer`; told in the request's line of
    /// the log.
    ///
    /// # Errors
    /// The service asks for keys, and the header holds none of them.
    pub fn caller(
        &self,
        authorization: Option<&str>,
        peer: Option<&Peer>,
    ) -> Result<Caller, ServiceError> {
        let caller = keys::caller(self.keys.as_ref(), authorization, peer)?;
        trace::note(|facts| facts.caller.clone_from(&caller));
        Ok(caller)
    }

    /// An empty share of the budget for one request, yet to be charged to its caller.
    pub fn share(&self) -> BytesHeld {
        self.budget.share()
    }

    /// Begins to take in a cloud, whose bytes `held` counts.
    pub fn upload(&self, held: BytesHeld) -> Upload {
        Upload::new(held, self.config.max_body_bytes)
    }

    /// Refuses a caller before its cloud is taken in, where the queue, or this key's share of it, is
    /// full already.
    ///
    /// # Errors
    /// There is no room.
    pub fn check_room(&self, caller: &Caller) -> Result<(), ServiceError> {
        if self.is_run_elsewhere() {
            return Ok(self.book.check_room(caller.as_deref())?);
        }
        Ok(self.pool.admit(caller.as_deref()).map(drop)?)
    }

    /// Segments a cloud while the caller waits, and writes the answer by `tell` on the same threads.
    /// Dropping the future cancels the work. `needs` says what the answer needs of the cloud.
    ///
    /// # Errors
    /// The cloud or the request is bad, there is no room, or time ran out.
    pub async fn segment<T: Send + 'static>(
        &self,
        upload: Upload,
        request: Request,
        needs: Needs,
        tell: impl FnOnce(Answer, bool) -> Result<T, ServiceError> + Send + 'static,
    ) -> Result<T, ServiceError> {
        if self.is_run_elsewhere() {
            return self.segment_elsewhere(upload, request, needs, tell).await;
        }
        trace::note(|facts| facts.bytes = Some(upload.bytes().len()));
        let place = self.pool.admit(upload.held().owner().as_deref())?;
        let limits = self.limits();
        let deadline = Instant::now() + self.time_for(&request);
        let control = Control::new(Some(deadline));
        let guard = control.cancel_on_drop();
        let announced = self.announced(upload, &request, needs).await?;
        let (upload, Announced { points, decoded }) = announced;
        // given back when the run has ended, while the upload's share goes on with the answer
        let room = self.share();
        room.charge(upload.held().owner().as_deref())?;
        room.grow_to(decoded)?;
        let lane = self.pool.lane(points);
        let work = move || {
            let mut answer = compute(upload.bytes(), &request, &limits, &control)?;
            if needs != Needs::Nothing {
                answer.fields = Fields::of(upload.bytes());
            }
            if needs == Needs::EachPoint && answer.cloud.thinned.is_some() {
                let whole = formats::read(upload.bytes(), request.hints().whole(), &limits)?;
                answer.whole = Some(Arc::new(whole));
            }
            let cloud = Arc::clone(&answer.cloud);
            let told = tell(answer, request.labels);
            // the system takes milliseconds to take large clouds back, and the caller need not wait
            rayon::spawn(move || drop((upload, cloud, room)));
            told
        };
        let run = self.pool.run(Some(place), lane, work);
        let done = tokio::time::timeout_at(deadline.into(), run).await;
        let done = done.map_err(|_| ServiceError::from(Stop::Deadline))?;
        guard.release();
        done?
    }

    /// Fits one feature to all points of a cloud while the caller waits. Dropping the future cancels the work.
    ///
    /// # Errors
    /// The cloud or the request is bad, the points do not determine the feature, there is no room, or time ran out.
    pub async fn fit(
        &self,
        upload: Upload,
        request: FitRequest,
    ) -> Result<FitDocument, ServiceError> {
        trace::note(|facts| facts.bytes = Some(upload.bytes().len()));
        let place = self.pool.admit(upload.held().owner().as_deref())?;
        let limits = self.limits();
        let deadline = Instant::now() + self.time_for(&request.request);
        let control = Control::new(Some(deadline));
        let guard = control.cancel_on_drop();
        let announced = self.announced(upload, &request.request, Needs::Nothing).await?;
        let (upload, Announced { points, decoded }) = announced;
        let room = self.share();
        room.charge(upload.held().owner().as_deref())?;
        room.grow_to(decoded)?;
        let lane = self.pool.lane(points);
        let work = move || {
            let _room = room;
            compute_fit(upload.bytes(), &request, &limits, &control)
        };
        let run = self.pool.run(Some(place), lane, work);
        let done = tokio::time::timeout_at(deadline.into(), run).await;
        let done = done.map_err(|_| ServiceError::from(Stop::Deadline))?;
        guard.release();
        done?
    }

    /// An upload, unpacked where it was packed, and what it announces; `needs` says what the answer needs of the cloud.
    ///
    /// # Errors
    /// It cannot be unpacked, or would never have room in the budget.
    pub(super) async fn announced(
        &self,
        upload: Upload,
        request: &Request,
        needs: Needs,
    ) -> Result<(Upload, Announced), ServiceError> {
        let (hints, max_points) = (request.hints(), self.limits().max_points as u64);
        let aside = upload.bytes().len() > LOOKED_AT_IN_PLACE || upload.is_packed();
        let look = move || {
            let upload = upload.unpacked()?;
            // a text may have lines that are no points: the reader counts those that are
            let points = formats::announced_points(upload.bytes(), hints).min(max_points);
            let decoded = decoded(upload.bytes(), hints, points, needs);
            Ok::<_, ServiceError>((points, decoded, upload))
        };
        let (points, decoded, upload) = if aside {
            let looked = tokio::task::spawn_blocking(look).await;
            looked.map_err(|_| ServiceError::from(PoolError::Closed))??
        } else {
            look()?
        };
        let all = decoded.saturating_add(upload.bytes().len() as u64);
        if all > self.budget.limit() {
            let limit = self.budget.limit();
            return Err(ServiceError::new(
                ErrorKind::TooManyPoints,
                format!(
                    "the cloud with up to {points} points takes {all} bytes and all clouds together \
                     may take {limit}: {}, or raise max_bytes_in_flight",
                    advice(request.thin)
                ),
            ));
        }
        Ok((upload, Announced { points, decoded }))
    }

    /// Whether workers segment what this process takes in.
    fn is_run_elsewhere(&self) -> bool {
        self.config.nats.is_some() && !self.config.work
    }

    /// Begins to run the jobs that processes share; nothing where this one has its own, or is not to work.
    pub fn work(&self) -> Option<Work> {
        self.config.work.then(|| self.book.work()).flatten()
    }

    pub(super) fn time_for(&self, request: &Request) -> Duration {
        request.deadline.unwrap_or(self.config.max_deadline).min(self.config.max_deadline)
    }
}

/// The limits of a cloud: thinning one takes no more than all clouds together may.
fn limits(config: &ServiceConfig) -> Limits {
    Limits::of(config.max_points).with_thin_bytes(config.max_bytes_in_flight)
}

fn open_store(config: &ServiceConfig) -> Result<Arc<dyn Store>, StartError> {
    let Some(path) = &config.data_dir else { return Ok(Arc::new(MemoryStore::default())) };
    std::fs::create_dir_all(path)
        .map_err(|error| StartError::Directory { path: path.clone(), error })?;
    let store = DiskStore::open(&path.join("jobs.redb"), config.data_cache_bytes);
    Ok(Arc::new(store.map_err(|error| match error {
        StoreError::InUse => StartError::DirectoryInUse(path.clone()),
        other => other.into(),
    })?))
}
