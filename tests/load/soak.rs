use std::{
    sync::{Arc, Mutex},
    time::{Duration, Instant},
};

use bytes::Bytes;
use conicoid::{
    formats::Limits,
    jobs::Control,
    service::{
        Request, compute,
        message::v1::{SegmentRequest, segmentations_client::SegmentationsClient},
    },
};
use reqwest::Client;
use serde_json::Value;
use tokio::{io::AsyncWriteExt, net::TcpStream, time::sleep};

use super::{
    block_on,
    cloud::bracket,
    jobs::{Tally, result, settled, submit},
    missed,
    random::Random,
    server::Server,
};

const SECONDS: u64 = 1800;
const CALLERS: u64 = 3;
const SIZES: [usize; 5] = [200, 900, 3_000, 8_000, 20_000];
/// Between two samples of the service's memory.
const SAMPLE: Duration = Duration::from_secs(5);
/// The memory settles in the first third; the line is drawn through the rest.
const SETTLED: f64 = 1.0 / 3.0;
/// A slope this many times its own uncertainty is a leak.
const SIGNIFICANT: f64 = 3.0;
/// Slopes below this, in MiB a minute, are no matter whatever their uncertainty: 3 MiB an hour.
const SLIGHT: f64 = 0.05;
const WAIT: Duration = Duration::from_secs(60);

/// How long a soak takes that is asked for by `word`: `soak` or `soak=SECONDS`.
pub fn seconds(word: &str) -> Option<u64> {
    match word.strip_prefix("soak")? {
        "" => Some(SECONDS),
        rest => rest.strip_prefix('=')?.parse().ok(),
    }
}

/// A cloud in the bytes of a file, and the labels that the library gives it.
struct Known {
    bytes: Bytes,
    labels: Vec<i32>,
}

/// What the callers saw.
#[derive(Default)]
struct Seen {
    tally: Tally,
    wrong: Vec<String>,
    // requests and jobs that ended in no clean way
    unclean: Vec<String>,
}

type Shared = Arc<Mutex<Seen>>;

pub fn run(seconds: u64) -> Vec<String> {
    let directory = tempfile::tempdir().unwrap();
    let data = format!("--data-dir={}", directory.path().display());
    let clouds: Arc<[Known]> =
        SIZES.iter().flat_map(|n| [ply(*n), text(*n / 2)]).map(known).collect();
    // jobs are forgotten soon and their room is small, so that both come to their end again and again; the
    // database's cache is small, so that it is full when the line begins
    let flags = [
        &data,
        "--threads=1",
        "--result-bytes=20971520",
        "--result-ttl=60",
        "--data-cache-bytes=8388608",
    ];
    let mut server = Server::start(&flags);
    let seen = Shared::default();
    let memory = block_on(soak(&server, &clouds, seconds, &seen));
    let seen = seen.lock().unwrap();
    let (slope, uncertainty) = line(&memory);
    let at_rest = block_on(async {
        sleep(Duration::from_secs(3)).await;
        (
            server.metric("conicoid_bytes_in_flight").await,
            server.metric("conicoid_queue_length").await,
        )
    });
    let panics = server.log().matches("panicked").count();
    println!("{}", seen.tally);
    println!("memory: {slope:.3} +- {uncertainty:.3} MiB a minute over the last two thirds");
    println!("wrong answers: {}; panics: {panics}", seen.wrong.len());
    println!("at rest: {} bytes in flight, {} waiting", at_rest.0, at_rest.1);
    seen.wrong.iter().take(5).for_each(|wrong| println!("wrong: {wrong}"));
    println!("without an answer: {}", seen.unclean.len());
    seen.unclean.iter().take(5).for_each(|unclean| println!("without an answer: {unclean}"));
    missed([
        (format!("{} wrong answers", seen.wrong.len()), seen.wrong.is_empty()),
        (
            format!("{} requests or jobs without an answer", seen.unclean.len()),
            seen.unclean.is_empty(),
        ),
        (
            format!("memory grows by {slope:.3} +- {uncertainty:.3} MiB a minute"),
            slope <= (SIGNIFICANT * uncertainty).max(SLIGHT),
        ),
        (format!("{panics} panics"), panics == 0),
        (format!("at rest {at_rest:?}"), at_rest == (0.0, 0.0)),
        ("the process ended".to_owned(), server.is_alive()),
    ])
}

fn ply(n: usize) -> Bytes {
    bracket(n)
}

/// The same points as text.
fn text(n: usize) -> Bytes {
    let bytes = bracket(n);
    let cloud = conicoid::formats::read(&bytes, None, &Limits::default()).unwrap();
    let lines = cloud.points.iter().map(|p| format!("{} {} {}\n", p.x, p.y, p.z));
    lines.collect::<String>().into()
}

fn known(bytes: Bytes) -> Known {
    let answer = compute(&bytes, &Request::default(), &Limits::default(), &Control::new(None));
    Known { labels: answer.unwrap().document.labels.unwrap(), bytes }
}

/// Lets the callers go on for that long; minutes and MiB of the service's memory.
async fn soak(
    server: &Server,
    clouds: &Arc<[Known]>,
    seconds: u64,
    seen: &Shared,
) -> Vec<(f64, f64)> {
    let (begin, time) = (Instant::now(), Duration::from_secs(seconds));
    let mut memory = Vec::new();
    let watch = async {
        while begin.elapsed() < time {
            sleep(SAMPLE).await;
            memory.push((begin.elapsed().as_secs_f64() / 60.0, server.memory()));
            if memory.len() % 24 == 0 {
                let (minutes, now) = memory[memory.len() - 1];
                println!("{minutes:>5.1} min  {now:>7.1} MiB");
            }
        }
    };
    let callers = (1..=CALLERS).map(|seed| async move {
        let mut caller = Caller::new(server, clouds, seed, seen).await;
        while begin.elapsed() < time {
            caller.one().await;
        }
    });
    tokio::join!(watch, futures::future::join_all(callers));
    memory
}

/// One caller, who does now this, now that.
struct Caller<'s> {
    server: &'s Server,
    clouds: &'s [Known],
    random: Random,
    client: Client,
    grpc: SegmentationsClient<tonic::transport::Channel>,
    seen: &'s Shared,
}

impl<'s> Caller<'s> {
    async fn new(server: &'s Server, clouds: &'s [Known], seed: u64, seen: &'s Shared) -> Self {
        let grpc = SegmentationsClient::connect(server.grpc.clone()).await.unwrap();
        Self { server, clouds, random: Random::new(seed), client: Client::new(), grpc, seen }
    }

    async fn one(&mut self) {
        let cloud = &self.clouds[self.random.below(self.clouds.len())];
        match self.random.below(100) {
            0..35 => self.wait_for(cloud).await,
            35..55 => self.job(cloud).await,
            55..65 => self.cancelled_job(cloud).await,
            65..75 => self.broken_off(cloud).await,
            75..82 => self.gone_away(cloud).await,
            82..92 => self.rubbish(cloud).await,
            92..96 => self.dropped_stream(cloud).await,
            _ => self.call(cloud).await,
        }
    }

    fn count(&self, what: impl ToString) {
        self.seen.lock().unwrap().tally.count(what);
    }

    fn unclean(&self, what: impl ToString) {
        self.seen.lock().unwrap().unclean.push(what.to_string());
    }

    fn check(&self, what: &str, text: &str, cloud: &Known) {
        let labels: Value = serde_json::from_str::<Value>(text).unwrap()["labels"].take();
        if labels != serde_json::json!(cloud.labels) {
            let points = cloud.labels.len();
            self.seen.lock().unwrap().wrong.push(format!("{what} of {points} points"));
        }
    }

    async fn wait_for(&mut self, cloud: &Known) {
        let request = self.client.post(self.server.segmentations()).body(cloud.bytes.clone());
        let answer = match request.send().await {
            Ok(answer) => answer,
            Err(error) => return self.unclean(format!("{error:?}")),
        };
        let status = answer.status().as_u16();
        self.count(format!("waited {status}"));
        match answer.text().await {
            Ok(text) if status == 200 => self.check("an answer", &text, cloud),
            Ok(_) => {}
            Err(error) => self.unclean(format!("{error:?}")),
        }
    }

    async fn job(&mut self, cloud: &Known) {
        let key = format!("{:x}", self.random.bits());
        let (status, id) = submit(self.server, &self.client, cloud.bytes.clone(), Some(&key)).await;
        self.count(format!("job {status}"));
        if status != 202 {
            return;
        }
        let again = submit(self.server, &self.client, cloud.bytes.clone(), Some(&key)).await;
        if again.0 == 202 && again.1 != id {
            self.unclean("another job under the same key");
        }
        let states = settled(self.server, &self.client, std::slice::from_ref(&id), WAIT).await;
        let (status, text) = result(self.server, &self.client, &id).await;
        match status {
            200 => self.check("a job", &text, cloud),
            // a job may have been forgotten for want of room
            404 => self.count("job forgotten"),
            _ => self.unclean(format!("a result: {status}, job {states}")),
        }
    }

    async fn cancelled_job(&mut self, cloud: &Known) {
        let (status, id) = submit(self.server, &self.client, cloud.bytes.clone(), None).await;
        if status == 202 {
            self.pause(100_000).await;
            let url = format!("{}/v1/jobs/{id}", self.server.http);
            let answer = self.client.delete(url).send().await.unwrap();
            self.count(format!("deleted {}", answer.status().as_u16()));
        }
    }

    async fn pause(&mut self, most_us: usize) {
        sleep(Duration::from_micros(self.random.below(most_us) as u64)).await;
    }

    /// Sends the head of a request and as much of the cloud as `part` says, and hangs up.
    async fn leave(&mut self, cloud: &Known, part: usize, patience_us: usize) {
        let address = self.server.http.trim_start_matches("http://");
        let length = cloud.bytes.len();
        let head = format!(
            "POST /v1/segmentations HTTP/1.1\r\nHost: {address}\r\nContent-Length: {length}\r\n\r\n"
        );
        let mut stream = TcpStream::connect(address).await.unwrap();
        // the service may have refused it by now
        let _ = stream.write_all(&[head.as_bytes(), &cloud.bytes[..part]].concat()).await;
        self.pause(patience_us).await;
    }

    async fn broken_off(&mut self, cloud: &Known) {
        let part = self.random.below(cloud.bytes.len());
        self.leave(cloud, part, 20_000).await;
        self.count("broken off");
    }

    async fn gone_away(&mut self, cloud: &Known) {
        self.leave(cloud, cloud.bytes.len(), 50_000).await;
        self.count("gone away");
    }

    async fn rubbish(&mut self, cloud: &Known) {
        let mut bytes = match self.random.below(5) {
            0 => Vec::new(),
            1 => b"ply\n".to_vec(),
            2 => b"LASF".to_vec(),
            3 => b"ASTM-E57".to_vec(),
            _ => cloud.bytes[..self.random.below(cloud.bytes.len())].to_vec(),
        };
        let more = self.random.below(3_000);
        bytes.extend((0..more).map(|_| self.random.bits() as u8));
        let request = self.client.post(self.server.segmentations()).body(bytes);
        match request.send().await {
            Ok(answer) => self.count(format!("rubbish {}", answer.status().as_u16())),
            Err(error) => self.unclean(format!("{error:?}")),
        }
    }

    /// A call over HTTP/2 that is given up on its way.
    async fn dropped_stream(&mut self, cloud: &Known) {
        let request = SegmentRequest { cloud: cloud.bytes.to_vec().into(), ..Default::default() };
        let mut grpc = self.grpc.clone();
        let call = tokio::spawn(async move { grpc.segment(request).await.is_ok() });
        self.pause(50_000).await;
        call.abort();
        self.count("stream given up");
    }

    async fn call(&mut self, cloud: &Known) {
        let request = SegmentRequest { cloud: cloud.bytes.to_vec().into(), ..Default::default() };
        match self.grpc.segment(request).await {
            Ok(answer) => {
                self.count("call OK");
                if answer.into_inner().labels != cloud.labels {
                    self.seen.lock().unwrap().wrong.push("a call".to_owned());
                }
            }
            Err(status) => self.count(format!("call {:?}", status.code())),
        }
    }
}

/// Slope of the straight line through the later points, and its standard uncertainty.
fn line(memory: &[(f64, f64)]) -> (f64, f64) {
    let later = &memory[(memory.len() as f64 * SETTLED) as usize..];
    let n = later.len() as f64;
    let mean = |of: fn(&(f64, f64)) -> f64| later.iter().map(of).sum::<f64>() / n;
    let (x, y) = (mean(|p| p.0), mean(|p| p.1));
    let spread: f64 = later.iter().map(|p| (p.0 - x).powi(2)).sum();
    let slope = later.iter().map(|p| (p.0 - x) * (p.1 - y)).sum::<f64>() / spread;
    let rest: f64 = later.iter().map(|p| (p.1 - y - slope * (p.0 - x)).powi(2)).sum();
    (slope, (rest / (n - 2.0).max(1.0) / spread).sqrt())
}
