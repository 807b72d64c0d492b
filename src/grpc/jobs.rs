use std::{pin::Pin, sync::Arc};

use futures::{Stream, StreamExt};
use tonic::{Request, Response, Status, Streaming};

use super::{
    call::{caller, share, upload},
    segmentations::receive,
};
use crate::{
    jobs::{JobState, JobView},
    service::{
        Service,
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

    type WatchJobStream = Pin<Box<dyn Stream<Item = Result<v1::Job, Status>> + Send>>;

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
        let v1::GetJobResultRequest { id, omit_labels } = call.into_inner();
        let tell = move |answer: crate::service::Answer, labels| {
            Ok(answer.document.shown(labels && !omit_labels).into())
        };
        Ok(Response::new(self.service.job_result(&caller, &id, &held, false, tell).await?))
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
