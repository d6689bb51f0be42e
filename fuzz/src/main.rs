//! `dgd-fuzz`: see `fuzz/README.md`.

use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use dgd_fuzz::case::Case;
use dgd_fuzz::grammar::{FAMILIES, Family, Origin};
use dgd_fuzz::oracle::{Finding, judged, keep_panics};
use dgd_fuzz::shrink::shrunk;

/// A case that takes longer counts as hanging.
const HANG: Duration = Duration::from_secs(20);
/// Memory limit of all workers together, more than any models need.
const MEMORY: u64 = 4 << 30;
/// Stack size of a worker.
const STACK: usize = 64 << 20;

#[derive(Default, Clone)]
struct Arguments {
    words: Vec<String>,
    seeds: (u64, u64),
    /// `None` for models of the table.
    families: Vec<Option<&'static Family>>,
    oracles: Vec<String>,
    without: Vec<String>,
    keep: Option<PathBuf>,
    findings: Option<PathBuf>,
    known: Vec<String>,
    /// Origins and symptoms.
    open: Vec<(String, String)>,
    threads: usize,
    seconds: Option<u64>,
    shrink: u64,
    models: u64,
}

fn arguments() -> Result<Arguments, String> {
    let mut arguments =
        Arguments { seeds: (0, 100), threads: 1, shrink: 10, models: 50, ..Arguments::default() };
    arguments.families = vec![None];
    let mut words = std::env::args().skip(1);
    while let Some(word) = words.next() {
        let mut value = || words.next().ok_or_else(|| format!("{word} needs a value"));
        let number = |text: String| text.parse::<u64>().map_err(|_| format!("{text} is no number"));
        let list = |text: String| text.split(',').map(str::to_owned).collect::<Vec<String>>();
        match word.as_str() {
            "--seeds" => {
                let text = value()?;
                let (a, b) = text.split_once("..").ok_or("--seeds A..B")?;
                arguments.seeds = (number(a.to_owned())?, number(b.to_owned())?);
            }
            // A range derived from a commit's hash.
            "--seeds-of" => {
                let text: String = value()?.chars().take(8).collect();
                let first = u64::from_str_radix(&text, 16).map_err(|_| "--seeds-of HASH")?;
                arguments.seeds = (first << 16, (first << 16) + (1 << 16));
            }
            "--open" => {
                let path = value()?;
                let text = std::fs::read_to_string(&path).map_err(|e| format!("{path}: {e}"))?;
                arguments.open = text
                    .lines()
                    .filter(|line| !line.starts_with('#') && !line.is_empty())
                    .filter_map(|line| line.split_once(' '))
                    .map(|(origin, key)| (origin.to_owned(), key.to_owned()))
                    .collect();
            }
            // Models with known solutions, of all families or of one.
            "--family" => {
                let named = |name: String| {
                    Family::named(&name).map(Some).ok_or_else(|| {
                        let names: Vec<&str> = FAMILIES.iter().map(|family| family.name).collect();
                        format!("no family {name}; there are all, {}", names.join(", "))
                    })
                };
                arguments.families = match value()? {
                    family if family == "all" => FAMILIES.iter().map(Some).collect(),
                    names => list(names).into_iter().map(named).collect::<Result<_, _>>()?,
                };
            }
            "--oracle" => arguments.oracles = list(value()?),
            "--without" => arguments.without = list(value()?),
            "--known" => arguments.known.push(value()?),
            "--findings" => arguments.findings = Some(value()?.into()),
            "--keep" => arguments.keep = Some(value()?.into()),
            "--threads" => arguments.threads = number(value()?)? as usize,
            "--seconds" => arguments.seconds = Some(number(value()?)?),
            "--models" => arguments.models = number(value()?)?,
            "--shrink" => arguments.shrink = number(value()?)?,
            _ => arguments.words.push(word),
        }
    }
    Ok(arguments)
}

impl Arguments {
    /// Number of cases.
    fn count(&self) -> u64 {
        (self.seeds.1.saturating_sub(self.seeds.0)) * self.families.len() as u64
    }

    /// The origin of a case; the families alternate.
    fn origin(&self, number: u64) -> Origin {
        let count = self.families.len() as u64;
        let family = self.families[(number % count) as usize];
        Origin { family, seed: self.seeds.0 + number / count }
    }
}

fn main() -> ExitCode {
    let arguments = match arguments() {
        Ok(arguments) => arguments,
        Err(reason) => {
            eprintln!("{reason}");
            return ExitCode::from(2);
        }
    };
    keep_panics();
    match arguments.words.first().map(String::as_str) {
        Some("print") => {
            for number in 0..arguments.count() {
                let case = arguments.origin(number).case(&arguments.without);
                println!("{}{}", case.text(), case.data);
            }
            ExitCode::SUCCESS
        }
        Some("run") => run(&arguments),
        Some("replay") => replay(&arguments),
        Some("shrink") => shrink(&arguments),
        Some("rust") => rust(&arguments),
        _ => {
            eprintln!("dgd-fuzz run | replay FILE… | shrink FILE | print");
            ExitCode::from(2)
        }
    }
}

/// Counts of a campaign.
#[derive(Default)]
struct Seen {
    cases: u64,
    /// Number of known findings.
    left_out: u64,
    /// Origins by symptom.
    symptoms: BTreeMap<String, Vec<String>>,
}

fn key(finding: &Finding) -> String {
    format!("{}: {}", finding.oracle, finding.symptom)
}

/// A campaign shared by workers.
struct Campaign {
    arguments: Arguments,
    start: Instant,
    next: AtomicU64,
    seen: Mutex<Seen>,
}

/// A worker's current case, and its start time in ms.
struct Worker {
    number: AtomicU64,
    since: AtomicU64,
    done: AtomicBool,
}

impl Campaign {
    fn seen(&self) -> MutexGuard<'_, Seen> {
        self.seen.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn elapsed(&self) -> u64 {
        self.start.elapsed().as_millis() as u64
    }

    /// Judges seeds until none are left, or until this worker is abandoned.
    fn work(&self, worker: &Worker) {
        let arguments = &self.arguments;
        while !worker.done.load(Ordering::Relaxed) {
            let number = self.next.fetch_add(1, Ordering::Relaxed);
            let late = arguments.seconds.is_some_and(|most| self.elapsed() >= 1000 * most);
            if number >= arguments.count() || late {
                break;
            }
            worker.number.store(number, Ordering::Relaxed);
            worker.since.store(self.elapsed(), Ordering::Relaxed);
            let origin = arguments.origin(number);
            let case = origin.case(&arguments.without);
            let findings = judged(&case, &arguments.oracles);
            worker.since.store(u64::MAX, Ordering::Relaxed);
            self.take(&origin.to_string(), &case, findings);
        }
        worker.done.store(true, Ordering::Relaxed);
    }

    /// Counts findings, and keeps the first of each symptom.
    fn take(&self, origin: &str, case: &Case, findings: Vec<Finding>) {
        let mut new = Vec::new();
        {
            let mut counts = self.seen();
            counts.cases += 1;
            for finding in findings {
                let key = key(&finding);
                let is_known =
                    self.arguments.known.iter().any(|known| key.contains(known.as_str()));
                let is_open = self.arguments.open.iter().any(|(o, k)| o == origin && *k == key);
                if is_known || is_open {
                    counts.left_out += 1;
                    continue;
                }
                let seeds = counts.symptoms.entry(key).or_default();
                if seeds.is_empty() {
                    new.push(finding);
                }
                if seeds.last().is_none_or(|last| last != origin) {
                    seeds.push(origin.to_owned());
                }
            }
        }
        for finding in new {
            println!(
                "seed {origin}: {}\n  {}",
                key(&finding),
                finding.detail.replace('\n', "\n  ")
            );
            if let Some(keep) = &self.arguments.keep {
                let most = Duration::from_secs(self.arguments.shrink);
                let small = shrunk(case, &finding, most);
                let name: String = (key(&finding).chars())
                    .map(|c| if c.is_ascii_alphanumeric() { c } else { '-' })
                    .collect();
                let path =
                    keep.join(format!("{name}-{}", origin.replace('/', "-"))).join("model.dgd");
                if let Err(error) = small.write(&path) {
                    println!("cannot write {}: {error}", path.display());
                }
            }
        }
    }
}

fn run(arguments: &Arguments) -> ExitCode {
    let campaign = Arc::new(Campaign {
        arguments: arguments.clone(),
        start: Instant::now(),
        next: AtomicU64::new(0),
        seen: Mutex::default(),
    });
    let spawn = || {
        let worker = Arc::new(Worker {
            number: AtomicU64::new(0),
            since: AtomicU64::new(u64::MAX),
            done: AtomicBool::new(false),
        });
        let (campaign, own) = (Arc::clone(&campaign), Arc::clone(&worker));
        let spawned = thread::Builder::new().stack_size(STACK).spawn(move || campaign.work(&own));
        if let Err(error) = spawned {
            println!("no thread: {error}");
            worker.done.store(true, Ordering::Relaxed);
        }
        worker
    };
    let mut workers: Vec<Arc<Worker>> = (0..arguments.threads).map(|_| spawn()).collect();
    while !workers.iter().all(|worker| worker.done.load(Ordering::Relaxed)) {
        thread::sleep(Duration::from_millis(20));
        let now = campaign.elapsed();
        if resident().is_some_and(|bytes| bytes > MEMORY) {
            let origin =
                |w: &Arc<Worker>| arguments.origin(w.number.load(Ordering::Relaxed)).to_string();
            let origins: Vec<String> = workers.iter().map(origin).collect();
            println!("more than {MEMORY} bytes of memory, at one of the seeds {origins:?}");
            return ExitCode::FAILURE;
        }
        for worker in &mut workers {
            // A thread cannot be stopped: it is abandoned, and another one continues.
            let since = worker.since.load(Ordering::Relaxed);
            if since < now && now - since > HANG.as_millis() as u64 {
                worker.done.store(true, Ordering::Relaxed);
                let origin = arguments.origin(worker.number.load(Ordering::Relaxed)).to_string();
                println!("seed {origin} hangs");
                let mut counts = campaign.seen();
                counts.cases += 1;
                if arguments.open.iter().any(|(o, key)| *o == origin && key == "hangs") {
                    counts.left_out += 1;
                } else {
                    counts.symptoms.entry("hangs".to_owned()).or_default().push(origin);
                }
                drop(counts);
                *worker = spawn();
            }
        }
    }
    let counts = campaign.seen();
    report(&counts, campaign.start);
    if let Some(path) = &arguments.findings {
        // In the form that `--open` reads.
        let mut lines: Vec<(u64, &str, &str)> = (counts.symptoms.iter())
            .flat_map(|(key, origins)| {
                origins.iter().map(move |o| (number(o), o.as_str(), key.as_str()))
            })
            .collect();
        lines.sort_unstable();
        let mut text = String::new();
        for (_, origin, key) in &lines {
            writeln!(text, "{origin} {key}").expect("text can be written to");
        }
        if let Err(error) = std::fs::write(path, text) {
            println!("cannot write {}: {error}", path.display());
        }
    }
    if counts.symptoms.is_empty() { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}

/// The seed of an origin, by which lists are sorted.
fn number(origin: &str) -> u64 {
    origin.rsplit('/').next().and_then(|seed| seed.parse().ok()).unwrap_or(0)
}

/// Memory of this process, if the system reports it.
fn resident() -> Option<u64> {
    let text = std::fs::read_to_string("/proc/self/statm").ok()?;
    let pages: u64 = text.split_whitespace().nth(1)?.parse().ok()?;
    Some(pages * 4096)
}

fn report(seen: &Seen, start: Instant) {
    let (cases, left_out) = (seen.cases, seen.left_out);
    let seconds = start.elapsed().as_secs_f64();
    println!("{cases} models in {seconds:.1} s, {left_out} known findings left out");
    for (symptom, seeds) in &seen.symptoms {
        let some: Vec<&str> = seeds.iter().take(6).map(String::as_str).collect();
        println!("{:6} {symptom}: {}", seeds.len(), some.join(" "));
    }
}

fn replay(arguments: &Arguments) -> ExitCode {
    let mut failed = false;
    for path in &arguments.words[1..] {
        match Case::read(Path::new(path)) {
            Ok(case) => {
                for finding in judged(&case, &arguments.oracles) {
                    failed = true;
                    println!("{path}: {}\n  {}", key(&finding), finding.detail);
                }
            }
            Err(error) => {
                failed = true;
                println!("{path}: {error}");
            }
        }
    }
    if failed { ExitCode::FAILURE } else { ExitCode::SUCCESS }
}

fn shrink(arguments: &Arguments) -> ExitCode {
    let Some(path) = arguments.words.get(1) else { return ExitCode::from(2) };
    let Ok(case) = Case::read(Path::new(path)) else { return ExitCode::from(2) };
    for finding in judged(&case, &arguments.oracles) {
        let small = shrunk(&case, &finding, Duration::from_secs(arguments.shrink));
        println!("{}\n{}{}", key(&finding), small.text(), small.data);
    }
    ExitCode::SUCCESS
}

/// Number of models in one program: as many as rustc compiles in a minute or two.
const BATCH: u64 = 50;

/// Compares generated Rust with the interpreter, in batches.
fn rust(arguments: &Arguments) -> ExitCode {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples");
    let file = folder.join("batch.rs");
    let target = std::env::current_exe().ok();
    let target =
        target.as_deref().and_then(Path::parent).map(Path::to_path_buf).unwrap_or_default();
    let (first, last) = (arguments.seeds.0, arguments.seeds.0 + arguments.models);
    let (mut compared, mut failed) = (0, false);
    let mut seed = first;
    while seed < last {
        let next = (seed + BATCH).min(last);
        let (text, count) = dgd_fuzz::generated::program(seed..next, &arguments.without);
        let written = std::fs::create_dir_all(&folder).and_then(|()| std::fs::write(&file, text));
        if let Err(error) = written {
            println!("cannot write {}: {error}", file.display());
            return ExitCode::from(2);
        }
        let built = Command::new("cargo")
            .args(["build", "--quiet", "--profile", "test", "-p", "dgd-fuzz", "--example", "batch"])
            .status();
        let ran = built.is_ok_and(|status| status.success())
            && Command::new(target.join("examples/batch")).status().is_ok_and(|s| s.success());
        println!("seeds {seed}..{next}: {count} models {}", if ran { "agree" } else { "fail" });
        compared += count;
        failed |= !ran;
        seed = next;
    }
    let _ = std::fs::remove_file(&file);
    println!("{compared} models as generated Rust");
    if failed { ExitCode::FAILURE } else { ExitCode::SUCCESS }
}
