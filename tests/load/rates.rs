use std::{
    thread,
    time::{Duration, Instant},
};

use conicoid::{
    formats::{Limits, read},
    segment::{Parameters, Silent, segment},
};

use super::{
    block_on,
    caller::{Interface, ask_all},
    cloud::bracket,
    missed,
    server::Server,
};

/// Callers that ask at the same time.
const CALLERS: usize = 4;
/// How long each row is measured.
const TIME: Duration = Duration::from_secs(5);
/// The share of the library's rate that clouds of 10k points and more must reach.
const SHARE: f64 = 0.9;

pub fn run() -> Vec<String> {
    println!("points  interface  requests/s  p50 ms  p99 ms  share of the library");
    let mut marks = Vec::new();
    let server = Server::start(&[]);
    for points in [1_000, 10_000, 100_000] {
        let cloud = bracket(points);
        let library = library_rate(&cloud);
        println!("{points:>6}  library    {library:>10.1}");
        for (name, interface) in [("http", Interface::Http), ("grpc", Interface::Grpc)] {
            let url = if name == "http" { &server.http } else { &server.grpc };
            let times = block_on(ask_all(CALLERS, interface, url, &cloud, TIME));
            let share = times.rate / library;
            let (p50, p99) = (times.quantile_ms(0.5), times.quantile_ms(0.99));
            println!(
                "{points:>6}  {name:<9}  {:>10.1}  {p50:>6.1}  {p99:>6.1}  {share:.2}",
                times.rate
            );
            marks.extend(missed([(
                format!("{name} at {points} points: {share:.2} of the library, wanted {SHARE}"),
                points < 10_000 || share >= SHARE,
            )]));
        }
    }
    marks
}

/// Clouds a second of the library on all processors, one thread a cloud, from bytes to result.
fn library_rate(bytes: &[u8]) -> f64 {
    let threads = thread::available_parallelism().map_or(1, usize::from);
    let work = || {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
        pool.install(|| {
            let (begin, mut done) = (Instant::now(), 0);
            while begin.elapsed() < TIME {
                let cloud = read(bytes, None, &Limits::default()).unwrap();
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
