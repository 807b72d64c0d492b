//! Every route by every kind of caller: nobody meets another's jobs, by any way of writing a path.

use std::fs;

use conicoid::service::{message::v1, sha256};
use reqwest::{Client, Method};
use tonic::{Code, Request};

use super::support::{Running, clouds, location, start};

/// What callers send as `Authorization`, who are not the job's owner.
fn strangers() -> Vec<(&'static str, Option<String>)> {
    let line = format!("Bearer {}", sha256(b"alpha"));
    vec![
        ("nothing", None),
        ("a wrong key", Some("Bearer gamma".into())),
        ("another's key", Some("Bearer beta".into())),
        ("a revoked key", Some("Bearer gone".into())),
        ("another scheme", Some("Basic alpha".into())),
        ("the bare key", Some("alpha".into())),
        ("no key after the scheme", Some("Bearer ".into())),
        ("the hash in the key file", Some(line)),
        ("the name of the key", Some("Bearer a".into())),
        ("the key in capitals", Some("Bearer ALPHA".into())),
        ("two keys", Some("Bearer beta alpha".into())),
    ]
}

/// A service with the keys of `a` and `b`, after the one of `c` was revoked, and a job of `a`.
async fn service() -> (Running, tempfile::TempDir, String) {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("keys");
    let line = |name: &str, key: &str| format!("{name} {}\n", sha256(key.as_bytes()));
    let kept = [line("a", "alpha"), line("b", "beta")].concat();
    fs::write(&path, format!("{kept}{}", line("c", "gone"))).unwrap();
    let running = start(&[&format!("--keys={}", path.display())]).await;
    for key in ["gone", "alpha"] {
        submit(&running, key).await;
    }
    fs::write(&path, kept).unwrap();
    let place = submit(&running, "alpha").await;
    (running, directory, place.rsplit('/').next().unwrap().to_owned())
}

async fn submit(running: &Running, key: &str) -> String {
    let request = Client::new().post(running.url("/v1/segmentations")).bearer_auth(key);
    let request = request.header("prefer", "respond-async");
    location(&request.body(clouds::xyz(&clouds::cylinder(200))).send().await.unwrap())
}

/// Every way to a job that a stranger may try.
fn ways(id: &str) -> Vec<(Method, String)> {
    let job = format!("/v1/jobs/{id}");
    let plain = id.replace('-', "");
    let paths = [
        job.clone(),
        format!("{job}/result"),
        format!("{job}/events"),
        format!("{job}/"),
        format!("{job}?key=alpha"),
        format!("/{job}"),
        format!("/v1/jobs/{}", id.to_uppercase()),
        format!("/v1/jobs/{plain}"),
        format!("/v1/jobs/%7B{id}%7D"),
        format!("/v1/jobs/x/../{id}"),
        format!("/v1/jobs/%2e%2e/jobs/{id}"),
        "/v1/jobs".to_owned(),
        "/v1/jobs/".to_owned(),
    ];
    let methods = [Method::GET, Method::HEAD, Method::POST, Method::PUT, Method::PATCH];
    let mut ways: Vec<_> =
        paths.iter().flat_map(|p| methods.iter().map(|m| (m.clone(), p.clone()))).collect();
    ways.extend(paths.into_iter().map(|path| (Method::DELETE, path)));
    ways
}

#[tokio::test]
async fn no_stranger_meets_a_job_on_any_route() {
    let (running, _directory, id) = service().await;
    for (who, header) in strangers() {
        for (method, path) in ways(&id) {
            let request = Client::new().request(method.clone(), running.url(&path));
            let request = header.iter().fold(request, |r, value| r.header("authorization", value));
            let answer = request.send().await.unwrap();
            let (status, text) = (answer.status().as_u16(), answer.text().await.unwrap());
            let said = format!("{method} {path} by {who}: {status} {text}");
            assert!((400..500).contains(&status) || !text.contains(&id), "{said}");
            assert!(!text.contains("\"regions\"") && !text.contains("\"state\""), "{said}");
        }
    }
    let owner = Client::new().get(running.url(&format!("/v1/jobs/{id}"))).bearer_auth("alpha");
    assert_eq!(owner.send().await.unwrap().status(), 200);
}

#[tokio::test]
async fn no_stranger_meets_a_job_on_any_call() {
    let (running, _directory, id) = service().await;
    let mut jobs = running.grpc_jobs().await;
    for (who, header) in strangers() {
        let another = header.as_deref() == Some("Bearer beta");
        let expected = if another { Code::NotFound } else { Code::Unauthenticated };
        let id = || id.clone();
        let codes = [
            jobs.get_job(sent(v1::GetJobRequest { id: id() }, &header)).await.map(drop),
            jobs.watch_job(sent(v1::GetJobRequest { id: id() }, &header)).await.map(drop),
            jobs.get_job_result(sent(
                v1::GetJobResultRequest { id: id(), ..Default::default() },
                &header,
            ))
            .await
            .map(drop),
            jobs.cancel_job(sent(v1::CancelJobRequest { id: id() }, &header)).await.map(drop),
        ];
        for told in codes {
            assert_eq!(told.unwrap_err().code(), expected, "{who}");
        }
    }
    let owner = Some("Bearer alpha".to_owned());
    assert!(jobs.get_job(sent(v1::GetJobRequest { id }, &owner)).await.is_ok());
}

fn sent<T>(message: T, header: &Option<String>) -> Request<T> {
    let mut call = Request::new(message);
    if let Some(value) = header {
        call.metadata_mut().insert("authorization", value.parse().unwrap());
    }
    call
}

#[tokio::test]
async fn nothing_told_to_operators_names_a_key_a_job_or_a_point() {
    let (running, _directory, id) = service().await;
    let text = clouds::xyz(&clouds::cylinder(200));
    let coordinate = text.split_whitespace().find(|word| word.len() > 12).unwrap().to_owned();
    let metrics = reqwest::get(running.admin_url("/metrics")).await.unwrap().text().await.unwrap();
    for secret in ["alpha", &sha256(b"alpha"), &id, &coordinate] {
        assert!(!metrics.contains(secret), "{secret}");
    }
}
