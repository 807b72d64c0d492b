use std::{
    any::Any,
    panic::{AssertUnwindSafe, catch_unwind},
    sync::{
        Arc, Mutex, PoisonError,
        atomic::{AtomicU64, Ordering},
    },
    time::Instant,
};

use rayon::{ThreadPool, ThreadPoolBuilder};
use tokio::sync::{AcquireError, OwnedSemaphorePermit, Semaphore, oneshot};

use super::trace;

/// How much the pool does at one time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PoolConfig {
    /// Threads of each lane.
    pub threads: usize,
    /// Runs that may wait for their turn, over both lanes.
    pub queue: usize,
    /// Clouds of up to this many points take the small lane.
    pub small_points: u64,
}

/// Which threads a run takes. The lanes share the processors evenly, so a small input never waits
/// for a huge one to end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Lane {
    /// Many runs at once, each on one thread: the most runs a second.
    Small,
    /// One run at a time, on all threads: the least time for a large cloud.
    Large,
}

impl Lane {
    fn name(self) -> &'static str {
        match self {
            Self::Small => "small",
            Self::Large => "large",
        }
    }
}

/// There is no room; try again later.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Overloaded {
    /// The queue is full.
    #[error("all {limit} places of the queue are taken")]
    Queue {
        /// Places in the queue.
        limit: usize,
    },
    /// Too many bytes of uploads are held.
    #[error("the uploads at hand have used up the budget of {limit} bytes")]
    Bytes {
        /// The budget.
        limit: u64,
    },
}

/// A run that gave no answer.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum PoolError {
    /// The work panicked.
    #[error("the work panicked: {0}")]
    Panicked(String),
    /// The pool is closing.
    #[error("the pool is closed")]
    Closed,
}

/// A place in the queue, kept until the run begins.
#[derive(Debug)]
pub struct Place(#[expect(dead_code, reason = "held for its drop")] OwnedSemaphorePermit);

/// The threads that segment, behind a bounded queue.
#[derive(Debug)]
pub struct Pool {
    config: PoolConfig,
    queue: Arc<Semaphore>,
    begun: AtomicU64,
    small: LaneThreads,
    large: LaneThreads,
}

/// The thread pools of one lane; one run has one pool to itself.
#[derive(Debug)]
struct LaneThreads {
    turns: Arc<Semaphore>,
    idle: Arc<Mutex<Vec<Arc<ThreadPool>>>>,
}

impl Pool {
    /// Starts the threads.
    ///
    /// # Errors
    /// The system gives no more threads.
    pub fn new(config: PoolConfig) -> Result<Self, rayon::ThreadPoolBuildError> {
        Ok(Self {
            config,
            queue: Arc::new(Semaphore::new(config.queue)),
            begun: AtomicU64::new(0),
            small: LaneThreads::new("small", config.threads, 1)?,
            large: LaneThreads::new("large", 1, config.threads)?,
        })
    }

    /// The lane for a cloud of that many points.
    pub fn lane(&self, points: u64) -> Lane {
        if points <= self.config.small_points { Lane::Small } else { Lane::Large }
    }

    /// Runs that wait for their turn.
    pub fn queued(&self) -> usize {
        self.config.queue - self.queue.available_permits()
    }

    /// Runs that have begun since the start.
    pub fn begun(&self) -> u64 {
        self.begun.load(Ordering::Relaxed)
    }

    /// Takes a place in the queue, at once or not at all.
    ///
    /// # Errors
    /// The queue is full.
    pub fn admit(&self) -> Result<Place, Overloaded> {
        let place = Arc::clone(&self.queue).try_acquire_owned();
        place.map(Place).map_err(|_| Overloaded::Queue { limit: self.config.queue })
    }

    /// Waits for a turn and does `work` on the lane's threads, within the caller's spans.
    ///
    /// Dropping the future while it waits leaves the queue; once begun, the work runs to its end, so
    /// it should watch a [`super::Control`].
    ///
    /// # Errors
    /// The work panicked, or the pool is closing.
    pub async fn run<T: Send + 'static>(
        &self,
        place: Option<Place>,
        lane: Lane,
        work: impl FnOnce() -> T + Send + 'static,
    ) -> Result<T, PoolError> {
        let threads = match lane {
            Lane::Small => &self.small,
            Lane::Large => &self.large,
        };
        let waiting = Instant::now();
        let turn = threads.turn().await.map_err(|_| PoolError::Closed)?;
        drop(place);
        self.begun.fetch_add(1, Ordering::Relaxed);
        metrics::histogram!("conicoid_wait_seconds", "lane" => lane.name())
            .record(waiting.elapsed());
        let (answer, answered) = oneshot::channel();
        let scope = trace::Scope::current();
        turn.spawn(move || {
            let running = Instant::now();
            let done = catch_unwind(AssertUnwindSafe(|| scope.enter(work)));
            metrics::histogram!("conicoid_run_seconds", "lane" => lane.name())
                .record(running.elapsed());
            // nobody listens when the caller has gone away
            let _ = answer.send(done.map_err(|panic| PoolError::Panicked(message(&*panic))));
        });
        answered.await.map_err(|_| PoolError::Closed)?
    }
}

impl LaneThreads {
    fn new(
        name: &'static str,
        pools: usize,
        threads: usize,
    ) -> Result<Self, rayon::ThreadPoolBuildError> {
        let build = |_| {
            let name = move |i| format!("{name}-{i}");
            ThreadPoolBuilder::new().num_threads(threads).thread_name(name).build().map(Arc::new)
        };
        let idle = (0..pools).map(build).collect::<Result<Vec<_>, _>>()?;
        Ok(Self { turns: Arc::new(Semaphore::new(pools)), idle: Arc::new(Mutex::new(idle)) })
    }

    async fn turn(&self) -> Result<Turn, AcquireError> {
        let permit = Arc::clone(&self.turns).acquire_owned().await?;
        let pool = self.idle.lock().unwrap_or_else(PoisonError::into_inner).pop();
        Ok(Turn { pool, idle: Arc::clone(&self.idle), _permit: permit })
    }
}

/// One pool, taken for one run.
struct Turn {
    pool: Option<Arc<ThreadPool>>,
    idle: Arc<Mutex<Vec<Arc<ThreadPool>>>>,
    _permit: OwnedSemaphorePermit,
}

impl Turn {
    fn spawn(mut self, work: impl FnOnce() + Send + 'static) {
        let Some(pool) = self.pool.take() else { return };
        let kept = Arc::clone(&pool);
        pool.spawn(move || {
            work();
            // back on the shelf before the permit of `self` lets the next run look there
            self.pool = Some(kept);
            drop(self);
        });
    }
}

impl Drop for Turn {
    fn drop(&mut self) {
        if let Some(pool) = self.pool.take() {
            self.idle.lock().unwrap_or_else(PoisonError::into_inner).push(pool);
        }
    }
}

fn message(panic: &(dyn Any + Send)) -> String {
    let text = panic.downcast_ref::<&str>().map(|s| (*s).to_owned());
    text.or_else(|| panic.downcast_ref::<String>().cloned()).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc;

    use super::*;

    fn pool(threads: usize, queue: usize) -> Arc<Pool> {
        Arc::new(Pool::new(PoolConfig { threads, queue, small_points: 10 }).unwrap())
    }

    #[tokio::test]
    async fn a_panic_is_an_error_and_the_pool_goes_on() {
        let pool = pool(1, 1);
        let failed = pool.run(None, Lane::Small, || panic!("no such luck")).await;
        assert_eq!(failed, Err::<(), _>(PoolError::Panicked("no such luck".into())));
        assert_eq!(pool.run(None, Lane::Small, || 7).await, Ok(7));
    }

    #[tokio::test]
    async fn a_full_queue_refuses_at_once_and_takes_again_when_a_place_is_free() {
        let pool = pool(1, 2);
        let first = pool.admit().unwrap();
        let _second = pool.admit().unwrap();
        assert_eq!(pool.admit().unwrap_err(), Overloaded::Queue { limit: 2 });
        assert_eq!(pool.queued(), 2);
        pool.run(Some(first), Lane::Large, || ()).await.unwrap();
        assert!(pool.admit().is_ok());
    }

    #[tokio::test]
    async fn a_small_run_does_not_wait_for_a_large_one() {
        let pool = pool(1, 4);
        let (release, wait) = mpsc::channel::<()>();
        let large = tokio::spawn({
            let pool = Arc::clone(&pool);
            async move { pool.run(None, pool.lane(11), move || wait.recv()).await }
        });
        assert_eq!(pool.run(None, pool.lane(10), || 1).await, Ok(1));
        release.send(()).unwrap();
        assert!(large.await.unwrap().unwrap().is_ok());
    }

    #[tokio::test]
    async fn the_large_lane_has_all_threads_and_the_small_one_each() {
        let pool = pool(2, 1);
        assert_eq!(pool.run(None, Lane::Large, rayon::current_num_threads).await, Ok(2));
        assert_eq!(pool.run(None, Lane::Small, rayon::current_num_threads).await, Ok(1));
    }
}
