//! The longest work between two looks at whether to stop, stage by stage, on clouds that are slow to segment.
//!
//! `cargo run --release --example cancel [NAME ...]`; figures are processor time of one thread, in milliseconds, as
//! Linux counts it. With `WHERE=1` in the environment it prints where work went on for more than 20.

#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "a measurement for people")]

use std::{
    collections::BTreeMap,
    f64::consts::TAU,
    sync::{Mutex, PoisonError},
    thread::ThreadId,
};

use conicoid::{
    geometry::{PointCloud, Vec3},
    segment::{Monitor, Parameters, Stage, segment},
};

/// A linear congruential generator: even enough for clouds.
struct Random(u64);

impl Random {
    fn uniform(&mut self, from: f64, to: f64) -> f64 {
        self.0 =
            self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        from + (to - from) * (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }

    fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.uniform(-0.5, 0.5)).sum()
    }

    fn unit(&mut self) -> Vec3 {
        Vec3::new(self.normal(), self.normal(), self.normal()).normalize()
    }
}

type Make = fn(&mut Random, usize) -> Vec3;

/// Name, points and how each is made.
const CLOUDS: [(&str, usize, Make); 7] = [
    ("bumpy sphere", 20_000, |r, _| {
        let d = r.unit();
        d * (10.0 + (5.0 * d.x).sin() * (5.0 * d.y).sin() * (5.0 * d.z).sin())
    }),
    ("torus knot", 10_000, |_, i| {
        let t = TAU * i as f64 / 10_000.0;
        let s = 3.0 + (7.0 * t).cos();
        Vec3::new(s * (3.0 * t).cos(), s * (3.0 * t).sin(), (7.0 * t).sin())
    }),
    ("egg box", 20_000, |r, _| {
        let (x, y) = (r.uniform(0.0, 30.0), r.uniform(0.0, 30.0));
        Vec3::new(x, y, x.sin() * y.sin())
    }),
    ("200 tubes", 20_000, |r, i| {
        let k = (i % 200) as f64;
        let at = Vec3::new((k * 61.8).rem_euclid(200.0), (k * 41.4).rem_euclid(200.0), 0.0);
        let (a, s) = (r.uniform(0.0, TAU), 2.0 + 0.01 * r.normal());
        at + Vec3::new(s * a.cos(), s * a.sin(), r.uniform(0.0, 50.0))
    }),
    ("lattice", 27_000, |_, i| Vec3::new((i % 30) as f64, (i / 30 % 30) as f64, (i / 900) as f64)),
    ("noisy line", 20_000, |r, _| {
        Vec3::new(r.uniform(0.0, 100.0), 0.01 * r.normal(), 0.01 * r.normal())
    }),
    ("wave", 400_000, |r, _| {
        let (a, k) = (r.uniform(0.0, TAU), r.uniform(0.0, 9.0).floor());
        let s = 5.0 + 0.01 * r.normal();
        Vec3::new(12.0 * k + s * a.cos(), s * a.sin(), r.uniform(0.0, 40.0))
    }),
];

/// Milliseconds that this thread has worked.
fn worked() -> f64 {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").unwrap_or_default();
    text.split(' ').next().and_then(|n| n.parse::<f64>().ok()).unwrap_or(0.0) / 1e6
}

#[derive(Default)]
struct Gaps {
    last: Option<(ThreadId, f64)>,
    stage: &'static str,
    longest: BTreeMap<&'static str, f64>,
    looks: usize,
}

struct Watch(Mutex<Gaps>);

impl Watch {
    fn look(&self, stage: Option<Stage>) {
        let mut gaps = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let (thread, now) = (std::thread::current().id(), worked());
        if let Some((_, before)) = gaps.last.filter(|l| l.0 == thread) {
            let place = gaps.stage;
            let longest = gaps.longest.entry(place).or_default();
            if now - before > longest.max(20.0) && std::env::var_os("WHERE").is_some() {
                println!(
                    "{:.0} ms before\n{}",
                    now - before,
                    std::backtrace::Backtrace::force_capture()
                );
            }
            *longest = longest.max(now - before);
        }
        if let Some(stage) = stage {
            gaps.stage = stage.name();
        }
        gaps.looks += 1;
        // what the look itself cost does not count
        gaps.last = Some((thread, worked()));
    }
}

impl Monitor for Watch {
    fn progress(&self, stage: Stage, _: f64) {
        self.look(Some(stage));
    }
    fn cancelled(&self) -> bool {
        self.look(None);
        false
    }
}

fn main() {
    rayon::ThreadPoolBuilder::new().num_threads(1).build_global().unwrap();
    let names: Vec<String> = std::env::args().skip(1).collect();
    for (name, n, make) in CLOUDS {
        if !names.is_empty() && !names.iter().any(|wanted| wanted == name) {
            continue;
        }
        let random = &mut Random(7);
        let cloud = PointCloud::from_points((0..n).map(|i| make(random, i)).collect());
        for method in ["distance", "rcond"] {
            let mut parameters = Parameters::default();
            parameters.set("method", method).unwrap();
            parameters.set("rcond_threshold", "1").unwrap();
            parameters.set("max_regions", "1000000").unwrap();
            let watch = Watch(Mutex::default());
            let before = std::time::Instant::now();
            let found = segment(&cloud, &parameters, &watch).map(|s| s.regions.len());
            watch.look(None);
            let gaps = watch.0.into_inner().unwrap_or_else(PoisonError::into_inner);
            let longest: Vec<String> =
                gaps.longest.iter().map(|(stage, gap)| format!("{stage} {gap:.1}")).collect();
            let (looks, seconds) = (gaps.looks, before.elapsed().as_secs_f64());
            println!(
                "{name:<13} {method:<9} {found:?} {seconds:.1} s {looks} looks: {}",
                longest.join(", ")
            );
        }
    }
}
