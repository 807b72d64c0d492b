//! Who may call: keys, other people's jobs, certificates, origins.

use std::{fs, path::PathBuf};

use conicoid::service::{message::v1, sha256};
use reqwest::{Client, Response};
use tempfile::TempDir;
use tonic::{Code, Request};

use super::support::{Running, clouds, conicoid, location, problem, reason, start};
use super::survival::Process;

/// A service with the keys `alpha` and `beta` of the names `a` and `b`.
async fn with_keys() -> (Running, TempDir, PathBuf) {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("keys");
    fs::write(&path, format!("a {}\nb {}\n", sha256(b"alpha"), sha256(b"beta"))).unwrap();
    let running = start(&[&format!("--keys={}", path.display())]).await;
    (running, directory, path)
}

async fn submit(running: &Running, key: Option<&str>) -> Response {
    let request = Client::new().post(running.url("/v1/segmentations"));
    let request = request.header("prefer", "respond-async");
    let request = request.body(clouds::xyz(&clouds::cylinder(200)));
    with(request, key).send().await.unwrap()
}

fn with(request: reqwest::RequestBuilder, key: Option<&str>) -> reqwest::RequestBuilder {
    match key {
        Some(key) => request.bearer_auth(key),
        None => request,
    }
}

#[tokio::test]
async fn no_key_a_wrong_key_and_a_revoked_key_are_refused_alike() {
    let (running, _directory, path) = with_keys().await;
    for key in [None, Some("gamma"), Some("")] {
        let refused = submit(&running, key).await;
        assert_eq!(refused.headers()["www-authenticate"], "Bearer");
        assert_eq!(problem(refused).await, (401, "unauthenticated".to_owned()));
    }
    assert_eq!(submit(&running, Some("alpha")).await.status(), 202);
    fs::write(&path, format!("b {}\n", sha256(b"beta"))).unwrap();
    assert_eq!(submit(&running, Some("alpha")).await.status(), 401);
    assert_eq!(submit(&running, Some("beta")).await.status(), 202);
}

#[tokio::test]
async fn a_key_revoked_in_place_is_refused_although_length_and_time_stay() {
    let (running, _directory, path) = with_keys().await;
    assert_eq!(submit(&running, Some("beta")).await.status(), 202);
    let before = fs::read_to_string(&path).unwrap();
    let modified = fs::metadata(&path).unwrap().modified().unwrap();
    fs::write(&path, before.replace(&sha256(b"beta"), &"0".repeat(64))).unwrap();
    fs::File::options().write(true).open(&path).unwrap().set_modified(modified).unwrap();
    assert_eq!(submit(&running, Some("beta")).await.status(), 401);
    assert_eq!(submit(&running, Some("alpha")).await.status(), 202);
}

#[tokio::test]
async fn a_key_file_that_is_gone_is_told_once_and_its_keys_stay() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("keys");
    fs::write(&path, format!("a {}\n", sha256(b"alpha"))).unwrap();
    let process = Process::start(&["--log=warn", "--keys", &path.display().to_string()]);
    fs::remove_file(&path).unwrap();
    for _ in 0..50 {
        let request = Client::new().get(format!("{}/v1/jobs/x", process.http));
        assert_eq!(request.bearer_auth("alpha").send().await.unwrap().status(), 404);
    }
    let log = process.stop_and_read();
    assert_eq!(log.matches("is not used").count(), 1, "{log}");
    assert!(log.contains("the key file changed") && !log.contains("alpha"), "{log}");
}

#[test]
fn a_key_file_without_keys_is_warned_of() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("keys");
    fs::write(&path, "# none yet\n").unwrap();
    let path = path.display().to_string();
    let mut process = Process::start(&["--log=warn", "--keys", &path]);
    assert!(process.logged("has no keys").contains(&path));
}

#[tokio::test]
async fn the_contract_is_open_to_those_who_have_no_key() {
    let (running, _directory, _) = with_keys().await;
    for path in ["/docs", "/openapi.json"] {
        assert_eq!(reqwest::get(running.url(path)).await.unwrap().status(), 200);
    }
}

#[tokio::test]
async fn another_keys_job_looks_like_no_job_at_all() {
    let (running, _directory, _) = with_keys().await;
    let place = location(&submit(&running, Some("alpha")).await);
    let ask = async |method: &str, path: &str, key: &str| {
        let request = Client::new().request(method.parse().unwrap(), running.url(path));
        with(request, Some(key)).send().await.unwrap()
    };
    let nobody = "/v1/jobs/01890a5d-ac96-774b-bcce-b302099a8057".to_owned();
    for path in [&place, &nobody] {
        for (method, end) in [("GET", ""), ("GET", "/result"), ("GET", "/events"), ("DELETE", "")] {
            let answer = ask(method, &format!("{path}{end}"), "beta").await;
            assert_eq!(problem(answer).await, (404, "job_not_found".to_owned()), "{method} {end}");
        }
    }
    assert_eq!(ask("GET", &place, "alpha").await.status(), 200);
    let id = place.rsplit('/').next().unwrap().to_owned();
    let mut client = running.grpc_jobs().await;
    let mut call = Request::new(v1::GetJobRequest { id });
    call.metadata_mut().insert("authorization", "Bearer beta".parse().unwrap());
    let status = client.get_job(call).await.unwrap_err();
    assert_eq!(reason(&status), (Code::NotFound, "job_not_found".to_owned()));
}

#[tokio::test]
async fn the_same_idempotency_key_of_two_callers_is_two_jobs() {
    let (running, _directory, _) = with_keys().await;
    let submit = async |key: &str| {
        let request = Client::new().post(running.url("/v1/segmentations"));
        let request = request.header("prefer", "respond-async").header("idempotency-key", "1");
        let request = request.body(clouds::xyz(&clouds::cylinder(200)));
        location(&with(request, Some(key)).send().await.unwrap())
    };
    assert_ne!(submit("alpha").await, submit("beta").await);
}

#[tokio::test]
async fn every_grpc_call_asks_for_the_key() {
    let (running, _directory, _) = with_keys().await;
    let (mut grpc, mut jobs) = (running.grpc().await, running.grpc_jobs().await);
    let nothing = || futures::stream::iter(Vec::<v1::Upload>::new());
    let statuses = [
        grpc.segment(v1::SegmentRequest::default()).await.unwrap_err(),
        grpc.segment_upload(nothing()).await.unwrap_err(),
        jobs.submit_job(nothing()).await.unwrap_err(),
        jobs.get_job(v1::GetJobRequest::default()).await.unwrap_err(),
        jobs.watch_job(v1::GetJobRequest::default()).await.unwrap_err(),
        jobs.get_job_result(v1::GetJobResultRequest::default()).await.unwrap_err(),
        jobs.cancel_job(v1::CancelJobRequest::default()).await.unwrap_err(),
    ];
    for status in &statuses {
        assert_eq!(reason(status), (Code::Unauthenticated, "unauthenticated".to_owned()));
    }
}

#[test]
fn a_made_key_fits_its_line() {
    let made = conicoid(&["key", "scanner"], None);
    let (line, told) =
        (String::from_utf8(made.stdout).unwrap(), String::from_utf8(made.stderr).unwrap());
    let key = told.trim().rsplit(' ').next().unwrap().to_owned();
    assert_eq!(line, format!("scanner {}\n", sha256(key.as_bytes())));
    assert!(!conicoid(&["key", "two words"], None).status.success());
}

#[test]
fn listening_to_strangers_without_keys_is_refused_unless_allowed() {
    for flag in ["--http", "--grpc"] {
        let run = conicoid(&["serve", flag, "0.0.0.0:0"], None);
        let told = String::from_utf8_lossy(&run.stderr);
        assert!(!run.status.success() && told.contains("--allow-anonymous"), "{told}");
    }
}

#[tokio::test]
async fn listening_to_strangers_is_allowed_on_demand() {
    let running = start(&["--http=0.0.0.0:0", "--allow-anonymous"]).await;
    assert!(running.addresses.http.ip().is_unspecified());
}

#[tokio::test]
async fn other_origins_are_refused_by_default_and_let_in_by_setting() {
    let preflight = async |running: &Running| {
        let request =
            Client::new().request(reqwest::Method::OPTIONS, running.url("/v1/segmentations"));
        let request = request.header("origin", "https://viewer.example");
        request.header("access-control-request-method", "POST").send().await.unwrap()
    };
    let answer = preflight(&start(&[]).await).await;
    assert!(!answer.headers().contains_key("access-control-allow-origin"));
    let answer = preflight(&start(&["--cors-origins=https://viewer.example"]).await).await;
    assert_eq!(answer.headers()["access-control-allow-origin"], "https://viewer.example");
}

#[tokio::test]
async fn nothing_of_a_strangers_message_is_taken_in() {
    let (running, _directory, _) = with_keys().await;
    let client = Client::builder().http2_prior_knowledge().build().unwrap();
    let url = format!("http://{}/conicoid.v1.Segmentations/Segment", running.addresses.grpc);
    // a message that never ends
    let head = futures::stream::iter([Ok::<_, std::io::Error>(vec![0, 0, 200, 0, 0])]);
    let body =
        reqwest::Body::wrap_stream(futures::StreamExt::chain(head, futures::stream::pending()));
    let request = client.post(url).header("content-type", "application/grpc").body(body);
    let answer = request.send().await.unwrap();
    assert_eq!(answer.headers()["grpc-status"], (Code::Unauthenticated as i32).to_string());
    assert_eq!(running.service.bytes_in_flight(), 0);
}
