//! What an earlier process has left.

use std::sync::{Arc, Mutex};

use tokio::sync::watch;
use tokio_util::{sync::CancellationToken, task::TaskTracker};

use super::{Book, BookConfig, Keeping, Runner, Shared};
use crate::jobs::{Ending, Job, Nats, Pool, PoolError, Store, StoreError, register::Register};

impl Book {
    /// The jobs that are kept; those of a store of this process that had not ended are queued again.
    ///
    /// # Errors
    /// The store fails.
    pub async fn open(
        config: BookConfig,
        pool: Arc<Pool>,
        keeping: Keeping,
        runner: Arc<dyn Runner>,
    ) -> Result<Arc<Self>, StoreError> {
        let (store, shared): (Arc<dyn Store>, _) = match keeping {
            Keeping::Own(store) => (store, None),
            Keeping::Shared(nats) => (Arc::<Nats>::clone(&nats), Some(Shared::new(nats))),
        };
        // those that are shared are told one by one
        let records = if shared.is_none() { store.records()? } else { Vec::new() };
        let mut register = Register::default();
        let mut unfinished = Vec::new();
        for record in records {
            let job = Job::new(record.clone());
            job.admit(Ok(()));
            register.add(Arc::clone(&job));
            if record.state.is_final() {
                register.ended(&record);
            } else {
                unfinished.push(job);
            }
        }
        let (jobs, tasks) = (Mutex::new(register), TaskTracker::new());
        let (probing, unwritten) = (Arc::default(), watch::Sender::new(0));
        let (closing, company) = (CancellationToken::new(), Arc::default());
        let book = Arc::new(Self {
            config,
            pool,
            store,
            shared,
            runner,
            jobs,
            tasks,
            probing,
            closing,
            unwritten,
            company,
        });
        match &book.shared {
            Some(shared) => book.follow(shared).await?,
            None => book.resume(unfinished),
        }
        Ok(book)
    }

    /// Sees jobs through that an earlier process accepted, so that they need no place in the queue. Those
    /// at work when a process ended come after the others, one by one and the one with most such ends
    /// last, so that the job that ends the process does not keep the others from their end.
    fn resume(self: &Arc<Self>, mut unfinished: Vec<Arc<Job>>) {
        // in the order of acceptance where nothing speaks against it
        unfinished.sort_by_key(|job| job.record().crashes);
        let mut before = TaskTracker::new();
        for job in unfinished {
            let (book, own) = (Arc::clone(self), Arc::clone(&job));
            let crashes = job.record().crashes;
            if crashes == 0 {
                self.spawn(&job, before.track_future(book.drive(own, None, None)));
                continue;
            }
            let id = job.record().id;
            if crashes >= self.config.max_crashes {
                self.spawn(&job, async move { book.refuse(&own, crashes).await });
                continue;
            }
            tracing::warn!(job_id = %id, crashes, "the process ended while a job ran: it runs again, alone");
            let earlier = std::mem::take(&mut before);
            earlier.close();
            let turn = async move {
                earlier.wait().await;
                book.drive(own, None, None).await;
            };
            self.spawn(&job, before.track_future(turn));
        }
    }

    /// Fails a job that has ended too many processes.
    pub(super) async fn refuse(self: &Arc<Self>, job: &Arc<Job>, crashes: u32) {
        let id = job.peek(|record| record.id);
        tracing::error!(job_id = %id, crashes, "a job is not run again: processes ended on it");
        let fault = self.runner.fault(&PoolError::Crashed { times: crashes });
        self.see_ended(job, Ending::Failed(fault)).await;
    }
}
