use std::{
    fs,
    io::{BufRead, BufReader},
    process::{Child, Command, Stdio},
};

use reqwest::{Client, Response};
use serde_json::Value;

/// A service in a process of its own; killed when dropped.
pub struct Server {
    child: Child,
    /// The URL of its HTTP listener.
    pub http: String,
    /// The URL of its gRPC listener.
    pub grpc: String,
}

impl Server {
    /// Starts it on free ports.
    pub fn start(flags: &[&str]) -> Self {
        let mut child = Command::new(std::env::current_exe().unwrap())
            .args(["serve", "--http=127.0.0.1:0", "--grpc=127.0.0.1:0", "--admin=127.0.0.1:0"])
            .arg("--log=error")
            .args(flags)
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let mut lines = BufReader::new(child.stdout.take().unwrap()).lines();
        let mut line = || lines.next().unwrap().unwrap();
        let (http, grpc) = (line(), line().replace("grpc", "http"));
        Self { child, http, grpc }
    }

    /// The most memory it has had, in MiB, since it began or since that was forgotten.
    pub fn peak_memory(&self) -> f64 {
        self.status("VmHWM:")
    }

    /// The memory it has, in MiB.
    pub fn memory(&self) -> f64 {
        self.status("VmRSS:")
    }

    /// Lets the most memory be what it has now.
    pub fn forget_peak(&self) {
        fs::write(format!("/proc/{}/clear_refs", self.child.id()), "5").unwrap();
    }

    fn status(&self, name: &str) -> f64 {
        let status = fs::read_to_string(format!("/proc/{}/status", self.child.id())).unwrap();
        let line = status.lines().find(|line| line.starts_with(name)).unwrap();
        line.split_whitespace().nth(1).unwrap().parse::<f64>().unwrap() / 1024.0
    }

    /// The URL of the segmentations.
    pub fn segmentations(&self) -> String {
        format!("{}/v1/segmentations", self.http)
    }

    /// Submits a job; where it is.
    pub async fn submit(&self, client: &Client, cloud: bytes::Bytes) -> String {
        let request = client.post(self.segmentations()).header("prefer", "respond-async");
        let accepted = request.body(cloud).send().await.unwrap();
        assert_eq!(accepted.status(), 202);
        format!("{}{}", self.http, accepted.headers()["location"].to_str().unwrap())
    }

    /// Waits until the job at `place` shows itself to be as `wanted` says.
    pub async fn wait(&self, place: &str, wanted: impl Fn(&Value) -> bool) -> Value {
        let events = reqwest::get(format!("{place}/events")).await.unwrap();
        follow(events, wanted).await
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        // it may have ended
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Reads events until a job is as `wanted` says, or their end.
async fn follow(mut events: Response, wanted: impl Fn(&Value) -> bool) -> Value {
    let (mut text, mut last) = (String::new(), Value::Null);
    while let Some(chunk) = events.chunk().await.unwrap() {
        text.push_str(std::str::from_utf8(&chunk).unwrap());
        while let Some((line, rest)) = text.split_once('\n') {
            if let Some(json) = line.strip_prefix("data: ") {
                last = serde_json::from_str(json).unwrap();
            }
            text = rest.to_owned();
            if wanted(&last) {
                return last;
            }
        }
    }
    last
}
