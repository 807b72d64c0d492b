use std::io::{self, IsTerminal};

use opentelemetry::trace::TracerProvider;
use tracing_subscriber::{
    EnvFilter, Layer, Registry,
    filter::{FilterExt, filter_fn},
    layer::SubscriberExt,
    util::SubscriberInitExt,
};

use super::{AnyError, LogFormat, Settings, traces::Traces};
use crate::jobs::trace;

/// Sends the log to standard error, in the form the settings ask for, and spans to `traces`.
pub fn start(settings: &Settings, traces: Option<&Traces>) -> Result<(), AnyError> {
    let filter = EnvFilter::try_new(&settings.log)
        .map_err(|e| format!("log = '{}' is not a filter: {e}", settings.log))?;
    let lines = filter.and(filter_fn(|of| of.target() != trace::TARGET));
    let log = tracing_subscriber::fmt::layer().with_writer(io::stderr);
    let log = log.with_ansi(io::stderr().is_terminal());
    let mut layers: Vec<Box<dyn Layer<Registry> + Send + Sync>> = vec![match settings.log_format {
        LogFormat::Text => log.with_filter(lines).boxed(),
        LogFormat::Json => log.json().flatten_event(true).with_filter(lines).boxed(),
    }];
    layers.extend(traces.map(|traces| {
        let layer = tracing_opentelemetry::layer()
            .with_tracer(traces.provider().tracer("conicoid"))
            .with_location(false)
            .with_threads(false)
            .with_target(false)
            .with_tracked_inactivity(false);
        layer.with_filter(filter_fn(|of| of.target() == trace::TARGET)).boxed()
    }));
    Ok(tracing_subscriber::registry().with(layers).try_init()?)
}
