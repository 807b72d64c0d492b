use std::{
    collections::{BTreeMap, HashMap},
    sync::{
        Arc, Mutex,
        atomic::{AtomicBool, Ordering},
    },
    time::{Duration, Instant},
};

use reqwest::Client;
use serde_json::Value;

use super::{
    block_on,
    cloud::bracket,
    missed,
    nats::NatsServer,
    server::{Server, Worker},
};

const JOBS: usize = 500;
const WORKERS: usize = 4;
/// Each size of cloud is asked for many times; the embedded service answers it once.
const POINTS: [usize; 10] =
    [10_000, 15_000, 20_000, 30_000, 40_000, 50_000, 70_000, 100_000, 150_000, 200_000];
/// A worker is killed this often.
const BETWEEN_KILLS: Duration = Duration::from_secs(5);
/// Jobs that are being submitted at one time.
const SUBMITTERS: usize = 4;
const LONGEST: Duration = Duration::from_secs(1800);

pub fn run() -> Vec<String> {
    let right: Arc<HashMap<usize, Value>> = Arc::new(block_on(embedded()));
    let mut marks = Vec::new();
    println!(
        "nodes  jobs  seconds  kills of workers  restarts of nodes  kills of front ends  handed out again  \
         run twice  refused  lost  answered differently"
    );
    for nodes in [1, 3] {
        let mut servers: Vec<NatsServer> = match nodes {
            1 => vec![NatsServer::start()],
            _ => NatsServer::cluster().into(),
        };
        let urls: Vec<_> = servers.iter().map(NatsServer::url).collect();
        let counts = block_on(storm(&mut servers, &urls.join(","), nodes, &right));
        println!(
            "{nodes:>5}  {JOBS:>4}  {:>7.0}  {:>16}  {:>17}  {:>19}  {:>16}  {:>9}  {:>7}  {:>4}  {:>20}",
            counts.seconds,
            counts.kills,
            counts.node_restarts,
            counts.front_kills,
            counts.again,
            counts.twice,
            counts.refused,
            counts.lost,
            counts.changed,
        );
        marks.extend(missed([
            (format!("{} jobs lost with {nodes} nodes", counts.lost), counts.lost == 0),
            (
                format!("{} answered differently with {nodes} nodes", counts.changed),
                counts.changed == 0,
            ),
        ]));
    }
    marks
}

#[derive(Default)]
struct Counts {
    seconds: f64,
    kills: usize,
    node_restarts: usize,
    front_kills: usize,
    again: u64,
    twice: usize,
    refused: usize,
    lost: usize,
    changed: usize,
}

/// The answers of a service that has its own jobs.
async fn embedded() -> HashMap<usize, Value> {
    let server = Server::start(&[]);
    let mut right = HashMap::new();
    for points in POINTS {
        let answer = Client::new().post(server.segmentations()).body(bracket(points)).send().await;
        right.insert(points, without_times(answer.unwrap().json().await.unwrap()));
    }
    right
}

/// An answer without the seconds that it took.
fn without_times(mut answer: Value) -> Value {
    answer.as_object_mut().unwrap().remove("timing");
    answer
}

/// Submits all jobs while workers, nodes and a front end are killed, and looks at the answers.
async fn storm(
    nodes: &mut [NatsServer],
    urls: &str,
    replicas: usize,
    right: &HashMap<usize, Value>,
) -> Counts {
    let flags = [
        format!("--nats={urls}"),
        format!("--nats-replicas={replicas}"),
        "--nats-ack-wait=2".to_owned(),
        "--max-crashes=20".to_owned(),
        "--queue=1000".to_owned(),
        "--threads=1".to_owned(),
        "--log=conicoid=info".to_owned(),
    ];
    let flags: Vec<_> = flags.iter().map(String::as_str).collect();
    let fronts = Mutex::new([0, 1].map(|_| Some(Server::start(&flags))));
    let mut workers: Vec<_> = (0..WORKERS).map(|_| Worker::start(&flags)).collect();
    let mut counts = Counts::default();
    let mut logs = String::new();
    let begin = Instant::now();
    let done = AtomicBool::new(false);
    let url = |i: usize| fronts.lock().unwrap()[i % 2].as_ref().map(|s: &Server| s.http.clone());
    let submitting = async {
        let tasks = (0..SUBMITTERS).map(|s| submit_some(s, &url));
        let mut all = BTreeMap::new();
        let mut refused = 0;
        for (own, no) in futures::future::join_all(tasks).await {
            all.extend(own);
            refused += no;
        }
        let ended = wait_for_all(&all, &url, right, begin).await;
        done.store(true, Ordering::Relaxed);
        (refused, ended)
    };
    let killing = async {
        let mut next = 0;
        while !done.load(Ordering::Relaxed) {
            tokio::time::sleep(BETWEEN_KILLS).await;
            let i = next % WORKERS;
            counts.again += workers[i].again().await;
            logs += &workers[i].log();
            workers[i] = Worker::start(&flags);
            counts.kills += 1;
            next += 1;
            if next == 3 || next == 6 {
                let node = next % nodes.len();
                nodes[node].end();
                tokio::time::sleep(Duration::from_secs(1)).await;
                nodes[node].run();
                counts.node_restarts += 1;
            }
            if next == 4 {
                // dropped, which kills it
                fronts.lock().unwrap()[0] = None;
                tokio::time::sleep(Duration::from_secs(1)).await;
                let again = Server::start(&flags);
                fronts.lock().unwrap()[0] = Some(again);
                counts.front_kills += 1;
            }
        }
    };
    let ((refused, (lost, changed)), ()) = tokio::join!(submitting, killing);
    for worker in &workers {
        counts.again += worker.again().await;
        logs += &worker.log();
    }
    let mut runs: HashMap<&str, usize> = HashMap::new();
    for id in logs.lines().filter(|line| line.contains(" done ")).filter_map(job_of) {
        *runs.entry(id).or_default() += 1;
    }
    counts.twice = runs.values().filter(|n| **n > 1).count();
    (counts.refused, counts.lost, counts.changed) = (refused, lost, changed);
    counts.seconds = begin.elapsed().as_secs_f64();
    counts
}

/// The job that a line of the log tells of.
fn job_of(line: &str) -> Option<&str> {
    line.split("job_id=").nth(1)?.split([' ', '}']).next()
}

/// Submits every `SUBMITTERS`-th job until it is accepted; where they are, and how often there was a no.
async fn submit_some(
    from: usize,
    url: &impl Fn(usize) -> Option<String>,
) -> (BTreeMap<usize, String>, usize) {
    let client = Client::new();
    let (mut places, mut refused) = (BTreeMap::new(), 0);
    for i in (from..JOBS).step_by(SUBMITTERS) {
        let cloud = bracket(POINTS[i % POINTS.len()]);
        for attempt in 0.. {
            let Some(url) = url(i + attempt) else { continue };
            let request = client
                .post(format!("{url}/v1/jobs"))
                // a caller who does not know whether it was accepted asks again for the same
                .header("idempotency-key", format!("storm-{i}"))
                .timeout(Duration::from_secs(30));
            if let Ok(answer) = request.body(cloud.clone()).send().await
                && answer.status() == 202
                && let Ok(job) = answer.json::<Value>().await
            {
                places.insert(i, job["id"].as_str().unwrap().to_owned());
                break;
            }
            refused += 1;
            tokio::time::sleep(Duration::from_millis(200)).await;
        }
    }
    (places, refused)
}

/// Waits for every job at any front end: how many have no answer, and how many another one than the
/// embedded service gives.
async fn wait_for_all(
    places: &BTreeMap<usize, String>,
    url: &impl Fn(usize) -> Option<String>,
    right: &HashMap<usize, Value>,
    begin: Instant,
) -> (usize, usize) {
    let client = Client::new();
    let (mut lost, mut changed) = (JOBS - places.len(), 0);
    for (i, id) in places {
        let mut attempt = 0;
        let answer = loop {
            attempt += 1;
            let asked = match url(i + attempt) {
                Some(url) => {
                    let url = format!("{url}/v1/jobs/{id}/result?wait=10");
                    client.get(url).timeout(Duration::from_secs(30)).send().await.ok()
                }
                None => None,
            };
            match asked {
                Some(answer) if answer.status() == 200 => {
                    if let Ok(answer) = answer.json::<Value>().await {
                        break Some(answer);
                    }
                }
                Some(answer) if answer.status() == 409 || answer.status() == 404 => {
                    let problem: Value = answer.json().await.unwrap_or_default();
                    if problem["code"] != "job_not_finished" {
                        println!("job {i} {id}: {problem}");
                        break None;
                    }
                }
                _ => {}
            }
            if begin.elapsed() > LONGEST {
                break None;
            }
            tokio::time::sleep(Duration::from_millis(100)).await;
        };
        match answer {
            None => lost += 1,
            Some(answer) => {
                let expected = &right[&POINTS[i % POINTS.len()]];
                changed += usize::from(without_times(answer) != *expected);
            }
        }
    }
    (lost, changed)
}
