use std::sync::Arc;

use tonic::{Request, Response, Status};

use super::{
    answer::{self, Messages},
    call::{caller, upload},
    timeout::grpc_timeout,
};
use crate::service::{
    FitDocument, FitRequest, Service, Upload,
    message::{fit_from_message, v1},
    render_fit,
};

/// The fits of the contract.
#[derive(Debug)]
pub struct Fits {
    service: Arc<Service>,
}

impl Fits {
    /// The calls of `service`.
    pub fn new(service: Arc<Service>) -> Self {
        Self { service }
    }

    /// The cloud of a call, its message without that, and the request in it.
    fn received(
        &self,
        call: Request<v1::FitRequest>,
    ) -> Result<(Upload, v1::FitRequest, FitRequest), Status> {
        let caller = caller(&self.service, &call)?;
        let timeout = grpc_timeout(call.metadata());
        let mut upload = upload(&self.service, &call, &caller)?;
        let mut message = call.into_inner();
        let cloud = std::mem::take(&mut message.cloud);
        let mut request = fit_from_message(&message)?;
        request.request.shorten_deadline(timeout);
        upload.put(cloud.into())?;
        Ok((upload, message, request))
    }
}

#[tonic::async_trait]
impl v1::fits_server::Fits for Fits {
    async fn fit(&self, call: Request<v1::FitRequest>) -> Result<Response<v1::FitResult>, Status> {
        let (upload, message, request) = self.received(call)?;
        drop(message);
        Ok(Response::new(self.service.fit(upload, request).await?.into()))
    }

    type FitFileStream = Messages<v1::FileChunk>;

    async fn fit_file(
        &self,
        call: Request<v1::FitRequest>,
    ) -> Result<Response<Self::FitFileStream>, Status> {
        let (upload, message, request) = self.received(call)?;
        let form = answer::form(message.representation, &FitDocument::OFFERED)?;
        let held = upload.held().clone();
        let fit = self.service.fit(upload, request).await?;
        Ok(answer::file(held.carrying(render_fit(form, fit)?)))
    }
}
