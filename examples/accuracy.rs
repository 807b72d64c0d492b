//! The accuracy table: clouds with exact truth, segmented with default parameters and scored.
//!
//! `cargo run --release --example accuracy [-- NAME ...]` prints one row a cloud;
//! `-- --dump DIR` writes the clouds and their truth instead; `-- --seed N` makes other ones.

#[path = "../tests/clouds/mod.rs"]
mod clouds;

use std::{path::PathBuf, process::ExitCode, time::Instant};

use clouds::{
    Cloud, cad,
    score::{Score, score},
    smooth,
};
use conicoid::segment::{Parameters, Segmentation, Silent, segment};

/// Machined parts: name, points, noise, whether posed at random.
const PARTS: [(&str, usize, f64, bool); 14] = [
    ("bracket", 100_000, 0.01, true),
    ("drilled", 150_000, 0.02, true),
    ("pockets", 200_000, 0.01, false),
    ("heatsink", 150_000, 0.02, true),
    ("flange", 100_000, 0.02, true),
    ("shaft", 80_000, 0.01, true),
    ("housing", 200_000, 0.02, false),
    ("tee", 120_000, 0.05, true),
    ("lever", 50_000, 0.01, true),
    ("mould", 150_000, 0.0, false),
    ("bolt", 60_000, 0.01, true),
    ("manifold", 300_000, 0.03, true),
    ("cover", 120_000, 0.0, false),
    ("clevis", 60_000, 0.02, true),
];

fn make(name: &str, seed: u64) -> Option<Cloud> {
    let part = PARTS.iter().find(|p| p.0 == name);
    part.and_then(|&(name, n, sigma, posed)| cad::make(name, seed, n, sigma, posed))
        .or_else(|| smooth::make(name, seed))
}

/// What the command line asks for.
struct Arguments {
    names: Vec<String>,
    seed: u64,
    dump: Option<PathBuf>,
}

fn arguments() -> Option<Arguments> {
    let mut parsed = Arguments { names: Vec::new(), seed: 1, dump: None };
    let mut words = std::env::args().skip(1);
    while let Some(word) = words.next() {
        match word.as_str() {
            "--seed" => parsed.seed = words.next()?.parse().ok()?,
            "--dump" => parsed.dump = Some(words.next()?.into()),
            "--bench" => {}
            name if name.starts_with('-') => return None,
            name => parsed.names.push(name.into()),
        }
    }
    if parsed.names.is_empty() {
        let all = smooth::NAMES.iter().copied().chain(PARTS.iter().map(|p| p.0));
        parsed.names = all.map(String::from).collect();
    }
    Some(parsed)
}

fn main() -> ExitCode {
    let Some(arguments) = arguments() else {
        eprintln!("usage: accuracy [--seed N] [--dump DIR] [NAME ...]");
        return ExitCode::from(2);
    };
    let mut summary = Summary::default();
    for name in &arguments.names {
        let Some(cloud) = make(name, arguments.seed) else {
            eprintln!("no cloud is named {name}");
            return ExitCode::from(2);
        };
        let done = match &arguments.dump {
            Some(directory) => clouds::dump::write(directory, &cloud).map_err(|e| e.to_string()),
            None => measure(&cloud, &mut summary),
        };
        if let Err(reason) = done {
            println!("{name:16} failed: {reason}");
            summary.failed += 1;
        }
    }
    if arguments.dump.is_none() {
        summary.print();
    }
    ExitCode::from(u8::from(summary.failed > 0))
}

fn measure(cloud: &Cloud, summary: &mut Summary) -> Result<(), String> {
    let input = cloud.input();
    let start = Instant::now();
    let result = segment(&input, &Parameters::default(), &Silent).map_err(|e| e.to_string())?;
    let seconds = start.elapsed().as_secs_f64();
    let scored = score(cloud, &result.labels, &reported(&result));
    println!("{:16} {scored} {seconds:6.2} s", cloud.name);
    summary.add(cloud, scored);
    Ok(())
}

fn reported(result: &Segmentation) -> Vec<clouds::score::Reported> {
    let one = |r: &conicoid::segment::Region| (r.surface_type, r.coefficients);
    result.regions.iter().map(one).collect()
}

/// Figures over all clouds.
#[derive(Default)]
struct Summary {
    ratios: Vec<f64>,
    efficiencies: Vec<f64>,
    false_regions: usize,
    failed: usize,
}

impl Summary {
    fn add(&mut self, cloud: &Cloud, score: Score) {
        if cloud.surfaces.is_empty() {
            self.false_regions += score.regions;
            return;
        }
        self.ratios.push(score.ratio);
        // a systematic error is no noise: the information limit says nothing about it
        if cloud.name != "wave5_poor" {
            self.efficiencies.extend(score.efficiencies);
        }
    }

    fn print(&self) {
        let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len().max(1) as f64;
        let squares: Vec<_> = self.efficiencies.iter().map(|e| e * e).collect();
        let worst = self.efficiencies.iter().copied().fold(0.0, f64::max);
        println!(
            "mean ratio {:.3}; efficiency over {} surfaces: rms {:.3}, max {worst:.2}; \
             {} regions in empty scenes",
            mean(&self.ratios),
            squares.len(),
            mean(&squares).sqrt(),
            self.false_regions
        );
    }
}
