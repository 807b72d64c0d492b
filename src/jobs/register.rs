use std::{
    collections::{BTreeMap, BTreeSet, HashMap},
    ops::Bound,
    sync::Arc,
};

use uuid::Uuid;

use super::{Job, JobRecord, JobState, SubmitError};

/// The jobs of a book, found by id and by their owner's idempotency key, and the ended ones in the
/// order in which they are forgotten. Every call takes the time of a look-up, or of one a key, however
/// many jobs there are.
#[derive(Debug, Default)]
pub struct Register {
    by_id: HashMap<Uuid, Arc<Job>>,
    by_key: HashMap<(Option<String>, String), Uuid>,
    // names rise with the time of acceptance
    by_owner: HashMap<Option<String>, BTreeSet<Uuid>>,
    ended: HashMap<Option<String>, Ended>,
    kept_bytes: u64,
    // whose jobs wait for their turn, and what each job takes, where processes share them
    waiting: HashMap<Uuid, Option<String>>,
    running: BTreeSet<Uuid>,
    sizes: HashMap<Uuid, u64>,
    all_bytes: u64,
}

/// The ended jobs of one owner.
#[derive(Debug, Default)]
struct Ended {
    // when each ended, and what it keeps
    jobs: BTreeMap<(u64, Uuid), u64>,
    kept_bytes: u64,
}

impl Ended {
    fn oldest(&self) -> Option<(u64, Uuid)> {
        self.jobs.first_key_value().map(|(&oldest, _)| oldest)
    }
}

/// What is kept of ended jobs.
#[derive(Clone, Copy, Debug)]
pub struct Keep {
    /// Those that ended by this time, in milliseconds since 1970, are not.
    pub latest_expired_ms: u64,
    /// Most bytes of all.
    pub bytes: u64,
    /// Most bytes of one key's.
    pub bytes_per_key: u64,
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
        self.by_owner.entry(record.owner).or_default().insert(record.id);
        self.by_id.insert(record.id, job);
    }

    /// The job of that id.
    pub fn get(&self, id: Uuid) -> Option<Arc<Job>> {
        self.by_id.get(&id).map(Arc::clone)
    }

    /// The `most` newest jobs of an owner that are older than `before`, the newest first.
    pub fn of_owner(
        &self,
        owner: Option<&str>,
        before: Option<Uuid>,
        most: usize,
    ) -> Vec<Arc<Job>> {
        let Some(own) = self.by_owner.get(&owner.map(str::to_owned)) else { return Vec::new() };
        let end = before.map_or(Bound::Unbounded, Bound::Excluded);
        let newest = own.range((Bound::Unbounded, end)).rev().take(most);
        newest.filter_map(|id| self.get(*id)).collect()
    }

    /// Notes what a job is now, for [`Self::waiting`] and [`Self::all_bytes`].
    pub fn note(&mut self, record: &JobRecord) {
        let bytes = record.kept_bytes();
        let before = self.sizes.insert(record.id, bytes).unwrap_or(0);
        self.all_bytes = self.all_bytes + bytes - before;
        if record.state == JobState::Queued {
            self.waiting.insert(record.id, record.owner.clone());
        } else {
            self.waiting.remove(&record.id);
        }
        if record.state == JobState::Running {
            self.running.insert(record.id);
        } else {
            self.running.remove(&record.id);
        }
    }

    /// How many jobs noted run.
    pub fn running(&self) -> usize {
        self.running.len()
    }

    /// How many jobs noted wait for their turn: all, and those of `owner`.
    pub fn waiting(&self, owner: Option<&str>) -> (usize, usize) {
        let own = self.waiting.values().filter(|of| of.as_deref() == owner).count();
        (self.waiting.len(), own)
    }

    /// The jobs noted that wait or run and were accepted at `ms` or before.
    pub fn under_way_since(&self, ms: u64) -> Vec<Arc<Job>> {
        let under_way = self.waiting.keys().chain(&self.running).filter_map(|id| self.get(*id));
        under_way.filter(|job| job.peek(|record| record.created_ms <= ms)).collect()
    }

    /// Bytes of all jobs noted.
    pub fn all_bytes(&self) -> u64 {
        self.all_bytes
    }

    /// The names of all jobs.
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
            let own = self.ended.entry(record.owner.clone()).or_default();
            let before = own.jobs.insert((finished, record.id), bytes).unwrap_or(0);
            own.kept_bytes = own.kept_bytes + bytes - before;
            self.kept_bytes = self.kept_bytes + bytes - before;
        }
    }

    /// Removes a job, and returns it where it was there.
    pub fn remove(&mut self, id: Uuid) -> Option<Arc<Job>> {
        let job = self.by_id.remove(&id)?;
        let record = job.record();
        if let Some(key) = key_of(&record).filter(|key| self.by_key.get(key) == Some(&id)) {
            self.by_key.remove(&key);
        }
        if let Some(own) = self.by_owner.get_mut(&record.owner) {
            own.remove(&id);
            if own.is_empty() {
                self.by_owner.remove(&record.owner);
            }
        }
        self.forget_end(&record);
        self.waiting.remove(&id);
        self.running.remove(&id);
        self.all_bytes -= self.sizes.remove(&id).unwrap_or(0);
        Some(job)
    }

    fn forget_end(&mut self, record: &JobRecord) {
        let Some(own) = self.ended.get_mut(&record.owner) else { return };
        let at = record.finished_ms.map(|finished| (finished, record.id));
        let bytes = at.and_then(|at| own.jobs.remove(&at)).unwrap_or(0);
        own.kept_bytes -= bytes;
        self.kept_bytes -= bytes;
        if own.jobs.is_empty() {
            self.ended.remove(&record.owner);
        }
    }

    /// The job that is to be forgotten next: one that is too old; the oldest of a key that keeps too
    /// much, never another's; or, where all together is too much, the oldest of the key that keeps
    /// most.
    pub fn expired(&self, keep: &Keep) -> Option<Uuid> {
        let oldest = self.ended.values().filter_map(Ended::oldest).min();
        let too_old = oldest.filter(|(finished, _)| *finished <= keep.latest_expired_ms);
        let over_share = || {
            let mut named = self.ended.iter().filter(|(owner, _)| owner.is_some());
            named.find(|(_, own)| own.kept_bytes > keep.bytes_per_key)?.1.oldest()
        };
        let too_much = || {
            let most = self.ended.values().max_by_key(|own| own.kept_bytes)?;
            if self.kept_bytes > keep.bytes { most.oldest() } else { None }
        };
        too_old.or_else(over_share).or_else(too_much).map(|(_, id)| id)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::jobs::{IdempotencyKey, Submission};

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

    /// A register of ended jobs, in the order of their ends.
    fn ended(owners: &[&str]) -> (Register, Vec<Uuid>, u64) {
        let (mut register, mut ids, mut each) = (Register::default(), Vec::new(), 0);
        for (i, owner) in owners.iter().enumerate() {
            let mut record = job(owner, &i.to_string(), "").record();
            let finished = 10 * (i as u64 + 1);
            (record.state, record.finished_ms) = (JobState::Succeeded, Some(finished));
            register.add(Job::new(record.clone()));
            register.ended(&record);
            (each, ids) = (record.kept_bytes(), [ids, vec![record.id]].concat());
        }
        (register, ids, each)
    }

    fn keep(latest_expired_ms: u64, bytes: u64, bytes_per_key: u64) -> Keep {
        Keep { latest_expired_ms, bytes, bytes_per_key }
    }

    #[test]
    fn ended_jobs_expire_by_time_and_by_bytes_the_oldest_first() {
        let (mut register, ids, each) = ended(&["a", "a", "a"]);
        let most = u64::MAX;
        assert_eq!(register.expired(&keep(9, 3 * each, most)), None);
        assert_eq!(register.expired(&keep(10, 3 * each, most)), Some(ids[0]));
        assert_eq!(register.expired(&keep(0, 3 * each - 1, most)), Some(ids[0]));
        register.remove(ids[0]);
        assert_eq!(register.expired(&keep(10, 2 * each, most)), None);
        assert_eq!(register.kept_bytes, 2 * each);
        register.remove(ids[1]);
        register.remove(ids[2]);
        assert!(register.kept_bytes == 0 && register.ended.is_empty());
    }

    #[test]
    fn a_key_that_keeps_too_much_loses_its_own_oldest_and_never_anothers() {
        let (mut register, ids, each) = ended(&["a", "b", "b", "b"]);
        assert_eq!(register.expired(&keep(0, 4 * each, 3 * each)), None);
        assert_eq!(register.expired(&keep(0, 4 * each, 3 * each - 1)), Some(ids[1]));
        // of all together it is the key that keeps most that gives way
        assert_eq!(register.expired(&keep(0, 4 * each - 1, 4 * each)), Some(ids[1]));
        register.remove(ids[1]);
        assert_eq!(register.expired(&keep(0, 3 * each, 2 * each)), None);
    }
}
