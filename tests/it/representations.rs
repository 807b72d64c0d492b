//! A result in each of its forms, from a request and from a job.

use conicoid::{
    formats::{Scene, write_picture},
    geometry::Vec3,
};

use super::support::{Running, clouds, location, start};

async fn fetch(running: &Running, path: &str, accept: &str) -> (String, Vec<u8>) {
    let request = reqwest::Client::new().get(running.url(path)).header("accept", accept);
    parts(request.send().await.unwrap()).await
}

async fn parts(answer: reqwest::Response) -> (String, Vec<u8>) {
    assert_eq!(answer.status(), 200);
    let media_type = answer.headers()["content-type"].to_str().unwrap().to_owned();
    (media_type, answer.bytes().await.unwrap().to_vec())
}

#[tokio::test]
async fn every_form_comes_from_a_request_and_from_a_job_alike() {
    let running = start(&[]).await;
    let cloud = clouds::ply(&clouds::bracket(3000));
    let place = location(&running.submit("seed=1", cloud.clone()).await);
    running.events(&place).await;
    for accept in [
        "application/x-npy",
        "model/ply",
        "text/csv",
        "application/vnd.conicoid.deviations+npy",
        "application/vnd.conicoid.points+csv",
        "model/step",
        "text/html",
        "image/png",
        "application/vnd.conicoid.qif+xml",
        "application/vnd.conicoid.dmis",
        "application/vnd.conicoid.characteristics+csv",
    ] {
        let url = running.url("/v1/segmentations?seed=1");
        let request = reqwest::Client::new().post(url).header("accept", accept);
        let direct = parts(request.body(cloud.clone()).send().await.unwrap()).await;
        assert_eq!(direct.0, accept);
        assert_eq!(fetch(&running, &format!("{place}/result"), accept).await, direct);
    }
}

#[tokio::test]
async fn arrays_and_tables_hold_the_labels_and_regions_of_the_document() {
    let running = start(&[]).await;
    let place = location(&running.submit("seed=1", clouds::ply(&clouds::bracket(3000))).await);
    running.events(&place).await;
    let result = format!("{place}/result");
    let document = running.job(&result).await;
    let (_, npy) = fetch(&running, &result, "application/x-npy").await;
    let values = npy[npy.len() - 3000 * 4..].chunks(4);
    let labels: Vec<_> = values.map(|b| i32::from_le_bytes(b.try_into().unwrap())).collect();
    assert_eq!(document["labels"], serde_json::json!(labels));
    let (_, csv) = fetch(&running, &result, "text/csv").await;
    let lines = String::from_utf8(csv).unwrap().lines().count();
    assert_eq!(lines, document["regions"].as_array().unwrap().len() + 1);
    let (_, ply) = fetch(&running, &result, "model/ply").await;
    assert!(ply.starts_with(b"ply\n"));
}

#[tokio::test]
async fn a_browser_that_opens_a_result_gets_the_report_with_the_name_it_was_given() {
    let running = start(&[]).await;
    let cloud = clouds::ply(&clouds::bracket(3000));
    let place = location(&running.submit("seed=1&name=bracket%20%C3%A4.ply", cloud).await);
    running.events(&place).await;
    // as browsers ask for pages
    let accept = "text/html,application/xhtml+xml,application/xml;q=0.9,image/webp,*/*;q=0.8";
    let request = reqwest::Client::new().get(running.url(&format!("{place}/result")));
    let answer = request.header("accept", accept).send().await.unwrap();
    let policy = answer.headers()["content-security-policy"].to_str().unwrap().to_owned();
    assert!(policy.starts_with("default-src 'none'") && !policy.contains("script"), "{policy}");
    let (media_type, html) = parts(answer).await;
    assert_eq!(media_type, "text/html");
    let html = String::from_utf8(html).unwrap();
    assert!(html.contains("<h1>bracket ä.ply</h1>"));
}

#[test]
fn a_picture_is_the_same_on_any_number_of_threads() {
    let points: Vec<_> = clouds::bracket(40_000).into_iter().map(Vec3::from).collect();
    let labels: Vec<i32> = (0..points.len() as i32).map(|k| k % 5 - 1).collect();
    let normals = vec![[0.0, 0.6, 0.8]; points.len()];
    let scene = Scene { points: &points, labels: &labels, normals: &normals };
    let written = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let mut bytes = Vec::new();
        pool.install(|| write_picture(&mut bytes, &scene)).unwrap();
        bytes
    };
    assert!(written(1) == written(5));
}
