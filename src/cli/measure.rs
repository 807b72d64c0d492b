use std::{
    sync::{Arc, OnceLock},
    time::Duration,
};

use metrics_exporter_prometheus::{Matcher, PrometheusBuilder, PrometheusHandle};

use crate::{
    http::{Connections, Gauges},
    service::Service,
};

/// Upper ends of the histograms' classes, in seconds: from a small cloud's time to a huge one's.
const SECONDS: [f64; 14] =
    [0.001, 0.0025, 0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1.0, 2.5, 10.0, 60.0, 300.0];

/// Measured times are put into their classes this often, also where nobody reads them: until then each
/// of them takes memory.
const UPKEEP_INTERVAL: Duration = Duration::from_secs(5);

/// The recorder of this process; metrics are one for all services in it.
fn recorder() -> Option<&'static PrometheusHandle> {
    static RECORDER: OnceLock<Option<PrometheusHandle>> = OnceLock::new();
    let install = || {
        let matcher = Matcher::Suffix("_seconds".to_owned());
        let builder = PrometheusBuilder::new().set_buckets_for_metric(matcher, &SECONDS).ok()?;
        let handle = builder.install_recorder().ok()?;
        describe();
        Some(handle)
    };
    RECORDER.get_or_init(install).as_ref()
}

fn describe() {
    use metrics::{describe_counter, describe_gauge, describe_histogram};
    describe_histogram!(
        "http_server_request_duration_seconds",
        "HTTP requests by route and status"
    );
    describe_histogram!("rpc_server_call_duration_seconds", "gRPC calls by method and code");
    describe_histogram!("conicoid_wait_seconds", "Time from admission to the start of a run");
    describe_histogram!("conicoid_run_seconds", "Time of a run on the pool");
    describe_counter!("conicoid_points_total", "Points segmented");
    describe_counter!("conicoid_rejections_total", "Requests answered with an error, by its code");
    describe_gauge!(
        "conicoid_queue_length",
        "Requests and jobs that wait for their turn; of shared jobs, those of all processes"
    );
    describe_gauge!("conicoid_shared_jobs_running", "Shared jobs that run, at any process");
    describe_counter!(
        "conicoid_redeliveries_total",
        "Shared jobs that were handed out before, to a worker that did not end them"
    );
    describe_counter!(
        "conicoid_poison_jobs_total",
        "Shared jobs that are not run again because workers ended on them"
    );
    describe_gauge!("conicoid_bytes_in_flight", "Bytes of uploads and answers held");
    describe_gauge!("conicoid_connections", "Connections of callers that are served");
    describe_counter!(
        "conicoid_connections_delayed_total",
        "Connections that came when all were taken"
    );
    describe_counter!("conicoid_tls_handshakes_failed_total", "TLS handshakes that were refused");
    describe_counter!(
        "conicoid_trace_exports_failed_total",
        "Batches of spans that did not reach the collector"
    );
    describe_counter!(
        "conicoid_connections_ended_total",
        "Connections ended because their callers kept the service waiting: too late, or to make room"
    );
}

/// Begins to measure; the answer writes all metrics down, with those that are asked for as they are.
pub fn start(service: Arc<Service>, connections: Connections) -> Gauges {
    let recorder = recorder();
    Arc::new(move || {
        metrics::gauge!("conicoid_queue_length").set(service.book().waiting() as f64);
        if let Some(running) = service.book().running_anywhere() {
            metrics::gauge!("conicoid_shared_jobs_running").set(running as f64);
        }
        metrics::gauge!("conicoid_connections").set(connections.open() as f64);
        metrics::gauge!("conicoid_bytes_in_flight").set(service.bytes_in_flight() as f64);
        recorder.map(PrometheusHandle::render).unwrap_or_default()
    })
}

/// Keeps the metrics in their place, whether anybody reads them or not.
pub async fn keep_up() {
    let mut time = tokio::time::interval(UPKEEP_INTERVAL);
    loop {
        time.tick().await;
        if let Some(recorder) = recorder() {
            // it walks over all that was measured since
            let _ = tokio::task::spawn_blocking(|| recorder.run_upkeep()).await;
        }
    }
}
