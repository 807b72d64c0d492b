//! Any request must get an answer that is no fault of the service: whatever its query, its media type, its
//! encoding and its body are, multipart ones included.
//!
//! The first three lines of the input are the query, the media type and the content encoding, the rest is
//! the body. From this folder: `mkdir -p corpus/request`, then
//! `cargo +nightly fuzz run --fuzz-dir . --features request request corpus/request seeds_request -- -timeout=10`.
#![no_main]

use std::{sync::LazyLock, time::Duration};

use axum::{Router, body::Body, http::Request};
use conicoid::{
    cli,
    http::{self, HttpConfig},
    service::Service,
};
use http_body_util::{BodyExt, Limited};
use libfuzzer_sys::fuzz_target;
use tokio::runtime::Runtime;
use tower::ServiceExt;

/// More than any answer to a cloud this small.
const LONGEST_ANSWER: usize = 8 << 20;

/// A service that takes small clouds only, and its interface.
static SERVICE: LazyLock<(Runtime, Router)> = LazyLock::new(|| {
    // the fuzzer's hook ends the process at any panic, those that the service answers too
    std::panic::set_hook(Box::new(|_| {}));
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
    let flags = ["conicoid", "--threads=1", "--max-points=200", "--max-body-bytes=65536"];
    let settings = cli::settings(&flags.map(Into::into)).unwrap();
    let mut config = settings.service();
    config.max_deadline = Duration::from_secs(5);
    let service = runtime.block_on(Service::new(config, None)).unwrap();
    let within = runtime.enter();
    let router = http::router(service, HttpConfig { cors_origins: Vec::new() });
    drop(within);
    (runtime, router)
});

fuzz_target!(|bytes: &[u8]| {
    let mut lines = bytes.splitn(4, |byte| *byte == b'\n');
    let mut line = || lines.next().unwrap_or_default();
    let (query, media_type, encoding, body) = (line(), line(), line(), line());
    let uri = [b"/v1/segmentations?", query].concat();
    let mut request = Request::post(uri.as_slice());
    for (name, value) in [("content-type", media_type), ("content-encoding", encoding)] {
        if !value.is_empty() {
            request = request.header(name, value);
        }
    }
    let request = request.header("host", "fuzz").body(Body::from(body.to_vec()));
    // what is no URI or no header never reaches a service
    let Ok(request) = request else { return };
    let (runtime, router) = &*SERVICE;
    runtime.block_on(async {
        let answer = router.clone().oneshot(request).await.unwrap_or_else(|never| match never {});
        let status = answer.status();
        let text = Limited::new(answer.into_body(), LONGEST_ANSWER).collect().await.unwrap();
        let clean = status.as_u16() < 500 || status == 503 || status == 504;
        assert!(clean, "{status}: {}", String::from_utf8_lossy(&text.to_bytes()));
    });
});
