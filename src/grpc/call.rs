//! What every call has: its caller, its share of the budget, and room for its cloud.

use tonic::Status;

use crate::{
    jobs::BytesHeld,
    service::{Caller, Peer, Service, ServiceError, Upload},
};

/// The share of the budget that counts the call's messages already; from now on it is the caller's.
pub fn share<T>(
    service: &Service,
    call: &tonic::Request<T>,
    caller: &Caller,
) -> Result<BytesHeld, Status> {
    let held = call.extensions().get::<BytesHeld>().cloned().unwrap_or_else(|| service.share());
    held.charge(caller.as_deref()).map_err(ServiceError::from)?;
    Ok(held)
}

/// An empty upload for the call.
pub fn upload<T>(
    service: &Service,
    call: &tonic::Request<T>,
    caller: &Caller,
) -> Result<Upload, Status> {
    Ok(service.upload(share(service, call, caller)?))
}

/// Who makes the call, by key or by the certificate of the connection.
pub fn caller<T>(service: &Service, call: &tonic::Request<T>) -> Result<Caller, Status> {
    let header = call.metadata().get("authorization").and_then(|value| value.to_str().ok());
    Ok(service.caller(header, call.extensions().get::<Peer>())?)
}
