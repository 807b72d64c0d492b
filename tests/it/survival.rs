//! With a data directory, accepted jobs and their results outlive the process, however it ends.

use std::{
    io::{BufRead, BufReader},
    path::Path,
    process::{Child, Command, Stdio},
};

use conicoid::service::sha256;
use reqwest::Client;
use serde_json::Value;

use super::support::{clouds, location};

/// A service in a process of its own.
pub struct Process {
    child: Child,
    /// The URL of its HTTP listener.
    pub http: String,
    /// The URL of its gRPC listener.
    pub grpc: String,
    /// The URL of its operators' listener.
    pub admin: String,
}

impl Process {
    /// Starts it with `flags` on free ports.
    pub fn start(flags: &[&str]) -> Self {
        Self::spawn(Self::command(flags))
    }

    /// What starts it.
    pub fn command(flags: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_conicoid"));
        command.args(["--http=127.0.0.1:0", "--grpc=127.0.0.1:0", "--admin=127.0.0.1:0"]);
        command.args(["--threads=1", "--log=error"]).args(flags);
        command
    }

    /// Starts what [`Self::command`] gave.
    pub fn spawn(mut command: Command) -> Self {
        let command = command.stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut child = command.spawn().unwrap();
        let mut lines = BufReader::new(child.stdout.take().unwrap()).lines();
        let [http, grpc, admin] = [(); 3].map(|()| lines.next().unwrap().unwrap());
        Self { child, http, grpc, admin }
    }

    /// The first line with `words` that it writes into its log; nothing more is read of it then.
    pub fn logged(&mut self, words: &str) -> String {
        let lines = BufReader::new(self.child.stderr.take().unwrap()).lines();
        lines.map_while(Result::ok).find(|line| line.contains(words)).unwrap_or_default()
    }

    /// Tells it to stop, waits until it has, and gives all that its log says.
    pub fn stop_and_read(mut self) -> String {
        let log = self.child.stderr.take().unwrap();
        let id = self.child.id().to_string();
        Command::new("kill").args(["-TERM", &id]).status().unwrap();
        std::io::read_to_string(log).unwrap()
    }

    fn keeping(data: &Path) -> Self {
        Self::start(&["--data-dir", data.to_str().unwrap()])
    }

    /// Tells it to stop and waits until it has.
    pub fn stop(mut self) {
        let id = self.child.id().to_string();
        Command::new("kill").args(["-TERM", &id]).status().unwrap();
        assert!(self.child.wait().unwrap().success());
    }

    /// Waits until the job at `place` is in a state of `states`; gives it as it then is.
    async fn wait(&self, place: &str, states: &[&str]) -> Value {
        let mut events = reqwest::get(format!("{}{place}/events", self.http)).await.unwrap();
        let mut text = String::new();
        loop {
            let chunk = events.chunk().await.unwrap().unwrap_or_else(|| panic!("{place}: {text}"));
            text.push_str(std::str::from_utf8(&chunk).unwrap());
            let jobs = text.lines().filter_map(|line| line.strip_prefix("data: "));
            let mut jobs = jobs.filter_map(|json| serde_json::from_str::<Value>(json).ok());
            if let Some(job) = jobs.find(|job| states.iter().any(|state| job["state"] == *state)) {
                return job;
            }
        }
    }

    /// SIGKILL: nothing of the process gets to run any more.
    fn kill(self) {
        drop(self);
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        // it may have ended
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

#[tokio::test]
async fn results_outlive_a_restart() {
    let directory = tempfile::tempdir().unwrap();
    let first = Process::keeping(directory.path());
    let cloud = clouds::xyz(&clouds::cylinder(300));
    let request = Client::new().post(format!("{}/v1/segmentations", first.http));
    let request = request.header("prefer", "respond-async").body(cloud);
    let place = location(&request.send().await.unwrap());
    let get = async |url: String| reqwest::get(url).await.unwrap().text().await.unwrap();
    get(format!("{}{place}/events", first.http)).await;
    let job = get(format!("{}{place}", first.http)).await;
    let result = get(format!("{}{place}/result", first.http)).await;
    assert!(job.contains("succeeded"), "{job}");
    first.stop();
    let second = Process::keeping(directory.path());
    assert_eq!(get(format!("{}{place}", second.http)).await, job);
    assert_eq!(get(format!("{}{place}/result", second.http)).await, result);
    second.kill();
}

#[tokio::test]
async fn accepted_jobs_survive_a_kill_and_are_done_once() {
    const JOBS: usize = 20;
    const KILLS: usize = 3;
    let directory = tempfile::tempdir().unwrap();
    let client = Client::new();
    let process = Process::keeping(directory.path());
    let cloud = |i| clouds::ply(&clouds::bracket(3000 + i));
    let mut places = Vec::new();
    for i in 0..JOBS {
        let request = client.post(format!("{}/v1/segmentations", process.http));
        let request = request.header("prefer", "respond-async").body(cloud(i));
        places.push(location(&request.send().await.unwrap()));
    }
    let mut process = process;
    let mut seen: Vec<Option<String>> = vec![None; JOBS];
    for kill in 0..=KILLS {
        // some jobs end between two kills, and all of them after the last
        let wanted = if kill == KILLS { JOBS } else { JOBS * (kill + 1) / (KILLS + 3) };
        for (place, seen) in places.iter().zip(&mut seen).take(wanted) {
            let url = format!("{}{place}", process.http);
            client.get(format!("{url}/events")).send().await.unwrap().text().await.unwrap();
            let result = client.get(format!("{url}/result")).send().await.unwrap();
            assert_eq!(result.status(), 200);
            let text = result.text().await.unwrap();
            // what was answered once is answered the same after every restart
            assert_eq!(seen.get_or_insert_with(|| text.clone()), &text);
        }
        let data = directory.path();
        process.kill();
        process = Process::keeping(data);
    }
    process.kill();
    for (i, text) in seen.into_iter().enumerate() {
        let answer: Value = serde_json::from_str(&text.unwrap()).unwrap();
        assert_eq!(answer["input"]["sha256"], sha256(&cloud(i)));
    }
}

/// What ends a process while a job runs.
#[derive(Clone, Copy, PartialEq)]
enum End {
    Killed,
    Stopped,
}

/// Submits a job, and two others that wait behind it, and ends the process whenever that job runs; how
/// it is in the end.
async fn ended_on(ends: &[End]) -> Value {
    let directory = tempfile::tempdir().unwrap();
    let mut process = Process::keeping(directory.path());
    let mut places = Vec::new();
    // large ones: they take the same thread
    for points in [400_000, 60_000, 60_001] {
        let request = Client::new().post(format!("{}/v1/segmentations", process.http));
        let cloud = clouds::ply(&clouds::bracket(points));
        let request = request.header("prefer", "respond-async").body(cloud);
        places.push(location(&request.send().await.unwrap()));
    }
    for end in ends {
        process.wait(&places[0], &["running"]).await;
        match end {
            End::Killed => process.kill(),
            End::Stopped => process.stop(),
        }
        process = Process::keeping(directory.path());
    }
    for place in &places[1..] {
        assert_eq!(process.wait(place, &["succeeded", "failed"]).await["state"], "succeeded");
    }
    process.wait(&places[0], &["succeeded", "failed"]).await
}

#[tokio::test]
async fn a_job_that_ends_the_process_three_times_fails_and_the_others_are_done() {
    let job = ended_on(&[End::Killed; 3]).await;
    assert_eq!((&job["state"], &job["problem"]["code"]), (&"failed".into(), &"run_crashed".into()));
    let detail = job["problem"]["detail"].as_str().unwrap();
    assert!(detail.contains("3 times") && detail.contains("more memory"), "{detail}");
}

#[tokio::test]
async fn a_job_that_survives_two_kills_and_any_number_of_stops_succeeds() {
    let ends = [End::Killed, End::Stopped, End::Killed, End::Stopped, End::Stopped];
    assert_eq!(ended_on(&ends).await["state"], "succeeded");
}
