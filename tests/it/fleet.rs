//! Front ends and workers that share their jobs over NATS.

use std::{
    process::{Child, Command, Stdio},
    time::Duration,
};

use conicoid::cli::Server;
use reqwest::{Client, StatusCode};
use serde_json::Value;
use tokio_util::sync::{CancellationToken, DropGuard};

use super::support::{Running, clouds, nats::NatsServer, settings, start};

pub fn cloud() -> String {
    clouds::xyz(&clouds::cylinder(300))
}

/// A cloud that takes seconds.
fn slow_cloud() -> Vec<u8> {
    let scatter = |i: usize, step: f64| (i as f64 * step).fract() as f32;
    let n = 1_200_000;
    let header = format!(
        "ply\nformat binary_little_endian 1.0\nelement vertex {n}\nproperty float x\n\
         property float y\nproperty float z\nend_header\n"
    );
    let point = |i| {
        [0.618_033_988_749_895, 0.569_840_290_998_053, 0.754_877_666_246_693].map(|s| scatter(i, s))
    };
    let coordinates = (0..n).flat_map(point).flat_map(f32::to_le_bytes);
    header.into_bytes().into_iter().chain(coordinates).collect()
}

/// A front end of the jobs on `nats`.
async fn front(nats: &NatsServer, flags: &[&str]) -> Running {
    let url = format!("--nats={}", nats.url());
    start(&[&[url.as_str(), "--nats-ack-wait=1"], flags].concat()).await
}

/// A worker of this process, until it is dropped.
async fn worker(nats: &NatsServer) -> DropGuard {
    let url = format!("--nats={}", nats.url());
    let server = Server::bind_worker(settings(&[&url, "--nats-ack-wait=1"])).await.unwrap();
    assert!(server.addresses().unwrap().is_none());
    let stop = CancellationToken::new();
    let run = server.run(stop.clone());
    tokio::spawn(async move { run.await.unwrap() });
    stop.drop_guard()
}

/// A worker in a process of its own; killed when dropped.
struct Worker(Child);

impl Worker {
    fn start(nats: &NatsServer, flags: &[&str]) -> Self {
        let url = format!("--nats={}", nats.url());
        let child = Command::new(env!("CARGO_BIN_EXE_conicoid"))
            .args(["worker", &url, "--admin=127.0.0.1:0", "--nats-ack-wait=1", "--log=error"])
            .args(flags)
            .stdout(Stdio::null())
            .spawn()
            .unwrap();
        Self(child)
    }

    fn tell(&self, signal: &str) {
        Command::new("kill").args([signal, &self.0.id().to_string()]).status().unwrap();
    }
}

impl Drop for Worker {
    fn drop(&mut self) {
        // it may have ended
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// Submits a cloud as a job; its id.
pub async fn submit(front: &Running, query: &str, cloud: impl Into<reqwest::Body>) -> String {
    let url = front.url(&format!("/v1/jobs?{query}"));
    let answer = Client::new().post(url).body(cloud).send().await.unwrap();
    assert_eq!(answer.status(), StatusCode::ACCEPTED);
    let job: Value = answer.json().await.unwrap();
    job["id"].as_str().unwrap().to_owned()
}

async fn get(front: &Running, path: &str) -> Value {
    reqwest::get(front.url(path)).await.unwrap().json().await.unwrap()
}

/// Waits until a job is in `state` where `front` sees it.
pub async fn until(front: &Running, id: &str, state: &str) -> Value {
    let begin = std::time::Instant::now();
    loop {
        let job = get(front, &format!("/v1/jobs/{id}")).await;
        if job["state"] == state {
            return job;
        }
        assert!(begin.elapsed() < Duration::from_secs(120), "{job}");
        tokio::time::sleep(Duration::from_millis(10)).await;
    }
}

/// An answer without the seconds that it took.
fn without_times(mut answer: Value) -> Value {
    answer.as_object_mut().unwrap().remove("timing").expect("an answer has its times");
    answer
}

#[tokio::test(flavor = "multi_thread")]
async fn a_job_of_one_front_end_is_seen_at_another_and_answered_as_without_any() {
    let nats = NatsServer::start();
    let (a, b) = (front(&nats, &[]).await, front(&nats, &[]).await);
    let id = submit(&a, "", cloud()).await;
    until(&b, &id, "queued").await;
    let events = reqwest::get(b.url(&format!("/v1/jobs/{id}/events"))).await.unwrap();
    let _worker = worker(&nats).await;
    // it ends with the job
    let events = events.text().await.unwrap();
    assert!(events.contains("\"queued\"") && events.contains("\"succeeded\""), "{events}");
    let own = start(&[]).await;
    let right: Value = own.post("", cloud()).await.json().await.unwrap();
    for front in [&a, &b] {
        until(front, &id, "succeeded").await;
        let answer = get(front, &format!("/v1/jobs/{id}/result")).await;
        assert_eq!(without_times(answer), without_times(right.clone()));
        let jobs = get(front, "/v1/jobs").await;
        assert_eq!(jobs["jobs"][0]["id"], *id);
    }
    let points = reqwest::Client::new().get(b.url(&format!("/v1/jobs/{id}/result")));
    let ply = points.header("accept", "model/ply").send().await.unwrap();
    assert_eq!(ply.status(), 200);
    assert!(ply.bytes().await.unwrap().starts_with(b"ply"));
    // forgotten at one, gone at the other
    Client::new().delete(b.url(&format!("/v1/jobs/{id}"))).send().await.unwrap();
    while reqwest::get(a.url(&format!("/v1/jobs/{id}"))).await.unwrap().status() != 404 {
        tokio::time::sleep(Duration::from_millis(5)).await;
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn who_waits_for_an_answer_gets_a_workers_in_every_form_and_its_errors() {
    let nats = NatsServer::start();
    let a = front(&nats, &[]).await;
    let _worker = worker(&nats).await;
    let own = start(&[]).await;
    let right: Value = own.post("", cloud()).await.json().await.unwrap();
    let answer: Value = a.post("", cloud()).await.json().await.unwrap();
    assert_eq!(without_times(answer), without_times(right));
    for media_type in ["model/ply", "text/csv", "application/step", "application/x-protobuf"] {
        let mut told = Vec::new();
        for service in [&own, &a] {
            let request = Client::new().post(service.url("/v1/segmentations")).body(cloud());
            let answer = request.header("accept", media_type).send().await.unwrap();
            assert_eq!(answer.status(), 200, "{media_type}");
            told.push(answer.bytes().await.unwrap());
        }
        // protobuf has the times in it, STEP the hour
        if ["model/ply", "text/csv"].contains(&media_type) {
            assert_eq!(told[0], told[1], "{media_type}");
        }
    }
    for (query, cloud, status, code) in [
        ("", b"0 0 0\n1 1 1\n".to_vec(), 422, "too_few_points"),
        ("", b"what is this".to_vec(), 415, "unknown_format"),
        ("deadline=0.1", slow_cloud(), 504, "deadline_exceeded"),
        ("colour=red", cloud().into_bytes(), 400, "unknown_parameter"),
    ] {
        let answer = a.post(query, cloud).await;
        let got = answer.status().as_u16();
        let problem: Value = answer.json().await.unwrap();
        assert_eq!((got, &problem["code"]), (status, &Value::from(code)), "{problem}");
    }
    // nothing is left of what was answered
    while get(&a, "/v1/jobs").await["jobs"] != Value::Array(Vec::new()) {
        tokio::time::sleep(Duration::from_millis(5)).await;
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_job_is_cancelled_at_any_front_end_whether_it_waits_or_runs() {
    let nats = NatsServer::start();
    let (a, b) = (front(&nats, &[]).await, front(&nats, &[]).await);
    let waiting = submit(&a, "", cloud()).await;
    until(&b, &waiting, "queued").await;
    let cancel = async |id: &str| {
        let answer = Client::new().delete(b.url(&format!("/v1/jobs/{id}"))).send().await.unwrap();
        answer.json::<Value>().await.unwrap()
    };
    assert_eq!(cancel(&waiting).await["state"], "cancelled");
    until(&a, &waiting, "cancelled").await;
    let _worker = worker(&nats).await;
    let running = submit(&a, "", slow_cloud()).await;
    let seen = until(&b, &running, "running").await;
    assert!(seen["started_ms"].is_u64());
    assert_eq!(cancel(&running).await["state"], "cancelled");
    until(&a, &running, "cancelled").await;
    // its threads are free
    let next = submit(&b, "", cloud()).await;
    until(&a, &next, "succeeded").await;
}

#[tokio::test(flavor = "multi_thread")]
async fn idempotency_keys_queue_and_shares_hold_across_front_ends() {
    let nats = NatsServer::start();
    let (a, b) = (front(&nats, &["--queue=3"]).await, front(&nats, &["--queue=3"]).await);
    let ask = async |front: &Running, key: &str, cloud: String| {
        let request = Client::new().post(front.url("/v1/jobs")).header("idempotency-key", key);
        let answer = request.body(cloud).send().await.unwrap();
        let status = answer.status().as_u16();
        let told: Value = answer.json().await.unwrap();
        let text = told["id"].as_str().or(told["code"].as_str()).unwrap().to_owned();
        (status, text)
    };
    // at the very same time as well
    let both = tokio::join!(ask(&a, "k", cloud()), ask(&b, "k", cloud()));
    assert_eq!((both.0.0, &both.0), (202, &both.1));
    assert_eq!(ask(&b, "k", cloud()).await, both.0);
    let other = clouds::xyz(&clouds::cylinder(301));
    assert_eq!(ask(&b, "k", other).await, (422, "idempotency_key_reused".to_owned()));
    submit(&a, "", cloud()).await;
    submit(&b, "", cloud()).await;
    for front in [&a, &b] {
        assert_eq!(ask(front, "l", cloud()).await, (503, "overloaded".to_owned()));
    }
    let _worker = worker(&nats).await;
    until(&a, &both.0.1, "succeeded").await;
    let mut at = 0;
    // there is room again
    while ask(&a, "l", cloud()).await.0 != 202 {
        at += 1;
        assert!(at < 1000);
        tokio::time::sleep(Duration::from_millis(10)).await;
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_killed_workers_job_is_run_by_another_and_one_that_kills_them_all_is_failed() {
    let nats = NatsServer::start();
    let a = front(&nats, &[]).await;
    let first = Worker::start(&nats, &[]);
    let id = submit(&a, "", slow_cloud()).await;
    let begun = until(&a, &id, "running").await["started_ms"].clone();
    drop(first);
    let second = Worker::start(&nats, &[]);
    while until(&a, &id, "running").await["started_ms"] == begun {
        tokio::time::sleep(Duration::from_millis(10)).await;
    }
    drop(second);
    // it has ended two workers by now, and this one does not give it a third
    let _careful = Worker::start(&nats, &["--max-crashes=2"]);
    let job = until(&a, &id, "failed").await;
    assert_eq!(job["problem"]["code"], "run_crashed", "{job}");
    // the others are well
    let next = submit(&a, "", cloud()).await;
    until(&a, &next, "succeeded").await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_worker_that_is_told_to_stop_gives_its_job_to_another() {
    let nats = NatsServer::start();
    let a = front(&nats, &[]).await;
    let first = Worker::start(&nats, &["--drain-deadline=0.1"]);
    let id = submit(&a, "deadline=300", slow_cloud()).await;
    until(&a, &id, "running").await;
    first.tell("-TERM");
    until(&a, &id, "queued").await;
    // one that counted this as a crash would fail it
    let _second = Worker::start(&nats, &["--max-crashes=1"]);
    until(&a, &id, "succeeded").await;
}

#[tokio::test(flavor = "multi_thread")]
async fn while_nats_is_away_callers_are_told_so_and_afterwards_all_goes_on() {
    let mut nats = NatsServer::start();
    let a = front(&nats, &[]).await;
    let waiting = submit(&a, "", cloud()).await;
    nats.end();
    let ready = async || reqwest::get(a.admin_url("/readyz")).await.unwrap().status();
    while ready().await != 503 {
        tokio::time::sleep(Duration::from_millis(10)).await;
    }
    let refused = Client::new().post(a.url("/v1/jobs")).body(cloud()).send().await.unwrap();
    assert_eq!(refused.status(), 503);
    assert!(refused.headers().contains_key("retry-after"));
    let problem: Value = refused.json().await.unwrap();
    assert_eq!(problem["code"], "storage_failed", "{problem}");
    // what is known is told all the same
    assert_eq!(get(&a, &format!("/v1/jobs/{waiting}")).await["state"], "queued");
    nats.run();
    while ready().await != 200 {
        tokio::time::sleep(Duration::from_millis(10)).await;
    }
    let _worker = worker(&nats).await;
    until(&a, &waiting, "succeeded").await;
    let next = submit(&a, "", cloud()).await;
    until(&a, &next, "succeeded").await;
}

#[tokio::test(flavor = "multi_thread")]
async fn of_three_servers_one_may_end_at_any_time() {
    let mut nats = NatsServer::cluster();
    let url = nats.iter().map(NatsServer::url).collect::<Vec<_>>().join(",");
    let flags = [format!("--nats={url}"), "--nats-replicas=3".to_owned()];
    let flags: Vec<_> = flags.iter().map(String::as_str).collect();
    let a = start(&flags).await;
    let server = Server::bind_worker(settings(&flags)).await.unwrap();
    let stop = CancellationToken::new();
    let run = server.run(stop.clone());
    tokio::spawn(async move { run.await.unwrap() });
    let _stop = stop.drop_guard();
    for node in &mut nats {
        let before = submit(&a, "", cloud()).await;
        node.end();
        // a caller asks again while the servers choose a leader
        let next = loop {
            let request = Client::new().post(a.url("/v1/jobs")).body(cloud());
            let answer = request.header("idempotency-key", "k").send().await.unwrap();
            if answer.status() == 202 {
                let job: Value = answer.json().await.unwrap();
                break job["id"].as_str().unwrap().to_owned();
            }
            assert_eq!(answer.status(), 503);
            tokio::time::sleep(Duration::from_millis(50)).await;
        };
        until(&a, &before, "succeeded").await;
        until(&a, &next, "succeeded").await;
        node.run();
        Client::new().delete(a.url(&format!("/v1/jobs/{next}"))).send().await.unwrap();
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_job_whose_message_was_lost_is_found_again() {
    let nats = NatsServer::start();
    let a = front(&nats, &[]).await;
    let id = submit(&a, "", cloud()).await;
    let client = async_nats::connect(nats.url()).await.unwrap();
    let stream = async_nats::jetstream::new(client).get_stream("conicoid_queue").await.unwrap();
    stream.purge().await.unwrap();
    let _worker = worker(&nats).await;
    // it is looked for after a while
    until(&a, &id, "succeeded").await;
}

/// A tube and a plate with some noise, without pattern.
fn tube_on_plate(n: usize) -> Vec<u8> {
    let point = |k: usize| {
        let [a, b, c] =
            [0.618_033_988, 0.569_840_290, 0.754_877_666].map(|s| (k as f64 * s).fract());
        let noise = 0.02 * (c + (k * 7919 % 1000) as f64 / 1000.0 - 1.0);
        let angle = std::f64::consts::TAU * a;
        let point = match k % 2 {
            0 => [(2.0 + noise) * angle.cos(), (2.0 + noise) * angle.sin(), 5.0 * b],
            _ => [8.0 * a - 4.0, 8.0 * b - 4.0, noise],
        };
        point.map(|x| x as f32)
    };
    let header = format!(
        "ply\nformat binary_little_endian 1.0\nelement vertex {n}\nproperty float x\n\
         property float y\nproperty float z\nend_header\n"
    );
    header
        .into_bytes()
        .into_iter()
        .chain((0..n).flat_map(point).flat_map(f32::to_le_bytes))
        .collect()
}

#[tokio::test(flavor = "multi_thread")]
async fn a_cloud_above_the_setting_is_worked_on_in_parts_by_all_and_answered_as_by_one() {
    let nats = NatsServer::start();
    let a = front(&nats, &[]).await;
    let alone = start(&[]).await;
    let body = tube_on_plate(300_000);
    let flags = ["--tile-points=40000", "--threads=1"];
    let first = Worker::start(&nats, &flags);
    let _second = Worker::start(&nats, &flags);
    let id = submit(&a, "", body.clone()).await;
    // whoever has it, parts are done again
    until(&a, &id, "running").await;
    drop(first);
    let _third = Worker::start(&nats, &flags);
    until(&a, &id, "succeeded").await;
    let parts = get(&a, &format!("/v1/jobs/{id}/result")).await;
    let by_one = submit(&alone, "", body).await;
    until(&alone, &by_one, "succeeded").await;
    let whole = get(&alone, &format!("/v1/jobs/{by_one}/result")).await;
    assert_eq!(parts["input"], whole["input"]);
    let labels = |answer: &Value| answer["labels"].as_array().unwrap().clone();
    let (a_labels, b_labels) = (labels(&parts), labels(&whole));
    assert_eq!(a_labels.len(), 300_000);
    let differ = a_labels.iter().zip(&b_labels).filter(|(a, b)| a != b).count();
    // those that both surfaces pass through
    assert!(differ < 2_000, "{differ}");
    let pairs =
        parts["regions"].as_array().unwrap().iter().zip(whole["regions"].as_array().unwrap());
    for (a, b) in pairs {
        assert_eq!(a["type"], b["type"]);
        assert!(a["type"].is_string());
        let radius = |region: &Value| region["surface"]["radius"].as_f64();
        if let (Some(x), Some(y)) = (radius(a), radius(b)) {
            let deviation = b["uncertainty"]["radius"].as_f64().unwrap();
            assert!((x - y).abs() < deviation, "{x} {y} {deviation}");
        }
    }
    // nothing of the parts is left
    let client = async_nats::connect(nats.url()).await.unwrap();
    let context = async_nats::jetstream::new(client);
    let blobs = context.get_stream("conicoid_blobs").await.unwrap();
    let subjects: usize = blobs.cached_info().state.messages as usize;
    let cloud = (300_000 * 12 + 200usize).div_ceil(512 << 10);
    assert!(subjects <= cloud + 4, "{subjects}");
}

#[test]
fn without_servers_there_is_no_worker() {
    let run = super::support::conicoid(&["worker", "--admin=127.0.0.1:0"], None);
    assert!(!run.status.success());
    assert!(String::from_utf8_lossy(&run.stderr).contains("no NATS server is named"));
}
