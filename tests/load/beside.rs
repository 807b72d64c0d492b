use std::time::Duration;

use reqwest::Client;

use super::{
    block_on,
    caller::{Interface, ask_all},
    cloud::bracket,
    missed,
    server::Server,
};

const SMALL: usize = 10_000;
const LARGE: usize = 10_000_000;
/// How many times longer the 99th percentile may be beside the large run.
const MOST: f64 = 5.0;
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
        let place = server.submit(&Client::new(), large).await;
        server.wait(&place, |job| job["progress"].is_object()).await;
        let (mut worst, mut asked, mut rate) = (0.0_f64, 0, f64::INFINITY);
        // as long as the large run is at work, in turns of a second at least
        let ended = server.wait(&place, |job| job["finished_ms"].is_u64());
        tokio::pin!(ended);
        let job = loop {
            tokio::select! {
                biased;
                job = &mut ended => break job,
                times = ask(2) => {
                    worst = worst.max(times.quantile_ms(0.99));
                    rate = rate.min(times.rate);
                    asked += times.count();
                }
            }
        };
        let seconds = |name: &str| job[name].as_f64().unwrap() / 1e3;
        println!(
            "{LARGE} points: {} in {:.1} s",
            job["state"],
            seconds("finished_ms") - seconds("started_ms")
        );
        println!("{SMALL} points          p50 ms  p99 ms  requests/s  requests");
        let (p50, p99) = (idle.quantile_ms(0.5), idle.quantile_ms(0.99));
        println!(
            "idle                  {p50:>6.1}  {p99:>6.1}  {:>10.1}  {:>8}",
            idle.rate,
            idle.count()
        );
        println!("beside it, worst turn         {worst:>6.1}  {rate:>10.1}  {asked:>8}");
        let times = worst / p99;
        println!("p99 is {times:.2} times as long; peak memory {:.0} MiB", server.peak_memory());
        missed([
            (format!("p99 {times:.2} times the idle one, wanted {MOST}"), times <= MOST),
            ("no small request was answered beside the large run".to_owned(), asked > 0),
            (format!("the large run ended as {}", job["state"]), job["state"] == "succeeded"),
        ])
    })
}
