use std::sync::Arc;

use tonic::{Request, Response, Status};

use super::{
    call::{caller, upload},
    timeout::grpc_timeout,
};
use crate::service::{
    Service,
    message::{fit_from_message, v1},
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
}

#[tonic::async_trait]
impl v1::fits_server::Fits for Fits {
    async fn fit(&self, call: Request<v1::FitRequest>) -> Result<Response<v1::FitResult>, Status> {
        let caller = caller(&self.service, &call)?;
        let timeout = grpc_timeout(call.metadata());
        let mut upload = upload(&self.service, &call, &caller)?;
        let mut message = call.into_inner();
        let cloud = std::mem::take(&mut message.cloud);
        let mut request = fit_from_message(&message)?;
        request.request.shorten_deadline(timeout);
        upload.put(cloud.into())?;
        Ok(Response::new(self.service.fit(upload, request).await?.into()))
    }
}
