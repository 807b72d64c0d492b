//! The figures of one cloud.

use std::{error::Error, fmt, fs, path::Path, sync::Mutex, time::Instant};

use conicoid::{
    formats::{Limits, read},
    geometry::PointCloud,
    segment::{Method, Monitor, Parameters, Segmentation, Silent, Stage, segment},
};
use rayon::ThreadPoolBuilder;
use serde::{Deserialize, Serialize};

use super::{
    clouds::smooth,
    floor::{floor, neighbours, sorted, tree},
    process::{least, memory, reset_peak},
};

pub type Outcome<T> = Result<T, Box<dyn Error + Send + Sync>>;

/// What the example prints about one cloud; times in seconds.
#[derive(Debug, Serialize, Deserialize)]
pub struct Figures {
    parse: f64,
    floor_one_thread: f64,
    floor: f64,
    neighbours: f64,
    pub total: f64,
    total_one_thread: f64,
    total_cpu: f64,
    bytes_per_point: f64,
    stages: Vec<f64>,
    regions: usize,
}

impl fmt::Display for Figures {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for time in [
            self.parse,
            self.floor_one_thread,
            self.floor,
            self.neighbours,
            self.total,
            self.total_one_thread,
        ] {
            write!(f, "{time:7.4} ")?;
        }
        write!(f, "{:5.2} | {:7.1} ", self.total_cpu, self.total / self.floor)?;
        write!(f, "{:5.2} ", self.total / self.neighbours)?;
        write!(f, "{:5.2} {:5.0}", self.total_one_thread / self.total, self.bytes_per_point)
    }
}

impl Figures {
    /// The time of every stage and the number of regions.
    pub fn stage_row(&self) -> String {
        let times: String = self.stages.iter().map(|t| format!("{t:8.4}")).collect();
        format!("{times} | {}", self.regions)
    }
}

/// Measures the PLY file and prints its figures as JSON.
pub fn child(file: &Path) -> Outcome<()> {
    let bytes = fs::read(file)?;
    let runs = if bytes.len() > 100_000_000 { 1 } else { 3 };
    let (parse, cloud) = least(runs, || read(&bytes, None, &Limits::default()));
    let cloud = cloud?;
    drop(bytes);
    let resident = memory("VmRSS");
    reset_peak()?;
    run(&cloud, &Silent)?;
    let bytes_per_point = (memory("VmHWM") - resident) / cloud.points.len() as f64;

    let one = ThreadPoolBuilder::new().num_threads(1).build()?;
    let (stages, sigma) = staged(&cloud)?;
    let (total, found) = least(runs, || run(&cloud, &Silent));
    let (total_one_thread, _) = one.install(|| least(runs, || run(&cloud, &Silent)));
    let (least_work, _) = least(runs, || floor(&cloud.points, 3.0 * sigma));
    let (floor_one_thread, _) = one.install(|| least(runs, || floor(&cloud.points, 3.0 * sigma)));
    let sorted = sorted(&cloud.points);
    let tree = tree(&sorted).ok_or("no tree of these points")?;
    let (nearest, sum) = least(runs, || neighbours(&tree, &sorted));
    if !sum.is_finite() {
        return Err("a neighbour is infinitely far".into());
    }
    let figures = Figures {
        parse: parse.wall,
        floor_one_thread: floor_one_thread.wall,
        floor: least_work.wall,
        neighbours: nearest.wall,
        total: total.wall,
        total_one_thread: total_one_thread.wall,
        total_cpu: total.cpu,
        bytes_per_point,
        stages,
        regions: found?.regions.len(),
    };
    println!("{}", serde_json::to_string(&figures)?);
    Ok(())
}

fn run(cloud: &PointCloud, monitor: &dyn Monitor) -> Outcome<Segmentation> {
    Ok(segment(cloud, &Parameters::default(), monitor)?)
}

/// Notes when each stage is heard of.
struct Clock(Mutex<Vec<(Stage, Instant)>>);

impl Monitor for Clock {
    fn progress(&self, stage: Stage, _: f64) {
        if let Ok(mut heard) = self.0.lock() {
            heard.push((stage, Instant::now()));
        }
    }
    fn cancelled(&self) -> bool {
        false
    }
}

/// Seconds in each stage of one call, and the noise it found.
fn staged(cloud: &PointCloud) -> Outcome<(Vec<f64>, f64)> {
    let clock = Clock(Mutex::new(Vec::new()));
    let found = run(cloud, &clock)?;
    let end = Instant::now();
    let heard = clock.0.into_inner()?;
    let ends = heard.iter().skip(1).map(|h| h.1).chain([end]);
    let spans: Vec<_> = heard.iter().zip(ends).map(|(h, end)| (h.0, end - h.1)).collect();
    let seconds =
        |stage| spans.iter().filter(|s| s.0 == stage).map(|s| s.1.as_secs_f64()).sum::<f64>();
    let sigma = found.parameters.noise_sigma.unwrap_or_default();
    Ok((Stage::ALL.map(seconds).into(), sigma))
}

/// One call on three joined elliptic cylinders by either method: method, seconds and regions.
pub fn chain(n: usize) -> Outcome<Vec<String>> {
    let cloud = smooth::sized("chain3", n, 1).ok_or("no such cloud")?.input();
    let rcond = Parameters {
        method: Method::Rcond,
        rcond_threshold: 0.5e-19,
        algebraic_threshold: 5e-5,
        ..Parameters::default()
    };
    let row = |(name, parameters): (&str, Parameters)| -> Outcome<String> {
        let (spent, found) = least(3, || segment(&cloud, &parameters, &Silent));
        let regions = found?.regions.len();
        Ok(format!("{name:>8} {:8.4} {regions:8}", spent.wall))
    };
    [("distance", Parameters::default()), ("rcond", rcond)].into_iter().map(row).collect()
}
