//! The disk fills up, fails and lies; callers go away; one key wants everything.

use std::{fs, io::Write, net::TcpStream, path::Path, time::Duration};

use conicoid::{
    formats,
    service::{message::v1, sha256},
};
use reqwest::{Client, Response};
use serde_json::Value;
use tonic::Code;

use super::support::{Running, clouds, conicoid, location, problem, reason, start};

fn cloud() -> String {
    clouds::xyz(&clouds::cylinder(300))
}

async fn keeping(directory: &Path) -> Running {
    start(&["--data-dir", directory.to_str().unwrap()]).await
}

async fn ready(running: &Running) -> (u16, String) {
    let answer = reqwest::get(running.admin_url("/readyz")).await.unwrap();
    (answer.status().as_u16(), answer.text().await.unwrap())
}

#[tokio::test]
async fn a_database_that_is_taken_away_is_told_and_taken_up_again() {
    let directory = tempfile::tempdir().unwrap();
    let running = keeping(directory.path()).await;
    assert_eq!(ready(&running).await, (200, "ready\n".to_owned()));
    let [file, aside] = ["jobs.redb", "aside"].map(|name| directory.path().join(name));
    fs::rename(&file, &aside).unwrap();
    let refused = running.submit("", cloud()).await;
    assert!(refused.headers().contains_key("retry-after"));
    assert_eq!(problem(refused).await, (503, "storage_failed".to_owned()));
    let (status, why) = ready(&running).await;
    assert!(status == 503 && why.contains("jobs.redb was removed"), "{why}");
    // who waits needs no disk
    assert_eq!(running.post("", cloud()).await.status(), 200);
    fs::rename(&aside, &file).unwrap();
    assert_eq!(ready(&running).await.0, 200);
    let place = location(&running.submit("", cloud()).await);
    assert_eq!(running.events(&place).await.last().unwrap()["state"], "succeeded");
}

#[test]
fn a_database_that_cannot_be_read_is_a_message_and_an_exit_code() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().to_str().unwrap();
    for text in [
        "no database".to_owned(),
        "\0".repeat(9000),
        format!("redb\x1a\n\u{a9}\r\n{}", "x".repeat(9000)),
    ] {
        fs::write(directory.path().join("jobs.redb"), text).unwrap();
        let ports = ["--http=127.0.0.1:0", "--grpc=127.0.0.1:0", "--admin=127.0.0.1:0"];
        let run = conicoid(&[&["serve", "--data-dir", path], &ports[..]].concat(), None);
        let told = String::from_utf8_lossy(&run.stderr);
        assert!(run.status.code().is_some_and(|code| code != 0), "{told}");
        assert!(told.contains("jobs.redb") && told.contains("move it away"), "{told}");
        assert!(!told.contains("panicked"), "{told}");
    }
}

#[tokio::test]
async fn a_damaged_result_is_an_error_and_the_others_are_as_they_were() {
    let directory = tempfile::tempdir().unwrap();
    let running = keeping(directory.path()).await;
    let mut places = Vec::new();
    for query in ["labels=inline&seed=1", "labels=inline&seed=2"] {
        let place = location(&running.submit(query, cloud()).await);
        running.events(&place).await;
        let text = reqwest::get(running.url(&format!("{place}/result"))).await.unwrap();
        places.push((place, text.text().await.unwrap()));
    }
    running.end().await;
    // another number in the first result: JSON as good as before
    let path = directory.path().join("jobs.redb");
    let mut bytes = fs::read(&path).unwrap();
    let found = bytes.windows(100).position(|w| w == &places[0].1.as_bytes()[..100]).unwrap();
    let at = found + places[0].1.find("\"points\":300").unwrap() + 9;
    bytes[at] ^= 1;
    fs::write(&path, bytes).unwrap();
    let running = keeping(directory.path()).await;
    let result = async |i: usize| {
        reqwest::get(running.url(&format!("{}/result", places[i].0))).await.unwrap()
    };
    assert_eq!(problem(result(0).await).await, (500, "storage_damaged".to_owned()));
    assert_eq!(result(1).await.text().await.unwrap(), places[1].1);
    assert!(directory.path().join("jobs.redb.damaged").exists());
    let mut client = running.grpc_jobs().await;
    let id = places[0].0.rsplit('/').next().unwrap().to_owned();
    let ask = v1::GetJobResultRequest { id, ..Default::default() };
    let damaged = client.get_job_result(ask).await.unwrap_err();
    assert_eq!(reason(&damaged), (Code::DataLoss, "storage_damaged".to_owned()));
}

#[tokio::test]
async fn callers_who_hang_up_leave_whole_jobs() {
    const CALLERS: usize = 60;
    let directory = tempfile::tempdir().unwrap();
    for running in [start(&["--queue=200"]).await, keeping(directory.path()).await] {
        let body = cloud();
        for i in 0..CALLERS {
            let head = format!(
                "POST /v1/segmentations HTTP/1.1\r\nHost: x\r\nPrefer: respond-async\r\n\
                 Idempotency-Key: k{i}\r\nContent-Length: {}\r\n\r\n{body}",
                body.len()
            );
            let mut caller = TcpStream::connect(running.addresses.http).unwrap();
            caller.write_all(head.as_bytes()).unwrap();
            tokio::time::sleep(Duration::from_micros(100 * (i as u64 % 20))).await;
        }
        for i in 0..CALLERS {
            let retry = async || {
                let request = Client::new().post(running.url("/v1/segmentations"));
                let request = request.header("prefer", "respond-async");
                request
                    .header("idempotency-key", format!("k{i}"))
                    .body(cloud())
                    .send()
                    .await
                    .unwrap()
            };
            let mut accepted = retry().await;
            while accepted.status() == 503 {
                accepted = retry().await;
            }
            let last = running.events(&location(&accepted)).await.pop().unwrap();
            assert_eq!(last["state"], "succeeded", "caller {i}");
        }
        while running.service.bytes_in_flight() > 0 || running.service.pool().queued() > 0 {
            tokio::time::sleep(Duration::from_millis(1)).await;
        }
    }
}

/// A service with one thread that is taken, and the keys `alpha` and `beta`.
async fn shared(flags: &[&str]) -> (Running, std::sync::mpsc::Sender<()>, tempfile::TempDir) {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("keys");
    fs::write(&path, format!("a {}\nb {}\n", sha256(b"alpha"), sha256(b"beta"))).unwrap();
    let keys = format!("--keys={}", path.display());
    let running = start(&[&[keys.as_str(), "--threads=1"], flags].concat()).await;
    let release = running.block_small_lane();
    tokio::task::yield_now().await;
    (running, release, directory)
}

async fn ask(running: &Running, key: &str, prefer: &str) -> Response {
    let request = Client::new().post(running.url("/v1/segmentations"));
    request.header("prefer", prefer).bearer_auth(key).body(cloud()).send().await.unwrap()
}

#[tokio::test]
async fn one_key_cannot_take_the_queue_from_the_others() {
    let (running, release, _directory) = shared(&["--queue=4", "--key-share=0.5"]).await;
    for _ in 0..2 {
        location(&ask(&running, "alpha", "respond-async").await);
    }
    for prefer in ["respond-async", "wait"] {
        let refused = ask(&running, "alpha", prefer).await;
        assert!(refused.headers().contains_key("retry-after"));
        assert_eq!(problem(refused).await, (429, "quota_exceeded".to_owned()));
    }
    let mut call = tonic::Request::new(v1::SegmentRequest {
        cloud: cloud().into_bytes().into(),
        ..Default::default()
    });
    call.metadata_mut().insert("authorization", "Bearer alpha".parse().unwrap());
    let refused = running.grpc().await.segment(call).await.unwrap_err();
    assert_eq!(reason(&refused), (Code::ResourceExhausted, "quota_exceeded".to_owned()));
    // callers who wait count as well
    let waiting = tokio::spawn({
        let url = running.url("/v1/segmentations");
        async move { Client::new().post(url).bearer_auth("beta").body(cloud()).send().await }
    });
    while running.service.pool().queued() < 3 {
        tokio::task::yield_now().await;
    }
    location(&ask(&running, "beta", "respond-async").await);
    assert_eq!(ask(&running, "beta", "respond-async").await.status(), 503);
    drop(release);
    assert_eq!(waiting.await.unwrap().unwrap().status(), 200);
    while ask(&running, "alpha", "wait").await.status() != 200 {}
}

#[tokio::test]
async fn one_key_holds_its_share_of_the_bytes_in_flight() {
    // a cloud counts with its points
    let bytes = cloud().len() + (300 + 1) * formats::BYTES_PER_POINT as usize;
    let limit = format!("--max-bytes-in-flight={}", 4 * bytes);
    let (running, _release, _directory) = shared(&[&limit]).await;
    for _ in 0..2 {
        location(&ask(&running, "alpha", "respond-async").await);
    }
    let refused = ask(&running, "alpha", "respond-async").await;
    assert_eq!(problem(refused).await, (429, "quota_exceeded".to_owned()));
    for _ in 0..2 {
        location(&ask(&running, "beta", "respond-async").await);
    }
    // who has no share of it left is told so before what all hold
    let refused = ask(&running, "beta", "respond-async").await;
    assert_eq!(problem(refused).await, (429, "quota_exceeded".to_owned()));
}

#[tokio::test]
async fn one_keys_results_do_not_push_out_anothers() {
    let (running, release, _directory) = shared(&["--result-bytes=100000"]).await;
    drop(release);
    let done = async |key: &str| {
        let place = location(&ask(&running, key, "respond-async").await);
        let url = running.url(&format!("{place}/events"));
        Client::new().get(url).bearer_auth(key).send().await.unwrap().text().await.unwrap();
        running.service.book().expire().await;
        place
    };
    let first = done("beta").await;
    let mut all = Vec::new();
    for _ in 0..12 {
        all.push(done("alpha").await);
    }
    let there = async |key: &str, place: &str| {
        let answer = Client::new().get(running.url(place)).bearer_auth(key).send().await.unwrap();
        answer.status() == 200
    };
    assert!(there("beta", &first).await);
    assert!(!there("alpha", &all[0]).await && there("alpha", &all[11]).await);
}

#[tokio::test]
async fn a_value_that_is_longer_than_any_number_is_refused_with_its_name() {
    let running = start(&[]).await;
    let long = format!("tolerance=1.{}", "0".repeat(400));
    let refused = running.post(&long, cloud()).await;
    let document: Value = refused.json().await.unwrap();
    assert_eq!(document["code"], "invalid_parameter");
    let detail = document["detail"].as_str().unwrap();
    assert!(
        detail.contains("'tolerance'") && detail.contains("402") && detail.len() < 200,
        "{detail}"
    );
}
