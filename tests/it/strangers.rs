//! Callers that do not keep to the rules take neither connections, memory nor labels from the others.

use std::{
    io::{Read, Write},
    net::SocketAddr,
    process::{Command, Stdio},
};

use reqwest::{
    Client,
    multipart::{Form, Part},
};
use tokio::{io::AsyncWriteExt, net::TcpStream};

use super::support::{
    Running, clouds, problem, start,
    wire::{self, connect, frame, is_open, preface, read_to_close},
};

fn cloud() -> String {
    clouds::xyz(&clouds::cylinder(300))
}

async fn metrics(running: &Running) -> String {
    reqwest::get(running.admin_url("/metrics")).await.unwrap().text().await.unwrap()
}

#[tokio::test]
async fn connections_that_never_ask_end_in_time() {
    let running = start(&["--head-timeout=0.3", "--idle-timeout=0.4"]).await;
    let settings = [wire::PREFACE, &frame(wire::SETTINGS, 0, 0, b"")].concat();
    let half = [settings.clone(), frame(wire::HEADERS, 1, 1, b"")].concat();
    let starts: [&[u8]; 8] = [
        b"",
        b"P",
        b"PRI * HTTP/2.0\r\n",
        b"GET /do",
        b"GET /docs HTTP/1.1\r\nHost: a\r\n",
        wire::PREFACE,
        &settings,
        &half,
    ];
    for address in [running.addresses.http, running.addresses.grpc, running.addresses.admin] {
        let mut held = Vec::new();
        for start in starts {
            held.push(connect(address, start).await);
        }
        for mut stream in held {
            read_to_close(&mut stream).await;
        }
    }
}

#[tokio::test]
async fn a_connection_without_a_request_under_way_ends_in_time_and_pings_do_not_keep_it() {
    let running = start(&["--head-timeout=60", "--idle-timeout=0.3"]).await;
    let asked = b"GET /livez HTTP/1.1\r\nHost: a\r\n\r\n";
    let mut one = connect(running.addresses.http, asked).await;
    assert!(read_to_close(&mut one).await.starts_with(b"HTTP/1.1 404"));
    let asked = [preface(65535), wire::request(1, "GET", "/docs", &[])].concat();
    let mut two = connect(running.addresses.http, &asked).await;
    let ping = frame(wire::PING, 0, 0, b"12345678");
    let (mut read, mut write) = two.split();
    let pings = async {
        while write.write_all(&ping).await.is_ok() {
            tokio::time::sleep(std::time::Duration::from_millis(20)).await;
        }
    };
    let mut bytes = Vec::new();
    let end = tokio::io::AsyncReadExt::read_to_end(&mut read, &mut bytes);
    tokio::select! {
        _ = end => {}
        () = pings => {}
    }
}

#[tokio::test]
async fn a_newcomer_takes_the_place_of_the_longest_silent_and_of_no_other() {
    let running = start(&["--max-connections=4"]).await;
    let ask = async || Client::new().get(running.url("/docs")).send().await.unwrap().status();
    let mut silent = Vec::new();
    for _ in 0..3 {
        silent.push(connect(running.addresses.http, b"").await);
    }
    // there is room for one more
    assert_eq!(ask().await, 200);
    assert!(silent.iter().all(is_open));
    silent.push(connect(running.addresses.grpc, wire::PREFACE).await);
    assert_eq!(ask().await, 200);
    read_to_close(&mut silent[0]).await;
    assert!(silent[1..3].iter().all(is_open));
    assert!(metrics(&running).await.contains("conicoid_connections_ended_total{cause=\"room\"}"));
}

#[tokio::test]
async fn silent_connections_of_every_kind_give_way_to_honest_callers() {
    let running = start(&["--max-connections=4", "--threads=1"]).await;
    let post = "POST /v1/segmentations HTTP/1.1\r\nHost: a\r\nTransfer-Encoding: chunked\r\n\r\n";
    let unread = [preface(0), wire::request(1, "GET", "/docs", &[])].concat();
    let watched = [preface(0), wire::request(1, "GET", "/openapi.json", &[])].concat();
    let begun = format!("{post}1\r\n1\r\n");
    let starts: [&[u8]; 6] =
        [b"", b"GET / HTTP/1.1\r\n", post.as_bytes(), begun.as_bytes(), &unread, &watched];
    for start in starts {
        let mut held = Vec::new();
        for _ in 0..8 {
            held.push(connect(running.addresses.http, start).await);
        }
        let answer = running.post("min_points=10", cloud()).await;
        assert_eq!(answer.status(), 200, "{}", String::from_utf8_lossy(start));
    }
}

#[tokio::test]
async fn a_request_at_work_is_not_ended_for_room() {
    let running = start(&["--max-connections=1", "--threads=1"]).await;
    let release = running.block_small_lane();
    let at_work = running.post("min_points=10", cloud());
    let ready = async || reqwest::get(running.admin_url("/readyz")).await.unwrap();
    let newcomer = async {
        while running.service.pool().queued() == 0 {
            tokio::task::yield_now().await;
        }
        let answer = tokio::spawn(Client::new().get(running.url("/docs")).send());
        while ready().await.status() != 503 {
            tokio::task::yield_now().await;
        }
        assert!(ready().await.text().await.unwrap().contains("every connection"));
        drop(release);
        answer.await.unwrap().unwrap().status()
    };
    let (at_work, newcomer) = tokio::join!(at_work, newcomer);
    assert_eq!((at_work.status().as_u16(), newcomer.as_u16()), (200, 200));
    assert_eq!(ready().await.status(), 200);
}

#[tokio::test]
async fn an_answer_that_is_not_taken_ends_in_time() {
    let running = start(&["--write-timeout=0.3"]).await;
    for path in ["/docs", "/openapi.json", "/none"] {
        let asked = [preface(0), wire::request(1, "GET", path, &[])].concat();
        let mut stream = connect(running.addresses.http, &asked).await;
        // pings and all
        let seen = wire::frames(&mut stream, |_| false).await;
        assert!(seen.contains(&(wire::HEADERS, 1)), "{path}: {seen:?}");
    }
    // a window for a part of it is not enough
    let asked = [preface(10), wire::request(1, "GET", "/docs", &[])].concat();
    read_to_close(&mut connect(running.addresses.http, &asked).await).await;
}

#[tokio::test]
async fn a_stream_of_events_that_has_nothing_to_say_goes_on() {
    let running = start(&["--write-timeout=0.2", "--idle-timeout=0.2", "--threads=1"]).await;
    let release = running.block_small_lane();
    let location = super::support::location(&running.submit("", cloud()).await);
    let path = format!("{location}/events");
    let asked = [preface(65535), wire::request(1, "GET", &path, &[])].concat();
    let mut taking = connect(running.addresses.http, &asked).await;
    let asked = [preface(0), wire::request(1, "GET", &path, &[])].concat();
    let mut full = connect(running.addresses.http, &asked).await;
    // the one that takes nothing is ended first
    wire::frames(&mut full, |_| false).await;
    let ended = running.submit("", cloud());
    drop(release);
    let ended = super::support::location(&ended.await);
    running.events(&ended).await;
    let last = |seen: &[(u8, u32)]| seen.iter().filter(|frame| **frame == (0, 1)).count() >= 2;
    assert!(last(&wire::frames(&mut taking, last).await));
}

#[tokio::test]
async fn a_connection_has_so_many_streams_and_no_more() {
    let running = start(&[]).await;
    for (streams, refused) in [(32, 0), (33, 1)] {
        let mut asked = preface(0);
        for i in 0..streams {
            asked.extend(wire::request(2 * i + 1, "GET", "/docs", &[]));
        }
        let mut stream = connect(running.addresses.http, &asked).await;
        let count = |seen: &[(u8, u32)], kind| seen.iter().filter(|(k, _)| *k == kind).count();
        let all = |seen: &[(u8, u32)]| {
            count(seen, wire::HEADERS) + count(seen, wire::RESET) == streams as usize
        };
        let seen = wire::frames(&mut stream, all).await;
        assert_eq!(count(&seen, wire::RESET), refused);
    }
}

/// A multipart body sent as it is.
async fn form(running: &Running, packed: bool, body: Vec<u8>) -> reqwest::Response {
    let request = Client::new().post(running.url("/v1/segmentations"));
    let request = request.header("content-type", "multipart/form-data; boundary=XX");
    if !packed {
        return request.body(body).send().await.unwrap();
    }
    let mut gzip = flate2::write::GzEncoder::new(Vec::new(), Default::default());
    gzip.write_all(&body).unwrap();
    let request = request.header("content-encoding", "gzip").body(gzip.finish().unwrap());
    request.send().await.unwrap()
}

#[tokio::test]
async fn a_form_counts_before_its_parser_has_it() {
    let running = start(&["--max-body-bytes=1000000", "--max-bytes-in-flight=600000"]).await;
    let part = b"--XX\r\nContent-Disposition: form-data; name=\"parameters\"\r\n\r\n{}\r\n";
    let head = |text: &[u8]| [text, &vec![b'a'; 500_000]].concat();
    for packed in [false, true] {
        // what has no end is refused long before the limit
        for endless in [head(b""), head(b"--XX\r\nX: ")] {
            let answer = form(&running, packed, endless).await;
            assert_eq!(problem(answer).await, (400, "malformed_body".to_owned()), "{packed}");
        }
        let answer = form(&running, packed, part.repeat(10_000)).await;
        assert_eq!(problem(answer).await, (503, "overloaded".to_owned()), "{packed}");
    }
    let answer = form(&running, false, part.repeat(20_000)).await;
    assert_eq!(problem(answer).await, (413, "body_too_large".to_owned()));
    assert_eq!(running.service.bytes_in_flight(), 0);
}

#[tokio::test]
async fn a_form_is_taken_up_to_the_limit_and_not_beyond() {
    let cloud = cloud();
    let form = || {
        let part = Part::text(cloud.clone()).file_name("a.xyz");
        Form::new().part("cloud", part).text("parameters", "{\"min_points\": 10}")
    };
    // a boundary's length is always the same
    let length = usize::try_from(reqwest_length(form())).unwrap();
    for (limit, expected) in [(length, 200), (length - 1, 413)] {
        let running = start(&[&format!("--max-body-bytes={limit}")]).await;
        let request = Client::new().post(running.url("/v1/segmentations")).multipart(form());
        assert_eq!(request.send().await.unwrap().status().as_u16(), expected);
    }
}

fn reqwest_length(form: Form) -> u64 {
    let request = Client::new().post("http://a/").multipart(form).build().unwrap();
    request.headers()["content-length"].to_str().unwrap().parse().unwrap()
}

#[tokio::test]
async fn what_is_announced_takes_nothing_from_the_budget() {
    let limits = ["--max-body-bytes=1000000", "--max-bytes-in-flight=1000000"];
    let running = start(&limits).await;
    let head = |length: u64| {
        format!("POST /v1/segmentations HTTP/1.1\r\nHost: a\r\nContent-Length: {length}\r\n\r\n1")
    };
    let mut held = Vec::new();
    for _ in 0..2 {
        held.push(connect(running.addresses.http, head(1_000_000).as_bytes()).await);
    }
    while running.service.bytes_in_flight() < 2 {
        tokio::task::yield_now().await;
    }
    assert_eq!(running.post("min_points=10", cloud()).await.status(), 200);
    let (status, _) = wire::status(running.addresses.http, head(1_000_001).as_bytes()).await;
    assert_eq!(status, 413);
}

/// The head of a call to Segment and the first `there` bytes of a message that says it has `length`.
fn begun_call(length: u32, there: usize) -> Vec<u8> {
    let more = [("content-type", "application/grpc"), ("te", "trailers")];
    let mut head = wire::request(1, "POST", "/conicoid.v1.Segmentations/Segment", &more);
    head[4] = 4; // the body follows
    let message = [&[0][..], &length.to_be_bytes(), &vec![0; there]].concat();
    [preface(65535), head, frame(0, 0, 1, &message)].concat()
}

#[tokio::test]
async fn a_message_counts_as_it_comes_and_not_as_it_is_announced() {
    let running = start(&["--max-bytes-in-flight=100000", "--max-message-bytes=10000000"]).await;
    let _held = connect(running.addresses.grpc, &begun_call(10_000_000, 1000)).await;
    while running.service.bytes_in_flight() < 1005 {
        tokio::task::yield_now().await;
    }
    // as it came, and once more for what it says
    assert!(running.service.bytes_in_flight() <= 2 * 1005);
    assert_eq!(running.post("min_points=10", cloud()).await.status(), 200);
    // one above the limit is refused at its head
    let mut refused = connect(running.addresses.grpc, &begun_call(10_000_001, 1)).await;
    let told = |seen: &[(u8, u32)]| seen.contains(&(wire::HEADERS, 1));
    assert!(told(&wire::frames(&mut refused, told).await));
}

#[tokio::test]
async fn the_window_of_zstd_counts_beside_what_is_unpacked() {
    let cloud = cloud();
    for (budget, expected) in [(2 * cloud.len(), 200), (2 * cloud.len() - 1, 503)] {
        let running = start(&[&format!("--max-bytes-in-flight={budget}")]).await;
        let (answer, _) = running.compressed("zstd", "min_points=10", cloud.as_bytes()).await;
        assert_eq!(answer.status(), expected);
        // what the last request held is given back just after its answer
        while running.service.bytes_in_flight() > 0 {
            tokio::task::yield_now().await;
        }
        let (answer, _) = running.compressed("gzip", "min_points=10", cloud.as_bytes()).await;
        assert_eq!(answer.status(), 200);
    }
}

#[tokio::test]
async fn requests_without_a_host_or_with_two_are_refused() {
    let running = start(&[]).await;
    let ask = async |head: &str| {
        let request = format!("GET /docs {head}Connection: close\r\n\r\n");
        wire::status(running.addresses.http, request.as_bytes()).await
    };
    assert_eq!(ask("HTTP/1.1\r\nHost: a\r\n").await.0, 200);
    assert_eq!(ask("HTTP/1.0\r\n").await.0, 200);
    for wrong in ["HTTP/1.1\r\n", "HTTP/1.1\r\nHost: a\r\nHost: b\r\n"] {
        let (status, text) = ask(wrong).await;
        assert_eq!(status, 400, "{wrong}");
        assert!(text.contains("application/problem+json"), "{text}");
    }
}

/// Sends `request` over HTTP/2 to the gRPC port and waits for the head of its answer.
async fn call(running: &Running, request: &[u8]) -> TcpStream {
    let asked = [&preface(65535), request].concat();
    let mut stream = connect(running.addresses.grpc, &asked).await;
    wire::frames(&mut stream, |seen| seen.contains(&(wire::HEADERS, 1))).await;
    stream
}

#[tokio::test]
async fn strangers_make_no_labels_and_what_is_refused_is_not_ok() {
    let running = start(&["--threads=1"]).await;
    let grpc = [("content-type", "application/grpc"), ("te", "trailers")];
    for path in ["/made.up.Stranger/Call", "/conicoid.v1.Jobs/Stranger", "/stranger"] {
        call(&running, &wire::request(1, "GET", path, &[])).await;
        call(&running, &wire::request(1, "POST", path, &grpc)).await;
    }
    wire::status(running.addresses.http, b"STRANGER /stranger HTTP/1.1\r\nHost: a\r\n\r\n").await;
    let text = metrics(&running).await;
    assert!(!text.to_lowercase().contains("stranger"), "{text}");
    let other = "rpc_method=\"_OTHER\",rpc_response_status_code=\"UNIMPLEMENTED\"";
    assert!(text.contains(other), "{text}");
    assert!(!text.contains("rpc_method=\"_OTHER\",rpc_response_status_code=\"OK\""));
}

#[tokio::test]
async fn a_call_given_up_is_measured_as_cancelled_and_a_good_one_as_ok() {
    use conicoid::service::message::v1::{GetJobRequest, SegmentRequest};
    let running = start(&["--threads=1"]).await;
    let release = running.block_small_lane();
    let request = || SegmentRequest { cloud: cloud().into(), ..Default::default() };
    let mut client = running.grpc().await;
    let given_up = tokio::spawn({
        let (mut client, request) = (client.clone(), request());
        async move { client.segment(request).await }
    });
    while running.service.pool().queued() == 0 {
        tokio::task::yield_now().await;
    }
    // a watch goes on until its caller leaves
    let location = super::support::location(&running.submit("", cloud()).await);
    let id = location.rsplit('/').next().unwrap().to_owned();
    let watch = running.grpc_jobs().await.watch_job(GetJobRequest { id }).await.unwrap();
    given_up.abort();
    drop(watch);
    let count = |text: &str, method: &str, code: &str| -> usize {
        let name = "rpc_server_call_duration_seconds_count";
        let line = format!(
            "{name}{{rpc_method=\"conicoid.v1.{method}\",rpc_response_status_code=\"{code}\"}} "
        );
        let line = text.lines().find_map(|text| text.strip_prefix(&line));
        line.map_or(0, |count| count.parse().unwrap())
    };
    for method in ["Segmentations/Segment", "Jobs/WatchJob"] {
        while count(&metrics(&running).await, method, "CANCELLED") == 0 {
            tokio::task::yield_now().await;
        }
    }
    let before = count(&metrics(&running).await, "Segmentations/Segment", "OK");
    drop(release);
    client.segment(request()).await.unwrap();
    while count(&metrics(&running).await, "Segmentations/Segment", "OK") <= before {
        tokio::task::yield_now().await;
    }
}

/// A service in a process of its own that may have `handles` file handles; its HTTP and operators' ports.
fn with_handles(handles: u32) -> (std::process::Child, SocketAddr, SocketAddr) {
    let command = format!("ulimit -n {handles}; exec \"$0\" serve \"$@\"");
    let mut child = Command::new("sh")
        .args(["-c", &command, env!("CARGO_BIN_EXE_conicoid"), "--log=error"])
        .args(["--http=127.0.0.1:0", "--grpc=127.0.0.1:0", "--admin=127.0.0.1:0"])
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let mut text = Vec::new();
    let mut out = child.stdout.take().unwrap();
    while text.iter().filter(|byte| **byte == b'\n').count() < 3 {
        let mut byte = [0];
        out.read_exact(&mut byte).unwrap();
        text.push(byte[0]);
    }
    let text = String::from_utf8(text).unwrap();
    let mut lines = text.lines().map(|line| line.rsplit('/').next().unwrap().parse().unwrap());
    let (http, _, admin) = (lines.next().unwrap(), lines.next().unwrap(), lines.next().unwrap());
    (child, http, admin)
}

#[tokio::test]
async fn the_operators_are_answered_where_file_handles_are_few() {
    let (mut child, http, admin) = with_handles(150);
    let mut held = Vec::new();
    for _ in 0..200 {
        held.push(connect(http, b"GET /docs HTTP/1.1\r\n").await);
    }
    for path in ["livez", "readyz", "metrics"] {
        let request = format!("GET /{path} HTTP/1.1\r\nHost: a\r\n\r\n");
        assert_eq!(wire::status(admin, request.as_bytes()).await.0, 200, "{path}");
    }
    let request = b"GET /docs HTTP/1.1\r\nHost: a\r\n\r\n";
    assert_eq!(wire::status(http, request).await.0, 200);
    child.kill().unwrap();
    child.wait().unwrap();
}
