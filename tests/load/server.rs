use std::{
    fs::{self, File},
    io::{BufRead, BufReader},
    process::{Child, Command, Stdio},
};

use reqwest::{Client, Response};
use serde_json::Value;
use tempfile::NamedTempFile;

/// A service in a process of its own; killed when dropped.
pub struct Server {
    child: Child,
    log: NamedTempFile,
    /// The URL of its HTTP listener.
    pub http: String,
    /// The URL of its gRPC listener.
    pub grpc: String,
    /// The URL of the operators' listener.
    pub admin: String,
}

impl Server {
    /// Starts it on free ports.
    pub fn start(flags: &[&str]) -> Self {
        Self::try_start(&[], flags).unwrap()
    }

    /// Starts it on free ports by the command `within`, which gets the service's own command as its
    /// last words.
    ///
    /// # Errors
    /// What it wrote before it ended.
    pub fn try_start(within: &[&str], flags: &[&str]) -> Result<Self, String> {
        let log = NamedTempFile::new().unwrap();
        let this = std::env::current_exe().unwrap();
        let mut words = within.iter().map(AsRef::as_ref).chain([this.as_os_str()]);
        let mut child = Command::new(words.next().unwrap())
            .args(words)
            .args(["serve", "--http=127.0.0.1:0", "--grpc=127.0.0.1:0", "--admin=127.0.0.1:0"])
            .arg("--log=error")
            .args(flags)
            .stdout(Stdio::piped())
            .stderr(File::create(log.path()).unwrap())
            .spawn()
            .unwrap();
        let mut lines = BufReader::new(child.stdout.take().unwrap()).lines().map_while(Result::ok);
        let mut line = || lines.next();
        let (Some(http), Some(grpc), Some(admin)) = (line(), line(), line()) else {
            let end = child.wait().unwrap();
            return Err(format!("{end}: {}", fs::read_to_string(log.path()).unwrap()));
        };
        let plain = |url: String| format!("http://{}", url.split_once("://").unwrap().1);
        Ok(Self { child, log, http, grpc: plain(grpc), admin: plain(admin) })
    }

    /// What it has written into its log.
    pub fn log(&self) -> String {
        String::from_utf8_lossy(&fs::read(self.log.path()).unwrap()).into_owned()
    }

    /// The process's number.
    pub fn id(&self) -> u32 {
        self.child.id()
    }

    /// Tells it to stop, and waits until it has.
    pub fn stop(mut self) {
        Command::new("kill").args(["-TERM", &self.id().to_string()]).status().unwrap();
        self.child.wait().unwrap();
    }

    /// Whether it goes on.
    pub fn is_alive(&mut self) -> bool {
        self.child.try_wait().unwrap().is_none()
    }

    /// The most memory it has had, in MiB, since it began or since that was forgotten.
    pub fn peak_memory(&self) -> f64 {
        self.status("VmHWM:")
    }

    /// The memory it has now, in MiB.
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

    /// The value of a metric without labels.
    pub async fn metric(&self, name: &str) -> f64 {
        let text = reqwest::get(format!("{}/metrics", self.admin)).await.unwrap().text().await;
        let text = text.unwrap();
        let line = text.lines().find_map(|line| line.strip_prefix(&format!("{name} ")));
        line.unwrap().parse().unwrap()
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

/// A worker in a process of its own; killed when dropped.
pub struct Worker {
    child: Child,
    log: NamedTempFile,
    admin: String,
}

impl Worker {
    /// Starts it; `flags` name its NATS servers.
    pub fn start(flags: &[&str]) -> Self {
        let log = NamedTempFile::new().unwrap();
        let mut child = Command::new(std::env::current_exe().unwrap())
            .args(["worker", "--admin=127.0.0.1:0", "--log=error"])
            .args(flags)
            .stdout(Stdio::piped())
            .stderr(File::create(log.path()).unwrap())
            .spawn()
            .unwrap();
        let mut lines = BufReader::new(child.stdout.take().unwrap()).lines().map_while(Result::ok);
        // without a line it has ended, and its log says why
        let admin = lines.next().ok_or_else(|| fs::read_to_string(log.path())).unwrap();
        let admin = admin.replace("admin://", "http://");
        Self { child, log, admin }
    }

    /// What it has written into its log.
    pub fn log(&self) -> String {
        String::from_utf8_lossy(&fs::read(self.log.path()).unwrap()).into_owned()
    }

    /// How many jobs it was given that another worker had before.
    pub async fn again(&self) -> u64 {
        let Ok(answer) = reqwest::get(format!("{}/metrics", self.admin)).await else { return 0 };
        let text = answer.text().await.unwrap_or_default();
        let name = "conicoid_redeliveries_total ";
        text.lines().find_map(|line| line.strip_prefix(name)?.parse().ok()).unwrap_or(0)
    }
}

impl Drop for Worker {
    fn drop(&mut self) {
        // it may have ended
        let _ = self.child.kill();
        let _ = self.child.wait();
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
