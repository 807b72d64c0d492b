//! The list of a caller's jobs, and waiting for their end.

use std::{collections::BTreeSet, fs, time::Duration};

use conicoid::service::{message::v1, sha256};
use reqwest::{Client, StatusCode};
use serde_json::Value;
use tokio::time::Instant;
use tonic::Code;

use super::support::{Running, clouds, location, problem, reason, start};

fn cloud() -> String {
    clouds::xyz(&clouds::cylinder(200))
}

async fn get(running: &Running, path: &str) -> Value {
    let answer = reqwest::get(running.url(path)).await.unwrap();
    assert_eq!(answer.status(), 200, "{path}");
    answer.json().await.unwrap()
}

fn ids(list: &Value) -> Vec<String> {
    let jobs = list["jobs"].as_array().unwrap();
    jobs.iter().map(|job| job["id"].as_str().unwrap().to_owned()).collect()
}

/// Submits by the operation that makes jobs alone.
async fn submit(running: &Running, query: &str, body: impl Into<reqwest::Body>) -> String {
    let url = running.url(&format!("/v1/jobs?{query}"));
    let accepted = Client::new().post(url).body(body).send().await.unwrap();
    let place = location(&accepted);
    let job: Value = accepted.json().await.unwrap();
    assert_eq!(place, format!("/v1/jobs/{}", job["id"].as_str().unwrap()));
    place.rsplit('/').next().unwrap().to_owned()
}

#[tokio::test]
async fn jobs_are_listed_the_newest_first_in_pages_that_stay_when_others_come_and_go() {
    let running = start(&[]).await;
    let mut submitted = Vec::new();
    for k in 0..7 {
        submitted.insert(0, submit(&running, &format!("seed={k}"), cloud()).await);
    }
    let first = get(&running, "/v1/jobs?page_size=3").await;
    assert_eq!(ids(&first), submitted[..3]);
    // one comes and one goes: the pages behind the first stay as they are
    submit(&running, "seed=9", cloud()).await;
    let last_shown = running.url(&format!("/v1/jobs/{}", submitted[2]));
    reqwest::get(format!("{last_shown}?wait=60")).await.unwrap();
    assert_eq!(Client::new().delete(last_shown).send().await.unwrap().status(), 200);
    let page = |list: &Value| {
        format!("/v1/jobs?page_size=3&page_token={}", list["next_page_token"].as_str().unwrap())
    };
    let second = get(&running, &page(&first)).await;
    assert_eq!(ids(&second), submitted[3..6]);
    let third = get(&running, &page(&second)).await;
    assert_eq!(ids(&third), submitted[6..]);
    assert!(third.get("next_page_token").is_none());
    let mut grpc = running.grpc_jobs().await;
    let ask = v1::ListJobsRequest { page_size: Some(4), ..Default::default() };
    let told = grpc.list_jobs(ask.clone()).await.unwrap().into_inner();
    let next = v1::ListJobsRequest { page_token: told.next_page_token, ..ask };
    let rest = grpc.list_jobs(next).await.unwrap().into_inner();
    assert!(rest.next_page_token.is_empty());
    let told: Vec<_> = told.jobs.into_iter().chain(rest.jobs).map(|job| job.id).collect();
    assert_eq!(told, ids(&get(&running, "/v1/jobs").await));
}

#[tokio::test]
async fn a_list_shows_the_states_that_are_asked_for() {
    let running = start(&["--threads=1"]).await;
    let good = submit(&running, "wait=60", cloud()).await;
    let bad = submit(&running, "wait=60", "0 0 0\n1 1 1\n").await;
    let release = running.block_small_lane();
    tokio::task::yield_now().await;
    let waiting = submit(&running, "", cloud()).await;
    let of = async |query: &str| ids(&get(&running, &format!("/v1/jobs?{query}")).await);
    assert_eq!(of("state=succeeded").await, std::slice::from_ref(&good));
    assert_eq!(of("state=failed").await, std::slice::from_ref(&bad));
    assert_eq!(of("state=queued&state=running").await, std::slice::from_ref(&waiting));
    assert_eq!(of("state=succeeded,failed").await, [bad.clone(), good.clone()]);
    assert!(of("state=cancelled").await.is_empty());
    let mut grpc = running.grpc_jobs().await;
    let state = vec![v1::JobState::Failed.into(), v1::JobState::Succeeded.into()];
    let told = grpc.list_jobs(v1::ListJobsRequest { state, ..Default::default() }).await.unwrap();
    let told: Vec<_> = told.into_inner().jobs.into_iter().map(|job| job.id).collect();
    assert_eq!(told, [bad, good]);
    let wrong = v1::ListJobsRequest { state: vec![99], ..Default::default() };
    let refused = grpc.list_jobs(wrong).await.unwrap_err();
    assert_eq!(reason(&refused), (Code::InvalidArgument, "invalid_parameter".to_owned()));
    drop(release);
}

#[tokio::test]
async fn a_list_with_a_wrong_question_says_so() {
    let running = start(&[]).await;
    for (query, code) in [
        ("page_size=0", "invalid_parameter"),
        ("page_size=1001", "invalid_parameter"),
        ("page_token=next", "invalid_parameter"),
        ("state=done", "invalid_parameter"),
        ("owner=alpha", "unknown_parameter"),
    ] {
        let answer = reqwest::get(running.url(&format!("/v1/jobs?{query}"))).await.unwrap();
        assert_eq!(problem(answer).await, (400, code.to_owned()), "{query}");
    }
    let mut grpc = running.grpc_jobs().await;
    let long = v1::ListJobsRequest { page_size: Some(1001), ..Default::default() };
    let refused = grpc.list_jobs(long).await.unwrap_err();
    assert_eq!(reason(&refused), (Code::InvalidArgument, "invalid_parameter".to_owned()));
}

#[tokio::test]
async fn a_key_lists_its_own_jobs_and_no_others() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("keys");
    let line = |name: &str| format!("{name} {}\n", sha256(name.as_bytes()));
    fs::write(&path, line("alpha") + &line("beta") + &line("gamma")).unwrap();
    let running = start(&[&format!("--keys={}", path.display())]).await;
    let client = Client::new();
    let mut own = BTreeSet::new();
    for key in ["alpha", "beta", "alpha"] {
        let request = client.post(running.url("/v1/jobs")).bearer_auth(key).body(cloud());
        let place = location(&request.send().await.unwrap());
        if key == "alpha" {
            own.insert(place.rsplit('/').next().unwrap().to_owned());
        }
    }
    let list = async |key: &str| {
        let answer = client.get(running.url("/v1/jobs")).bearer_auth(key).send().await.unwrap();
        ids(&answer.json().await.unwrap())
    };
    assert_eq!(list("alpha").await.into_iter().collect::<BTreeSet<_>>(), own);
    assert_eq!(list("beta").await.len(), 1);
    assert!(list("gamma").await.is_empty());
    // another's page says nothing of what is in it
    let token = own.first().unwrap();
    let url = running.url(&format!("/v1/jobs?page_token={token}"));
    let answer = client.get(url).bearer_auth("gamma").send().await.unwrap();
    assert!(ids(&answer.json().await.unwrap()).is_empty());
    let nobody = client.get(running.url("/v1/jobs")).send().await.unwrap();
    assert_eq!(problem(nobody).await, (401, "unauthenticated".to_owned()));
    let refused = running.grpc_jobs().await.list_jobs(v1::ListJobsRequest::default()).await;
    assert_eq!(refused.unwrap_err().code(), Code::Unauthenticated);
}

#[tokio::test]
async fn jobs_kept_on_disk_are_listed_by_the_next_process() {
    let directory = tempfile::tempdir().unwrap();
    let data = format!("--data-dir={}", directory.path().display());
    let running = start(&[&data]).await;
    let submitted = [
        submit(&running, "wait=60", cloud()).await,
        submit(&running, "wait=60&seed=2", cloud()).await,
    ];
    running.end().await;
    let running = start(&[&data]).await;
    let [older, newer] = submitted;
    assert_eq!(ids(&get(&running, "/v1/jobs").await), [newer, older]);
}

#[tokio::test]
async fn a_wait_ends_with_the_job_or_with_its_time() {
    let running = start(&["--threads=1"]).await;
    let release = running.block_small_lane();
    tokio::task::yield_now().await;
    let id = submit(&running, "wait=0.05", cloud()).await;
    let job = get(&running, &format!("/v1/jobs/{id}?wait=0.05")).await;
    assert_eq!(job["state"], "queued");
    let early =
        reqwest::get(running.url(&format!("/v1/jobs/{id}/result?wait=0.05"))).await.unwrap();
    assert_eq!(problem(early).await, (409, "job_not_finished".to_owned()));
    let begin = Instant::now();
    let result = tokio::spawn(reqwest::get(running.url(&format!("/v1/jobs/{id}/result?wait=600"))));
    let preferred = Client::new().get(running.url(&format!("/v1/jobs/{id}")));
    let preferred = tokio::spawn(preferred.header("prefer", "wait=600").send());
    drop(release);
    let result: Value = result.await.unwrap().unwrap().json().await.unwrap();
    assert!(!result["regions"].as_array().unwrap().is_empty());
    let job: Value = preferred.await.unwrap().unwrap().json().await.unwrap();
    assert_eq!(job["state"], "succeeded");
    assert!(begin.elapsed() < Duration::from_secs(300));
    for (path, code) in [
        (format!("/v1/jobs/{id}?wait=601"), "invalid_parameter"),
        (format!("/v1/jobs/{id}?wait=-1"), "invalid_parameter"),
        (format!("/v1/jobs/{id}/result?wait=soon"), "invalid_parameter"),
        (format!("/v1/jobs/{id}?weight=1"), "unknown_parameter"),
    ] {
        let answer = reqwest::get(running.url(&path)).await.unwrap();
        assert_eq!(problem(answer).await, (400, code.to_owned()), "{path}");
    }
}

#[tokio::test]
async fn respond_async_with_a_wait_answers_with_the_surfaces_where_they_are_there_in_time() {
    let running = start(&["--threads=1"]).await;
    let post = |prefer: &str| {
        let request = Client::new().post(running.url("/v1/segmentations")).header("prefer", prefer);
        request.body(cloud()).send()
    };
    let done: Value = post("respond-async, wait=60").await.unwrap().json().await.unwrap();
    assert_eq!(done["labels"].as_array().unwrap().len(), 200);
    let release = running.block_small_lane();
    tokio::task::yield_now().await;
    let late = post("respond-async, wait=0").await.unwrap();
    assert_eq!(late.status(), StatusCode::ACCEPTED);
    assert_eq!(late.headers()["preference-applied"], "respond-async");
    drop(release);
}

#[tokio::test]
async fn those_who_wait_are_let_go_when_the_service_ends() {
    let directory = tempfile::tempdir().unwrap();
    let data = format!("--data-dir={}", directory.path().display());
    let running = start(&["--threads=1", &data, "--drain-deadline=3600"]).await;
    let _release = running.block_small_lane();
    tokio::task::yield_now().await;
    let id = submit(&running, "", cloud()).await;
    let url = running.url(&format!("/v1/jobs/{id}?wait=600"));
    let waiting = tokio::spawn(reqwest::get(url));
    // whether it waits by then or comes too late, it does not stay
    tokio::time::sleep(Duration::from_millis(50)).await;
    running.stop.cancel();
    let _ = tokio::time::timeout(Duration::from_secs(60), waiting).await.expect("it stays");
}

#[tokio::test]
async fn a_job_comes_from_a_form_and_a_form_from_no_other_body() {
    let running = start(&[]).await;
    let form = || {
        let part = reqwest::multipart::Part::bytes(cloud().into_bytes()).file_name("c.xyz");
        let form = reqwest::multipart::Form::new().part("cloud", part);
        form.text("parameters", r#"{"seed": 1, "merge": true, "surfaces": ["cylinder"]}"#)
    };
    // what the query says as well is no contradiction
    for path in ["/v1/jobs/form", "/v1/jobs", "/v1/jobs?seed=1&merge=True&wait=0"] {
        let accepted =
            Client::new().post(running.url(path)).multipart(form()).send().await.unwrap();
        let result = get(&running, &format!("{}/result?wait=60", location(&accepted))).await;
        assert_eq!(
            (&result["parameters"]["seed"], &result["input"]["format"]),
            (&1.into(), &"xyz".into())
        );
    }
    let answer = Client::new().post(running.url("/v1/segmentations/form")).multipart(form());
    let answer: Value = answer.send().await.unwrap().json().await.unwrap();
    assert_eq!(answer["regions"][0]["surface"]["type"], "cylinder");
    // every parameter may be a part; lists repeat theirs, and an empty one says nothing
    let flat = |last: &'static str| {
        let form = form().text("seed", "1").text("name", "").text("merge", "True");
        form.text("max_regions", "7")
            .text("surfaces", "cylinder")
            .text("columns", "1")
            .text("columns", "2,3")
            .text(last, "2")
    };
    let post = |path, form| Client::new().post(running.url(path)).multipart(form).send();
    let answer: Value =
        post("/v1/segmentations", flat("max_failed_seeds")).await.unwrap().json().await.unwrap();
    assert_eq!(
        (&answer["parameters"]["max_regions"], &answer["parameters"]["max_failed_seeds"]),
        (&7.into(), &2.into())
    );
    let twice = post("/v1/segmentations", flat("seed")).await.unwrap();
    assert_eq!(problem(twice).await, (400, "invalid_parameter".to_owned()));
    let unknown = post("/v1/segmentations", flat("radius")).await.unwrap();
    assert_eq!(problem(unknown).await, (400, "malformed_body".to_owned()));
    for path in ["/v1/jobs/form", "/v1/segmentations/form"] {
        let bare = Client::new().post(running.url(path)).body(cloud()).send().await.unwrap();
        assert_eq!(problem(bare).await, (400, "malformed_body".to_owned()), "{path}");
    }
}
