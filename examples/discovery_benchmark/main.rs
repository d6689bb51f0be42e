//! How often the right effect is found in recordings of a rig that hides it.
//!
//! ```text
//! cargo run --release --example discovery_benchmark -- [--cases N] [--hard] [--seed S]
//!     [--only NAME[+NAME]] [--threads N] [--out DIR]
//! cargo run --release --example discovery_benchmark -- --nulls N [--threads N]
//! ```
//!
//! plants every effect of the library in `examples/drilling_rig`, which shares no code with the
//! models, some pairs of effects, nothing, and what the library has no name for; each in two
//! recordings of 70 to 110 min, one of them held out. With `--hard` effects have two fifths of their
//! size and the sensors coloured noise, and half of them round. `--only` repeats one kind of case;
//! `none` and `outside` are kinds, too. `--threads` is the number of cases at a time; each is
//! searched by one thread. With `--out` all rows go to `cases.csv` there, and the recordings of cases
//! that were not seen through beside it.
//!
//! `--nulls` looks at so many servos with nothing hidden, with white noise and as many with coloured,
//! and says whether the p-values are uniform.

#[path = "../drilling_rig/mod.rs"]
mod drilling_rig;
#[path = "../../tests/support/examined.rs"]
mod examined;
#[path = "../../tests/support/nulls.rs"]
mod nulls;
#[path = "../../tests/support/servo.rs"]
mod servo;
#[path = "../../tests/support/uniform.rs"]
mod uniform;

mod cases;
mod score;

use std::error::Error;
use std::fs;
use std::path::PathBuf;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

use cases::{Case, cases};
use dgd_discover::{Discovery, RankedStructure, Verdict};
use drilling_rig::{Pair, random, record};
use examined::{Examined, Samples, Texts};
use nulls::{Noise, Said};
use score::{Score, table};
use uniform::kolmogorov_smirnov;

struct Arguments {
    cases: usize,
    hard: bool,
    seed: u64,
    only: Option<String>,
    threads: usize,
    out: Option<PathBuf>,
    nulls: Option<usize>,
}

/// Every so many cases the search is made again with another seed and two threads.
const REPEATED: usize = 9;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments = parse(std::env::args().skip(1))?;
    let Arguments { seed, hard, .. } = arguments;
    if let Some(number) = arguments.nulls {
        calibrate(number, arguments.threads);
        return Ok(());
    }
    let cases = cases(arguments.cases, seed, hard, arguments.only.as_deref())?;
    if let Some(folder) = &arguments.out {
        fs::create_dir_all(folder)?;
    }
    let examined = Texts::of_the_repository().read();
    let scores = Mutex::new(vec![None; cases.len()]);
    let next = AtomicUsize::new(0);
    let work = || -> std::io::Result<()> {
        loop {
            let k = next.fetch_add(1, Ordering::Relaxed);
            let Some(case) = cases.get(k) else { return Ok(()) };
            let pair = record(&case.scenario);
            let (score, account) = run(&examined, case, &pair, k.is_multiple_of(REPEATED));
            println!("{}", score.line());
            if let (Some(folder), false) = (&arguments.out, score.is_exact) {
                fs::write(folder.join(format!("{}.train.csv", case.name)), pair.train.csv())?;
                fs::write(folder.join(format!("{}.valid.csv", case.name)), pair.valid.csv())?;
                fs::write(folder.join(format!("{}.txt", case.name)), account)?;
            }
            if let Ok(mut scores) = scores.lock() {
                scores[k] = Some(score);
            }
        }
    };
    std::thread::scope(|scope| {
        let others: Vec<_> = (1..arguments.threads).map(|_| scope.spawn(work)).collect();
        let own = work();
        others.into_iter().filter_map(|other| other.join().ok()).fold(own, Result::and)
    })?;
    let scores: Vec<Score> =
        scores.into_inner().unwrap_or_default().into_iter().flatten().collect();
    if let Some(folder) = &arguments.out {
        let rows: Vec<String> = scores.iter().map(Score::row).collect();
        fs::write(folder.join("cases.csv"), format!("{}\n{}\n", Score::HEADER, rows.join("\n")))?;
    }
    print!("\n{}", table(&scores, hard));
    Ok(())
}

/// Shows what is said where nothing is hidden.
fn calibrate(number: usize, threads: usize) {
    for (name, noise) in [("white", Noise::White), ("coloured", Noise::Coloured)] {
        let begin = Instant::now();
        let said = nulls::said(number, noise, threads);
        let p_values: Vec<f64> = said.iter().map(|said| said.p_value).collect();
        let below = |least: f64| p_values.iter().filter(|p| **p <= least).count();
        let is_alarm = |said: &&Said| said.verdict != Verdict::Sufficient;
        println!(
            "{name:8}  {number} with nothing hidden: Kolmogorov-Smirnov p = {:.3}; below 0.01, 0.05, 0.1, \
             0.5: {} {} {} {}; false alarms: {}; {:.1} s",
            kolmogorov_smirnov(&p_values),
            below(0.01),
            below(0.05),
            below(0.1),
            below(0.5),
            said.iter().filter(is_alarm).count(),
            begin.elapsed().as_secs_f64()
        );
    }
}

/// How good what is found in a case is, and what is said about it.
fn run(examined: &Examined, case: &Case, pair: &Pair, repeated: bool) -> (Score, String) {
    let samples = [&pair.train, &pair.valid].map(|recording| Samples::of_csv(&recording.csv()));
    let [train, valid] = samples.each_ref().map(|samples| examined.recording(samples));
    let (train, valid) = ([train], [valid]);
    let begin = Instant::now();
    let found = examined.discover(&train, &valid, 1);
    let seconds = begin.elapsed().as_secs_f64();
    let mut score = Score::new(case, pair, &found, seconds);
    if repeated {
        let again = examined.discover_seeded(&train, &valid, 2, 12_345);
        score.is_repeatable = Some(said(&found) == said(&again));
    }
    (score, account(&found))
}

/// The reason of a verdict, and the structures that were tried.
fn account(found: &Discovery) -> String {
    let line = |ranked: &RankedStructure| {
        let RankedStructure { effects, train, valid, bic, note } = ranked;
        let valid = valid.map_or_else(|| "-".to_owned(), |valid| format!("{valid:.3}"));
        format!("{train:10.3} {valid:>10} {bic:14.1}  {}  {note}", effects.join(" + "))
    };
    let rows: Vec<String> = found.ranking.iter().map(line).collect();
    let sizes = found.corrected_parameters.iter();
    let sizes: Vec<String> = sizes.map(|p| format!("{} = {:.6e}", p.name, p.value)).collect();
    format!("{}\n{}\n{}\n", found.reason, rows.join("\n"), sizes.join("\n"))
}

/// Verdict, names and targets.
fn said(found: &Discovery) -> (&'static str, Vec<(&str, &str)>) {
    let effects = found.effects.iter();
    let effects = effects.map(|effect| (effect.name.as_str(), effect.target.as_str())).collect();
    (found.verdict.word(), effects)
}

fn parse(mut words: impl Iterator<Item = String>) -> Result<Arguments, Box<dyn Error>> {
    let threads = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
    let mut arguments =
        Arguments { cases: 54, hard: false, seed: 1, only: None, threads, out: None, nulls: None };
    while let Some(word) = words.next() {
        if word == "--hard" {
            arguments.hard = true;
            continue;
        }
        let value = words.next().ok_or_else(|| format!("`{word}` wants a value"))?;
        match word.as_str() {
            "--cases" => arguments.cases = value.parse()?,
            "--seed" => arguments.seed = value.parse()?,
            "--nulls" => arguments.nulls = Some(value.parse()?),
            "--only" => arguments.only = Some(value),
            "--threads" => arguments.threads = value.parse::<usize>()?.max(1),
            "--out" => arguments.out = Some(PathBuf::from(value)),
            _ => return Err(format!("`{word}` is no option").into()),
        }
    }
    Ok(arguments)
}
