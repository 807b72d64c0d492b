use std::sync::Arc;

use tonic::{Request, Response, Status, Streaming};

use super::{
    call::{caller, upload},
    timeout::grpc_timeout,
};
use crate::service::{
    self, ErrorKind, Service, ServiceError, Upload,
    message::{request_from_message, v1},
};

/// The segmentation service of the contract.
#[derive(Debug)]
pub struct Segmentations {
    service: Arc<Service>,
}

impl Segmentations {
    /// The calls of `service`.
    pub fn new(service: Arc<Service>) -> Self {
        Self { service }
    }

    async fn answer(
        &self,
        upload: Upload,
        request: service::Request,
    ) -> Result<Response<v1::Segmentation>, Status> {
        let tell = |answer: service::Answer, labels| Ok(answer.document.shown(labels).into());
        Ok(Response::new(self.service.segment(upload, request, false, tell).await?))
    }
}

#[tonic::async_trait]
impl v1::segmentations_server::Segmentations for Segmentations {
    async fn segment(
        &self,
        call: Request<v1::SegmentRequest>,
    ) -> Result<Response<v1::Segmentation>, Status> {
        let caller = caller(&self.service, &call)?;
        let timeout = grpc_timeout(call.metadata());
        let mut upload = upload(&self.service, &call, &caller)?;
        let mut message = call.into_inner();
        let cloud = std::mem::take(&mut message.cloud);
        let mut request = request_from_message(&message)?;
        request.shorten_deadline(timeout);
        // nobody else has these bytes, so they stay where they are
        upload.put(cloud.into())?;
        self.answer(upload, request).await
    }

    async fn segment_upload(
        &self,
        call: Request<Streaming<v1::Upload>>,
    ) -> Result<Response<v1::Segmentation>, Status> {
        let caller = caller(&self.service, &call)?;
        let timeout = grpc_timeout(call.metadata());
        self.service.check_room(&caller)?;
        let mut upload = upload(&self.service, &call, &caller)?;
        let start = receive(call.into_inner(), &mut upload).await?;
        let mut request = request_from_message(&start.request.unwrap_or_default())?;
        request.shorten_deadline(timeout);
        self.answer(upload, request).await
    }
}

/// Takes in a whole upload: its start, then chunks.
pub async fn receive(
    mut parts: Streaming<v1::Upload>,
    upload: &mut Upload,
) -> Result<v1::UploadStart, Status> {
    use v1::upload::Part;
    let malformed = |detail: &str| ServiceError::new(ErrorKind::MalformedBody, detail);
    let Some(Part::Start(start)) = parts.message().await?.and_then(|m| m.part) else {
        return Err(malformed("the first message of an upload must be its start").into());
    };
    if start.request.as_ref().is_some_and(|request| !request.cloud.is_empty()) {
        return Err(malformed("the start of an upload must not hold the cloud: send chunks").into());
    }
    while let Some(message) = parts.message().await? {
        match message.part {
            Some(Part::Chunk(chunk)) => upload.push(&chunk)?,
            _ => return Err(malformed("after its start an upload has only chunks").into()),
        }
    }
    Ok(start)
}
