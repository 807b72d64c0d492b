//! Measures the service against the library and under load, and prints a table for each part.
//!
//! `cargo run --release --example load [-- PART...]`; without a part all but `soak` run, in about ten
//! minutes:
//!
//! | part | shows |
//! |---|---|
//! | `rates` | requests a second and their times over HTTP and gRPC, as a share of the library's rate |
//! | `answer` | a million points over HTTP, labels and all, beside the library's own time |
//! | `overload` | ten times the load that can be served, for a minute |
//! | `beside` | small requests while a cloud of ten million points is at work |
//! | `cancel` | how soon the threads are free when a large run is cancelled |
//! | `strangers` | a thousand silent or half-open connections of each kind beside an honest caller |
//! | `survival` | 50 queued jobs and `kill -9`, twenty times |
//! | `gone` | 300 callers who hang up after their last byte and send the same again |
//! | `full` | a disk that fills up and has room again; needs `unshare` and `mount` |
//! | `damaged` | 120 starts on a database with changed bytes |
//! | `fleet` | 500 jobs of two front ends and four workers over 1 and 3 NATS servers, while all of them are killed |
//! | `queue` | what the queue of NATS costs: jobs a second, milliseconds a request |
//! | `soak` | half an hour of mixed load with cancels, broken uploads and rubbish; `soak=SECONDS` for less |
//!
//! The service runs in a process of its own, on the same processors as its callers: other programs on
//! the machine spoil the figures. A part that misses its mark says so, and then the command fails.

#![allow(clippy::unwrap_used, clippy::expect_used, reason = "a load test that cannot go on ends")]

mod answer;
mod beside;
mod caller;
mod cancel;
mod cloud;
mod damaged;
mod fleet;
mod full;
mod gone;
mod jobs;
#[path = "../support/nats.rs"]
#[allow(dead_code, reason = "what it has for tests is not all needed here")]
mod nats;
mod overload;
mod queue;
#[path = "../clouds/random.rs"]
#[allow(dead_code, reason = "whole numbers are all that is needed here")]
mod random;
mod rates;
mod server;
mod soak;
mod strangers;
mod survival;
#[allow(dead_code, reason = "what it has for tests is not all needed here")]
#[path = "../it/support/wire.rs"]
mod wire;

use std::process::ExitCode;

/// One part: what it prints is its table, what it returns the marks it missed.
type Part = (&'static str, fn() -> Vec<String>);

const PARTS: [Part; 12] = [
    ("rates", rates::run),
    ("answer", answer::run),
    ("overload", overload::run),
    ("beside", beside::run),
    ("cancel", cancel::run),
    ("strangers", strangers::run),
    ("survival", survival::run),
    ("gone", gone::run),
    ("full", full::run),
    ("damaged", damaged::run),
    ("fleet", fleet::run),
    ("queue", queue::run),
];

fn main() -> ExitCode {
    let words: Vec<_> = std::env::args().skip(1).collect();
    // the same program is the service and the callers of the overload, in processes of their own
    match words.first().map(String::as_str) {
        Some("serve" | "worker") => return conicoid::cli::main(),
        Some("call") => return overload::call(&words[1..]),
        _ => {}
    }
    let soak = words.iter().find_map(|word| soak::seconds(word));
    let known = |word: &str| PARTS.iter().any(|(name, _)| *name == word);
    if let Some(wrong) = words.iter().find(|word| !known(word) && soak::seconds(word).is_none()) {
        let names = PARTS.map(|(name, _)| name).join(", ");
        eprintln!("no part '{wrong}': the parts are {names}, soak and soak=SECONDS");
        return ExitCode::FAILURE;
    }
    let mut missed = Vec::new();
    for (name, run) in PARTS {
        if words.is_empty() || words.iter().any(|word| word == name) {
            println!("== {name}");
            missed.extend(run().into_iter().map(|mark| format!("{name}: {mark}")));
            println!();
        }
    }
    if let Some(seconds) = soak {
        println!("== soak");
        missed.extend(soak::run(seconds).into_iter().map(|mark| format!("soak: {mark}")));
    }
    missed.iter().for_each(|mark| println!("missed: {mark}"));
    if missed.is_empty() { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}

/// Runs a part that calls the service.
fn block_on<T>(part: impl Future<Output = T>) -> T {
    tokio::runtime::Builder::new_multi_thread().enable_all().build().unwrap().block_on(part)
}

/// The marks that are missed, from pairs of a claim and whether it holds.
fn missed<const N: usize>(claims: [(String, bool); N]) -> Vec<String> {
    claims.into_iter().filter(|(_, holds)| !holds).map(|(claim, _)| claim).collect()
}
