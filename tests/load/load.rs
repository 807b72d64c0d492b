//! Load test: requests a second and their times over HTTP and gRPC, and the share of what the library
//! itself does on the same processors.
//!
//! `cargo run --release --example load [-- SECONDS]` starts a service of its own and prints one row for
//! each size and interface. Other programs on the machine spoil the figures.

#![allow(clippy::unwrap_used, clippy::expect_used, reason = "a load test that cannot go on ends")]

use std::{
    fmt::Write,
    sync::Arc,
    thread,
    time::{Duration, Instant},
};

use conicoid::{
    cli::{Server, settings},
    formats::{Limits, read},
    segment::{Parameters, Silent, segment},
    service::message::v1::{SegmentRequest, segmentations_client::SegmentationsClient},
};
use tokio_util::sync::CancellationToken;

/// Callers that ask at the same time, each waiting for its answer before it asks again.
const CALLERS: usize = 4;

fn main() {
    let seconds = std::env::args().nth(1).and_then(|s| s.parse().ok()).unwrap_or(5.0);
    let time = Duration::from_secs_f64(seconds);
    let runtime = tokio::runtime::Builder::new_multi_thread().enable_all().build().unwrap();
    println!("points  interface  requests/s  p50 ms  p99 ms  share of the library");
    for points in [1_000, 10_000, 100_000] {
        let cloud = Arc::new(bracket(points));
        let library = library_rate(&cloud, time);
        println!("{points:>6}  library    {library:>10.1}");
        for interface in ["http", "grpc"] {
            let callers = runtime.block_on(load(interface, Arc::clone(&cloud), time));
            // a caller always waits for one answer, so its times add up to how long it asked
            let rate: f64 =
                callers.iter().map(|times| times.len() as f64 / times.iter().sum::<f64>()).sum();
            let mut times = callers.concat();
            times.sort_by(f64::total_cmp);
            let at = |share: f64| times[((times.len() - 1) as f64 * share) as usize] * 1e3;
            let (p50, p99, share) = (at(0.5), at(0.99), rate / library);
            println!(
                "{points:>6}  {interface:<9}  {rate:>10.1}  {p50:>6.1}  {p99:>6.1}  {share:.2}"
            );
        }
    }
}

/// A half cylinder that runs out into two planes, as a binary PLY file.
fn bracket(n: usize) -> Vec<u8> {
    let scatter = |i: usize, step: f64| (i as f64 * step).fract();
    let mut header = String::new();
    let _ = write!(
        header,
        "ply\nformat binary_little_endian 1.0\nelement vertex {n}\nproperty double x\n\
         property double y\nproperty double z\nend_header\n"
    );
    let point = |i| {
        let along = scatter(i, 0.618_033_988_749_895) * 60.0;
        let y = scatter(i, 0.569_840_290_998_053) * 40.0;
        let r = 10.0 + 0.01 * (scatter(i, 0.754_877_666_246_693) - 0.5);
        let angle = (along - 20.0) / 20.0 * std::f64::consts::PI;
        match along {
            a if a < 20.0 => [r, y, a - 20.0],
            a if a < 40.0 => [r * angle.cos(), y, r * angle.sin()],
            a => [-r, y, 40.0 - a],
        }
    };
    let coordinates = (0..n).flat_map(point).flat_map(f64::to_le_bytes);
    header.into_bytes().into_iter().chain(coordinates).collect()
}

/// Clouds a second of the library on all processors, one thread a cloud.
fn library_rate(bytes: &[u8], time: Duration) -> f64 {
    let cloud = read(bytes, None, &Limits::default()).unwrap();
    let threads = thread::available_parallelism().map_or(1, usize::from);
    let work = || {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
        pool.install(|| {
            let (begin, mut done) = (Instant::now(), 0);
            while begin.elapsed() < time {
                segment(&cloud, &Parameters::default(), &Silent).unwrap();
                done += 1;
            }
            f64::from(done) / begin.elapsed().as_secs_f64()
        })
    };
    thread::scope(|scope| {
        let running: Vec<_> = (0..threads).map(|_| scope.spawn(work)).collect();
        running.into_iter().map(|rate| rate.join().unwrap()).sum()
    })
}

/// The times of each caller's requests, begun within `time`, in seconds.
async fn load(interface: &'static str, cloud: Arc<Vec<u8>>, time: Duration) -> Vec<Vec<f64>> {
    let flags = ["conicoid", "--http=127.0.0.1:0", "--grpc=127.0.0.1:0", "--admin=127.0.0.1:0"];
    let server = Server::bind(settings(&flags.map(Into::into)).unwrap()).await.unwrap();
    let (addresses, stop) = (server.addresses().unwrap(), CancellationToken::new());
    let served = tokio::spawn(server.run(stop.clone()));
    let callers: Vec<_> = (0..CALLERS)
        .map(|_| {
            let cloud = Arc::clone(&cloud);
            match interface {
                "http" => tokio::spawn(http(format!("http://{}", addresses.http), cloud, time)),
                _ => tokio::spawn(grpc(format!("http://{}", addresses.grpc), cloud, time)),
            }
        })
        .collect();
    let mut times = Vec::new();
    for caller in callers {
        times.push(caller.await.unwrap());
    }
    stop.cancel();
    served.await.unwrap().unwrap();
    times
}

async fn http(url: String, cloud: Arc<Vec<u8>>, time: Duration) -> Vec<f64> {
    let (client, begin, mut times) = (reqwest::Client::new(), Instant::now(), Vec::new());
    while begin.elapsed() < time {
        let asked = Instant::now();
        let request = client.post(format!("{url}/v1/segmentations")).body(cloud.to_vec());
        let answer = request.send().await.unwrap();
        assert_eq!(answer.status(), 200);
        answer.bytes().await.unwrap();
        times.push(asked.elapsed().as_secs_f64());
    }
    times
}

async fn grpc(url: String, cloud: Arc<Vec<u8>>, time: Duration) -> Vec<f64> {
    let mut client = SegmentationsClient::connect(url).await.unwrap();
    let (begin, mut times) = (Instant::now(), Vec::new());
    while begin.elapsed() < time {
        let asked = Instant::now();
        let request = SegmentRequest { cloud: cloud.to_vec().into(), ..Default::default() };
        client.segment(request).await.unwrap();
        times.push(asked.elapsed().as_secs_f64());
    }
    times
}
