use std::{
    sync::Arc,
    time::{Duration, Instant},
};

use super::{Document, ErrorKind, Request, ServiceError, compute};
use crate::{
    formats::Limits,
    jobs::{ByteBudget, BytesHeld, Control, Pool, PoolConfig, Stop},
};

/// The limits of the service.
#[derive(Clone, Copy, Debug)]
pub struct ServiceConfig {
    /// Threads, queue and lanes.
    pub pool: PoolConfig,
    /// Longest body, after decompression.
    pub max_body_bytes: u64,
    /// Bytes of uploads held at one time.
    pub max_bytes_in_flight: u64,
    /// Most points of one cloud.
    pub max_points: usize,
    /// Longest time a segmentation may take, whatever the request says.
    pub max_deadline: Duration,
}

/// The use cases, and what they share.
#[derive(Debug)]
pub struct Service {
    config: ServiceConfig,
    pool: Pool,
    budget: ByteBudget,
}

impl Service {
    /// Starts the threads.
    ///
    /// # Errors
    /// The system gives no more threads.
    pub fn new(config: ServiceConfig) -> Result<Arc<Self>, rayon::ThreadPoolBuildError> {
        let pool = Pool::new(config.pool)?;
        let budget = ByteBudget::new(config.max_bytes_in_flight);
        Ok(Arc::new(Self { config, pool, budget }))
    }

    /// The limits.
    pub fn config(&self) -> &ServiceConfig {
        &self.config
    }

    /// The pool that segments.
    pub fn pool(&self) -> &Pool {
        &self.pool
    }

    /// Begins to take in a cloud.
    pub fn upload(&self) -> Upload {
        let limit = self.config.max_body_bytes;
        Upload { bytes: Vec::new(), held: self.budget.share(), limit }
    }

    /// Segments a cloud while the caller waits, and writes the answer by `tell` on the same threads. Dropping the future cancels the work.
    ///
    /// # Errors
    /// The cloud or the request is bad, there is no room, or time ran out.
    pub async fn segment<T: Send + 'static>(
        &self,
        upload: Upload,
        request: Request,
        tell: impl FnOnce(Document) -> T + Send + 'static,
    ) -> Result<T, ServiceError> {
        let place = self.pool.admit()?;
        let limits = Limits { max_points: self.config.max_points };
        let deadline = Instant::now() + self.time_for(&request);
        let control = Control::new(Some(deadline));
        let guard = control.cancel_on_drop();
        let lane = self.pool.lane(upload.bytes.len());
        let work = move || {
            let document = compute(&upload.bytes, &request, &limits, &control);
            document.map(|d| tell(if request.labels { d } else { d.without_labels() }))
        };
        let run = self.pool.run(Some(place), lane, work);
        let done = tokio::time::timeout_at(deadline.into(), run).await;
        let done = done.map_err(|_| ServiceError::from(Stop::Deadline))?;
        guard.release();
        done?
    }

    fn time_for(&self, request: &Request) -> Duration {
        request.deadline.unwrap_or(self.config.max_deadline).min(self.config.max_deadline)
    }
}

/// A cloud coming in: its bytes, counted against the budget of all uploads.
#[derive(Debug)]
pub struct Upload {
    bytes: Vec<u8>,
    held: BytesHeld,
    limit: u64,
}

impl Upload {
    /// Makes sure that `bytes` more would be taken, and takes them from the budget.
    ///
    /// # Errors
    /// The upload would be over its limit, or the budget is used up.
    pub fn expect(&mut self, bytes: u64) -> Result<(), ServiceError> {
        let total = (self.bytes.len() as u64).saturating_add(bytes);
        if total > self.limit {
            return Err(ServiceError::new(
                ErrorKind::BodyTooLarge,
                format!("the body has more than {} bytes: thin the cloud out", self.limit),
            ));
        }
        self.held.grow_to(total)?;
        // what is announced is in the budget, so it may be reserved; it is not touched before it comes
        self.bytes.reserve(usize::try_from(bytes).unwrap_or_default());
        Ok(())
    }

    /// Adds the next bytes.
    ///
    /// # Errors
    /// The upload is over its limit, or the budget is used up.
    pub fn push(&mut self, chunk: &[u8]) -> Result<(), ServiceError> {
        self.expect(chunk.len() as u64)?;
        self.bytes.extend_from_slice(chunk);
        Ok(())
    }

    /// The bytes so far.
    pub fn bytes(&self) -> &[u8] {
        &self.bytes
    }
}
