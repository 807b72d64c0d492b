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

use super::{KeyShare, tally::Tally, trace};

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
    /// Both lanes.
    pub const ALL: [Self; 2] = [Self::Small, Self::Large];

    /// Its name in metrics and queues.
    pub fn name(self) -> &'static str {
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
    /// One key has too many places in the queue.
    #[error("this key has taken what one key may have of the queue: {limit}")]
    KeyQueue {
        /// Places of one key.
        limit: u64,
    },
    /// Too many bytes of one key are held.
    #[error("this key's uploads and answers at hand have used up its {limit} bytes")]
    KeyBytes {
        /// The budget of one key.
        limit: u64,
    },
    /// The servers that keep the jobs are as full as they may be.
    #[error("the jobs and results that are kept have used up {limit} bytes")]
    Storage {
        /// What may be kept.
        limit: u64,
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
    /// The process has ended each time the work was begun.
    #[error("the process ended {times} times while the work ran")]
    Crashed {
        /// How often.
        times: u32,
    },
}

/// A place in the queue, kept until the run begins.
#[derive(Debug)]
pub struct Place {
    _permit: OwnedSemaphorePermit,
    owner: Option<String>,
    keys: Arc<Tally>,
}

impl Drop for Place {
    fn drop(&mut self) {
        self.keys.give_back(self.owner.as_deref(), 1);
    }
}

/// The threads that segment, behind a bounded queue.
#[derive(Debug)]
pub struct Pool {
    config: PoolConfig,
    queue: Arc<Semaphore>,
    // places that each key has
    keys: Arc<Tally>,
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
    /// Starts the threads; one key may take `share` of the queue.
    ///
    /// # Errors
    /// The system gives no more threads.
    pub fn new(
        mut config: PoolConfig,
        share: KeyShare,
    ) -> Result<Self, rayon::ThreadPoolBuildError> {
        // more than there can ever be
        config.queue = config.queue.min(Semaphore::MAX_PERMITS);
        Ok(Self {
            config,
            queue: Arc::new(Semaphore::new(config.queue)),
            keys: Tally::new(share.of(config.queue as u64)),
            begun: AtomicU64::new(0),
            small: LaneThreads::new("small", config.threads, 1)?,
            large: LaneThreads::new("large", 1, config.threads)?,
        })
    }

    /// Runs that a lane does at one time.
    pub fn turns(&self, lane: Lane) -> usize {
        match lane {
            Lane::Small => self.config.threads,
            Lane::Large => 1,
        }
    }

    /// The settings.
    pub fn config(&self) -> &PoolConfig {
        &self.config
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

    /// Takes a place in the queue for `owner`, at once or not at all.
    ///
    /// # Errors
    /// The queue is full, or this owner has its share of it.
    pub fn admit(&self, owner: Option<&str>) -> Result<Place, Overloaded> {
        let permit = Arc::clone(&self.queue).try_acquire_owned();
        let permit = permit.map_err(|_| Overloaded::Queue { limit: self.config.queue })?;
        if !self.keys.take(owner, 1) {
            return Err(Overloaded::KeyQueue { limit: self.keys.limit() });
        }
        let (owner, keys) = (owner.map(str::to_owned), Arc::clone(&self.keys));
        Ok(Place { _permit: permit, owner, keys })
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

/// What a panic says.
pub fn message(panic: &(dyn Any + Send)) -> String {
    let text = panic.downcast_ref::<&str>().map(|s| (*s).to_owned());
    text.or_else(|| panic.downcast_ref::<String>().cloned()).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc;

    use super::*;

    fn pool(threads: usize, queue: usize) -> Arc<Pool> {
        let config = PoolConfig { threads, queue, small_points: 10 };
        Arc::new(Pool::new(config, KeyShare(0.5)).unwrap())
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
        let first = pool.admit(None).unwrap();
        let _second = pool.admit(None).unwrap();
        assert_eq!(pool.admit(None).unwrap_err(), Overloaded::Queue { limit: 2 });
        assert_eq!(pool.queued(), 2);
        pool.run(Some(first), Lane::Large, || ()).await.unwrap();
        assert!(pool.admit(None).is_ok());
    }

    #[tokio::test]
    async fn a_key_takes_its_share_of_the_queue_and_leaves_the_rest() {
        let pool = pool(1, 4);
        let places = [(); 2].map(|()| pool.admit(Some("a")).unwrap());
        assert_eq!(pool.admit(Some("a")).unwrap_err(), Overloaded::KeyQueue { limit: 2 });
        let _others = [pool.admit(Some("b")).unwrap(), pool.admit(None).unwrap()];
        assert_eq!(pool.admit(Some("b")).unwrap_err(), Overloaded::Queue { limit: 4 });
        drop(places);
        assert!(pool.admit(Some("a")).is_ok() && pool.admit(Some("b")).is_ok());
    }

    #[tokio::test]
    async fn a_queue_may_be_as_long_as_numbers_go() {
        assert!(pool(1, usize::MAX).admit(None).is_ok());
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
