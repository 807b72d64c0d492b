use std::time::{Duration, Instant};

use bytes::Bytes;
use conicoid::service::message::v1::{SegmentRequest, segmentations_client::SegmentationsClient};

/// The interface a caller uses.
#[derive(Clone, Copy)]
pub enum Interface {
    Http,
    Grpc,
}

/// The times in seconds of requests that one caller makes, each after the answer to the one before,
/// until `done` says so.
pub async fn ask_until(
    interface: Interface,
    url: String,
    cloud: Bytes,
    done: impl Fn() -> bool,
) -> Vec<f64> {
    let mut times = Vec::new();
    let http = reqwest::Client::new();
    let mut grpc = match interface {
        Interface::Http => None,
        Interface::Grpc => Some(SegmentationsClient::connect(url.clone()).await.unwrap()),
    };
    while !done() {
        let asked = Instant::now();
        match &mut grpc {
            Some(client) => {
                let request = SegmentRequest { cloud: cloud.clone(), ..Default::default() };
                client.segment(request).await.unwrap();
            }
            None => {
                let request = http.post(format!("{url}/v1/segmentations")).body(cloud.clone());
                let answer = request.send().await.unwrap();
                assert_eq!(answer.status(), 200);
                answer.bytes().await.unwrap();
            }
        }
        times.push(asked.elapsed().as_secs_f64());
    }
    times
}

/// The same, until `time` is over.
pub async fn ask(interface: Interface, url: String, cloud: Bytes, time: Duration) -> Vec<f64> {
    let begin = Instant::now();
    ask_until(interface, url, cloud, || begin.elapsed() >= time).await
}

/// What a number of callers got.
pub struct Times {
    sorted: Vec<f64>,
    /// Requests a second, over all callers.
    pub rate: f64,
}

/// Lets `callers` ask at the same time.
pub async fn ask_all(
    callers: usize,
    interface: Interface,
    url: &str,
    cloud: &Bytes,
    time: Duration,
) -> Times {
    let asking: Vec<_> = (0..callers)
        .map(|_| tokio::spawn(ask(interface, url.to_owned(), cloud.clone(), time)))
        .collect();
    let mut all = Vec::new();
    let mut rate = 0.0;
    for caller in asking {
        let times = caller.await.unwrap();
        // a caller always waits for one answer, so its times add up to how long it asked
        rate += times.len() as f64 / times.iter().sum::<f64>();
        all.extend(times);
    }
    all.sort_by(f64::total_cmp);
    Times { sorted: all, rate }
}

impl Times {
    /// Those of one caller.
    pub fn of(mut times: Vec<f64>) -> Self {
        let rate = times.len() as f64 / times.iter().sum::<f64>();
        times.sort_by(f64::total_cmp);
        Self { sorted: times, rate }
    }

    /// The time in milliseconds that `share` of the requests kept to.
    pub fn quantile_ms(&self, share: f64) -> f64 {
        quantile(&self.sorted, share) * 1e3
    }

    /// How many there were.
    pub fn count(&self) -> usize {
        self.sorted.len()
    }
}

/// The value that `share` of the sorted ones do not exceed.
pub fn quantile(sorted: &[f64], share: f64) -> f64 {
    let place = ((sorted.len() as f64 * share).ceil() as usize).clamp(1, sorted.len());
    sorted[place - 1]
}
