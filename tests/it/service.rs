//! The listeners, overload, deadlines, health and the end of the service.

use conicoid::service::message::v1;
use futures::StreamExt;
use tonic::Code;
use tonic_health::pb::{HealthCheckRequest, health_client::HealthClient};

use super::support::{clouds, conicoid, problem, reason, start};

#[tokio::test]
async fn a_full_queue_is_answered_at_once_and_says_when_to_come_back() {
    let running = start(&["--queue=1"]).await;
    let place = running.service.pool().admit(None).unwrap();
    let refused = running.post("", clouds::xyz(&clouds::cylinder(100))).await;
    assert!(refused.headers().contains_key("retry-after"));
    assert_eq!(problem(refused).await, (503, "overloaded".to_owned()));
    let message = || v1::SegmentRequest {
        cloud: clouds::xyz(&clouds::cylinder(100)).into(),
        ..Default::default()
    };
    let status = running.grpc().await.segment(message()).await.unwrap_err();
    assert_eq!(reason(&status), (Code::ResourceExhausted, "overloaded".to_owned()));
    drop(place);
    assert!(running.grpc().await.segment(message()).await.is_ok());
}

#[tokio::test]
async fn uploads_beyond_the_byte_budget_are_refused() {
    let running = start(&["--max-bytes-in-flight=1000"]).await;
    let refused = running.post("", clouds::xyz(&clouds::cylinder(100))).await;
    assert_eq!(problem(refused).await, (503, "overloaded".to_owned()));
    let fine = running.post("min_points=10", "0 0 0\n1 0 0\n".repeat(10)).await;
    assert_eq!(fine.status(), 200);
}

#[tokio::test]
async fn a_deadline_that_has_passed_ends_the_work() {
    let running = start(&["--threads=1"]).await;
    let _release = running.block_small_lane();
    // let the blocking run take the thread first
    tokio::task::yield_now().await;
    let cloud = clouds::xyz(&clouds::cylinder(2000));
    let late = running.post("deadline=0.1", cloud.clone()).await;
    assert_eq!(problem(late).await, (504, "deadline_exceeded".to_owned()));
    let message =
        v1::SegmentRequest { cloud: cloud.into(), deadline: Some(0.1), ..Default::default() };
    let status = running.grpc().await.segment(message).await.unwrap_err();
    assert_eq!(reason(&status), (Code::DeadlineExceeded, "deadline_exceeded".to_owned()));
}

#[tokio::test]
async fn an_upload_that_stalls_times_out() {
    let running = start(&["--upload-timeout=0.05"]).await;
    let stalled = reqwest::Body::wrap_stream(futures::stream::pending::<Result<String, String>>());
    let refused = running.post("", stalled).await;
    assert_eq!(problem(refused).await, (408, "upload_timeout".to_owned()));
}

#[tokio::test]
async fn a_call_whose_upload_stalls_times_out() {
    let running = start(&["--upload-timeout=0.05"]).await;
    let start = v1::Upload { part: Some(v1::upload::Part::Start(Default::default())) };
    let stalled = futures::stream::iter([start]).chain(futures::stream::pending());
    let status = running.grpc().await.segment_upload(stalled).await.unwrap_err();
    assert_eq!(reason(&status), (Code::DeadlineExceeded, "upload_timeout".to_owned()));
}

#[tokio::test]
async fn a_message_beyond_the_byte_budget_is_refused_before_it_is_put_together() {
    let running = start(&["--max-bytes-in-flight=100000"]).await;
    let message =
        |bytes| v1::SegmentRequest { cloud: vec![b' '; bytes].into(), ..Default::default() };
    let status = running.grpc().await.segment(message(100_000)).await.unwrap_err();
    assert_eq!(reason(&status), (Code::ResourceExhausted, "overloaded".to_owned()));
    // it is there twice while it is read
    let status = running.grpc().await.segment(message(49_000)).await.unwrap_err();
    assert_eq!(status.code(), Code::InvalidArgument, "{status}");
    assert_eq!(running.service.bytes_in_flight(), 0);
}

#[tokio::test]
async fn a_caller_reads_why_its_large_upload_is_refused() {
    let running = start(&["--max-bytes-in-flight=1000"]).await;
    for _ in 0..20 {
        let refused = running.post("", vec![b' '; 8 << 20]).await;
        assert_eq!(problem(refused).await, (503, "overloaded".to_owned()));
    }
}

#[tokio::test]
async fn an_answer_that_is_not_read_keeps_its_part_of_the_budget() {
    let running = start(&[]).await;
    let cloud = clouds::ply(&clouds::bracket(100_000));
    let bytes = cloud.len() as u64;
    let client = reqwest::Client::builder().http2_prior_knowledge();
    // two streams of one connection whose window is small
    let client = client.http2_initial_stream_window_size(1000).build().unwrap();
    let url = running.url("/v1/segmentations?method=rcond&max_regions=1&deadline=60");
    let answer = client.post(url).body(cloud).send().await.unwrap();
    assert_eq!(answer.status(), 200);
    assert!(running.service.bytes_in_flight() >= bytes);
    answer.bytes().await.unwrap();
    while running.service.bytes_in_flight() > 0 {
        tokio::task::yield_now().await;
    }
}

#[tokio::test]
async fn the_request_id_of_the_caller_comes_back() {
    let running = start(&[]).await;
    let request = reqwest::Client::new().get(running.url("/docs"));
    let answer = request.header("x-request-id", "trace-7").send().await.unwrap();
    assert_eq!(answer.headers()["x-request-id"], "trace-7");
    let long = reqwest::Client::new().get(running.url("/docs"));
    let answer = long.header("x-request-id", "x".repeat(129)).send().await.unwrap();
    assert_eq!(answer.headers()["x-request-id"].len(), 36);
}

#[tokio::test]
async fn health_and_reflection_answer() {
    use tonic_reflection::pb::v1::{
        ServerReflectionRequest, server_reflection_client::ServerReflectionClient,
        server_reflection_request::MessageRequest, server_reflection_response::MessageResponse,
    };
    let running = start(&[]).await;
    let mut health = HealthClient::new(running.channel().await);
    let answer = health.check(HealthCheckRequest::default()).await.unwrap().into_inner();
    assert_eq!(answer.status, 1);
    let mut reflection = ServerReflectionClient::new(running.channel().await);
    let list = ServerReflectionRequest {
        message_request: Some(MessageRequest::ListServices(String::new())),
        ..Default::default()
    };
    let answers = reflection.server_reflection_info(futures::stream::iter([list])).await.unwrap();
    let answer = answers.into_inner().message().await.unwrap().unwrap();
    let Some(MessageResponse::ListServicesResponse(list)) = answer.message_response else {
        panic!("no list: {answer:?}");
    };
    assert!(list.service.iter().any(|s| s.name == "conicoid.v1.Segmentations"));
}

#[tokio::test]
async fn an_unknown_grpc_method_is_unimplemented() {
    let running = start(&[]).await;
    let url = format!("http://{}/conicoid.v1.Segmentations/Guess", running.addresses.grpc);
    let client = reqwest::Client::builder().http2_prior_knowledge().build().unwrap();
    let request = client.post(url).header("content-type", "application/grpc");
    let answer = request.send().await.unwrap();
    assert_eq!(answer.headers()["grpc-status"], "12");
}

#[tokio::test]
async fn told_to_stop_it_drains_and_ends() {
    let running = start(&[]).await;
    let ready = reqwest::get(running.admin_url("/readyz")).await.unwrap();
    assert_eq!(ready.status(), 200);
    assert_eq!(reqwest::get(running.admin_url("/livez")).await.unwrap().status(), 200);
    running.stop.cancel();
    running.ended.await.unwrap();
    assert!(reqwest::get(format!("http://{}/docs", running.addresses.http)).await.is_err());
}

#[tokio::test]
async fn while_it_drains_it_is_not_ready_and_ends_what_it_has_begun() {
    let running = start(&["--threads=1"]).await;
    let release = running.block_small_lane();
    let cloud = clouds::xyz(&clouds::cylinder(200));
    let url = running.url("/v1/segmentations");
    let post = reqwest::Client::new().post(url).body(cloud);
    let under_way = tokio::spawn(post.send());
    while running.service.pool().queued() == 0 {
        tokio::task::yield_now().await;
    }
    running.stop.cancel();
    let ready = async || reqwest::get(running.admin_url("/readyz")).await.unwrap().status();
    assert_eq!(ready().await, 503);
    assert_eq!(reqwest::get(running.admin_url("/livez")).await.unwrap().status(), 200);
    drop(release);
    assert_eq!(under_way.await.unwrap().unwrap().status(), 200);
    running.ended.await.unwrap();
}

#[tokio::test]
async fn a_drain_does_not_take_longer_than_its_deadline() {
    let running = start(&["--threads=1", "--drain-deadline=0.1"]).await;
    let _release = running.block_small_lane();
    let url = running.url("/v1/segmentations");
    let post = reqwest::Client::new().post(url).body(clouds::xyz(&clouds::cylinder(200)));
    tokio::spawn(post.send());
    while running.service.pool().queued() == 0 {
        tokio::task::yield_now().await;
    }
    running.stop.cancel();
    running.ended.await.unwrap();
}

#[test]
fn an_address_that_is_taken_stops_the_start_with_a_clear_message() {
    let taken = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    let address = taken.local_addr().unwrap().to_string();
    let run = conicoid(&["serve", "--http", &address], None);
    let told = String::from_utf8_lossy(&run.stderr);
    assert!(!run.status.success());
    assert!(told.contains(&format!("cannot listen on {address} (http)")), "{told}");
}

#[tokio::test]
async fn those_who_watch_its_health_are_told_that_it_ends_and_let_go() {
    use tonic_health::pb::{HealthCheckRequest, health_client::HealthClient};
    let running = start(&["--drain-deadline=3600"]).await;
    let mut health = HealthClient::new(running.channel().await);
    let mut watches = Vec::new();
    for service in ["", "conicoid.v1.Segmentations", "conicoid.v1.Jobs", "conicoid.v1.Fits"] {
        let request = HealthCheckRequest { service: service.to_owned() };
        let mut watch = health.watch(request).await.unwrap().into_inner();
        assert_eq!(watch.message().await.unwrap().unwrap().status, 1, "{service}");
        watches.push(watch);
    }
    running.stop.cancel();
    for mut watch in watches {
        assert_eq!(watch.message().await.unwrap().unwrap().status, 2);
        assert!(watch.message().await.unwrap().is_none());
    }
    drop(health);
    running.ended.await.unwrap();
}
