//! What the driver asks a program, and the answer.
//!
//! ```text
//!   program CASE METHOD RTOL SPAN DATA OUTPUT
//! ```
//!
//! CASE is `p1a`, `p1b`, `p2a`, `p2b`, `p3-1000` (cells), `p4`, `p4-64` (sets), `p4-threads`, `p5a`, `p5b`, `fit`,
//! `fit6`, `rank`; METHOD one of the program's own; RTOL the relative tolerance; SPAN for how many seconds to repeat, or how
//! often, as `10x` (Rust only); DATA the folder of recorded inputs. The program writes the values of its last run to
//! OUTPUT, little-endian doubles row by row, and prints `least`, `median` (seconds of one run), `steps`, where it
//! can the peak of its `memory` in bytes, and where there is something to say, what it `says`. Programs in other
//! languages do the same.

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::{Duration, Instant};
use std::{env, fmt, fs, io};

/// Longer work than this is not repeated.
const LONG: Duration = Duration::from_secs(10);

/// A program ends so where this machine cannot do what is asked.
const LEFT_OUT: u8 = 77;

/// What is asked.
#[derive(Debug)]
pub struct Request {
    /// Which problem.
    pub case: String,
    /// Which of the program's methods.
    pub method: String,
    /// Relative tolerance.
    pub rtol: f64,
    repeat: Repeat,
    data: PathBuf,
    output: PathBuf,
}

/// How long to repeat.
#[derive(Debug, Clone, Copy)]
enum Repeat {
    /// For so long, and at least three times where that is not too long.
    For(Duration),
    /// So often.
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

/// What a run gives.
#[derive(Debug)]
pub struct Answer {
    /// Row by row: states, then sensitivities parameter by parameter.
    pub values: Vec<f64>,
    /// Steps of the solver.
    pub steps: usize,
    /// What a fit says of the parameters; empty where there is nothing to say.
    pub says: String,
}

impl Answer {
    /// Values and steps, and nothing to say.
    pub fn new(values: Vec<f64>, steps: usize) -> Self {
        Self { values, steps, says: String::new() }
    }
}

/// Why there is no answer.
pub type Failure = Box<dyn std::error::Error>;

/// This machine has not the memory for what is asked.
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

/// Whether this machine has so many bytes of memory to spare.
///
/// # Errors
///
/// That it has not, and the program is not to be run.
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

    /// The case without what stands behind its hyphen.
    pub fn problem(&self) -> &str {
        self.case.split('-').next().unwrap_or_default()
    }

    /// The number behind the hyphen of the case: of cells, or of sets.
    pub fn size(&self) -> Option<usize> {
        self.case.split_once('-')?.1.parse().ok()
    }

    /// Whether sensitivities are asked for, too: the variants b.
    pub fn with_sensitivities(&self) -> bool {
        self.case.ends_with('b')
    }

    /// Absolute tolerances: a hundredth of the relative one, of each state's size.
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

    /// What four instruments showed, with noise, at each sample of the recording: h, q, and the pressures before
    /// and behind the pump, Pa.
    pub fn instruments(&self) -> io::Result<Vec<[f64; 4]>> {
        rows(&self.data.join("instruments.bin"))
    }

    /// Runs `work` as long as is asked for, at least once, and writes what the last run gave.
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

/// Answers the request on the command line with what `solve` makes of it.
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

/// Peak of the memory that this process has had in use, bytes, where the system tells.
fn peak_memory() -> Option<u64> {
    bytes("/proc/self/status", "VmHWM:")
}

/// What a file of the system has behind a name, in kB.
fn bytes(file: &str, name: &str) -> Option<u64> {
    let text = fs::read_to_string(file).ok()?;
    let line = text.lines().find_map(|line| line.strip_prefix(name))?;
    let kilobytes: u64 = line.split_whitespace().next()?.parse().ok()?;
    Some(1024 * kilobytes)
}

/// Rows of so many little-endian doubles.
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
