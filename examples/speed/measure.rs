//! The figures of one cloud.

use std::{
    error::Error,
    fs,
    path::Path,
    sync::Mutex,
    time::{Duration, Instant},
};

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
    process::{Spent, least, memory, reset_peak},
};

pub type Outcome<T> = Result<T, Box<dyn Error + Send + Sync>>;

/// What the example prints about one cloud.
#[derive(Debug, Serialize, Deserialize)]
pub struct Figures {
    parse: Spent,
    floor_one_thread: Spent,
    floor: Spent,
    neighbours: Spent,
    pub total: Spent,
    total_one_thread: Spent,
    bytes_per_point: f64,
    /// Wall-clock seconds.
    stages: Vec<f64>,
    regions: usize,
}

/// Heads of the columns of `wall_row`, `cpu_row` and `stage_row`.
pub const WALL: &str =
    "   parse floor/1   floor  kNN 12   total total/1 | x floor x kNN 1/all  B/pt";
pub const CPU: &str = "   floor  kNN 12   total | x floor x kNN";

impl Figures {
    /// Wall-clock seconds, their ratios, and memory.
    pub fn wall_row(&self) -> String {
        let times = [
            self.parse,
            self.floor_one_thread,
            self.floor,
            self.neighbours,
            self.total,
            self.total_one_thread,
        ];
        let (total, floor, nearest) = (self.total.wall, self.floor.wall, self.neighbours.wall);
        format!(
            "{} | {:7.1} {:5.2} {:5.2} {:5.0}",
            columns(times.map(|t| t.wall)),
            total / floor,
            total / nearest,
            self.total_one_thread.wall / total,
            self.bytes_per_point
        )
    }

    /// Processor seconds and their ratios.
    pub fn cpu_row(&self) -> String {
        let [floor, nearest, total] = [self.floor, self.neighbours, self.total].map(|t| t.cpu);
        let times = columns([floor, nearest, total]);
        format!("{times} | {:7.1} {:5.2}", total / floor, total / nearest)
    }

    /// Wall-clock seconds of every stage, and the number of regions.
    pub fn stage_row(&self) -> String {
        format!("{} | {:7}", columns(self.stages.iter().copied()), self.regions)
    }
}

fn columns(times: impl IntoIterator<Item = f64>) -> String {
    times.into_iter().map(|t| format!("{t:8.4}")).collect()
}

/// Measures the PLY file and prints its figures as JSON.
pub fn child(file: &Path) -> Outcome<()> {
    let bytes = fs::read(file)?;
    let runs = if bytes.len() > 10_000_000 { 1 } else { 3 };
    let (parse, cloud) = least(runs, || read(&bytes, None, &Limits::default()));
    let cloud = cloud?;
    drop(bytes);
    let resident = memory("VmRSS");
    reset_peak()?;
    let (stages, sigma) = staged(&cloud)?;
    let bytes_per_point = (memory("VmHWM") - resident) / cloud.points.len() as f64;

    let one = ThreadPoolBuilder::new().num_threads(1).build()?;
    let (total, found) = least(runs, || run(&cloud, &Silent));
    let (total_one_thread, _) = one.install(|| least(runs, || run(&cloud, &Silent)));
    let (least_work, _) = least(3, || floor(&cloud.points, 3.0 * sigma));
    let (floor_one_thread, _) = one.install(|| least(3, || floor(&cloud.points, 3.0 * sigma)));
    let sorted = sorted(&cloud.points);
    let tree = tree(&sorted).ok_or("no tree of these points")?;
    let (nearest, sum) = least(runs, || neighbours(&tree, &sorted));
    if !sum.is_finite() {
        return Err("a neighbour is infinitely far".into());
    }
    let figures = Figures {
        parse,
        floor_one_thread,
        floor: least_work,
        neighbours: nearest,
        total,
        total_one_thread,
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
        |stage| spans.iter().filter(|s| s.0 == stage).map(|s| s.1).sum::<Duration>().as_secs_f64();
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
