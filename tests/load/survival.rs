use std::collections::HashMap;

use reqwest::Client;
use serde_json::Value;

use super::{block_on, cloud::bracket, missed, server::Server};

const ROUNDS: usize = 20;
const JOBS: usize = 50;
const POINTS: usize = 1_000;

pub fn run() -> Vec<String> {
    println!("round  accepted  ended before the kill  lost  answered differently");
    let (mut accepted, mut lost, mut changed) = (0, 0, 0);
    for round in 1..=ROUNDS {
        let counts = block_on(kill_in_the_middle(round));
        println!(
            "{round:>5}  {:>8}  {:>21}  {:>4}  {:>20}",
            counts.accepted, counts.before, counts.lost, counts.changed
        );
        accepted += counts.accepted;
        (lost, changed) = (lost + counts.lost, changed + counts.changed);
    }
    println!("{accepted} accepted, {lost} lost, {changed} answered differently");
    missed([
        (format!("{lost} jobs lost"), lost == 0),
        (format!("{changed} jobs answered differently"), changed == 0),
    ])
}

struct Counts {
    accepted: usize,
    before: usize,
    lost: usize,
    changed: usize,
}

/// Queues jobs, kills the service in the middle of them, and looks at what a new one makes of them.
async fn kill_in_the_middle(round: usize) -> Counts {
    let directory = tempfile::tempdir().unwrap();
    let data = format!("--data-dir={}", directory.path().display());
    let server = Server::start(&[&data, "--threads=1"]);
    let client = Client::new();
    let mut jobs = HashMap::new();
    for i in 0..JOBS {
        // every cloud is another one, so that no answer can be taken for another's
        let place = server.submit(&client, bracket(POINTS + JOBS * round + i)).await;
        jobs.insert(place.replace(&server.http, ""), POINTS + JOBS * round + i);
    }
    // a few more have ended in each round
    let mut early = HashMap::new();
    for place in jobs.keys().take(2 * round) {
        server.wait(&format!("{}{place}", server.http), ended).await;
        early.insert(place.clone(), result(&client, &server, place).await);
    }
    drop(server); // SIGKILL
    let server = Server::start(&[&data, "--threads=1"]);
    let (mut lost, mut changed) = (0, 0);
    for (place, points) in &jobs {
        server.wait(&format!("{}{place}", server.http), ended).await;
        match result(&client, &server, place).await {
            None => lost += 1,
            Some(text) => {
                let again = result(&client, &server, place).await;
                let first = early.get(place).cloned().flatten().unwrap_or_else(|| text.clone());
                let answer: Value = serde_json::from_str(&text).unwrap();
                let right = answer["input"]["points"] == *points;
                changed += usize::from(first != text || again != Some(text) || !right);
            }
        }
    }
    Counts { accepted: jobs.len(), before: early.len(), lost, changed }
}

fn ended(job: &Value) -> bool {
    job["finished_ms"].is_u64()
}

/// The answer of a job that has one.
async fn result(client: &Client, server: &Server, place: &str) -> Option<String> {
    let answer = client.get(format!("{}{place}/result", server.http)).send().await.unwrap();
    if answer.status() == 200 { Some(answer.text().await.unwrap()) } else { None }
}
