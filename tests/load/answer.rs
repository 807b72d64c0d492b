use std::time::Instant;

use conicoid::{
    formats::{Limits, read},
    segment::{Parameters, Silent, segment},
};

use super::{block_on, cloud::bracket, missed, server::Server};

const POINTS: usize = 1_000_000;
const ROUNDS: usize = 15;
/// How many times the library's own time an answer may take.
const MOST: f64 = 1.3;

pub fn run() -> Vec<String> {
    let bytes = bracket(POINTS);
    let cloud = read(&bytes, None, &Limits::default()).unwrap();
    let server = Server::start(&[]);
    let (client, url) = (reqwest::Client::new(), server.segmentations());
    let ask = || async {
        let answer = client.post(&url).body(bytes.clone()).send().await.unwrap();
        answer.bytes().await.unwrap().len()
    };
    println!("round  parse ms  library ms  HTTP ms  times the library  answer bytes");
    // in turns, so that both meet the same machine
    let rounds = (1..=ROUNDS).map(|round| {
        let (parse, _) = timed(|| read(&bytes, None, &Limits::default()).unwrap());
        let (library, _) = timed(|| segment(&cloud, &Parameters::default(), &Silent).unwrap());
        let (http, length) = timed(|| block_on(ask()));
        let times = http / library;
        println!("{round:>5}  {parse:>8.1}  {library:>10.1}  {http:>7.1}  {times:>17.2}  {length}");
        times
    });
    let mut times: Vec<_> = rounds.collect();
    times.sort_by(f64::total_cmp);
    let median = times[ROUNDS / 2];
    println!("median {median:.2}; peak memory of the service {:.0} MiB", server.peak_memory());
    missed([(format!("{median:.2} times the library, wanted {MOST}"), median <= MOST)])
}

/// How long `work` takes in milliseconds, and what it gives.
fn timed<T>(work: impl FnOnce() -> T) -> (f64, T) {
    let begin = Instant::now();
    let done = work();
    (begin.elapsed().as_secs_f64() * 1e3, done)
}
