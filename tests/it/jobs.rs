//! Jobs: submitted, watched, fetched, cancelled, expired, and the same when submitted again.

use conicoid::service::message::v1;
use futures::StreamExt;
use serde_json::Value;
use tonic::Code;

use super::support::{Running, clouds, location, problem, reason, start};

fn cloud() -> String {
    clouds::xyz(&clouds::cylinder(400))
}

#[tokio::test]
async fn a_job_runs_shows_its_progress_and_gives_the_synchronous_answer() {
    let running = start(&[]).await;
    let accepted = running.submit("method=rcond", cloud()).await;
    assert_eq!(accepted.headers()["preference-applied"], "respond-async");
    let place = location(&accepted);
    let events = running.events(&place).await;
    let last = events.last().unwrap();
    assert_eq!(last["state"], "succeeded");
    assert!(last["finished_ms"].as_u64() >= last["created_ms"].as_u64());
    assert_eq!(running.job(&place).await, *last);
    let mut result = running.job(&format!("{place}/result")).await;
    let mut direct: Value = running.post("method=rcond", cloud()).await.json().await.unwrap();
    (result["timing"], direct["timing"]) = (Value::Null, Value::Null);
    assert_eq!(result, direct);
}

#[tokio::test]
async fn labels_are_left_out_where_the_submission_or_the_fetch_says_so() {
    let running = start(&[]).await;
    let place = location(&running.submit("labels=none", cloud()).await);
    running.events(&place).await;
    let labels = async |query: &str| {
        running.job(&format!("{place}/result{query}")).await["labels"].is_array()
    };
    assert!(!labels("").await);
    assert!(labels("?labels=inline").await);
    let wrong = reqwest::get(running.url(&format!("{place}/result?labels=some"))).await.unwrap();
    assert_eq!(problem(wrong).await, (400, "invalid_parameter".to_owned()));
    let wrong = reqwest::get(running.url(&format!("{place}/result?label=none"))).await.unwrap();
    assert_eq!(problem(wrong).await, (400, "unknown_parameter".to_owned()));
}

#[tokio::test]
async fn a_job_that_fails_says_why() {
    let running = start(&[]).await;
    let place = location(&running.submit("", "0 0 0\n1 1 1\n").await);
    let events = running.events(&place).await;
    let last = events.last().unwrap();
    assert_eq!(
        (&last["state"], &last["problem"]["code"]),
        (&"failed".into(), &"too_few_points".into())
    );
    let result = reqwest::get(running.url(&format!("{place}/result"))).await.unwrap();
    assert_eq!(problem(result).await, (409, "job_failed".to_owned()));
}

#[tokio::test]
async fn an_empty_or_wrong_submission_is_no_job() {
    let running = start(&[]).await;
    assert_eq!(problem(running.submit("", "").await).await, (400, "empty_body".to_owned()));
    let wrong = running.submit("min_points=1", cloud()).await;
    assert_eq!(problem(wrong).await, (400, "invalid_parameter".to_owned()));
}

/// A service whose one thread for small clouds is taken until the sender is dropped.
async fn blocked(flags: &[&str]) -> (Running, std::sync::mpsc::Sender<()>) {
    let running = start(&[&["--threads=1"], flags].concat()).await;
    let release = running.block_small_lane();
    // let the blocking run take the thread first
    tokio::task::yield_now().await;
    (running, release)
}

#[tokio::test]
async fn a_queued_job_has_no_result_yet_and_can_be_cancelled_and_forgotten() {
    let (running, release) = blocked(&[]).await;
    let place = location(&running.submit("", cloud()).await);
    assert_eq!(running.job(&place).await["state"], "queued");
    let early = reqwest::get(running.url(&format!("{place}/result"))).await.unwrap();
    assert_eq!(problem(early).await, (409, "job_not_finished".to_owned()));
    let delete = async || reqwest::Client::new().delete(running.url(&place)).send().await.unwrap();
    let cancelled: Value = delete().await.json().await.unwrap();
    assert_eq!(cancelled["state"], "cancelled");
    assert_eq!(running.events(&place).await.len(), 1);
    let result = reqwest::get(running.url(&format!("{place}/result"))).await.unwrap();
    assert_eq!(problem(result).await, (409, "job_failed".to_owned()));
    assert_eq!(delete().await.status(), 200);
    let gone = reqwest::get(running.url(&place)).await.unwrap();
    assert_eq!(problem(gone).await, (404, "job_not_found".to_owned()));
    drop(release);
}

#[tokio::test]
async fn the_queue_takes_jobs_up_to_its_length_and_a_cancelled_one_gives_its_place_back() {
    let (running, _release) = blocked(&["--queue=2"]).await;
    let first = location(&running.submit("", cloud()).await);
    location(&running.submit("", cloud()).await);
    let refused = running.submit("", cloud()).await;
    assert!(refused.headers().contains_key("retry-after"));
    assert_eq!(problem(refused).await, (503, "overloaded".to_owned()));
    reqwest::Client::new().delete(running.url(&first)).send().await.unwrap();
    // the place is free once the cancelled job's task has seen it
    while running.service.pool().queued() > 1 {
        tokio::task::yield_now().await;
    }
    location(&running.submit("", cloud()).await);
}

#[tokio::test]
async fn a_retried_submission_is_the_same_job() {
    let running = start(&[]).await;
    let submit = async |query: &str, key: &str, cloud: String| {
        let url = running.url(&format!("/v1/segmentations?{query}"));
        let request = reqwest::Client::new().post(url).header("prefer", "respond-async");
        request.header("idempotency-key", key).body(cloud).send().await.unwrap()
    };
    let first = location(&submit("seed=1", "scan-7", cloud()).await);
    assert_eq!(location(&submit("seed=1", "scan-7", cloud()).await), first);
    assert_ne!(location(&submit("seed=1", "scan-8", cloud()).await), first);
    for (query, cloud) in [("seed=2", cloud()), ("seed=1", clouds::xyz(&clouds::cylinder(401)))] {
        let refused = submit(query, "scan-7", cloud).await;
        assert_eq!(problem(refused).await, (422, "idempotency_key_reused".to_owned()));
    }
    location(&submit("", &"k".repeat(255), cloud()).await);
    let long = submit("", &"k".repeat(256), cloud()).await;
    assert_eq!(problem(long).await, (400, "invalid_parameter".to_owned()));
}

#[tokio::test]
async fn results_expire_by_time() {
    let running = start(&["--result-ttl=0.001"]).await;
    let place = location(&running.submit("", cloud()).await);
    running.events(&place).await;
    let gone = async || reqwest::get(running.url(&place)).await.unwrap().status() == 404;
    while !gone().await {
        tokio::task::yield_now().await;
    }
}

#[tokio::test]
async fn results_expire_by_bytes_the_oldest_first() {
    let running = start(&["--result-bytes=30000"]).await;
    let first = location(&running.submit("", cloud()).await);
    running.events(&first).await;
    let second = location(&running.submit("", cloud()).await);
    running.events(&second).await;
    running.service.book().expire().await;
    assert_eq!(reqwest::get(running.url(&first)).await.unwrap().status(), 404);
    assert_eq!(reqwest::get(running.url(&second)).await.unwrap().status(), 200);
}

#[tokio::test]
async fn a_running_job_stops_when_it_is_cancelled() {
    let running = start(&["--threads=1"]).await;
    let scene = clouds::ply(&clouds::bracket(400_000));
    let place = location(&running.submit("method=rcond", scene).await);
    while running.job(&place).await["state"] == "queued" {
        tokio::task::yield_now().await;
    }
    let cancelled = reqwest::Client::new().delete(running.url(&place)).send().await.unwrap();
    assert_eq!(cancelled.json::<Value>().await.unwrap()["state"], "cancelled");
    // the large lane has one turn: it is free when the cancelled run has left
    let free = running.service.pool().run(None, conicoid::jobs::Lane::Large, || ()).await;
    assert_eq!(free, Ok(()));
    assert_eq!(running.job(&place).await["state"], "cancelled");
}

#[tokio::test]
async fn a_caller_that_goes_away_leaves_the_queue() {
    let (running, _release) = blocked(&[]).await;
    let request = tokio::spawn({
        let url = running.url("/v1/segmentations");
        async move { reqwest::Client::new().post(url).body(cloud()).send().await }
    });
    while running.service.pool().queued() == 0 {
        tokio::task::yield_now().await;
    }
    request.abort();
    while running.service.pool().queued() > 0 {
        tokio::task::yield_now().await;
    }
    assert_eq!(running.service.bytes_in_flight(), 0);
}

fn upload(key: &str, cloud: &str) -> Vec<v1::Upload> {
    use v1::upload::Part;
    let start = v1::UploadStart { idempotency_key: key.to_owned(), ..Default::default() };
    let chunks = cloud.as_bytes().chunks(1000).map(|c| Part::Chunk(c.to_vec().into()));
    let parts = std::iter::once(Part::Start(start)).chain(chunks);
    parts.map(|part| v1::Upload { part: Some(part) }).collect()
}

#[tokio::test]
async fn jobs_go_the_same_way_over_grpc() {
    let running = start(&[]).await;
    let mut client = running.grpc_jobs().await;
    let submit = |key| futures::stream::iter(upload(key, &cloud()));
    let job = client.submit_job(submit("k")).await.unwrap().into_inner();
    let again = client.submit_job(submit("k")).await.unwrap().into_inner();
    assert_eq!(job.id, again.id);
    let watch = v1::GetJobRequest { id: job.id.clone() };
    let seen: Vec<_> = client.watch_job(watch.clone()).await.unwrap().into_inner().collect().await;
    let last = seen.last().unwrap().as_ref().unwrap().clone();
    assert_eq!(last.state(), v1::JobState::Succeeded);
    assert_eq!(client.get_job(watch.clone()).await.unwrap().into_inner(), last);
    let ask = |omit_labels| v1::GetJobResultRequest {
        id: job.id.clone(),
        omit_labels,
        ..Default::default()
    };
    let result = client.get_job_result(ask(false)).await.unwrap().into_inner();
    assert_eq!(result.labels.len(), 400);
    let short = client.get_job_result(ask(true)).await.unwrap().into_inner();
    assert!(short.labels.is_empty() && short.input == result.input);
    let forget = v1::CancelJobRequest { id: job.id.clone() };
    client.cancel_job(forget).await.unwrap();
    let gone = client.get_job(watch).await.unwrap_err();
    assert_eq!(reason(&gone), (Code::NotFound, "job_not_found".to_owned()));
}

#[tokio::test]
async fn a_job_is_one_over_both_interfaces() {
    let (running, release) = blocked(&[]).await;
    let place = location(&running.submit("", cloud()).await);
    let id = place.rsplit('/').next().unwrap().to_owned();
    let mut client = running.grpc_jobs().await;
    let early = v1::GetJobResultRequest { id: id.clone(), ..Default::default() };
    let early = client.get_job_result(early).await.unwrap_err();
    assert_eq!(reason(&early), (Code::FailedPrecondition, "job_not_finished".to_owned()));
    let job = client.cancel_job(v1::CancelJobRequest { id }).await.unwrap().into_inner();
    assert_eq!(job.state(), v1::JobState::Cancelled);
    assert_eq!(running.job(&place).await["state"], "cancelled");
    drop(release);
}

#[tokio::test]
async fn a_retry_after_the_job_has_expired_is_a_new_job() {
    let running = start(&["--result-ttl=0.05"]).await;
    let submit = async |query: &str| {
        let url = running.url(&format!("/v1/segmentations?{query}"));
        let request = reqwest::Client::new().post(url).header("prefer", "respond-async");
        location(&request.header("idempotency-key", "1").body(cloud()).send().await.unwrap())
    };
    let first = submit("").await;
    running.events(&first).await;
    while reqwest::get(running.url(&first)).await.unwrap().status() == 200 {
        tokio::task::yield_now().await;
    }
    // the key is free for another request as well
    assert_ne!(submit("seed=7").await, first);
}

#[tokio::test]
async fn a_service_that_ends_lets_go_those_who_watch_jobs_that_the_next_one_does() {
    let directory = tempfile::tempdir().unwrap();
    let data = format!("--data-dir={}", directory.path().display());
    let running = start(&["--threads=1", &data, "--drain-deadline=3600"]).await;
    let _release = running.block_small_lane();
    let place = location(&running.submit("", cloud()).await);
    let id = place.rsplit('/').next().unwrap().to_owned();
    let mut grpc = running.grpc_jobs().await;
    let mut watch = grpc.watch_job(v1::GetJobRequest { id }).await.unwrap().into_inner();
    assert!(watch.next().await.unwrap().is_ok());
    let events = reqwest::get(running.url(&format!("{place}/events"))).await.unwrap();
    running.stop.cancel();
    assert!(events.text().await.unwrap().contains("\"queued\""));
    while let Some(job) = watch.next().await {
        assert!(job.is_ok());
    }
    drop(grpc);
    running.ended.await.unwrap();
}
