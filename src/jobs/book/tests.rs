use std::sync::{
    Condvar,
    atomic::{AtomicUsize, Ordering},
};

use futures::FutureExt;

use super::*;
use crate::jobs::{ByteBudget, IdempotencyKey, JobState, MemoryStore, PoolConfig};

mod resumed;

/// What a store does when it is called.
#[derive(Clone, Debug, PartialEq)]
enum Does {
    Works,
    Blocks,
    Fails(StoreError),
    Panics,
}

/// A store in memory that works, blocks, fails and panics on demand.
#[derive(Debug)]
struct Moody {
    kept: MemoryStore,
    durable: bool,
    insert: Mood,
    finish: Mood,
    read: Mood,
    remove: Mood,
    begin: Mood,
    // the jobs that began to run and those that left, in their order
    begun: Mutex<Vec<Uuid>>,
    left: Mutex<Vec<Uuid>>,
}

#[derive(Debug)]
struct Mood {
    does: Mutex<Does>,
    changed: Condvar,
    calls: AtomicUsize,
}

impl Mood {
    fn new() -> Self {
        Self { does: Mutex::new(Does::Works), changed: Condvar::new(), calls: AtomicUsize::new(0) }
    }

    fn set(&self, does: Does) {
        *self.does.lock().unwrap() = does;
        self.changed.notify_all();
    }

    fn called(&self) -> Result<(), StoreError> {
        self.calls.fetch_add(1, Ordering::SeqCst);
        let does = self.does.lock().unwrap();
        let does = self.changed.wait_while(does, |does| *does == Does::Blocks).unwrap().clone();
        match does {
            Does::Fails(error) => Err(error),
            Does::Panics => panic!("a library gave up"),
            _ => Ok(()),
        }
    }

    /// Waits until it has been called `n` times.
    async fn called_times(&self, n: usize) {
        until(|| self.calls.load(Ordering::SeqCst) >= n).await;
    }
}

/// Waits until `done` says so.
async fn until(done: impl Fn() -> bool) {
    while !done() {
        tokio::time::sleep(Duration::from_millis(1)).await;
    }
}

impl Moody {
    fn new(durable: bool) -> Self {
        let [insert, finish, read, remove, begin] = [(); 5].map(|()| Mood::new());
        let (kept, begun, left) = (MemoryStore::default(), Mutex::default(), Mutex::default());
        Self { kept, durable, insert, finish, read, remove, begin, begun, left }
    }

    fn begun(&self) -> Vec<Uuid> {
        self.begun.lock().unwrap().clone()
    }

    fn left(&self) -> Vec<Uuid> {
        self.left.lock().unwrap().clone()
    }
}

impl Store for Moody {
    fn durable(&self) -> bool {
        self.durable
    }

    fn insert(&self, record: &JobRecord, input: Bytes) -> Result<(), StoreError> {
        self.insert.called()?;
        self.kept.insert(record, input)
    }

    fn begin(&self, record: &JobRecord) -> Result<(), StoreError> {
        self.begin.called()?;
        self.begun.lock().unwrap().push(record.id);
        Ok(())
    }

    fn leave(&self, id: Uuid) {
        self.left.lock().unwrap().push(id);
    }

    fn finish(&self, record: &JobRecord, result: Option<Bytes>) -> Result<(), StoreError> {
        self.finish.called()?;
        self.kept.finish(record, result)
    }

    fn remove(&self, id: Uuid) -> Result<(), StoreError> {
        self.remove.called()?;
        self.kept.remove(id)
    }

    fn records(&self) -> Result<Vec<JobRecord>, StoreError> {
        self.kept.records()
    }

    fn input(&self, id: Uuid) -> Result<Option<Bytes>, StoreError> {
        self.read.called()?;
        self.kept.input(id)
    }

    fn result(&self, id: Uuid) -> Result<Option<Bytes>, StoreError> {
        self.read.called()?;
        self.kept.result(id)
    }
}

/// Answers with the input's length; an input `wait` runs until it is cancelled.
#[derive(Debug)]
struct Lengths;

impl Runner for Lengths {
    fn run(
        &self,
        _record: &JobRecord,
        input: Bytes,
        control: &Control,
        _parts: Option<&dyn Parts>,
    ) -> Outcome {
        while input == "wait" && control.stop().is_none() {
            std::thread::sleep(Duration::from_millis(1));
        }
        match control.stop() {
            Some(stop) => Err(Fault { code: format!("{stop:?}"), detail: String::new() }),
            None => Ok(input.len().to_string().into()),
        }
    }

    fn run_part(
        &self,
        _guide: &[u8],
        part: &[u8],
        _is_over: &(dyn Fn() -> bool + Sync),
    ) -> Result<Bytes, String> {
        Ok(part.len().to_string().into())
    }

    fn time_for(&self, _record: &JobRecord) -> Duration {
        Duration::from_secs(60)
    }

    fn fault(&self, error: &PoolError) -> Fault {
        Fault { code: "internal".to_owned(), detail: error.to_string() }
    }

    fn store_fault(&self, error: &StoreError) -> Fault {
        Fault { code: "storage".to_owned(), detail: error.to_string() }
    }
}

struct Bench {
    book: Arc<Book>,
    store: Arc<Moody>,
    budget: ByteBudget,
}

const CONFIG: BookConfig = BookConfig {
    result_ttl: Duration::from_secs(3600),
    result_bytes: 1 << 20,
    key_share: KeyShare::ALL,
    max_crashes: 3,
};

fn book(store: &Arc<Moody>) -> Arc<Book> {
    let pool =
        Pool::new(PoolConfig { threads: 1, queue: 4, small_points: 100 }, KeyShare::ALL).unwrap();
    let keeping = Keeping::Own(Arc::<Moody>::clone(store));
    // nothing of a store of this process is waited for
    let opened = Book::open(CONFIG, Arc::new(pool), keeping, Arc::new(Lengths)).now_or_never();
    opened.unwrap().unwrap()
}

fn bench() -> Bench {
    let store = Arc::new(Moody::new(true));
    Bench { book: book(&store), store, budget: ByteBudget::new(1000, KeyShare::ALL) }
}

impl Bench {
    /// Submits `input` under the idempotency key `k`.
    async fn submit(&self, input: &'static [u8]) -> Result<(Arc<Job>, bool), SubmitError> {
        let key = IdempotencyKey { key: "k".to_owned(), fingerprint: String::new() };
        let submission = Submission { idempotency: Some(key), ..Submission::default() };
        let held = self.budget.share();
        held.grow_to(input.len() as u64).unwrap();
        self.book.submit(submission, Bytes::from_static(input), held).await
    }

    /// Submits `input` and goes away while it is being kept.
    async fn submit_and_go(&self, input: &'static [u8]) {
        self.store.insert.set(Does::Blocks);
        let calls = self.store.insert.calls.load(Ordering::SeqCst);
        tokio::select! {
            _ = self.submit(input) => panic!("the insert blocks"),
            () = self.store.insert.called_times(calls + 1) => {}
        }
    }

    /// Waits until nothing is left of any job but what is kept.
    async fn rest(&self) {
        until(|| self.budget.held() == 0 && self.book.pool.queued() == 0).await;
    }
}

async fn last(job: &Arc<Job>) -> JobRecord {
    use futures::StreamExt;
    job.watch().map(|view| view.record).collect::<Vec<_>>().await.pop().unwrap()
}

fn full() -> StoreError {
    StoreError::Full("no space left".to_owned())
}

#[tokio::test]
async fn a_caller_that_goes_away_during_the_insert_leaves_a_whole_job() {
    let bench = bench();
    bench.submit_and_go(b"abc").await;
    let retry = async {
        let retried = bench.submit(b"abc").await.unwrap();
        assert!(!retried.1);
        last(&retried.0).await
    };
    let release = async {
        tokio::task::yield_now().await;
        bench.store.insert.set(Does::Works);
    };
    let (record, ()) = tokio::join!(retry, release);
    assert_eq!((record.state, record.result_bytes), (JobState::Succeeded, 1));
    bench.rest().await;
}

#[tokio::test]
async fn a_retry_during_an_insert_that_fails_gets_the_same_error_and_the_next_one_a_new_job() {
    let bench = bench();
    for does in [Does::Fails(full()), Does::Panics] {
        bench.submit_and_go(b"abc").await;
        let (retried, ()) = tokio::join!(bench.submit(b"abc"), async {
            tokio::task::yield_now().await;
            bench.store.insert.set(does.clone());
        });
        let error = retried.unwrap_err();
        assert!(matches!(error, SubmitError::Store(_)), "{error:?}");
        bench.rest().await;
        assert_eq!(bench.book.jobs().ids().count(), 0);
    }
    bench.store.insert.set(Does::Works);
    let (job, is_new) = bench.submit(b"abc").await.unwrap();
    assert!(is_new);
    assert_eq!(last(&job).await.state, JobState::Succeeded);
}

#[tokio::test]
async fn a_job_that_is_being_kept_is_seen_by_nobody() {
    let bench = bench();
    bench.submit_and_go(b"abc").await;
    let ids: Vec<_> = bench.book.jobs().ids().collect();
    assert_eq!((ids.len(), bench.book.find(ids[0], None).is_none()), (1, true));
    bench.store.insert.set(Does::Works);
    until(|| bench.book.find(ids[0], None).is_some()).await;
}

#[tokio::test]
async fn an_input_that_is_missing_or_damaged_fails_the_job() {
    let id = Uuid::nil();
    for does in [Does::Works, Does::Fails(StoreError::Damaged { part: "input", id })] {
        let bench = bench();
        bench.submit_and_go(b"abc").await;
        bench.store.read.set(Does::Blocks);
        bench.store.insert.set(Does::Works);
        let (job, _) = bench.submit(b"abc").await.unwrap();
        bench.store.kept.remove(job.record().id).unwrap();
        bench.store.read.set(does);
        let record = last(&job).await;
        assert_eq!(
            (record.state, record.fault.unwrap().code.as_str()),
            (JobState::Failed, "storage")
        );
        bench.rest().await;
    }
}

#[tokio::test]
async fn a_result_that_the_store_has_lost_is_an_error_and_a_panic_no_missing_one() {
    let bench = bench();
    let (job, _) = bench.submit(b"abc").await.unwrap();
    let id = last(&job).await.id;
    assert_eq!(bench.book.result(id).await.unwrap().as_deref(), Some(b"3".as_slice()));
    bench.store.read.set(Does::Panics);
    assert!(matches!(bench.book.result(id).await, Err(StoreError::Failed(_))));
    bench.store.read.set(Does::Works);
    bench.store.kept.remove(id).unwrap();
    let lost = StoreError::Missing { part: "result", id };
    assert_eq!(bench.book.result(id).await, Err(lost));
}

#[tokio::test]
async fn a_full_disk_is_waited_for_and_the_job_ends_when_there_is_room() {
    let bench = bench();
    bench.store.finish.set(Does::Fails(full()));
    let (job, _) = bench.submit(b"abc").await.unwrap();
    // far more often than another failure is borne
    bench.store.finish.called_times(3 * 6).await;
    assert_eq!(job.record().state, JobState::Running);
    assert!(bench.budget.held() >= 4, "the result that waits is counted");
    bench.store.finish.set(Does::Works);
    assert_eq!(last(&job).await.state, JobState::Succeeded);
    assert_eq!(bench.book.result(job.record().id).await.unwrap().unwrap(), "3");
    bench.rest().await;
}

#[tokio::test]
async fn no_run_begins_while_an_end_waits_for_the_disk() {
    let bench = bench();
    bench.store.finish.set(Does::Fails(full()));
    let (first, _) = bench.submit(b"abc").await.unwrap();
    bench.store.finish.called_times(2).await;
    let held = bench.budget.share();
    let submitted = bench.book.submit(Submission::default(), Bytes::from_static(b"abcd"), held);
    let (second, _) = submitted.await.unwrap();
    bench.store.finish.called_times(20).await;
    assert_eq!(second.record().state, JobState::Queued);
    bench.store.finish.set(Does::Works);
    assert_eq!(last(&first).await.state, JobState::Succeeded);
    assert_eq!(last(&second).await.state, JobState::Succeeded);
}

#[tokio::test]
async fn a_store_that_goes_wrong_fails_its_jobs_and_has_them_after_a_restart() {
    for reads in [false, true] {
        let bench = bench();
        let mood = if reads { &bench.store.read } else { &bench.store.finish };
        mood.set(Does::Fails(StoreError::Failed("no such device".to_owned())));
        let (job, _) = bench.submit(b"abc").await.unwrap();
        let record = last(&job).await;
        assert_eq!(
            (record.state, record.fault.unwrap().code.as_str()),
            (JobState::Failed, "storage")
        );
        bench.rest().await;
        mood.set(Does::Works);
        let again = book(&bench.store).find(record.id, None).unwrap();
        assert_eq!(last(&again).await.state, JobState::Succeeded);
    }
}

#[tokio::test]
async fn a_cancelled_job_ends_as_such_when_the_disk_has_room() {
    let bench = bench();
    bench.store.finish.set(Does::Fails(full()));
    let (job, _) = bench.submit(b"wait").await.unwrap();
    assert_eq!(bench.book.cancel(Arc::clone(&job)).await, Err(full()));
    bench.store.finish.set(Does::Works);
    assert_eq!(last(&job).await.state, JobState::Cancelled);
    bench.rest().await;
}

#[tokio::test]
async fn a_cancelled_run_holds_its_share_until_it_has_left_the_threads() {
    let bench = bench();
    bench.store.read.set(Does::Blocks);
    let (job, _) = bench.submit(b"abc").await.unwrap();
    bench.store.read.called_times(1).await;
    bench.book.cancel(Arc::clone(&job)).await.unwrap();
    // its task is done with it, its run is not
    until(|| bench.book.tasks.is_empty() || Arc::strong_count(&job) <= 3).await;
    assert_eq!(bench.budget.held(), 3);
    bench.store.read.set(Does::Works);
    bench.rest().await;
}

#[tokio::test]
async fn a_job_forgotten_while_it_runs_leaves_nothing_in_the_store() {
    let bench = bench();
    let (job, _) = bench.submit(b"wait").await.unwrap();
    until(|| job.record().state == JobState::Running).await;
    bench.book.cancel(Arc::clone(&job)).await.unwrap();
    bench.book.cancel(Arc::clone(&job)).await.unwrap();
    bench.rest().await;
    assert!(bench.book.find(job.record().id, None).is_none());
    assert_eq!(bench.store.records().unwrap(), []);
}

#[tokio::test]
async fn a_job_that_the_store_does_not_let_go_stays_until_it_does() {
    let bench = bench();
    let (job, _) = bench.submit(b"abc").await.unwrap();
    last(&job).await;
    bench.store.remove.set(Does::Fails(full()));
    assert_eq!(bench.book.cancel(Arc::clone(&job)).await, Err(full()));
    let id = job.record().id;
    assert!(bench.book.find(id, None).is_some());
    // and its key is still its own
    assert_eq!(bench.submit(b"abc").await.unwrap().0.record().id, id);
    bench.store.remove.set(Does::Works);
    bench.book.cancel(Arc::clone(&job)).await.unwrap();
    assert!(bench.book.find(id, None).is_none() && bench.store.records().unwrap().is_empty());
}

#[tokio::test]
async fn a_drain_waits_for_what_is_being_kept_in_memory() {
    let mut bench = bench();
    let store = Arc::get_mut(&mut bench.store);
    assert!(store.is_none(), "the book has it too");
    let store = Arc::new(Moody::new(false));
    let bench = Bench { book: book(&store), store, budget: ByteBudget::new(1000, KeyShare::ALL) };
    bench.submit_and_go(b"abc").await;
    let ids: Vec<_> = bench.book.jobs().ids().collect();
    tokio::join!(bench.book.drain(), async {
        tokio::task::yield_now().await;
        bench.store.insert.set(Does::Works);
    });
    let state = bench.book.find(ids[0], None).unwrap().record().state;
    assert_eq!(state, JobState::Succeeded);
}
