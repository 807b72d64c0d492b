//! HTTP answers compressed as `Accept-Encoding` asks, and bodies as `Content-Encoding` says.

use std::io::{Read, Write};

use reqwest::{Client, Response};

use super::support::{Running, clouds, location, problem, start};

async fn get(running: &Running, path: &str, accept: &str, encodings: &str) -> Response {
    let request = Client::new().get(running.url(path)).header("accept", accept);
    let answer = request.header("accept-encoding", encodings).send().await.unwrap();
    assert_eq!(answer.status(), 200, "{path} {accept}");
    answer
}

fn encoding(answer: &Response) -> Option<&str> {
    Some(answer.headers().get("content-encoding")?.to_str().unwrap())
}

fn unpacked(encoding: &str, bytes: &[u8]) -> Vec<u8> {
    match encoding {
        "gzip" => {
            let mut all = Vec::new();
            flate2::read::GzDecoder::new(bytes).read_to_end(&mut all).unwrap();
            all
        }
        _ => zstd::decode_all(bytes).unwrap(),
    }
}

#[tokio::test]
async fn answers_are_packed_as_the_caller_takes_them_and_no_other_way() {
    let running = start(&[]).await;
    let place = location(&running.submit("", clouds::ply(&clouds::bracket(20_000))).await);
    running.events(&place).await;
    let result = format!("{place}/result");
    for accept in [
        "application/json",
        "application/x-npy",
        "model/ply",
        "text/csv",
        "model/step",
        "text/html",
    ] {
        let plain = get(&running, &result, accept, "identity").await;
        assert_eq!(encoding(&plain), None, "{accept}");
        let length = plain.content_length().unwrap();
        let plain = plain.bytes().await.unwrap();
        assert_eq!(plain.len() as u64, length);
        if length < 1024 {
            continue;
        }
        for name in ["gzip", "zstd"] {
            let packed = get(&running, &result, accept, name).await;
            assert_eq!(encoding(&packed), Some(name), "{accept}");
            // of the answer as it is sent nothing is known beforehand
            assert_eq!(packed.content_length(), None, "{accept}");
            let vary: Vec<_> = packed.headers().get_all("vary").iter().collect();
            let vary = format!("{vary:?}").to_lowercase();
            assert!(vary.contains("accept-encoding") && vary.contains("\"accept"), "{vary}");
            let bytes = packed.bytes().await.unwrap();
            assert!(bytes.len() < plain.len(), "{accept} {name}");
            assert!(unpacked(name, &bytes) == plain, "{accept} {name}");
        }
        let none = get(&running, &result, accept, "br, deflate, gzip;q=0").await;
        assert_eq!(encoding(&none), None, "{accept}");
    }
    while running.service.bytes_in_flight() > 0 {
        tokio::task::yield_now().await;
    }
}

#[tokio::test]
async fn what_is_packed_short_or_a_stream_of_events_goes_as_it_is() {
    let running = start(&[]).await;
    let place = location(&running.submit("", clouds::ply(&clouds::bracket(3000))).await);
    let events = get(&running, &format!("{place}/events"), "*/*", "gzip, zstd").await;
    assert_eq!(encoding(&events), None);
    assert!(events.text().await.unwrap().contains("succeeded"));
    let picture = get(&running, &format!("{place}/result"), "image/png", "gzip").await;
    assert_eq!(encoding(&picture), None);
    assert!(picture.bytes().await.unwrap().starts_with(b"\x89PNG"));
    let job = get(&running, &place, "*/*", "gzip").await;
    assert_eq!(encoding(&job), None);
    let contract = get(&running, "/openapi.json", "*/*", "gzip").await;
    assert_eq!(encoding(&contract), Some("gzip"));
    let head = Client::new().head(running.url("/openapi.json")).header("accept-encoding", "gzip");
    let head = head.send().await.unwrap();
    assert_eq!((head.status().as_u16(), head.bytes().await.unwrap().len()), (200, 0));
    let post =
        Client::new().post(running.url("/v1/segmentations")).header("accept-encoding", "gzip");
    let answer = post.body(clouds::ply(&clouds::bracket(3000))).send().await.unwrap();
    assert_eq!(encoding(&answer), Some("gzip"));
    let bytes = unpacked("gzip", &answer.bytes().await.unwrap());
    let told: serde_json::Value = serde_json::from_slice(&bytes).unwrap();
    assert_eq!(told["labels"].as_array().unwrap().len(), 3000);
}

fn packed(encoding: &str, bytes: &[u8]) -> Vec<u8> {
    if encoding == "zstd" {
        return zstd::encode_all(bytes, 3).unwrap();
    }
    let mut gzip = flate2::write::GzEncoder::new(Vec::new(), Default::default());
    gzip.write_all(bytes).unwrap();
    gzip.finish().unwrap()
}

async fn post(running: &Running, encoding: &str, body: Vec<u8>) -> Response {
    let request = Client::new().post(running.url("/v1/segmentations"));
    request.header("content-encoding", encoding).body(body).send().await.unwrap()
}

#[tokio::test]
async fn all_members_and_frames_of_a_body_are_unpacked() {
    let running = start(&[]).await;
    let cloud = clouds::xyz(&clouds::bracket(20_000)).into_bytes();
    let (first, rest) = cloud.split_at(cloud.len() / 3);
    for encoding in ["gzip", "zstd"] {
        let body =
            [packed(encoding, first), packed(encoding, b""), packed(encoding, rest)].concat();
        let answer: serde_json::Value = post(&running, encoding, body).await.json().await.unwrap();
        assert_eq!(answer["input"]["points"], 20_000, "{encoding}");
        // the digest is of all that was packed
        assert_eq!(answer["input"]["sha256"], conicoid::service::sha256(&cloud), "{encoding}");
    }
}

#[tokio::test]
async fn bodies_that_are_not_packed_as_they_say_are_told_what_to_do() {
    let running = start(&[]).await;
    let cloud = clouds::xyz(&clouds::cylinder(2000)).into_bytes();
    for encoding in ["gzip", "zstd"] {
        let whole = packed(encoding, &cloud);
        let part = &whole[..whole.len() - 3];
        for body in [cloud.clone(), part.to_vec(), [&whole[..], part].concat()] {
            let answer = post(&running, encoding, body).await;
            assert_eq!(answer.status(), 400, "{encoding}");
            let told = answer.text().await.unwrap();
            let is_told = told.contains("leave the header out") && !told.contains("broke off");
            assert!(is_told, "{encoding}: {told}");
        }
        let form = Client::new().post(running.url("/v1/segmentations"));
        let form = form.header("content-encoding", encoding).body(cloud.clone());
        let form = form.header("content-type", "multipart/form-data; boundary=XX").send().await;
        let told = form.unwrap().text().await.unwrap();
        assert!(told.contains("leave the header out"), "{encoding}: {told}");
        assert_eq!(problem(post(&running, encoding, Vec::new()).await).await.1, "empty_body");
    }
    let form = Client::new().post(running.url("/v1/segmentations")).body("1 2 3\n4 5 6\n");
    let form = form.header("content-type", "multipart/form-data; boundary=XX").send().await;
    let told = form.unwrap().text().await.unwrap();
    assert!(told.contains("curl -F cloud=@"), "{told}");
}
