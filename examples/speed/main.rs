//! How long a segmentation takes, beside the least work any method must do.
//!
//! `cargo run --release --example speed [-- --large]` prints, in one run, for 10k, 100k and 1M points (with
//! `--large` also 10M) of a scene of 50 quadrics and of a machined part:
//!
//! - parse: reading the cloud from the bytes of a binary PLY file;
//! - floor: one sort along a Morton curve, one pass of the 35 moments of degree four and less for each cell of
//!   24 points, and one labelling pass against a plane for each cell, on one thread and on all;
//! - kNN 12: kiddo's 12 nearest neighbours of every point, points sorted, on all threads, the tree ready;
//! - total: one call of `segment` with default parameters, on all threads and on one;
//! - memory: peak resident memory during the first call above what was resident before it (the points among
//!   that), in bytes a point;
//! - the stages of the call on all threads;
//! - the growth exponent: slope of log time over log points, from 100k points to the most.
//!
//! Wall-clock times are the least of up to three runs, in seconds. Where others use the machine they say little, so
//! floor, neighbours and total stand also in processor seconds of all threads. The last table gives one call
//! on three joined elliptic cylinders by either method. Each cloud has a process of its own, so that none sees
//! another's memory. Linux only: memory and processor time are read from /proc.

#[path = "../../tests/clouds/mod.rs"]
mod clouds;
mod floor;
mod measure;
mod process;

use std::{
    env, fs,
    path::{Path, PathBuf},
    process::{Command, ExitCode, Stdio},
};

use clouds::{dump::ply, smooth};
use conicoid::segment::Stage;
use measure::{Figures, Outcome};

const SCENES: [&str; 2] = ["scene", "part"];
const SIZES: [usize; 3] = [10_000, 100_000, 1_000_000];
const LARGE: usize = 10_000_000;
/// Points from which growth is measured: below, fixed costs show.
const GROWTH_FROM: usize = 100_000;

fn main() -> ExitCode {
    let words: Vec<String> = env::args().skip(1).collect();
    let words: Vec<&str> = words.iter().map(String::as_str).collect();
    let done = match words[..] {
        ["--one", file] => measure::child(Path::new(file)),
        [] => whole(&SIZES),
        ["--large"] => whole(&[&SIZES[..], &[LARGE]].concat()),
        _ => Err("usage: speed [--large]".into()),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("{error}");
            ExitCode::FAILURE
        }
    }
}

fn whole(sizes: &[usize]) -> Outcome<()> {
    println!("wall seconds    |{}", measure::WALL);
    let (mut cpu, mut stages) = (Vec::new(), Vec::new());
    for scene in SCENES {
        let mut totals = Vec::new();
        for &n in sizes {
            let figures = in_child(scene, n)?;
            println!("{scene:6} {n:8} |{}", figures.wall_row());
            cpu.push(format!("{scene:6} {n:8} |{}", figures.cpu_row()));
            stages.push(format!("{scene:6} {n:8} |{}", figures.stage_row()));
            totals.push((n as f64, figures.total.wall));
        }
        if let Some(exponent) = exponent(&totals) {
            println!("{scene:6} growth exponent {exponent:.2}");
        }
    }
    println!("\nprocessor sec.  |{}", measure::CPU);
    cpu.iter().for_each(|row| println!("{row}"));
    let names: String = Stage::ALL.iter().map(|s| format!("{:>8}", s.name())).collect();
    println!("\nstages, wall    |{names} | regions");
    stages.iter().for_each(|row| println!("{row}"));
    println!("\nchain3   points |  method  seconds  regions");
    for n in [10_000, 100_000] {
        for row in measure::chain(n)? {
            println!("chain3 {n:8} | {row}");
        }
    }
    Ok(())
}

/// Slope of log time over log points from the first size that counts to the last.
fn exponent(totals: &[(f64, f64)]) -> Option<f64> {
    let first = totals.iter().find(|t| t.0 >= GROWTH_FROM as f64)?;
    let last = totals.last().filter(|l| l.0 > first.0)?;
    Some((last.1 / first.1).ln() / (last.0 / first.0).ln())
}

/// A file that is gone when this is dropped.
struct Scratch(PathBuf);

impl Drop for Scratch {
    fn drop(&mut self) {
        let _ = fs::remove_file(&self.0);
    }
}

/// Writes the cloud to a file and measures it in a process of its own.
fn in_child(scene: &str, n: usize) -> Outcome<Figures> {
    let cloud = smooth::sized(scene, n, 1).ok_or("no such scene")?;
    let name = format!("conicoid-speed-{}-{scene}-{n}.ply", std::process::id());
    let file = Scratch(env::temp_dir().join(name));
    fs::write(&file.0, ply(&cloud))?;
    drop(cloud);
    let mut command = Command::new(env::current_exe()?);
    let child = command.arg("--one").arg(&file.0).stderr(Stdio::inherit()).output()?;
    if !child.status.success() {
        return Err(format!("{scene} of {n} points could not be measured").into());
    }
    Ok(serde_json::from_slice(&child.stdout)?)
}
