use std::{
    sync::atomic::{AtomicBool, Ordering},
    time::Duration,
};

use reqwest::Client;

use super::{
    block_on,
    caller::{Interface, Times, ask_all, ask_until},
    cloud::bracket,
    missed,
    server::Server,
};

const SMALL: usize = 10_000;
const LARGE: usize = 10_000_000;
/// How many times longer the 99th percentile may be beside the large run.
const MOST: f64 = 5.0;
/// Large runs, one after the other, and the fewest small answers beside them that a percentile is made of.
const RUNS: usize = 10;
const FEW: usize = 100;
/// Callers of the small clouds.
const CALLERS: usize = 1;

pub fn run() -> Vec<String> {
    let server = Server::start(&[]);
    let (small, large) = (bracket(SMALL), bracket(LARGE));
    block_on(async {
        let ask = |seconds| {
            ask_all(CALLERS, Interface::Http, &server.http, &small, Duration::from_secs(seconds))
        };
        ask(1).await; // warms up
        let idle = ask(10).await;
        let (mut beside, mut spent) = (Vec::new(), 0.0);
        for _ in 0..RUNS {
            let place = server.submit(&Client::new(), large.clone()).await;
            server.wait(&place, |job| job["progress"].is_object()).await;
            let stop = AtomicBool::new(false);
            let ended = async {
                let job = server.wait(&place, |job| job["finished_ms"].is_u64()).await;
                stop.store(true, Ordering::Relaxed);
                job
            };
            let asking = ask_until(Interface::Http, server.http.clone(), small.clone(), || {
                stop.load(Ordering::Relaxed)
            });
            let (job, times) = tokio::join!(ended, asking);
            assert_eq!(job["state"], "succeeded");
            let seconds = |name: &str| job[name].as_f64().unwrap() / 1e3;
            spent += seconds("finished_ms") - seconds("started_ms");
            beside.extend(times);
        }
        let beside = Times::of(beside);
        println!("{LARGE} points: {RUNS} runs of {:.1} s", spent / RUNS as f64);
        println!("{SMALL} points          p50 ms  p99 ms  requests/s  requests");
        let (p50, p99) = (idle.quantile_ms(0.5), idle.quantile_ms(0.99));
        println!(
            "idle                  {p50:>6.1}  {p99:>6.1}  {:>10.1}  {:>8}",
            idle.rate,
            idle.count()
        );
        let (p50, worst) = (beside.quantile_ms(0.5), beside.quantile_ms(0.99));
        println!(
            "beside the large runs {p50:>6.1}  {worst:>6.1}  {:>10.1}  {:>8}",
            beside.rate,
            beside.count()
        );
        let times = worst / p99;
        println!("p99 is {times:.2} times as long; peak memory {:.0} MiB", server.peak_memory());
        missed([
            (format!("p99 {times:.2} times the idle one, wanted {MOST}"), times <= MOST),
            (format!("{} answers beside the large runs", beside.count()), beside.count() >= FEW),
        ])
    })
}
