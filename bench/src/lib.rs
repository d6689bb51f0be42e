//! Timing for the benchmarks.

use std::time::{Duration, Instant};

/// Times of repeated runs.
#[derive(Debug, Clone, Copy)]
pub struct Times {
    /// The shortest: the cost of the work without disturbance.
    pub least: Duration,
    /// The median.
    pub median: Duration,
}

/// Runs `work` for about `span`, at least five times, and measures each run.
pub fn measure<T>(span: Duration, mut work: impl FnMut() -> T) -> Times {
    let begin = Instant::now();
    let mut times = Vec::new();
    while times.len() < 5 || begin.elapsed() < span {
        let start = Instant::now();
        std::hint::black_box(work());
        times.push(start.elapsed());
    }
    times.sort_unstable();
    Times { least: times[0], median: times[times.len() / 2] }
}

/// Peak memory of this process so far, in MB, if the system reports it.
pub fn peak_memory() -> Option<f64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|line| line.starts_with("VmHWM:"))?;
    let kilobytes: f64 = line.split_whitespace().nth(1)?.parse().ok()?;
    Some(kilobytes / 1024.0)
}
