//! Requests of the driver to a program, and the answer.
//!
//! ```text
//!   program CASE METHOD RTOL SPAN DATA OUTPUT
//! ```
//!
//! CASE is `p1a`, `p1b`, `p2a`, `p2b`, `p3-1000` (cells), `p4`, `p4-64` (sets), `p4-threads`, `p5a`, `p5b`, `fit`,
//! `fit6`, `rank`; METHOD a method of the program; RTOL the relative tolerance; SPAN the time for repetitions in
//! seconds, or their number, as `10x` (Rust only); DATA the folder of recorded inputs. The program writes the values of
//! its last run to OUTPUT, little-endian doubles row by row, and prints `least` and `median` (seconds of one run),
//! `steps`, if possible the peak of its `memory` in bytes, and `says` with a text, if any. Programs in other languages
//! follow the same protocol.

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::{Duration, Instant};
use std::{env, fmt, fs, io};

/// Longer runs are not repeated.
const LONG: Duration = Duration::from_secs(10);

/// Exit code for a request that this machine cannot fulfil.
const LEFT_OUT: u8 = 77;

/// A request.
#[derive(Debug)]
pub struct Request {
    /// The problem.
    pub case: String,
    /// The method of the program.
    pub method: String,
    /// Relative tolerance.
    pub rtol: f64,
    repeat: Repeat,
    data: PathBuf,
    output: PathBuf,
}

/// Number of repetitions.
#[derive(Debug, Clone, Copy)]
enum Repeat {
    /// For this time, with at least three runs unless that takes too long.
    For(Duration),
    /// This many runs.
    Times(usize),
}

impl Repeat {
    fn parse(text: &str) -> Result<Self, Failure> {
        Ok(match text.strip_suffix('x') {
            Some(times) => Self::Times(times.parse()?),
            None => Self::For(Duration::from_secs_f64(text.parse()?)),
        })
    }

    /// Whether `runs` since `begin` are enough.
    fn is_over(self, runs: usize, begin: Instant) -> bool {
        match self {
            Self::For(span) => begin.elapsed() >= LONG || (runs >= 3 && begin.elapsed() >= span),
            Self::Times(times) => runs >= times,
        }
    }
}

/// The result of a run.
#[derive(Debug)]
pub struct Answer {
    /// Row by row: states, then sensitivities parameter by parameter.
    pub values: Vec<f64>,
    /// Steps of the solver.
    pub steps: usize,
    /// The report of a fit on its parameters; empty if there is none.
    pub says: String,
}

impl Answer {
    /// Values and steps without a report.
    pub fn new(values: Vec<f64>, steps: usize) -> Self {
        Self { values, steps, says: String::new() }
    }
}

/// The reason why there is no answer.
pub type Failure = Box<dyn std::error::Error>;

/// This machine lacks the memory for the request.
#[derive(Debug)]
struct LeftOut {
    needed: u64,
    available: u64,
}

impl std::error::Error for LeftOut {}

impl fmt::Display for LeftOut {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let gigabytes = |bytes: u64| bytes as f64 / 1e9;
        let Self { needed, available } = *self;
        write!(f, "needs {:.1} GB, and {:.1} are free", gigabytes(needed), gigabytes(available))
    }
}

/// Checks that this machine has this many bytes of free memory.
///
/// # Errors
///
/// It has not, and the program must not run.
pub fn check_memory(needed: u64) -> Result<(), Failure> {
    match bytes("/proc/meminfo", "MemAvailable:") {
        Some(available) if available < needed => Err(LeftOut { needed, available }.into()),
        _ => Ok(()),
    }
}

/// A sample of the recording: pump speed, and flow out of the volume, m³/s.
#[derive(Debug, Clone, Copy)]
pub struct Sample {
    /// w.
    pub w: f64,
    /// The first of two flows that leave the volume.
    pub q_b: f64,
    /// The second.
    pub q_tf: f64,
}

impl Request {
    fn from_arguments() -> Result<Self, Failure> {
        let arguments: Vec<String> = env::args().skip(1).collect();
        let [case, method, rtol, span, data, output] = arguments.as_slice() else {
            return Err("usage: CASE METHOD RTOL SPAN DATA OUTPUT".into());
        };
        Ok(Self {
            case: case.clone(),
            method: method.clone(),
            rtol: rtol.parse()?,
            repeat: Repeat::parse(span)?,
            data: data.into(),
            output: output.into(),
        })
    }

    /// The case without its size after the hyphen.
    pub fn problem(&self) -> &str {
        self.case.split('-').next().unwrap_or_default()
    }

    /// The number after the hyphen of the case: of cells, or of sets.
    pub fn size(&self) -> Option<usize> {
        self.case.split_once('-')?.1.parse().ok()
    }

    /// Whether the request includes sensitivities: the variants b.
    pub fn with_sensitivities(&self) -> bool {
        self.case.ends_with('b')
    }

    /// Absolute tolerances: a hundredth of the relative one times each state's size.
    pub fn atol<const N: usize>(&self, sizes: [f64; N]) -> [f64; N] {
        sizes.map(|size| 0.01 * self.rtol * size)
    }

    /// The recording of P5: a sample each second, each held until the next.
    pub fn recording(&self) -> io::Result<Vec<Sample>> {
        let values = read(&self.data.join("recording.bin"))?;
        Ok(values.chunks_exact(3).map(|x| Sample { w: x[0], q_b: x[1], q_tf: x[2] }).collect())
    }

    /// h and q with noise, at each sample of the recording.
    pub fn measured(&self) -> io::Result<Vec<[f64; 2]>> {
        rows(&self.data.join("measured.bin"))
    }

    /// Noisy readings of four instruments at each sample of the recording: h, q, and the pressures before and after the
    /// pump, Pa.
    pub fn instruments(&self) -> io::Result<Vec<[f64; 4]>> {
        rows(&self.data.join("instruments.bin"))
    }

    /// Runs `work` as often as requested, at least once, and writes the result of the last run.
    pub fn measure<T>(
        &self,
        mut work: impl FnMut() -> Result<T, Failure>,
        answer: impl FnOnce(T) -> Answer,
    ) -> Result<(), Failure> {
        let begin = Instant::now();
        let mut times = Vec::new();
        let last = loop {
            let start = Instant::now();
            let result = std::hint::black_box(work()?);
            times.push(start.elapsed().as_secs_f64());
            if self.repeat.is_over(times.len(), begin) {
                break result;
            }
        };
        times.sort_unstable_by(f64::total_cmp);
        let Answer { values, steps, says } = answer(last);
        let bytes: Vec<u8> = values.iter().flat_map(|x| x.to_le_bytes()).collect();
        fs::write(&self.output, bytes)?;
        println!("least {:e}\nmedian {:e}\nsteps {steps}", times[0], times[times.len() / 2]);
        if let Some(memory) = peak_memory() {
            println!("memory {memory}");
        }
        if !says.is_empty() {
            println!("says {says}");
        }
        Ok(())
    }
}

/// Answers the request on the command line with `solve`.
pub fn answer(solve: impl FnOnce(&Request) -> Result<(), Failure>) -> ExitCode {
    match Request::from_arguments().and_then(|request| solve(&request)) {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) if failure.is::<LeftOut>() => {
            eprintln!("{failure}");
            ExitCode::from(LEFT_OUT)
        }
        Err(failure) => {
            eprintln!("{failure}");
            ExitCode::FAILURE
        }
    }
}

/// Peak memory of this process, bytes, if the system reports it.
fn peak_memory() -> Option<u64> {
    bytes("/proc/self/status", "VmHWM:")
}

/// The number after a name in a file of the system, in kB.
fn bytes(file: &str, name: &str) -> Option<u64> {
    let text = fs::read_to_string(file).ok()?;
    let line = text.lines().find_map(|line| line.strip_prefix(name))?;
    let kilobytes: u64 = line.split_whitespace().next()?.parse().ok()?;
    Some(1024 * kilobytes)
}

/// Rows of N little-endian doubles.
fn rows<const N: usize>(path: &Path) -> io::Result<Vec<[f64; N]>> {
    let values = read(path)?;
    let (rows, _) = values.as_chunks::<N>();
    Ok(rows.to_vec())
}

/// Little-endian doubles.
pub fn read(path: &Path) -> io::Result<Vec<f64>> {
    let bytes = fs::read(path)?;
    let (numbers, _) = bytes.as_chunks::<8>();
    Ok(numbers.iter().map(|x| f64::from_le_bytes(*x)).collect())
}
