//! What an earlier process has left.

use std::sync::{Arc, Mutex};

use tokio::sync::watch;
use tokio_util::{sync::CancellationToken, task::TaskTracker};

use super::{Book, BookConfig, Runner};
use crate::jobs::{Ending, Job, Pool, PoolError, Store, StoreError, register::Register};

/// A job that so many processes ended on is not run again. The first time another job beside it may have
/// been the cause, the second, alone, chance: a machine short of memory, a loss of power. The third is
/// the job's.
pub(super) const MOST_CRASHES: u32 = 3;

impl Book {
    /// The jobs of `store`; those that had not ended are queued again. Must be called within a tokio
    /// runtime.
    ///
    /// # Errors
    /// The store fails.
    pub fn open(
        config: BookConfig,
        pool: Arc<Pool>,
        store: Arc<dyn Store>,
        runner: Arc<dyn Runner>,
    ) -> Result<Arc<Self>, StoreError> {
        let records = store.records()?;
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
            runner,
            jobs,
            tasks,
            probing,
            closing,
            unwritten,
            company,
        });
        book.resume(unfinished);
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
            if crashes >= MOST_CRASHES {
                tracing::error!(job_id = %id, crashes, "a job is not run again: the process ended on it");
                let fault = self.runner.fault(&PoolError::Crashed { times: crashes });
                self.spawn(&job, async move { book.see_ended(&own, Ending::Failed(fault)).await });
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
}
