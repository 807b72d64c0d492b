use serde::Serialize;
use utoipa::ToSchema;

use crate::jobs::{JobState, JobView};

/// A job.
#[derive(Clone, Debug, PartialEq, Serialize, ToSchema)]
pub struct JobDocument {
    /// Its name.
    #[schema(example = "01890a5d-ac96-774b-bcce-b302099a8057")]
    pub id: String,
    /// Where it stands.
    pub state: JobState,
    /// How far it is; only while it runs.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub progress: Option<JobProgress>,
    /// When it was accepted, in milliseconds since 1970-01-01 UTC.
    pub created_ms: u64,
    /// When it began to run; absent before.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub started_ms: Option<u64>,
    /// When it ended; absent before.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub finished_ms: Option<u64>,
    /// Why it failed; absent otherwise.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub problem: Option<JobProblem>,
}

/// How far a job is.
#[derive(Clone, Debug, PartialEq, Serialize, ToSchema)]
pub struct JobProgress {
    /// The stage of the method.
    #[schema(example = "grow")]
    pub stage: String,
    /// How much of the whole work is done, 0 to 1.
    pub fraction: f64,
}

/// Why a job failed.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, ToSchema)]
pub struct JobProblem {
    /// The stable code.
    #[schema(example = "too_few_points")]
    pub code: String,
    /// What happened and what to do.
    pub detail: String,
}

impl From<JobView> for JobDocument {
    fn from(JobView { record, progress }: JobView) -> Self {
        let progress = progress
            .map(|p| JobProgress { stage: p.stage.name().to_owned(), fraction: p.fraction });
        Self {
            id: record.id.to_string(),
            state: record.state,
            progress,
            created_ms: record.created_ms,
            started_ms: record.started_ms,
            finished_ms: record.finished_ms,
            problem: record.fault.map(|f| JobProblem { code: f.code, detail: f.detail }),
        }
    }
}

/// Some of the caller's jobs.
#[derive(Clone, Debug, PartialEq, Serialize, ToSchema)]
pub struct JobList {
    /// The jobs, the newest first.
    pub jobs: Vec<JobDocument>,
    /// Asks for the page behind this one, as `page_token`; absent where there is none.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub next_page_token: Option<String>,
}
