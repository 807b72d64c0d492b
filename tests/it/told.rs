//! What the log and the traces tell: who asked for what, how long it took, and nothing that was forged.

use std::time::Duration;

use conicoid::service::{message::v1, sha256};
use reqwest::Client;
use serde_json::Value;
use tonic::Request;

use super::{
    support::{clouds, location},
    survival::Process,
};

/// The line of the log with this message and whose `field` is `value`.
fn line<'a>(log: &'a [Value], message: &str, field: &str, value: &str) -> &'a Value {
    let found = log.iter().find(|line| line["message"] == message && line[field] == value);
    found.unwrap_or_else(|| panic!("no line '{message}' with {field} = {value} in {log:#?}"))
}

#[tokio::test]
async fn each_line_says_who_what_and_how_long() {
    let directory = tempfile::tempdir().unwrap();
    let keys = directory.path().join("keys");
    std::fs::write(&keys, format!("scanner {}\n", sha256(b"secret"))).unwrap();
    let keys = keys.display().to_string();
    let process = Process::start(&["--log=debug", "--log-format=json", "--keys", &keys]);
    let cloud = clouds::xyz(&clouds::cylinder(300));
    let post = |query: &str, key: &str| {
        let url = format!("{}/v1/segmentations?{query}", process.http);
        Client::new().post(url).bearer_auth(key).body(cloud.clone())
    };
    assert_eq!(post("", "secret").send().await.unwrap().status(), 200);
    assert_eq!(post("min_points=5000", "secret").send().await.unwrap().status(), 422);
    assert_eq!(post("", "wrong").send().await.unwrap().status(), 401);
    let accepted = post("", "secret").header("prefer", "respond-async").send().await.unwrap();
    let place = location(&accepted);
    let events = Client::new().get(format!("{}{place}/events", process.http));
    events.bearer_auth("secret").send().await.unwrap().text().await.unwrap();
    let channel = tonic::transport::Channel::from_shared(process.grpc.replace("grpc", "http"));
    let channel = channel.unwrap().connect().await.unwrap();
    let message = v1::SegmentRequest { cloud: cloud.clone().into(), ..Default::default() };
    let mut call = Request::new(message);
    call.metadata_mut().insert("authorization", "Bearer secret".parse().unwrap());
    let mut client = v1::segmentations_client::SegmentationsClient::new(channel);
    client.segment(call).await.unwrap();

    let text = process.stop_and_read();
    let log: Vec<Value> = text.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    let whole = |line: &Value| {
        assert_eq!(line["caller"], "scanner", "{line}");
        assert_eq!(line["format"], "xyz", "{line}");
        assert_eq!(line["bytes"], cloud.len(), "{line}");
        assert_eq!(line["points"], 300, "{line}");
        assert!(line["regions"].is_u64(), "{line}");
        assert!(line["seconds"].as_f64().unwrap() > 0.0, "{line}");
    };
    let of = |status: i64| log.iter().find(|line| line["status"] == status).unwrap();
    whole(of(200));
    whole(line(&log, "done", "caller", "scanner"));
    whole(line(&log, "answered", "code", "OK"));
    let refused = of(422);
    assert_eq!(
        (&refused["caller"], &refused["code"]),
        (&"scanner".into(), &"too_few_points".into())
    );
    assert_eq!(refused["bytes"], cloud.len());
    assert!(of(401).get("caller").is_none());
    // the request names the job it became
    let accepted = of(202);
    let job = place.rsplit('/').next().unwrap();
    assert_eq!((&accepted["job"], &accepted["bytes"]), (&job.into(), &cloud.len().into()));
    // and nothing says what nobody should read
    let coordinate = cloud.split_whitespace().max_by_key(|number| number.len()).unwrap();
    for secret in ["secret", "wrong", &sha256(b"secret"), coordinate] {
        assert!(!text.contains(secret), "{secret}: {text}");
    }
}

#[tokio::test]
async fn names_in_a_request_forge_no_line_of_the_text_log() {
    let process = Process::start(&["--log=debug"]);
    let forged = "%0a2026-01-01T00:00:00Z%20%20INFO%20forged%1b[2J%c2%9b";
    let get = |url: String| Client::new().get(url).header("x-request-id", "a\"} INFO forged");
    for path in [format!("/{forged}"), format!("/v1/jobs/{forged}")] {
        get(format!("{}{path}", process.http)).send().await.unwrap();
    }
    for query in [format!("{forged}=1"), format!("seed={forged}"), format!("format={forged}")] {
        let url = format!("{}/v1/segmentations?{query}", process.http);
        let post = Client::new().post(url).header("prefer", "respond-async");
        let key = format!("tab\tand {}", "long".repeat(100));
        post.header("idempotency-key", key).body("0 0 0\n").send().await.unwrap();
    }
    let log = process.stop_and_read();
    assert!(log.matches("forged").count() > 4, "{log}");
    for line in log.lines() {
        assert!(!line.contains(char::is_control), "{line:?}");
        // the lines of the service begin with the time of this run
        assert!(line.starts_with("20") && !line.starts_with("2026-01-01T00"), "{line}");
    }
}

#[tokio::test]
async fn a_collector_that_is_away_is_told_once_and_counted() {
    // a port that nobody listens on any more
    let taken = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    let url = format!("http://{}", taken.local_addr().unwrap());
    drop(taken);
    let mut command = Process::command(&["--log=info", "--otlp-endpoint", &url]);
    command.env("OTEL_BSP_SCHEDULE_DELAY", "20");
    let process = Process::spawn(command);
    let failed = async || {
        let url = format!("{}/metrics", process.admin.replace("admin", "http"));
        let metrics = reqwest::get(url).await.unwrap().text().await.unwrap();
        let line = metrics.lines().find(|l| l.starts_with("conicoid_trace_exports_failed_total "));
        line.map_or(0, |line| line.rsplit(' ').next().unwrap().parse().unwrap())
    };
    while failed().await < 3 {
        reqwest::get(format!("{}/docs", process.http)).await.unwrap();
        tokio::time::sleep(Duration::from_millis(20)).await;
    }
    let log = process.stop_and_read();
    assert_eq!(log.matches("do not reach the collector").count(), 1, "{log}");
}
