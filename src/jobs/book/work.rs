//! Running the jobs that the queue hands out.

use std::{sync::Arc, time::Duration};

use tokio_util::{sync::CancellationToken, task::TaskTracker};

use super::{Book, drive, shared::Shared};
use crate::jobs::{
    Job, Lane,
    nats::{Claim, Delivery, PARTS_LANE},
};

/// Pause before a worker asks servers again that failed.
const PAUSE: Duration = Duration::from_millis(500);

/// Pause between two of a run's messages of progress: nobody sees more.
const PROGRESS_PAUSE: Duration = Duration::from_millis(100);
/// A worker that has asked in vain so often while jobs wait looks whether a server hands them out.
const MOST_VAIN: u32 = 5;
/// Looks in vain, each as long as an answer is waited for, after which no server will: the choice of a new
/// leader takes less.
const MOST_UNLED: u32 = 3;

/// Jobs of a lane that wait here for a turn, so that it need not wait for the next one. One in the small lane,
/// where a turn is short; behind a large cloud another worker may be idle.
const fn ahead(lane: Lane) -> usize {
    match lane {
        Lane::Small => 1,
        Lane::Large => 0,
    }
}

/// What is asked for.
#[derive(Clone, Copy, Debug)]
enum Wanted {
    Jobs(Lane),
    Parts,
}

impl Wanted {
    fn lane(self) -> &'static str {
        match self {
            Self::Jobs(lane) => lane.name(),
            Self::Parts => PARTS_LANE,
        }
    }
}

/// The work on the queue.
#[derive(Debug)]
pub struct Work {
    asking: TaskTracker,
    stop: CancellationToken,
    cut: CancellationToken,
}

impl Work {
    /// Takes no more jobs; those under way get `time` to end, and then are given to other workers.
    pub async fn end(self, time: Duration) {
        self.stop.cancel();
        self.asking.close();
        if tokio::time::timeout(time, self.asking.wait()).await.is_err() {
            tracing::warn!("the drain deadline passed with jobs under way: other workers run them");
            self.cut.cancel();
            self.asking.wait().await;
        }
    }
}

impl Book {
    /// Begins to run the jobs of the queue, as many at one time as the pool has turns, and has one small one
    /// at hand; nothing where the jobs are this process's own.
    pub fn work(self: &Arc<Self>) -> Option<Work> {
        self.shared.as_ref()?;
        let (asking, stop, cut) =
            (TaskTracker::new(), CancellationToken::new(), CancellationToken::new());
        let of_jobs = |lane| (Wanted::Jobs(lane), self.pool.turns(lane) + ahead(lane));
        // parts take the turns of small clouds, and one thread each
        let of_parts = (Wanted::Parts, self.pool.turns(Lane::Small));
        for (wanted, times) in Lane::ALL.map(of_jobs).into_iter().chain([of_parts]) {
            for _ in 0..times {
                let (book, stop, cut) = (Arc::clone(self), stop.clone(), cut.clone());
                asking.spawn(async move { book.ask(wanted, &stop, &cut).await });
            }
        }
        Some(Work { asking, stop, cut })
    }

    /// Asks for what is wanted and works on each, one after the other.
    async fn ask(
        self: &Arc<Self>,
        wanted: Wanted,
        stop: &CancellationToken,
        cut: &CancellationToken,
    ) {
        let Some(shared) = &self.shared else { return };
        let (mut consumer, mut vain, mut unled) = (None, 0, 0);
        while !stop.is_cancelled() {
            let asked = async {
                if consumer.is_none() {
                    consumer = Some(shared.nats().queue().consumer(wanted.lane()).await?);
                    unled = 0;
                }
                match &consumer {
                    Some(consumer) => shared.nats().queue().next(consumer).await,
                    None => Ok(None),
                }
            };
            match asked.await {
                Ok(Some(delivery)) if stop.is_cancelled() => delivery.later(Duration::ZERO).await,
                Ok(Some(delivery)) => {
                    vain = 0;
                    match wanted {
                        Wanted::Jobs(_) => self.work_on(shared, delivery, cut).await,
                        Wanted::Parts => self.work_on_part(shared, delivery, cut).await,
                    }
                }
                Ok(None) if self.waiting() > 0 => {
                    vain += 1;
                    if vain == MOST_VAIN {
                        (consumer, vain) = (None, 0);
                    }
                }
                Ok(None) => vain = 0,
                Err(error) => {
                    tracing::debug!(%error, "no job can be asked for");
                    if consumer.is_none() && shared.nats().is_connected() {
                        unled += 1;
                    }
                    if unled == MOST_UNLED {
                        unled = 0;
                        tracing::warn!(
                            lane = wanted.lane(),
                            "no server hands out jobs: begun anew"
                        );
                        // where it fails, it is tried again
                        let _ = shared.nats().queue().drop_consumer(wanted.lane()).await;
                    }
                    consumer = None;
                    tokio::select! {
                        () = stop.cancelled() => {}
                        () = tokio::time::sleep(PAUSE) => {}
                    }
                }
            }
        }
    }

    /// Sees a job through that was handed to this worker.
    async fn work_on(
        self: &Arc<Self>,
        shared: &Shared,
        delivery: Delivery,
        cut: &CancellationToken,
    ) {
        let nats = shared.nats();
        let Some(id) = delivery.job() else { return delivery.refuse().await };
        let kept = delivery.keep();
        let record = match nats.claim(id).await {
            Ok(Claim::Run(record)) => *record,
            Ok(Claim::Over) => return delivery.done().await,
            Ok(Claim::Elsewhere) => return delivery.later(nats.config().ack_wait).await,
            Err(error) if error.may_pass() => return delivery.later(PAUSE).await,
            Err(error) => {
                // nobody can do anything with it
                tracing::error!(%error, job_id = %id, "a job of the queue cannot be read");
                return delivery.done().await;
            }
        };
        let Some(at_work) = nats.at_work(id) else {
            return delivery.later(nats.config().ack_wait).await;
        };
        if delivery.times > 1 {
            metrics::counter!("conicoid_redeliveries_total").increment(1);
        }
        let job = {
            let mut jobs = self.jobs();
            match jobs.get(id) {
                Some(job) => job,
                None => {
                    let job = Job::new(record.clone());
                    job.admit(Ok(()));
                    jobs.add(Arc::clone(&job));
                    jobs.note(&record);
                    job
                }
            }
        };
        job.follow(Some(&record));
        let own = Arc::clone(&job);
        let told = {
            let (nats, job) = (Arc::clone(nats), Arc::clone(&job));
            tokio_util::task::AbortOnDropHandle::new(tokio::spawn(async move {
                let mut progress = job.control().watch();
                while progress.changed().await.is_ok() {
                    let now = *progress.borrow_and_update();
                    if let Some(now) = now {
                        nats.tell_progress(id, now).await;
                    }
                    tokio::time::sleep(PROGRESS_PAUSE).await;
                }
            }))
        };
        let run = drive::scope(&job).cover(self.see_through(own, record.crashes));
        tokio::select! {
            () = run => {}
            () = cut.cancelled() => {
                job.control().cancel();
                if let Err(error) = nats.give_back(id).await {
                    tracing::warn!(%error, job_id = %id, "a job cannot be given back");
                }
            }
        }
        drop((told, at_work, kept));
        if job.peek(|record| record.state.is_final()) {
            delivery.done().await;
        } else {
            delivery.later(PAUSE).await;
        }
    }

    /// Runs a job to its end, unless it has ended too many workers.
    async fn see_through(self: &Arc<Self>, job: Arc<Job>, crashes: u32) {
        if crashes >= self.config.max_crashes {
            metrics::counter!("conicoid_poison_jobs_total").increment(1);
            return self.refuse(&job, crashes).await;
        }
        Arc::clone(self).drive(job, None, None).await;
    }
}
