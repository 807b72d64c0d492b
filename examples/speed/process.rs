//! What the system knows about this process (Linux).

use std::{fs, time::Instant};

use serde::{Deserialize, Serialize};

/// Wall-clock and processor seconds of a piece of work.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct Spent {
    pub wall: f64,
    pub cpu: f64,
}

/// Does `work` `times` times; the run of least wall-clock time, and the last result.
pub fn least<T>(times: usize, mut work: impl FnMut() -> T) -> (Spent, T) {
    let mut once = || {
        let (begin, cpu) = (Instant::now(), cpu_seconds());
        let done = work();
        (Spent { wall: begin.elapsed().as_secs_f64(), cpu: cpu_seconds() - cpu }, done)
    };
    let (mut best, mut done) = once();
    for _ in 1..times {
        let next = once();
        if next.0.wall < best.wall {
            best = next.0;
        }
        done = next.1;
    }
    (best, done)
}

/// Processor time of all living threads so far; 0 where the system does not tell.
pub fn cpu_seconds() -> f64 {
    let Ok(threads) = fs::read_dir("/proc/self/task") else { return 0.0 };
    let nanoseconds = |thread: fs::DirEntry| -> Option<f64> {
        let line = fs::read_to_string(thread.path().join("schedstat")).ok()?;
        line.split_whitespace().next()?.parse().ok()
    };
    1e-9 * threads.flatten().filter_map(nanoseconds).sum::<f64>()
}

/// A figure of `/proc/self/status` in bytes, such as `VmRSS` or `VmHWM`.
pub fn memory(name: &str) -> f64 {
    let status = fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|l| l.strip_prefix(name)?.strip_prefix(':'));
    let kib = line.and_then(|l| l.split_whitespace().next()?.parse::<f64>().ok());
    1024.0 * kib.unwrap_or(f64::NAN)
}

/// Sets the peak of the resident memory back to what is resident now.
pub fn reset_peak() -> std::io::Result<()> {
    fs::write("/proc/self/clear_refs", "5")
}
