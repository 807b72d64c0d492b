//! Traces reach a collector, under the names of OpenTelemetry's conventions.

use std::collections::HashMap;

use opentelemetry_proto::tonic::{
    collector::trace::v1::{
        ExportTraceServiceRequest, ExportTraceServiceResponse,
        trace_service_server::{TraceService, TraceServiceServer},
    },
    common::v1::{KeyValue, any_value::Value},
    trace::v1::{Span, span::SpanKind, status::StatusCode},
};
use reqwest::Client;
use tokio::{net::TcpListener, sync::mpsc};
use tokio_stream::wrappers::TcpListenerStream;
use tonic::{Request, Response, Status, transport::Server};

use super::{
    support::{clouds, location},
    survival::Process,
};

/// A collector that passes on what it gets.
struct Collector(mpsc::UnboundedSender<ExportTraceServiceRequest>);

#[tonic::async_trait]
impl TraceService for Collector {
    async fn export(
        &self,
        request: Request<ExportTraceServiceRequest>,
    ) -> Result<Response<ExportTraceServiceResponse>, Status> {
        self.0.send(request.into_inner()).map_err(|_| Status::unavailable("the test is over"))?;
        Ok(Response::new(ExportTraceServiceResponse::default()))
    }
}

async fn collector() -> (String, mpsc::UnboundedReceiver<ExportTraceServiceRequest>) {
    let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
    let url = format!("http://{}", listener.local_addr().unwrap());
    let (send, receive) = mpsc::unbounded_channel();
    let service = TraceServiceServer::new(Collector(send));
    tokio::spawn(
        Server::builder()
            .add_service(service)
            .serve_with_incoming(TcpListenerStream::new(listener)),
    );
    (url, receive)
}

fn attributes(of: &[KeyValue]) -> HashMap<&str, String> {
    let text = |value: &KeyValue| match value.value.as_ref()?.value.as_ref()? {
        Value::StringValue(text) => Some(text.clone()),
        Value::IntValue(number) => Some(number.to_string()),
        Value::DoubleValue(number) => Some(number.to_string()),
        _ => None,
    };
    of.iter().filter_map(|value| Some((value.key.as_str(), text(value)?))).collect()
}

/// The spans of one service, by name, after checking whose they are.
fn spans(sent: Vec<ExportTraceServiceRequest>) -> HashMap<String, Vec<Span>> {
    let mut spans: HashMap<_, Vec<_>> = HashMap::new();
    for of_resource in sent.into_iter().flat_map(|request| request.resource_spans) {
        let resource = of_resource.resource.unwrap_or_default();
        let resource = attributes(&resource.attributes);
        assert_eq!(resource["service.name"], "conicoid");
        assert_eq!(resource["service.version"], env!("CARGO_PKG_VERSION"));
        for span in of_resource.scope_spans.into_iter().flat_map(|scope| scope.spans) {
            spans.entry(span.name.clone()).or_default().push(span);
        }
    }
    spans
}

#[tokio::test(flavor = "multi_thread")]
async fn requests_and_jobs_are_traced_by_the_conventions() {
    let (url, mut sent) = collector().await;
    let process = Process::start(&["--otlp-endpoint", &url]);
    let segmentations = format!("{}/v1/segmentations", process.http);
    let post = || Client::new().post(&segmentations).body(clouds::xyz(&clouds::cylinder(300)));
    let trace = "0af7651916cd43dd8448eb211c80319c";
    let traced = post().header("traceparent", format!("00-{trace}-b7ad6b7169203331-01"));
    assert_eq!(traced.send().await.unwrap().status(), 200);
    let place = location(&post().header("prefer", "respond-async").send().await.unwrap());
    reqwest::get(format!("{}{place}/events", process.http)).await.unwrap().text().await.unwrap();
    assert_eq!(post().query(&[("tolerance", "-1")]).send().await.unwrap().status(), 400);
    process.stop(); // sends the last spans
    let mut requests = Vec::new();
    while let Ok(request) = sent.try_recv() {
        requests.push(request);
    }
    let spans = spans(requests);
    let posts = &spans["POST /v1/segmentations"];
    assert_eq!(posts.len(), 3);
    let first = posts.iter().find(|span| hex(&span.trace_id) == trace).unwrap();
    assert_eq!(first.kind(), SpanKind::Server);
    assert_eq!(hex(&first.parent_span_id), "b7ad6b7169203331");
    let told = attributes(&first.attributes);
    assert_eq!(told["http.request.method"], "POST");
    assert_eq!(told["http.route"], "/v1/segmentations");
    assert_eq!(told["http.response.status_code"], "200");
    // the work is part of the caller's trace, although it is done on other threads
    for step in ["parse", "segment"] {
        assert!(spans[step].iter().any(|span| span.parent_span_id == first.span_id), "{step}");
    }
    let work = spans["segment"].iter().find(|span| span.parent_span_id == first.span_id).unwrap();
    assert_eq!(attributes(&work.attributes)["conicoid.points"], "300");
    // a job has a trace of its own, linked to the request it came by
    let job = &spans["job"][0];
    assert!(posts.iter().any(|post| post.span_id == job.links[0].span_id));
    assert!(posts.iter().all(|post| post.trace_id != job.trace_id));
    assert!(spans["segment"].iter().any(|span| span.parent_span_id == job.span_id));
    // a caller's mistake is no failure of the service
    let refused = posts.iter().map(|post| (attributes(&post.attributes), post.status.clone()));
    let (_, status) =
        refused.into_iter().find(|(told, _)| told["http.response.status_code"] == "400").unwrap();
    assert_ne!(status.unwrap_or_default().code(), StatusCode::Error);
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}
