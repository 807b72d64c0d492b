use std::sync::Arc;

use futures::StreamExt;
use tonic::{Request, Response, Status, Streaming};

use super::{
    answer::{self, Messages},
    call::{caller, share, upload},
    segmentations::receive,
};
use crate::{
    jobs::{JobState, JobView},
    service::{
        self, ErrorKind, JobPage, Listing, Needs, Representation, Service, ServiceError,
        message::{request_from_message, v1},
    },
};

/// The job service of the contract.
#[derive(Debug)]
pub struct Jobs {
    service: Arc<Service>,
}

impl Jobs {
    /// The calls of `service`.
    pub fn new(service: Arc<Service>) -> Self {
        Self { service }
    }
}

#[tonic::async_trait]
impl v1::jobs_server::Jobs for Jobs {
    async fn submit_job(
        &self,
        call: Request<Streaming<v1::Upload>>,
    ) -> Result<Response<v1::Job>, Status> {
        let caller = caller(&self.service, &call)?;
        self.service.check_room(&caller)?;
        let mut upload = upload(&self.service, &call, &caller)?;
        let start = receive(call.into_inner(), &mut upload).await?;
        let request = request_from_message(&start.request.unwrap_or_default())?;
        let key = Some(start.idempotency_key).filter(|key| !key.is_empty());
        let (job, _) = self.service.submit(caller, key, upload, request).await?;
        Ok(Response::new(job.view().into()))
    }

    async fn get_job(&self, call: Request<v1::GetJobRequest>) -> Result<Response<v1::Job>, Status> {
        let caller = caller(&self.service, &call)?;
        let job = self.service.job(&caller, &call.get_ref().id)?;
        Ok(Response::new(job.view().into()))
    }

    async fn list_jobs(
        &self,
        call: Request<v1::ListJobsRequest>,
    ) -> Result<Response<v1::ListJobsResponse>, Status> {
        let caller = caller(&self.service, &call)?;
        let v1::ListJobsRequest { state, page_size, page_token } = call.into_inner();
        let states = state.into_iter().map(known_state).collect::<Result<_, _>>()?;
        let listing = Listing::new(states, page_size.map(u64::from), &page_token)?;
        let JobPage { jobs, next_page_token } = self.service.jobs(&caller, &listing);
        let jobs = jobs.into_iter().map(Into::into).collect();
        let next_page_token = next_page_token.unwrap_or_default();
        Ok(Response::new(v1::ListJobsResponse { jobs, next_page_token }))
    }

    type WatchJobStream = Messages<v1::Job>;

    async fn watch_job(
        &self,
        call: Request<v1::GetJobRequest>,
    ) -> Result<Response<Self::WatchJobStream>, Status> {
        let caller = caller(&self.service, &call)?;
        let job = self.service.job(&caller, &call.get_ref().id)?;
        let watch = job.watch().take_until(self.service.book().closed());
        Ok(Response::new(Box::pin(watch.map(|view| Ok(view.into())))))
    }

    async fn get_job_result(
        &self,
        call: Request<v1::GetJobResultRequest>,
    ) -> Result<Response<v1::Segmentation>, Status> {
        let caller = caller(&self.service, &call)?;
        let held = share(&self.service, &call, &caller)?;
        let v1::GetJobResultRequest { id, omit_labels, max_answer_bytes } = call.into_inner();
        let most = max_answer_bytes.unwrap_or(answer::CLIENTS_TAKE);
        let tell = move |answer: service::Answer, labels| {
            answer::whole(answer.document.shown(labels && !omit_labels), most)
        };
        Ok(Response::new(self.service.job_result(&caller, &id, &held, Needs::Nothing, tell).await?))
    }

    type StreamJobResultStream = Messages<v1::Segmentation>;

    async fn stream_job_result(
        &self,
        call: Request<v1::GetJobResultRequest>,
    ) -> Result<Response<Self::StreamJobResultStream>, Status> {
        let caller = caller(&self.service, &call)?;
        let held = share(&self.service, &call, &caller)?;
        let v1::GetJobResultRequest { id, omit_labels, .. } = call.into_inner();
        let tell = move |answer: service::Answer, labels| {
            Ok(answer.document.shown(labels && !omit_labels))
        };
        let document = self.service.job_result(&caller, &id, &held, Needs::Nothing, tell).await?;
        Ok(answer::pieces(document, held))
    }

    type GetJobFileStream = Messages<v1::FileChunk>;

    async fn get_job_file(
        &self,
        call: Request<v1::GetJobFileRequest>,
    ) -> Result<Response<Self::GetJobFileStream>, Status> {
        let caller = caller(&self.service, &call)?;
        let held = share(&self.service, &call, &caller)?;
        let v1::GetJobFileRequest { id, representation } = call.into_inner();
        let form = answer::form(representation, &Representation::ALL)?;
        let room = self.service.room_for(form, &caller)?;
        let tell = move |answer, labels| {
            let _room = room;
            service::render(form, answer, labels)
        };
        let needs = Needs::of(form);
        let bytes = self.service.job_result(&caller, &id, &held, needs, tell).await?;
        Ok(answer::file(held.carrying(bytes)))
    }

    async fn cancel_job(
        &self,
        call: Request<v1::CancelJobRequest>,
    ) -> Result<Response<v1::Job>, Status> {
        let caller = caller(&self.service, &call)?;
        let job = self.service.cancel(&caller, &call.get_ref().id).await?;
        Ok(Response::new(job.view().into()))
    }
}

/// The state of that number.
fn known_state(number: i32) -> Result<JobState, ServiceError> {
    let state = JobState::ALL.into_iter().find(|state| v1::JobState::from(*state) as i32 == number);
    state.ok_or_else(|| {
        let detail = format!("field 'state': {number} is no state of a job");
        ServiceError::new(ErrorKind::InvalidParameter, detail)
    })
}

impl From<JobState> for v1::JobState {
    fn from(state: JobState) -> Self {
        match state {
            JobState::Queued => Self::Queued,
            JobState::Running => Self::Running,
            JobState::Succeeded => Self::Succeeded,
            JobState::Failed => Self::Failed,
            JobState::Cancelled => Self::Cancelled,
        }
    }
}

fn milliseconds(time: u64) -> i64 {
    i64::try_from(time).unwrap_or(i64::MAX)
}

impl From<JobView> for v1::Job {
    fn from(JobView { record, progress }: JobView) -> Self {
        let progress = progress
            .map(|p| v1::Progress { stage: p.stage.name().to_owned(), fraction: p.fraction });
        Self {
            id: record.id.to_string(),
            state: v1::JobState::from(record.state).into(),
            progress,
            created_ms: milliseconds(record.created_ms),
            started_ms: record.started_ms.map(milliseconds),
            finished_ms: record.finished_ms.map(milliseconds),
            problem: record.fault.map(|f| v1::Problem { code: f.code, detail: f.detail }),
        }
    }
}
