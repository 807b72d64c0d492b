//! Bad input gets a clear error over HTTP and gRPC alike, and the service goes on.

use conicoid::service::message::v1;
use tonic::Code;

use super::support::{clouds, problem, reason, start};

/// What is sent, the status and the code it must get, and the gRPC code of the same.
struct Case {
    name: &'static str,
    query: &'static str,
    body: Vec<u8>,
    status: u16,
    grpc: Code,
    code: &'static str,
}

fn case(
    name: &'static str,
    body: impl Into<Vec<u8>>,
    status: u16,
    grpc: Code,
    code: &'static str,
) -> Case {
    Case { name, query: "", body: body.into(), status, grpc, code }
}

/// Bad clouds, whatever the transport.
fn bad_clouds() -> Vec<Case> {
    let truncated = {
        let mut bytes = clouds::ply(&clouds::cylinder(100));
        bytes.truncate(bytes.len() - 1000);
        bytes
    };
    let invalid = Code::InvalidArgument;
    vec![
        case("nothing", "", 400, invalid, "empty_body"),
        case("three points", "0 0 0\n1 0 0\n0 1 0\n", 422, invalid, "too_few_points"),
        case("a header alone", clouds::ply_header(0), 422, invalid, "too_few_points"),
        case("no finite point", "nan nan nan\ninf 1 2\n", 422, invalid, "no_finite_points"),
        case("a file cut short", truncated, 422, invalid, "malformed_cloud"),
        case(
            "a header that lies",
            clouds::ply_header(1_000_000_000_000),
            422,
            invalid,
            "malformed_cloud",
        ),
        case("one point over and over", "1 2 3\n".repeat(60), 422, invalid, "extent_out_of_range"),
        case(
            "coordinates beyond reckoning",
            "0 0 0\n1e51 2 3\n".repeat(60),
            422,
            invalid,
            "extent_out_of_range",
        ),
        case("a mesh", "ISO-10303-21;\n0 0 0\n1 0 0\n0 1 0\n", 415, invalid, "unknown_format"),
        case("other columns", "a,b,c,d\n1,2,3,4\n", 422, invalid, "malformed_cloud"),
        case(
            "rows that count up",
            "1 0 0 5\n2 0 1 5\n3 1 0 5\n4 1 1 5\n5 2 1 5\n",
            422,
            invalid,
            "malformed_cloud",
        ),
        case("an archive", b"PK\x03\x04\0\0\0\0", 415, invalid, "unknown_format"),
        case("half a gzip file", b"\x1f\x8b\x08\0\0\0", 422, invalid, "malformed_cloud"),
        case("words", "once upon a time\nthere was\na cloud\n", 415, invalid, "unknown_format"),
        case("binary rubbish", [0_u8, 159, 146, 150].repeat(64), 415, invalid, "unknown_format"),
        case(
            "more points than the limit",
            clouds::xyz(&clouds::cylinder(5001)),
            413,
            Code::ResourceExhausted,
            "too_many_points",
        ),
        case("a long body", vec![b' '; 400_001], 413, Code::ResourceExhausted, "body_too_large"),
    ]
}

const LIMITS: &[&str] = &["--max-points=5000", "--max-body-bytes=400000"];

#[tokio::test]
async fn bad_clouds_are_refused_over_http_and_the_service_goes_on() {
    let running = start(LIMITS).await;
    for case in bad_clouds() {
        let got = problem(running.post(case.query, case.body).await).await;
        assert_eq!(got, (case.status, case.code.to_owned()), "{}", case.name);
    }
    let fine = running.post("labels=none", clouds::xyz(&clouds::cylinder(5000))).await;
    assert_eq!(fine.status(), 200);
}

#[tokio::test]
async fn bad_clouds_are_refused_over_grpc_and_the_service_goes_on() {
    let running = start(LIMITS).await;
    let mut client = running.grpc().await;
    let message = |cloud: Vec<u8>| v1::SegmentRequest { cloud: cloud.into(), ..Default::default() };
    for case in bad_clouds() {
        let status = client.segment(message(case.body)).await.unwrap_err();
        assert_eq!(reason(&status), (case.grpc, case.code.to_owned()), "{}", case.name);
    }
    let fine = clouds::xyz(&clouds::cylinder(5000)).into_bytes();
    assert!(client.segment(message(fine)).await.is_ok());
}

#[tokio::test]
async fn bad_requests_are_refused_over_http() {
    let running = start(LIMITS).await;
    let cloud = clouds::xyz(&clouds::cylinder(200));
    for (query, status, code) in [
        ("radius=3", 400, "unknown_parameter"),
        ("min_points=9", 400, "invalid_parameter"),
        ("tolerance=-1", 400, "invalid_parameter"),
        ("surfaces=plane,blob", 400, "invalid_parameter"),
        ("labels=some", 400, "invalid_parameter"),
        ("deadline=0", 400, "invalid_parameter"),
        ("method=magic", 400, "invalid_parameter"),
        ("min_radius=5&max_radius=2", 400, "invalid_parameter"),
        ("max_radius=2&min_radius=5", 400, "invalid_parameter"),
        ("format=dwg", 415, "unknown_format"),
        ("format=ply", 422, "malformed_cloud"),
        ("min_points=201", 422, "too_few_points"),
    ] {
        let got = problem(running.post(query, cloud.clone()).await).await;
        assert_eq!(got, (status, code.to_owned()), "{query}");
    }
}

#[tokio::test]
async fn bad_headers_and_paths_are_refused_over_http() {
    let running = start(LIMITS).await;
    let client = reqwest::Client::new();
    let cloud = || clouds::xyz(&clouds::cylinder(200));
    let post = || client.post(running.url("/v1/segmentations")).body(cloud());
    let form = "application/x-www-form-urlencoded";
    let unbroken = || post().header("content-type", form).body(cloud().replace('\n', ""));
    let later = || post().header("prefer", "respond-async");
    for (request, status, code) in [
        (post().header("content-type", "image/webp"), 415, "unknown_format"),
        (post().header("content-encoding", "br"), 415, "unsupported_encoding"),
        (post().header("content-encoding", "gzip"), 400, "malformed_body"),
        (post().header("accept", "image/webp"), 406, "not_acceptable"),
        (unbroken(), 400, "malformed_body"),
        (later().header("idempotency-key", "a b"), 400, "invalid_parameter"),
        (client.get(running.url("/v1/jobs/x/result?foo=1")), 400, "unknown_parameter"),
        (client.get(running.url("/v1/jobs/x/events?foo=1")), 400, "unknown_parameter"),
        (client.delete(running.url("/v1/jobs/x?foo=1")), 400, "unknown_parameter"),
        (post().header("accept-encoding", "identity;q=0, *;q=0"), 406, "not_acceptable"),
        (post().header("content-type", "multipart/form-data"), 400, "malformed_body"),
        (client.get(running.url("/v2")), 404, "not_found"),
        (client.delete(running.url("/v1/segmentations")), 405, "method_not_allowed"),
    ] {
        let got = problem(request.send().await.unwrap()).await;
        assert_eq!(got, (status, code.to_owned()));
    }
}

#[tokio::test]
async fn what_curl_sends_by_default_and_codings_in_capitals_are_taken() {
    let running = start(&[]).await;
    let cloud = clouds::xyz(&clouds::cylinder(200));
    let post = || reqwest::Client::new().post(running.url("/v1/segmentations"));
    let form = post().header("content-type", "application/x-www-form-urlencoded");
    assert_eq!(form.body(cloud.clone()).send().await.unwrap().status(), 200);
    for coding in ["GZIP", "x-gzip"] {
        let mut gzip = flate2::write::GzEncoder::new(Vec::new(), Default::default());
        std::io::Write::write_all(&mut gzip, cloud.as_bytes()).unwrap();
        let packed = post().header("content-encoding", coding).body(gzip.finish().unwrap());
        assert_eq!(packed.send().await.unwrap().status(), 200, "{coding}");
    }
}

#[tokio::test]
async fn a_parameter_stands_in_the_query_or_in_the_form() {
    use reqwest::multipart::{Form, Part};
    let running = start(LIMITS).await;
    for (query, json, status) in [
        ("seed=1", r#"{"seed": 2}"#, 400),
        ("", r#"{"seed": 1, "seed": 2}"#, 400),
        ("format=xyz", r#"{"format": "ply"}"#, 400),
        // said twice, it is one thing
        ("format=xyz", r#"{"format": "xyz"}"#, 200),
        ("seed=1", r#"{"min_points": 60}"#, 200),
        // the file's name is no parameter
        ("", r#"{"format": "xyz"}"#, 200),
    ] {
        let cloud = Part::text(clouds::xyz(&clouds::cylinder(200))).file_name("cloud.txt");
        let form = Form::new().part("cloud", cloud).text("parameters", json);
        let url = running.url(&format!("/v1/segmentations?{query}"));
        let answer = reqwest::Client::new().post(url).multipart(form).send().await.unwrap();
        if status == 200 {
            assert_eq!(answer.status(), 200, "{query} {json}");
        } else {
            assert_eq!(problem(answer).await, (400, "invalid_parameter".to_owned()), "{json}");
        }
    }
}

#[tokio::test]
async fn bad_multipart_bodies_are_refused() {
    use reqwest::multipart::{Form, Part};
    let running = start(LIMITS).await;
    let cloud = || Part::text(clouds::xyz(&clouds::cylinder(200)));
    for (form, status, code) in [
        (Form::new().text("parameters", "{}"), 400, "empty_body"),
        (Form::new().part("cloud", cloud()).text("parameters", "[1]"), 400, "malformed_body"),
        (Form::new().part("cloud", cloud()).text("colour", "red"), 400, "malformed_body"),
        (Form::new().part("cloud", cloud()).part("cloud", cloud()), 400, "malformed_body"),
        (
            Form::new().part("cloud", cloud()).text("parameters", r#"{"seed": -1}"#),
            400,
            "invalid_parameter",
        ),
        (
            Form::new().part("cloud", cloud()).text("parameters", " ".repeat(65 * 1024)),
            400,
            "malformed_body",
        ),
        (Form::new().part("cloud", Part::bytes(vec![b' '; 400_001])), 413, "body_too_large"),
    ] {
        let request = reqwest::Client::new().post(running.url("/v1/segmentations")).multipart(form);
        let got = problem(request.send().await.unwrap()).await;
        assert_eq!(got, (status, code.to_owned()));
    }
}

#[tokio::test]
async fn bad_parameters_and_uploads_are_refused_over_grpc() {
    use v1::upload::Part;
    let running = start(LIMITS).await;
    let mut client = running.grpc().await;
    let request = |parameters| v1::SegmentRequest {
        cloud: clouds::xyz(&clouds::cylinder(200)).into(),
        parameters: Some(parameters),
        ..Default::default()
    };
    for wrong in [
        v1::Parameters { min_points: Some(9), ..Default::default() },
        v1::Parameters { axis_direction: vec![1.0, 2.0], ..Default::default() },
        v1::Parameters { min_radius: Some(5.0), max_radius: Some(2.0), ..Default::default() },
    ] {
        let status = client.segment(request(wrong)).await.unwrap_err();
        assert_eq!(reason(&status), (Code::InvalidArgument, "invalid_parameter".into()));
    }

    let chunk = || v1::Upload { part: Some(Part::Chunk("0 0 0\n".into())) };
    let begin = |cloud: &'static str| {
        let request = v1::SegmentRequest { cloud: cloud.into(), ..Default::default() };
        let start = v1::UploadStart { request: Some(request), ..Default::default() };
        v1::Upload { part: Some(Part::Start(start)) }
    };
    for parts in [vec![], vec![chunk()], vec![begin("x")], vec![begin(""), chunk(), begin("")]] {
        let status = client.segment_upload(futures::stream::iter(parts)).await.unwrap_err();
        assert_eq!(reason(&status), (Code::InvalidArgument, "malformed_body".into()));
    }
}

#[tokio::test]
async fn a_message_beyond_the_limit_is_refused_with_the_way_round_it() {
    use v1::upload::Part;
    let running = start(&["--max-message-bytes=1000"]).await;
    let mut client = running.grpc().await;
    let message =
        |bytes| v1::SegmentRequest { cloud: vec![b' '; bytes].into(), ..Default::default() };
    let chunk = v1::Upload { part: Some(Part::Chunk(vec![b' '; 2000].into())) };
    let begin = v1::Upload { part: Some(Part::Start(v1::UploadStart::default())) };
    let parts = futures::stream::iter([begin, chunk]);
    for status in [
        client.segment(message(1000)).await.unwrap_err(),
        client.segment_upload(parts).await.unwrap_err(),
    ] {
        assert_eq!(reason(&status), (Code::ResourceExhausted, "body_too_large".into()));
        assert!(status.message().contains("limit is: 1000 bytes"), "{status}");
        assert!(status.message().contains("SegmentUpload"), "{status}");
    }
    // the limit is the message's, in which the cloud has a head of three bytes
    let within = client.segment(message(997)).await.unwrap_err();
    assert_ne!(within.code(), Code::ResourceExhausted, "{within}");
}

#[tokio::test]
async fn points_that_are_not_finite_are_skipped_counted_and_labelled() {
    let running = start(&[]).await;
    let cloud = format!("nan 0 0\n{}", clouds::xyz(&clouds::cylinder(300)));
    let answer: serde_json::Value = running.post("", cloud).await.json().await.unwrap();
    assert_eq!(answer["input"]["points"], 301);
    assert_eq!(answer["input"]["skipped"], 1);
    assert_eq!(answer["labels"].as_array().unwrap().len(), 301);
    assert_eq!(answer["labels"][0], -1);
    assert_eq!(answer["unassigned"]["reasons"]["not_finite"], 1);
}

#[tokio::test]
async fn a_body_that_expands_beyond_the_limit_is_refused() {
    let running = start(LIMITS).await;
    for encoding in ["gzip", "zstd"] {
        let (answer, sent) = running.compressed(encoding, "", &[b' '; 10_000_000]).await;
        assert!(sent < 400_000);
        assert_eq!(problem(answer).await, (413, "body_too_large".to_owned()));
    }
}

#[tokio::test]
async fn bodies_and_clouds_are_taken_up_to_their_limit_and_not_beyond() {
    let cloud = "0 0 0\n1 0 0\n".repeat(10);
    for (flag, limit, code) in [
        ("--max-body-bytes", cloud.len(), "body_too_large"),
        // a point takes 24 bytes beside the file
        ("--max-bytes-in-flight", cloud.len() + 20 * 24, "too_many_points"),
        ("--max-points", 20, "too_many_points"),
    ] {
        let running = start(&[&format!("{flag}={limit}")]).await;
        assert_eq!(running.post("min_points=10", cloud.clone()).await.status(), 200, "{flag}");
        // one byte more, and one point more
        for more in [" ".to_owned() + &cloud, cloud.clone() + "1 1 1\n"] {
            if flag == "--max-points" && more.starts_with(' ') {
                continue;
            }
            // what the last request took is given back a moment after its answer
            while running.service.bytes_in_flight() > 0 {
                tokio::task::yield_now().await;
            }
            let refused = running.post("min_points=10", more).await;
            assert_eq!(problem(refused).await, (413, code.to_owned()), "{flag}");
        }
    }
}

#[tokio::test]
async fn a_cloud_under_another_formats_name_is_told_what_it_looks_like() {
    let running = start(&[]).await;
    let ply = "ply\nformat ascii 1.0\nelement vertex 1\nproperty double x\nproperty double y\n\
               property double z\nend_header\n1 2 3\n";
    for named in ["las", "xyz", "pcd"] {
        let answer = running.post(&format!("format={named}"), ply).await;
        let document: serde_json::Value = answer.json().await.unwrap();
        let detail = document["detail"].as_str().unwrap();
        assert!(detail.contains(&format!("named {named} and looks like ply")), "{detail}");
    }
    // nothing is added where the name is right
    let answer = running.post("format=ply", ply.replace("1 2 3\n", "")).await;
    let document: serde_json::Value = answer.json().await.unwrap();
    assert!(!document["detail"].as_str().unwrap().contains("looks like"));
}

#[tokio::test]
async fn calls_that_are_none_of_the_contract_are_refused_in_its_terms() {
    let running = start(&[]).await;
    let client = reqwest::Client::builder().http2_prior_knowledge().build().unwrap();
    let message = |bytes: &[u8]| [&[0, 0, 0, 0, bytes.len() as u8], bytes].concat();
    for (call, body, code, told) in [
        ("Segmentations/Segment", message(&[0xff; 5]), Code::InvalidArgument, "contract"),
        ("Segmentations/Cut", message(&[]), Code::Unimplemented, "no such call"),
    ] {
        let url = format!("http://{}/conicoid.v1.{call}", running.addresses.grpc);
        let request = client.post(url).header("content-type", "application/grpc");
        let answer = request.header("te", "trailers").body(body).send().await.unwrap();
        let header = |name: &str| answer.headers()[name].to_str().unwrap().to_owned();
        assert_eq!(header("grpc-status"), (code as i32).to_string(), "{call}");
        assert!(header("grpc-message").replace("%20", " ").contains(told), "{call}");
        assert!(answer.headers().contains_key("grpc-status-details-bin"), "{call}");
    }
}
