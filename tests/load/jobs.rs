use std::{
    collections::BTreeMap,
    time::{Duration, Instant},
};

use bytes::Bytes;
use reqwest::Client;
use serde_json::Value;

use super::server::Server;

/// How long a caller waits before it asks again.
const PAUSE: Duration = Duration::from_millis(50);

/// Submits a job: the status, and its id or the code of the problem.
pub async fn submit(
    server: &Server,
    client: &Client,
    cloud: Bytes,
    key: Option<&str>,
) -> (u16, String) {
    let request = client.post(server.segmentations()).header("prefer", "respond-async");
    let request = key.into_iter().fold(request, |r, key| r.header("idempotency-key", key));
    let answer = request.body(cloud).send().await.unwrap();
    let status = answer.status().as_u16();
    let json: Value = answer.json().await.unwrap_or_default();
    let told = json["id"].as_str().or(json["code"].as_str());
    (status, told.unwrap_or("neither id nor code").to_owned())
}

/// The states of jobs, or the codes of problems, once none is under way or `time` is over.
pub async fn settled(server: &Server, client: &Client, ids: &[String], time: Duration) -> Tally {
    let begin = Instant::now();
    loop {
        let mut states = Tally::default();
        for id in ids {
            let answer = client.get(format!("{}/v1/jobs/{id}", server.http)).send().await.unwrap();
            let job: Value = answer.json().await.unwrap();
            states.count(job["state"].as_str().or(job["code"].as_str()).unwrap_or("nothing"));
        }
        let under_way = states.of("queued") + states.of("running");
        if under_way == 0 || begin.elapsed() > time {
            return states;
        }
        tokio::time::sleep(PAUSE).await;
    }
}

/// The result of a job: the status and the text.
pub async fn result(server: &Server, client: &Client, id: &str) -> (u16, String) {
    let url = format!("{}/v1/jobs/{id}/result", server.http);
    let answer = client.get(url).send().await.unwrap();
    (answer.status().as_u16(), answer.text().await.unwrap())
}

/// How often each thing was seen.
#[derive(Clone, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct Tally(BTreeMap<String, usize>);

impl Tally {
    /// One more.
    pub fn count(&mut self, what: impl ToString) {
        *self.0.entry(what.to_string()).or_default() += 1;
    }

    /// How often `what` was seen.
    pub fn of(&self, what: &str) -> usize {
        self.0.get(what).copied().unwrap_or(0)
    }

    /// How many there were.
    pub fn total(&self) -> usize {
        self.0.values().sum()
    }
}

impl std::fmt::Display for Tally {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let pairs: Vec<_> = self.0.iter().map(|(what, n)| format!("{n} {what}")).collect();
        write!(f, "{}", if pairs.is_empty() { "none".to_owned() } else { pairs.join(", ") })
    }
}
