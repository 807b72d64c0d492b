use std::sync::Arc;

use tonic::{Request, Response, Status, Streaming};

use super::{
    answer::{self, Messages},
    call::{caller, upload},
    timeout::grpc_timeout,
};
use crate::service::{
    self, ErrorKind, Needs, Representation, Service, ServiceError, Upload,
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

    /// Takes in an upload: the cloud, what to do with it, and the start of the upload, without its request.
    async fn uploaded(
        &self,
        call: Request<Streaming<v1::Upload>>,
    ) -> Result<(Upload, service::Request, v1::UploadStart), Status> {
        let caller = caller(&self.service, &call)?;
        let timeout = grpc_timeout(call.metadata());
        self.service.check_room(&caller)?;
        let mut upload = upload(&self.service, &call, &caller)?;
        let mut start = receive(call.into_inner(), &mut upload).await?;
        let message = start.request.take().unwrap_or_default();
        let mut request = request_from_message(&message)?;
        request.max_answer_bytes = Some(message.max_answer_bytes.unwrap_or(answer::CLIENTS_TAKE));
        request.shorten_deadline(timeout);
        Ok((upload, request, start))
    }

    async fn answer(
        &self,
        upload: Upload,
        request: service::Request,
    ) -> Result<Response<v1::Segmentation>, Status> {
        let most = request.max_answer_bytes.unwrap_or(answer::CLIENTS_TAKE);
        let tell = move |answer: service::Answer, labels| {
            answer::whole(answer.document.shown(labels), most)
        };
        Ok(Response::new(self.service.segment(upload, request, Needs::Nothing, tell).await?))
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
        request.max_answer_bytes = Some(message.max_answer_bytes.unwrap_or(answer::CLIENTS_TAKE));
        request.shorten_deadline(timeout);
        // nobody else has these bytes, so they stay where they are
        upload.put(cloud.into())?;
        self.answer(upload, request).await
    }

    async fn segment_upload(
        &self,
        call: Request<Streaming<v1::Upload>>,
    ) -> Result<Response<v1::Segmentation>, Status> {
        let (upload, request, _) = self.uploaded(call).await?;
        self.answer(upload, request).await
    }

    type SegmentStreamStream = Messages<v1::Segmentation>;

    async fn segment_stream(
        &self,
        call: Request<Streaming<v1::Upload>>,
    ) -> Result<Response<Self::SegmentStreamStream>, Status> {
        let (upload, mut request, _) = self.uploaded(call).await?;
        request.max_answer_bytes = None;
        let held = upload.held().clone();
        let tell = |answer: service::Answer, labels| Ok(answer.document.shown(labels));
        let document = self.service.segment(upload, request, Needs::Nothing, tell).await?;
        Ok(answer::pieces(document, held))
    }

    type SegmentFileStream = Messages<v1::FileChunk>;

    async fn segment_file(
        &self,
        call: Request<Streaming<v1::Upload>>,
    ) -> Result<Response<Self::SegmentFileStream>, Status> {
        let caller = caller(&self.service, &call)?;
        let (upload, mut request, start) = self.uploaded(call).await?;
        let form = answer::form(start.representation, &Representation::ALL)?;
        request.max_answer_bytes = None;
        let held = upload.held().clone();
        let room = self.service.room_for(form, &caller)?;
        let tell = move |answer, labels| {
            let _room = room;
            service::render(form, answer, labels)
        };
        let bytes = self.service.segment(upload, request, Needs::of(form), tell).await?;
        Ok(answer::file(held.carrying(bytes)))
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
