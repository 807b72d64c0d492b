use std::time::{SystemTime, UNIX_EPOCH};

use serde::{Deserialize, Serialize};
use uuid::Uuid;

/// What a job takes beside its input, its result and its texts, as a round figure.
const RECORD_BYTES: u64 = 2048;
/// How often a job's texts are in memory: in the job, in the store, and in what finds it.
const COPIES: u64 = 3;
/// What a text takes beside its characters.
const TEXT_BYTES: u64 = 48;

/// Where a job stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, utoipa::ToSchema)]
#[serde(rename_all = "lowercase")]
pub enum JobState {
    /// Waiting for its turn.
    Queued,
    /// At work.
    Running,
    /// Done; its result can be fetched until it expires.
    Succeeded,
    /// Ended without a result.
    Failed,
    /// Cancelled by its owner.
    Cancelled,
}

impl JobState {
    /// Every state, in the order in which a job may go through them.
    pub const ALL: [Self; 5] =
        [Self::Queued, Self::Running, Self::Succeeded, Self::Failed, Self::Cancelled];

    /// Its name in every contract.
    pub fn name(self) -> &'static str {
        match self {
            Self::Queued => "queued",
            Self::Running => "running",
            Self::Succeeded => "succeeded",
            Self::Failed => "failed",
            Self::Cancelled => "cancelled",
        }
    }

    /// The state of that name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|state| state.name() == name)
    }

    /// Whether the state is the last one.
    pub fn is_final(self) -> bool {
        matches!(self, Self::Succeeded | Self::Failed | Self::Cancelled)
    }
}

/// Why a job failed.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Fault {
    /// The stable code.
    pub code: String,
    /// What happened.
    pub detail: String,
}

/// What its submitter called a job, so that a retried upload is the same job.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct IdempotencyKey {
    /// The submitter's key.
    pub key: String,
    /// What was submitted under it, in short.
    pub fingerprint: String,
}

/// All there is to know of a job beside its input and its result.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct JobRecord {
    /// Its name.
    pub id: Uuid,
    /// Who may see it; `None` where the service asks nobody for a key.
    pub owner: Option<String>,
    /// What its submitter called it.
    pub idempotency: Option<IdempotencyKey>,
    /// The request, as names and text.
    pub request: Vec<(String, String)>,
    /// Length of its input.
    pub input_bytes: u64,
    /// How many points its input announces.
    pub points: u64,
    /// Where it stands.
    pub state: JobState,
    /// When it was accepted, in milliseconds since 1970.
    pub created_ms: u64,
    /// When it began to run.
    pub started_ms: Option<u64>,
    /// When it ended.
    pub finished_ms: Option<u64>,
    /// Length of its result.
    pub result_bytes: u64,
    /// Why it failed.
    pub fault: Option<Fault>,
    /// How many processes ended suddenly while it ran.
    #[serde(default)]
    pub crashes: u32,
}

/// What a submitter says of a job.
#[derive(Clone, Debug, Default)]
pub struct Submission {
    /// Who may see it.
    pub owner: Option<String>,
    /// What its submitter calls it.
    pub idempotency: Option<IdempotencyKey>,
    /// The request, as names and text.
    pub request: Vec<(String, String)>,
    /// How many points its cloud announces.
    pub points: u64,
}

impl JobRecord {
    /// A job accepted now.
    pub fn new(submission: Submission, input_bytes: u64) -> Self {
        Self {
            id: Uuid::now_v7(),
            owner: submission.owner,
            idempotency: submission.idempotency,
            request: submission.request,
            input_bytes,
            points: submission.points,
            state: JobState::Queued,
            created_ms: now_ms(),
            started_ms: None,
            finished_ms: None,
            result_bytes: 0,
            fault: None,
            crashes: 0,
        }
    }

    /// Bytes the job keeps: its input, for outputs that show the points, its result, and itself with
    /// all its texts, so that a great many small jobs have their end too.
    pub fn kept_bytes(&self) -> u64 {
        let texts: u64 = self.texts().map(|text| TEXT_BYTES + text.len() as u64).sum();
        RECORD_BYTES + COPIES * texts + self.input_bytes + self.result_bytes
    }

    fn texts(&self) -> impl Iterator<Item = &str> {
        let idempotency = self.idempotency.iter().flat_map(|i| [&i.key, &i.fingerprint]);
        let request = self.request.iter().flat_map(|(name, value)| [name, value]);
        let fault = self.fault.iter().flat_map(|fault| [&fault.code, &fault.detail]);
        let all = self.owner.iter().chain(idempotency).chain(request).chain(fault);
        all.map(String::as_str)
    }
}

/// Milliseconds since 1970.
pub fn now_ms() -> u64 {
    let since = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    u64::try_from(since.as_millis()).unwrap_or(u64::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_text_of_a_job_counts_in_what_it_keeps() {
        let mut record = JobRecord::new(Submission::default(), 10);
        let mut before = record.kept_bytes();
        let long = || "x".repeat(1000);
        let mut grows = |record: &JobRecord, by: u64| {
            assert!(record.kept_bytes() >= before + by);
            before = record.kept_bytes();
        };
        record.result_bytes = 1000;
        grows(&record, 1000);
        record.owner = Some(long());
        grows(&record, 3000);
        record.idempotency = Some(IdempotencyKey { key: long(), fingerprint: long() });
        grows(&record, 6000);
        record.request = vec![(long(), long())];
        grows(&record, 6000);
        record.fault = Some(Fault { code: long(), detail: long() });
        grows(&record, 6000);
    }

    #[test]
    fn a_record_of_an_earlier_version_is_one() {
        let text = r#"{"id": "0190163d-8694-739b-aea5-966c26f8ad91", "owner": null,
            "idempotency": null, "request": [["seed", "1"]], "input_bytes": 3, "points": 1,
            "state": "running", "created_ms": 1, "started_ms": 2, "finished_ms": null,
            "result_bytes": 0, "fault": null}"#;
        let record: JobRecord = serde_json::from_str(text).unwrap();
        assert_eq!((record.state, record.crashes), (JobState::Running, 0));
    }
}
