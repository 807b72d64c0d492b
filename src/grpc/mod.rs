//! The gRPC interface: the services of `conicoid.v1`, health and reflection.

mod answer;
mod call;
mod config;
mod context;
mod fits;
mod frames;
mod intake;
mod jobs;
mod outcome;
mod segmentations;
mod status;
mod timeout;
mod unpack;

use std::sync::Arc;

use axum::Router;
use tonic::{
    codec::CompressionEncoding::{Gzip, Zstd},
    server::NamedService,
    service::RoutesBuilder,
};
use tonic_health::{ServingStatus, server::HealthReporter};

use crate::service::{
    Service,
    message::{
        DESCRIPTOR,
        v1::{
            fits_server::FitsServer, jobs_server::JobsServer,
            segmentations_server::SegmentationsServer,
        },
    },
};
pub use config::GrpcConfig;

use fits::Fits;
use jobs::Jobs;
use segmentations::Segmentations;

/// The gRPC interface of `service`, and the handle on the health it reports.
///
/// # Errors
/// The built-in descriptor cannot be read.
pub async fn router(
    service: Arc<Service>,
    config: GrpcConfig,
) -> Result<(Router, HealthReporter), tonic_reflection::server::Error> {
    let (health, health_service) = tonic_health::server::health_reporter();
    // answers are packed for those who say that they take it
    let segmentations = SegmentationsServer::new(Segmentations::new(Arc::clone(&service)))
        .max_decoding_message_size(config.max_message_bytes)
        .accept_compressed(Gzip)
        .accept_compressed(Zstd)
        .send_compressed(Gzip)
        .send_compressed(Zstd);
    let jobs = JobsServer::new(Jobs::new(Arc::clone(&service)))
        .max_decoding_message_size(config.max_message_bytes)
        .accept_compressed(Gzip)
        .accept_compressed(Zstd)
        .send_compressed(Gzip)
        .send_compressed(Zstd);
    let fits = FitsServer::new(Fits::new(Arc::clone(&service)))
        .max_decoding_message_size(config.max_message_bytes)
        .accept_compressed(Gzip)
        .accept_compressed(Zstd)
        .send_compressed(Gzip)
        .send_compressed(Zstd);
    health.set_serving::<FitsServer<Fits>>().await;
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
        .add_service(health_service.accept_compressed(Gzip).accept_compressed(Zstd))
        .add_service(reflection().build_v1()?.accept_compressed(Gzip).accept_compressed(Zstd))
        .add_service(reflection().build_v1alpha()?.accept_compressed(Gzip).accept_compressed(Zstd))
        .add_service(segmentations)
        .add_service(jobs)
        .add_service(fits);
    let calls = routes.routes().into_axum_router();
    let context = axum::middleware::from_fn_with_state((service, config), context::wrap);
    Ok((calls.layer(context), health))
}

/// Tells that the service ends: to those who ask, and to those who watch, who are then let go.
pub async fn end(health: &HealthReporter) {
    let segmentations = <SegmentationsServer<Segmentations> as NamedService>::NAME;
    let fits = <FitsServer<Fits> as NamedService>::NAME;
    for name in ["", segmentations, fits, <JobsServer<Jobs> as NamedService>::NAME] {
        health.set_service_status(name, ServingStatus::NotServing).await;
        // the last status is told before a watch ends
        health.clone().clear_service_status(name).await;
    }
}
