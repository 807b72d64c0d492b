//! A service of its own for each test, clients for it, and small clouds.

pub mod clouds;
pub mod curves;
pub mod facets;
pub mod features;
#[path = "../../support/nats.rs"]
pub mod nats;
pub mod related;
pub mod solid;
pub mod step;
#[path = "../../clouds/mod.rs"]
pub mod truth;
pub mod wire;

use std::{io::Write, path::Path, sync::Arc};

use conicoid::{
    cli::{Addresses, Server, Settings},
    jobs::Lane,
    service::{
        Service,
        message::v1::{
            fits_client::FitsClient, jobs_client::JobsClient,
            segmentations_client::SegmentationsClient,
        },
    },
};
use serde_json::Value;
use tokio::task::JoinHandle;
use tokio_util::sync::{CancellationToken, DropGuard};
use tonic::transport::Channel;

/// Settings as `conicoid serve` reads them from `flags`, on free ports.
pub fn settings(flags: &[&str]) -> Settings {
    let ports = ["--http=127.0.0.1:0", "--grpc=127.0.0.1:0", "--admin=127.0.0.1:0"];
    let flags = ["conicoid"].iter().chain(&ports).chain(flags);
    let flags: Vec<_> = flags.map(std::ffi::OsString::from).collect();
    conicoid::cli::settings(&flags).unwrap()
}

/// A running service; it stops when this is dropped.
pub struct Running {
    pub addresses: Addresses,
    pub service: Arc<Service>,
    pub stop: CancellationToken,
    pub ended: JoinHandle<()>,
    _guard: DropGuard,
}

/// Starts a service with `flags` on free ports.
pub async fn start(flags: &[&str]) -> Running {
    let server = Server::bind(settings(flags)).await.expect("the service starts");
    let (addresses, service) = (server.addresses().unwrap().unwrap(), Arc::clone(server.service()));
    let stop = CancellationToken::new();
    let run = server.run(stop.clone());
    let ended = tokio::spawn(async move { run.await.expect("the service runs") });
    Running { addresses, service, _guard: stop.clone().drop_guard(), stop, ended }
}

impl Running {
    /// Ends the service and waits until it has closed its files.
    pub async fn end(self) {
        let Self { service, stop, ended, .. } = self;
        stop.cancel();
        ended.await.unwrap();
        // a job's task may hold the jobs a little longer than the service does
        let left = Arc::downgrade(service.book());
        drop(service);
        while left.strong_count() > 0 {
            tokio::time::sleep(std::time::Duration::from_millis(1)).await;
        }
    }

    /// The URL of `path` on the HTTP listener.
    pub fn url(&self, path: &str) -> String {
        format!("http://{}{path}", self.addresses.http)
    }

    /// The URL of `path` on the operators' listener.
    pub fn admin_url(&self, path: &str) -> String {
        format!("http://{}{path}", self.addresses.admin)
    }

    /// Posts `body` to the segmentations with `query`.
    pub async fn post(&self, query: &str, body: impl Into<reqwest::Body>) -> reqwest::Response {
        let url = self.url(&format!("/v1/segmentations?{query}"));
        reqwest::Client::new().post(url).body(body).send().await.unwrap()
    }

    /// Posts `body` compressed, and how long it was then.
    pub async fn compressed(
        &self,
        encoding: &str,
        query: &str,
        body: &[u8],
    ) -> (reqwest::Response, usize) {
        let packed = match encoding {
            "gzip" => {
                let mut gzip = flate2::write::GzEncoder::new(Vec::new(), Default::default());
                gzip.write_all(body).unwrap();
                gzip.finish().unwrap()
            }
            _ => zstd::encode_all(body, 0).unwrap(),
        };
        let (length, url) = (packed.len(), self.url(&format!("/v1/segmentations?{query}")));
        let request = reqwest::Client::new().post(url).header("content-encoding", encoding);
        (request.body(packed).send().await.unwrap(), length)
    }

    pub async fn channel(&self) -> Channel {
        let url = format!("http://{}", self.addresses.grpc);
        Channel::from_shared(url).unwrap().connect().await.unwrap()
    }

    /// A client of the segmentation calls.
    pub async fn grpc(&self) -> SegmentationsClient<Channel> {
        SegmentationsClient::new(self.channel().await).max_decoding_message_size(64 << 20)
    }
}

impl Running {
    /// A client of the fits.
    pub async fn grpc_fits(&self) -> FitsClient<Channel> {
        FitsClient::new(self.channel().await)
    }

    /// A client of the job calls.
    pub async fn grpc_jobs(&self) -> JobsClient<Channel> {
        JobsClient::new(self.channel().await)
    }

    /// Submits `body` as a job; the answer.
    pub async fn submit(&self, query: &str, body: impl Into<reqwest::Body>) -> reqwest::Response {
        let url = self.url(&format!("/v1/segmentations?{query}"));
        let request = reqwest::Client::new().post(url).header("prefer", "respond-async");
        request.body(body).send().await.unwrap()
    }

    /// The job at `location`.
    pub async fn job(&self, location: &str) -> Value {
        reqwest::get(self.url(location)).await.unwrap().json().await.unwrap()
    }

    /// Follows the events of a job to their end: the jobs they show.
    pub async fn events(&self, location: &str) -> Vec<Value> {
        let url = self.url(&format!("{location}/events"));
        let text = reqwest::get(url).await.unwrap().text().await.unwrap();
        let data = text.lines().filter_map(|line| line.strip_prefix("data: "));
        data.map(|json| serde_json::from_str(json).unwrap()).collect()
    }

    /// Takes the one thread of the small lane until the sender is used or dropped.
    pub fn block_small_lane(&self) -> std::sync::mpsc::Sender<()> {
        let (release, wait) = std::sync::mpsc::channel();
        let service = Arc::clone(&self.service);
        tokio::spawn(async move {
            let _ = service.pool().run(None, Lane::Small, move || wait.recv()).await;
        });
        release
    }
}

/// Where an accepted job is.
pub fn location(accepted: &reqwest::Response) -> String {
    assert_eq!(accepted.status(), 202);
    accepted.headers()["location"].to_str().unwrap().to_owned()
}

/// The `code` of a problem document, after checking that it is one.
pub async fn problem(response: reqwest::Response) -> (u16, String) {
    let status = response.status().as_u16();
    let media_type = response.headers()["content-type"].to_str().unwrap().to_owned();
    let id = response.headers()["x-request-id"].to_str().unwrap().to_owned();
    let text = response.text().await.unwrap();
    assert_eq!(media_type, "application/problem+json", "{text}");
    let document: Value = serde_json::from_str(&text).unwrap();
    assert_eq!(document["status"], status, "{text}");
    assert_eq!(document["request_id"], id.as_str(), "{text}");
    assert!(!document["detail"].as_str().unwrap().is_empty(), "{text}");
    (status, document["code"].as_str().unwrap().to_owned())
}

/// The code of a gRPC status and the reason in its details.
pub fn reason(status: &tonic::Status) -> (tonic::Code, String) {
    use tonic_types::StatusExt;
    let details = status.get_error_details();
    let reason = details.error_info().map(|info| info.reason.clone()).unwrap_or_default();
    (status.code(), reason)
}

/// Runs the command `conicoid` with `args`.
pub fn conicoid(args: &[&str], input: Option<&Path>) -> std::process::Output {
    let stdin = input
        .map_or_else(std::process::Stdio::null, |path| std::fs::File::open(path).unwrap().into());
    let mut command = std::process::Command::new(env!("CARGO_BIN_EXE_conicoid"));
    command.args(args).stdin(stdin).output().unwrap()
}
