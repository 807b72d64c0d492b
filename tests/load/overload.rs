use std::{
    collections::BTreeMap,
    process::{Command, ExitCode},
    sync::{Arc, Mutex},
    time::{Duration, Instant},
};

use bytes::Bytes;
use reqwest::Client;

use super::{
    block_on,
    caller::{Interface, ask_all, quantile},
    cloud::bracket,
    missed,
    server::Server,
};

const POINTS: usize = 10_000;
/// How many times the load that can be served.
const TIMES: f64 = 10.0;
const SECONDS: f64 = 60.0;
/// The deadline that each request names.
const DEADLINE: f64 = 5.0;
/// Beyond the deadline: the way there and back, and the turn at a processor, on a full machine.
const GRACE: f64 = 1.0;
const QUEUE: usize = 64;
const BYTES_IN_FLIGHT: usize = 64 << 20;
/// What the service may take beside the bytes in flight, in MiB: itself, the small runs, the answers.
const BESIDE: f64 = 300.0;

pub fn run() -> Vec<String> {
    let flags = [format!("--queue={QUEUE}"), format!("--max-bytes-in-flight={BYTES_IN_FLIGHT}")];
    let server = Server::start(&[&flags[0], &flags[1]]);
    let cloud = bracket(POINTS);
    let peak = |seconds| {
        let time = Duration::from_secs(seconds);
        block_on(ask_all(4, Interface::Http, &server.http, &cloud, time)).rate
    };
    peak(2); // warms up
    let unloaded = peak(10);
    let rate = TIMES * unloaded;
    println!("unloaded: {unloaded:.1} answers/s; now {rate:.0} requests/s for {SECONDS} s");
    // Callers are other machines as a rule: here they stand back where they share the processors, but not so far that
    // what they measure is their own waiting for a turn.
    let callers = Command::new("nice")
        .args(["-n", "13"])
        .arg(std::env::current_exe().unwrap())
        .args(["call", &server.segmentations(), &rate.to_string(), &SECONDS.to_string()])
        .output()
        .unwrap();
    let told = String::from_utf8(callers.stdout).unwrap();
    print!("{told}");
    let number = |name: &str| -> f64 {
        let line = told.lines().find_map(|line| line.strip_prefix(name)).unwrap_or("nan");
        line.trim().parse().unwrap()
    };
    let (accepted, slowest, broken) =
        (number("accepted/s"), number("slowest s"), number("not answered, or otherwise"));
    let memory = server.peak_memory();
    let budget = (BYTES_IN_FLIGHT >> 20) as f64 + BESIDE;
    println!("accepted / unloaded  {:.2}", accepted / unloaded);
    println!("peak memory          {memory:.0} MiB of {budget:.0}");
    missed([
        (format!("{broken} requests without a clean answer"), broken == 0.0),
        (
            format!("an answer after {slowest:.1} s, deadline {DEADLINE}"),
            slowest <= DEADLINE + GRACE,
        ),
        (format!("accepted {accepted:.1}/s of {unloaded:.1}/s"), accepted >= 0.9 * unloaded),
        (format!("{memory:.0} MiB, budget {budget:.0}"), memory <= budget),
    ])
}

/// What the requests got: how long each kind of answer took.
type Answers = Arc<Mutex<BTreeMap<String, Vec<f64>>>>;

/// The callers' own process: `call URL RATE SECONDS` sends requests at that rate, whatever the answers.
pub fn call(words: &[String]) -> ExitCode {
    let [url, rate, seconds] = words else { return ExitCode::FAILURE };
    let (rate, seconds): (f64, f64) = (rate.parse().unwrap(), seconds.parse().unwrap());
    let answers = Answers::default();
    let url = format!("{url}?deadline={DEADLINE}");
    let sent = block_on(send(url, rate, seconds, Arc::clone(&answers)));
    let answers = answers.lock().unwrap();
    println!("answer                           count    p50 s    p99 s    max s");
    let (mut slowest, mut answered) = (0.0_f64, 0);
    for (kind, times) in answers.iter() {
        let mut times = times.clone();
        times.sort_by(f64::total_cmp);
        let [p50, p99, max] = [0.5, 0.99, 1.0].map(|share| quantile(&times, share));
        println!("{kind:<30} {:>7} {p50:>8.3} {p99:>8.3} {max:>8.3}", times.len());
        (slowest, answered) = (slowest.max(max), answered + times.len());
    }
    let count = |kinds: &[&str]| -> usize {
        answers
            .iter()
            .filter(|(kind, _)| kinds.contains(&kind.as_str()))
            .map(|(_, t)| t.len())
            .sum()
    };
    let clean = count(&["200", "503 overloaded", "504 deadline_exceeded"]);
    println!("sent/s               {:.1}", sent as f64 / seconds);
    println!("accepted/s           {:.1}", count(&["200"]) as f64 / seconds);
    println!("slowest s            {slowest:.3}");
    println!("not answered, or otherwise {}", sent - answered + (answered - clean));
    ExitCode::SUCCESS
}

/// Sends at `rate` for `seconds` and waits for every answer; how many were sent.
async fn send(url: String, rate: f64, seconds: f64, answers: Answers) -> usize {
    let (client, cloud) = (Client::new(), bracket(POINTS));
    let (begin, mut running) = (Instant::now(), tokio::task::JoinSet::new());
    let mut sent = 0;
    while begin.elapsed().as_secs_f64() < seconds {
        // those that are due by now: a busy machine does not make the load less
        while sent as f64 <= begin.elapsed().as_secs_f64() * rate {
            running.spawn(one(client.clone(), url.clone(), cloud.clone(), Arc::clone(&answers)));
            sent += 1;
        }
        tokio::time::sleep(Duration::from_millis(2)).await;
    }
    while running.join_next().await.is_some() {}
    sent
}

async fn one(client: Client, url: String, cloud: Bytes, answers: Answers) {
    let asked = Instant::now();
    let answer = client.post(url).body(cloud).timeout(Duration::from_secs(30)).send().await;
    let kind = match answer {
        Err(error) => format!("{error:?}").chars().take(60).collect(),
        Ok(answer) if answer.status() == 200 => match answer.bytes().await {
            Ok(_) => "200".to_owned(),
            Err(error) => error.to_string(),
        },
        Ok(answer) => {
            let status = answer.status().as_u16();
            let problem: serde_json::Value = answer.json().await.unwrap_or_default();
            format!("{status} {}", problem["code"].as_str().unwrap_or("without a problem document"))
        }
    };
    answers.lock().unwrap().entry(kind).or_default().push(asked.elapsed().as_secs_f64());
}
