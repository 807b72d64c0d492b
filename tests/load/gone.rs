use std::time::Duration;

use bytes::Bytes;
use reqwest::Client;
use tokio::{io::AsyncWriteExt, net::TcpStream, time::sleep};

use super::{
    block_on,
    cloud::bracket,
    jobs::{Tally, settled, submit},
    missed,
    server::Server,
};

const CALLERS: usize = 300;
const POINTS: usize = 900;
/// How long after its last byte a caller hangs up: from before the service has read it to after it has
/// answered.
const PATIENCE_US: [u64; 6] = [0, 200, 500, 1_000, 2_000, 4_000];
/// Memory may be this much above that of before, in MiB: what an allocator keeps after 600 uploads.
const ABOVE_REST: f64 = 16.0;

pub fn run() -> Vec<String> {
    println!(
        "jobs kept in    retried            states of the jobs    bytes in flight  MiB above rest"
    );
    let mut marks = Vec::new();
    for on_disk in [false, true] {
        let directory = tempfile::tempdir().unwrap();
        let data = format!("--data-dir={}", directory.path().display());
        let place = if on_disk { "data directory" } else { "memory" };
        let flags: &[&str] = if on_disk { &[&data] } else { &[] };
        let server = Server::start(flags);
        let (retried, states, in_flight, above) = block_on(hang_up(&server));
        println!("{place:<14}  {retried}   {states}   {in_flight}   {above:.1}");
        let stuck = states.total() - states.of("succeeded");
        marks.extend(missed([
            (format!("{place}: {stuck} of {CALLERS} stuck or lost: {states}"), stuck == 0),
            (format!("{place}: {in_flight} bytes still in flight"), in_flight == 0.0),
            (format!("{place}: {above:.1} MiB above rest"), above <= ABOVE_REST),
        ]));
    }
    marks
}

/// Lets callers hang up, and send the same again under the same key.
async fn hang_up(server: &Server) -> (Tally, Tally, f64, f64) {
    let (client, cloud) = (Client::new(), bracket(POINTS));
    // a first round brings the service to its usual memory
    for _ in 0..20 {
        submit_once_there_is_room(server, &client, &cloud, None).await;
    }
    rest(server).await;
    let before = server.memory();
    for caller in 0..CALLERS {
        send_and_leave(server, caller, &cloud).await;
    }
    let (mut ids, mut told) = (Vec::new(), Tally::default());
    for caller in 0..CALLERS {
        let key = key(caller);
        let (status, id) = submit_once_there_is_room(server, &client, &cloud, Some(&key)).await;
        told.count(status);
        ids.push(id);
    }
    let states = settled(server, &client, &ids, Duration::from_secs(60)).await;
    rest(server).await;
    let in_flight = server.metric("conicoid_bytes_in_flight").await;
    (told, states, in_flight, server.memory() - before)
}

/// Waits until the service gives idle memory back.
async fn rest(server: &Server) {
    while server.metric("conicoid_queue_length").await > 0.0 {
        sleep(Duration::from_millis(100)).await;
    }
    sleep(Duration::from_secs(15)).await;
}

fn key(caller: usize) -> String {
    format!("caller-{caller}")
}

async fn send_and_leave(server: &Server, caller: usize, cloud: &Bytes) {
    let address = server.http.trim_start_matches("http://");
    let mut stream = TcpStream::connect(address).await.unwrap();
    let head = format!(
        "POST /v1/segmentations HTTP/1.1\r\nHost: {address}\r\nPrefer: respond-async\r\n\
         Idempotency-Key: {}\r\nContent-Length: {}\r\n\r\n",
        key(caller),
        cloud.len()
    );
    stream.write_all(&[head.as_bytes(), cloud].concat()).await.unwrap();
    sleep(Duration::from_micros(PATIENCE_US[caller % PATIENCE_US.len()])).await;
}

async fn submit_once_there_is_room(
    server: &Server,
    client: &Client,
    cloud: &Bytes,
    key: Option<&str>,
) -> (u16, String) {
    loop {
        let told = submit(server, client, cloud.clone(), key).await;
        if told.0 != 503 {
            return told;
        }
        sleep(Duration::from_millis(20)).await;
    }
}
