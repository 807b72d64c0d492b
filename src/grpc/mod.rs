//! The gRPC interface: the services of `conicoid.v1`, health and reflection.

mod context;
mod frames;
mod intake;
mod jobs;
mod outcome;
mod segmentations;
mod status;
mod timeout;

use std::sync::Arc;

use axum::Router;
use tonic::{Status, server::NamedService, service::RoutesBuilder};
use tonic_health::{ServingStatus, server::HealthReporter};

use crate::{
    jobs::BytesHeld,
    service::{
        Caller, Peer, Service, ServiceError, Upload,
        message::{
            DESCRIPTOR,
            v1::{jobs_server::JobsServer, segmentations_server::SegmentationsServer},
        },
    },
};
use jobs::Jobs;
use segmentations::Segmentations;

/// How the gRPC interface takes messages.
#[derive(Clone, Copy, Debug)]
pub struct GrpcConfig {
    /// Longest message taken.
    pub max_message_bytes: usize,
}

/// The gRPC interface of `service`, and the handle on the health it reports.
///
/// # Errors
/// The built-in descriptor cannot be read.
pub async fn router(
    service: Arc<Service>,
    config: GrpcConfig,
) -> Result<(Router, HealthReporter), tonic_reflection::server::Error> {
    let (health, health_service) = tonic_health::server::health_reporter();
    let segmentations = SegmentationsServer::new(Segmentations::new(Arc::clone(&service)))
        .max_decoding_message_size(config.max_message_bytes);
    let jobs = JobsServer::new(Jobs::new(Arc::clone(&service)))
        .max_decoding_message_size(config.max_message_bytes);
    health.set_serving::<SegmentationsServer<Segmentations>>().await;
    health.set_serving::<JobsServer<Jobs>>().await;
    let reflection = || {
        tonic_reflection::server::Builder::configure()
            .register_encoded_file_descriptor_set(DESCRIPTOR)
            .register_encoded_file_descriptor_set(tonic_health::pb::FILE_DESCRIPTOR_SET)
    };
    // an empty router first: the default one would answer unknown paths with status 200
    let mut routes = RoutesBuilder::from(Router::new());
    routes
        .add_service(health_service)
        .add_service(reflection().build_v1()?)
        .add_service(reflection().build_v1alpha()?)
        .add_service(segmentations)
        .add_service(jobs);
    let calls = routes.routes().into_axum_router();
    let context = axum::middleware::from_fn_with_state((service, config), context::wrap);
    Ok((calls.layer(context), health))
}

/// Tells that the service ends: to those who ask, and to those who watch, who are then let go.
pub async fn end(health: &HealthReporter) {
    let segmentations = <SegmentationsServer<Segmentations> as NamedService>::NAME;
    for name in ["", segmentations, <JobsServer<Jobs> as NamedService>::NAME] {
        health.set_service_status(name, ServingStatus::NotServing).await;
        // the last status is told before a watch ends
        health.clone().clear_service_status(name).await;
    }
}

/// The share of the budget that counts the call's messages already; from now on it is the caller's.
fn share<T>(
    service: &Service,
    call: &tonic::Request<T>,
    caller: &Caller,
) -> Result<BytesHeld, Status> {
    let held = call.extensions().get::<BytesHeld>().cloned().unwrap_or_else(|| service.share());
    held.charge(caller.as_deref()).map_err(ServiceError::from)?;
    Ok(held)
}

/// An empty upload for the call.
fn upload<T>(
    service: &Service,
    call: &tonic::Request<T>,
    caller: &Caller,
) -> Result<Upload, Status> {
    Ok(service.upload(share(service, call, caller)?))
}

/// Who makes the call, by key or by the certificate of the connection.
fn caller<T>(service: &Service, call: &tonic::Request<T>) -> Result<Caller, Status> {
    let header = call.metadata().get("authorization").and_then(|value| value.to_str().ok());
    Ok(service.caller(header, call.extensions().get::<Peer>())?)
}
