use std::{
    collections::{BTreeMap, HashMap},
    sync::Arc,
};

use uuid::Uuid;

use super::{Job, JobRecord, SubmitError};

/// The jobs of a book, found by id and by their owner's idempotency key, and the ended ones in the
/// order in which they are forgotten. Every call takes the time of a look-up, however many there are.
#[derive(Debug, Default)]
pub struct Register {
    by_id: HashMap<Uuid, Arc<Job>>,
    by_key: HashMap<(Option<String>, String), Uuid>,
    // when each ended, and what it keeps
    ended: BTreeMap<(u64, Uuid), u64>,
    kept_bytes: u64,
}

/// The owner and the idempotency key of a job that has one.
fn key_of(record: &JobRecord) -> Option<(Option<String>, String)> {
    let idempotency = record.idempotency.as_ref()?;
    Some((record.owner.clone(), idempotency.key.clone()))
}

impl Register {
    /// Adds a job; an idempotency key stays with the job that has it.
    pub fn add(&mut self, job: Arc<Job>) {
        let record = job.record();
        if let Some(key) = key_of(&record) {
            self.by_key.entry(key).or_insert(record.id);
        }
        self.by_id.insert(record.id, job);
    }

    /// The job of that id.
    pub fn get(&self, id: Uuid) -> Option<Arc<Job>> {
        self.by_id.get(&id).map(Arc::clone)
    }

    /// The names of all jobs.
    #[cfg(test)]
    pub fn ids(&self) -> impl Iterator<Item = Uuid> {
        self.by_id.keys().copied()
    }

    /// The job its owner has submitted under the same idempotency key, where there is one.
    ///
    /// # Errors
    /// The key was used for something else.
    pub fn same(&self, new: &JobRecord) -> Result<Option<Arc<Job>>, SubmitError> {
        let first = key_of(new).and_then(|key| self.get(*self.by_key.get(&key)?));
        let Some(first) = first else { return Ok(None) };
        match &new.idempotency {
            Some(wanted) if first.record().idempotency.as_ref() != Some(wanted) => {
                Err(SubmitError::KeyReused(wanted.key.clone()))
            }
            _ => Ok(Some(first)),
        }
    }

    /// The job has ended: from now on it can expire.
    pub fn ended(&mut self, record: &JobRecord) {
        let Some(finished) = record.finished_ms else { return };
        // one that was forgotten while it ended does not come back
        if self.by_id.contains_key(&record.id) {
            let bytes = record.kept_bytes();
            let before = self.ended.insert((finished, record.id), bytes).unwrap_or(0);
            self.kept_bytes += bytes - before;
        }
    }

    /// Removes a job, and returns it where it was there.
    pub fn remove(&mut self, id: Uuid) -> Option<Arc<Job>> {
        let job = self.by_id.remove(&id)?;
        let record = job.record();
        if let Some(key) = key_of(&record).filter(|key| self.by_key.get(key) == Some(&id)) {
            self.by_key.remove(&key);
        }
        let ended = record.finished_ms.and_then(|finished| self.ended.remove(&(finished, id)));
        self.kept_bytes -= ended.unwrap_or(0);
        Some(job)
    }

    /// The job that is to be forgotten next: one that ended by `latest_ms`, or the oldest where more
    /// than `most_bytes` are kept.
    pub fn expired(&self, latest_ms: u64, most_bytes: u64) -> Option<Uuid> {
        let (&(finished, id), _) = self.ended.first_key_value()?;
        (finished <= latest_ms || self.kept_bytes > most_bytes).then_some(id)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::jobs::{IdempotencyKey, JobState, Submission};

    fn job(owner: &str, key: &str, fingerprint: &str) -> Arc<Job> {
        let idempotency =
            IdempotencyKey { key: key.to_owned(), fingerprint: fingerprint.to_owned() };
        let submission = Submission {
            owner: Some(owner.to_owned()),
            idempotency: Some(idempotency),
            ..Submission::default()
        };
        Job::new(JobRecord::new(submission, 100))
    }

    #[test]
    fn a_key_is_its_owners_and_stands_for_one_content() {
        let mut register = Register::default();
        let first = job("a", "k", "1");
        register.add(Arc::clone(&first));
        let same = |job: Arc<Job>| register.same(&job.record()).map(|j| j.map(|j| j.record().id));
        assert_eq!(same(job("a", "k", "1")).unwrap(), Some(first.record().id));
        assert_eq!(same(job("b", "k", "1")).unwrap(), None);
        assert_eq!(same(job("a", "l", "1")).unwrap(), None);
        assert!(matches!(same(job("a", "k", "2")), Err(SubmitError::KeyReused(_))));
        register.remove(first.record().id);
        assert!(register.same(&first.record()).unwrap().is_none() && register.by_key.is_empty());
    }

    #[test]
    fn ended_jobs_expire_by_time_and_by_bytes_the_oldest_first() {
        let mut register = Register::default();
        let jobs = ["1", "2", "3"].map(|key| job("a", key, ""));
        for (job, finished) in jobs.iter().zip([10, 20, 30]) {
            let mut record = job.record();
            (record.state, record.finished_ms) = (JobState::Succeeded, Some(finished));
            register.add(Job::new(record.clone()));
            register.ended(&record);
        }
        let each = jobs[0].record().kept_bytes();
        assert_eq!(register.expired(9, 3 * each), None);
        assert_eq!(register.expired(10, 3 * each), Some(jobs[0].record().id));
        assert_eq!(register.expired(0, 3 * each - 1), Some(jobs[0].record().id));
        register.remove(jobs[0].record().id);
        assert_eq!(register.expired(10, 2 * each), None);
        assert_eq!(register.kept_bytes, 2 * each);
    }
}
