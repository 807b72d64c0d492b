use std::time::{Duration, Instant};

use reqwest::Client;
use serde_json::Value;

use super::{
    block_on,
    caller::{Interface, ask_all},
    cloud::bracket,
    missed,
    nats::NatsServer,
    server::{Server, Worker},
};

/// Callers that ask at the same time.
const CALLERS: usize = 4;
/// How long each row is measured.
const TIME: Duration = Duration::from_secs(10);
/// Jobs of one measurement of throughput.
const JOBS: usize = 60;
/// Requests of one measurement of latency.
const REQUESTS: usize = 300;

pub fn run() -> Vec<String> {
    let nats = NatsServer::start();
    let url = format!("--nats={}", nats.url());
    let embedded = Server::start(&["--queue=1000"]);
    let front = Server::start(&[&url, "--queue=1000"]);
    let _worker = Worker::start(&[&url, "--queue=1000"]);
    let mut marks = Vec::new();
    println!("jobs of 100k points: rate of the embedded store and of the queue, three turns each");
    let cloud = bracket(100_000);
    let mut shares = Vec::new();
    for _ in 0..3 {
        let own = block_on(job_rate(&embedded, &cloud));
        let queue = block_on(job_rate(&front, &cloud));
        println!("  {own:.2}/s  {queue:.2}/s  share {:.3}", queue / own);
        shares.push(queue / own);
    }
    shares.sort_by(f64::total_cmp);
    let share = shares[1];
    println!("requests of 100k points by {CALLERS} callers that wait for their answers");
    for server in [&embedded, &front] {
        let times = block_on(ask_all(CALLERS, Interface::Http, &server.http, &cloud, TIME));
        println!("  {:.2}/s  p50 {:.0} ms", times.rate, times.quantile_ms(0.5));
    }
    println!("one request of 10k points after another: embedded, over the queue, added");
    let cloud = bracket(10_000);
    let (own, queue) = block_on(latencies(&embedded, &front, &cloud));
    let mut added = [0.0; 2];
    for (i, q) in [0.5, 0.99].into_iter().enumerate() {
        let at = |times: &[f64]| times[((times.len() - 1) as f64 * q) as usize];
        added[i] = at(&queue) - at(&own);
        println!(
            "  p{:.0}: {:.1} ms  {:.1} ms  +{:.1} ms",
            q * 100.0,
            at(&own),
            at(&queue),
            added[i]
        );
    }
    marks.extend(missed([
        (
            format!("throughput over the queue {share:.3} of the embedded store's, wanted 0.9"),
            share >= 0.9,
        ),
        (format!("p50 longer by {:.1} ms, wanted 5", added[0]), added[0] <= 5.0),
        (format!("p99 longer by {:.1} ms, wanted 20", added[1]), added[1] <= 20.0),
    ]));
    marks
}

/// Jobs a second, from the first submission to the last end.
async fn job_rate(server: &Server, cloud: &bytes::Bytes) -> f64 {
    let client = Client::new();
    let begin = Instant::now();
    let mut places = Vec::new();
    for _ in 0..JOBS {
        places.push(server.submit(&client, cloud.clone()).await);
    }
    for place in places {
        let job: Value =
            client.get(format!("{place}?wait=600")).send().await.unwrap().json().await.unwrap();
        assert_eq!(job["state"], "succeeded");
    }
    JOBS as f64 / begin.elapsed().as_secs_f64()
}

/// The milliseconds of requests that take turns at two services, in ascending order.
async fn latencies(own: &Server, queue: &Server, cloud: &bytes::Bytes) -> (Vec<f64>, Vec<f64>) {
    let client = Client::new();
    let mut times = [Vec::new(), Vec::new()];
    for _ in 0..REQUESTS {
        for (server, times) in [own, queue].into_iter().zip(&mut times) {
            let begin = Instant::now();
            let answer = client.post(server.segmentations()).body(cloud.clone()).send().await;
            let text = answer.unwrap().error_for_status().unwrap().text().await.unwrap();
            assert!(!text.is_empty());
            times.push(begin.elapsed().as_secs_f64() * 1e3);
        }
    }
    times.iter_mut().for_each(|times| times.sort_by(f64::total_cmp));
    let [own, queue] = times;
    (own, queue)
}
