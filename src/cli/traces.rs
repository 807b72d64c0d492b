use std::{
    sync::atomic::{AtomicBool, Ordering},
    time::Duration,
};

use opentelemetry::KeyValue;
use opentelemetry_otlp::{ExporterBuildError, SpanExporter, WithExportConfig};
use opentelemetry_sdk::{
    Resource,
    error::OTelSdkResult,
    trace::{self, Sampler, SdkTracerProvider, SpanData},
};

use super::settings::Settings;

/// Longest time the last spans get to reach the collector when the service ends.
const LAST_SPANS: Duration = Duration::from_secs(2);

/// The way to the collector; the spans at hand are sent when it is dropped.
#[derive(Debug)]
pub struct Traces(SdkTracerProvider);

impl Traces {
    /// The way to the collector that the settings name, if they do. Must be called within a tokio
    /// runtime, which must outlive what is returned.
    ///
    /// # Errors
    /// The collector's URL cannot be used.
    pub fn start(settings: &Settings) -> Result<Option<Self>, ExporterBuildError> {
        let Some(endpoint) = &settings.otlp_endpoint else { return Ok(None) };
        let exporter = SpanExporter::builder().with_tonic().with_endpoint(endpoint).build()?;
        let version = KeyValue::new("service.version", env!("CARGO_PKG_VERSION"));
        // OTEL_RESOURCE_ATTRIBUTES adds to these
        let resource = Resource::builder().with_service_name("conicoid").with_attribute(version);
        let sampler =
            Sampler::ParentBased(Box::new(Sampler::TraceIdRatioBased(settings.trace_share)));
        let exporter = Watched { exporter, fails: AtomicBool::new(false) };
        let provider = SdkTracerProvider::builder()
            .with_resource(resource.build())
            .with_sampler(sampler)
            .with_batch_exporter(exporter);
        Ok(Some(Self(provider.build())))
    }

    /// What makes tracers.
    pub fn provider(&self) -> &SdkTracerProvider {
        &self.0
    }
}

impl Drop for Traces {
    fn drop(&mut self) {
        if let Err(error) = self.0.shutdown_with_timeout(LAST_SPANS) {
            tracing::warn!(%error, "the last spans did not reach the collector");
        }
    }
}

/// The exporter; batches that fail are counted, and the first of them and the next that does not are told.
#[derive(Debug)]
struct Watched<E> {
    exporter: E,
    fails: AtomicBool,
}

impl<E: trace::SpanExporter> trace::SpanExporter for Watched<E> {
    async fn export(&self, batch: Vec<SpanData>) -> OTelSdkResult {
        let done = self.exporter.export(batch).await;
        if done.is_err() {
            metrics::counter!("conicoid_trace_exports_failed_total").increment(1);
        }
        let failed = self.fails.swap(done.is_err(), Ordering::Relaxed);
        match &done {
            Err(error) if !failed => {
                tracing::warn!(%error, "traces do not reach the collector (otlp_endpoint)");
            }
            Ok(()) if failed => tracing::info!("traces reach the collector again"),
            _ => {}
        }
        done
    }

    fn shutdown_with_timeout(&self, timeout: Duration) -> OTelSdkResult {
        self.exporter.shutdown_with_timeout(timeout)
    }

    fn force_flush(&self) -> OTelSdkResult {
        self.exporter.force_flush()
    }

    fn set_resource(&mut self, resource: &Resource) {
        self.exporter.set_resource(resource);
    }
}
