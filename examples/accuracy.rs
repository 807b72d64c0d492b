//! The accuracy table: clouds with exact truth, segmented with default parameters and scored.
//!
//! `cargo run --release --example accuracy [-- NAME ...]` prints one row a cloud;
//! `-- --dump DIR` writes the clouds and their truth instead; `-- --seed N` makes other ones.
//!
//! `-- --constants [WORD ...]` prints the numbers that the engine decides with, those whose path holds one of the words;
//! `-- --perturb [WORD ...]` scales each by 0.8 and by 1.25 and says what a small set of clouds makes of it,
//! `-- --range [WORD ...]` how far each can be scaled either way until a cloud is lost; `-- --set PATH=VALUE ...` prints
//! the table with other values.

#[path = "../tests/clouds/mod.rs"]
mod clouds;

use std::{path::PathBuf, process::ExitCode, time::Instant};

use clouds::{
    Cloud, cad, quick,
    score::{Score, score},
    smooth,
};
use conicoid::fit::constant::Adjustable;
use conicoid::model;
use conicoid::segment::{self, Parameters, Segmentation, Silent, segment};

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

/// The numbers that are decided with, in the engine and in what is derived from its result.
fn constants() -> impl Iterator<Item = &'static dyn Adjustable> {
    segment::constants().chain(model::constants())
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
            "--set" => {
                let word = words.next()?;
                let (name, value) = word.split_once('=')?;
                let constant = constants().find(|c| path(*c) == name)?;
                constant.scale(value.parse::<f64>().ok()? / constant.given());
            }
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
    let words: Vec<String> = std::env::args().skip(1).collect();
    match words.split_first() {
        Some((mode, names)) if mode == "--constants" => {
            asked(names).for_each(print_constant);
            return ExitCode::SUCCESS;
        }
        Some((mode, names)) if mode == "--perturb" => return Perturbation::new().run(names),
        Some((mode, names)) if mode == "--range" => return Perturbation::new().ranges(names),
        _ => {}
    }
    let Some(arguments) = arguments() else {
        eprintln!(
            "usage: accuracy [--seed N] [--dump DIR] [--set PATH=VALUE] [NAME ...] | (--constants | --perturb | --range) [WORD ...]"
        );
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

/// The constants whose path holds one of the words; without words all that the default method decides with.
fn asked(words: &[String]) -> impl Iterator<Item = &'static dyn Adjustable> {
    let named = |c: &&dyn Adjustable| words.iter().any(|word| c.name().contains(word.as_str()));
    constants().filter(move |c| named(c) || words.is_empty() && !c.name().contains("::rcond::"))
}

/// Its path in the engine.
fn path(constant: &dyn Adjustable) -> &'static str {
    let name = constant.name().trim_start_matches("conicoid::");
    name.trim_start_matches("segment::")
}

fn print_constant(constant: &dyn Adjustable) {
    let (given, origin) = (constant.given(), constant.origin());
    println!("{:36} {given:9} {origin:50} {}", path(constant), constant.meaning().trim());
}

/// What scaled constants do to a small set of clouds.
struct Perturbation {
    clouds: Vec<Cloud>,
    /// What each cloud gives with all constants as they were declared.
    results: Vec<Option<Segmentation>>,
    lost: usize,
}

impl Perturbation {
    fn new() -> Self {
        let clouds = quick::clouds();
        let start = Instant::now();
        let results = clouds.iter().map(found).collect();
        let seconds = start.elapsed().as_secs_f64();
        let mut all = Self { clouds, results: Vec::new(), lost: 0 };
        let lost = all.look().0;
        println!("{} clouds in {seconds:.2} s; not good: {lost:?}", all.clouds.len());
        (all.results, all.lost) = (results, lost.len());
        all
    }

    /// The clouds that are not good, and how many results are others than they were.
    fn look(&self) -> (Vec<String>, usize) {
        let (mut lost, mut changed) = (Vec::new(), 0);
        for (k, cloud) in self.clouds.iter().enumerate() {
            let result = found(cloud);
            let before = self.results.get(k);
            if before.is_some_and(|before| is_same(before.as_ref(), result.as_ref())) {
                continue;
            }
            changed += 1;
            let good =
                result.is_some_and(|r| quick::is_good(&score(cloud, &r.labels, &reported(&r))));
            if !good {
                lost.push(cloud.name.clone());
            }
        }
        (lost, changed)
    }

    /// The same with a constant scaled.
    fn scaled(&self, constant: &dyn Adjustable, factor: f64) -> (Vec<String>, usize, f64) {
        constant.scale(factor);
        let (lost, changed) = self.look();
        let value = constant.value();
        constant.scale(1.0);
        (lost, changed, value)
    }

    fn run(&self, words: &[String]) -> ExitCode {
        let (mut runs, mut losing) = (0, 0);
        for constant in asked(words) {
            for factor in [0.8, 1.25] {
                let (lost, changed, value) = self.scaled(constant, factor);
                println!("{:36} {value:9.4} changes {changed:2} loses {lost:?}", path(constant));
                runs += 1;
                losing += usize::from(!lost.is_empty());
            }
        }
        let share = 100.0 * f64::from(losing as u32) / f64::from(runs.max(1));
        println!("{losing} of {runs} runs lose a cloud: {share:.1} %");
        ExitCode::from(u8::from(self.lost > 0))
    }

    fn ranges(&self, words: &[String]) -> ExitCode {
        for constant in asked(words) {
            let reach = |factors: [f64; 5]| {
                let (mut last, mut most) = (constant.given(), 0);
                for factor in factors {
                    let (lost, changed, value) = self.scaled(constant, factor);
                    if !lost.is_empty() {
                        break;
                    }
                    (last, most) = (value, most.max(changed));
                }
                (last, most)
            };
            let (from, below) = reach([0.8, 0.65, 0.5, 0.35, 0.25]);
            let (to, above) = reach([1.25, 1.5, 2.0, 3.0, 4.0]);
            println!("{:36} {from} {to} changes {}", path(constant), below.max(above));
        }
        ExitCode::SUCCESS
    }
}

fn found(cloud: &Cloud) -> Option<Segmentation> {
    segment(&cloud.input(), &Parameters::default(), &Silent).ok()
}

fn is_same(a: Option<&Segmentation>, b: Option<&Segmentation>) -> bool {
    let (Some(a), Some(b)) = (a, b) else { return a.is_none() && b.is_none() };
    a.labels == b.labels && reported(a) == reported(b)
}
