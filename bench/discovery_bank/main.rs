//! How `dgd discover` does away from drilling: plants of many fields, each of which hides something.
//!
//! ```text
//! cargo run --release --package dgd-bench --bin discovery_bank -- [--seed S] [--domain NAME] [--kind KIND]
//!     [--threads N] [--out DIR] [--write DIR] [--verify] [--nulls N]
//! ```
//!
//! Each folder of `domains` has a plant, which is simulated in plain Rust and shares no code with the product, a model
//! that lacks something, and a library of near rivals. Of each domain the seed draws cases of five kinds: an effect of
//! the library, or two; something that a general template has a name for, without the library; a parameter that
//! changes, without the library; nothing, under odd noise; and twins, which are cases again in other units, names,
//! order or scales. Each case has a recording to search in and one for validation.
//!
//! `--domain` and `--kind` choose (`library`, `template`, `parameter`, `nothing`, `twin`). `--threads` is the number of
//! cases at a time; each is searched by one thread. With `--out` all rows go to `cases.csv` there, and `result.json` of
//! each case beside it. `--write` only writes each case as a folder with `model.dgd`, `effects`, `train.csv`,
//! `valid.csv` and `truth.json`. `--verify` tests the bank instead: everything that can be hidden is fitted with the base
//! model and with the truth, which has to leave no more than noise. `--nulls` looks at so many recordings of eight domains
//! with white noise in which nothing is hidden: p-values should be uniform, and nothing named.

mod bank;
mod calibration;
mod domains;
mod score;
mod search;
mod table;
mod verify;

use std::collections::BTreeMap;
use std::error::Error;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use bank::cases::{Planned, everything, planned};
use bank::{Domain, Kind};
use score::{Said, Score};

struct Arguments {
    seed: u64,
    domain: Option<String>,
    kind: Option<Kind>,
    threads: usize,
    out: Option<PathBuf>,
    write: Option<PathBuf>,
    verify: bool,
    nulls: Option<usize>,
}

fn main() -> Result<(), Box<dyn Error>> {
    let arguments = parse(std::env::args().skip(1))?;
    let domains = chosen(arguments.domain.as_deref())?;
    let is_chosen = |case: &Planned| arguments.kind.is_none_or(|kind| kind == case.kind);
    if arguments.verify {
        let mut cases = everything(&domains, arguments.seed);
        cases.retain(is_chosen);
        each(&cases, arguments.threads, |case| {
            println!("{}", verify::line(&case.recorded()));
            Ok(())
        })?;
        return Ok(());
    }
    if let Some(number) = arguments.nulls {
        let cases = calibration::cases(&domains, arguments.seed, number);
        let said = each(&cases, arguments.threads, |case| {
            Ok(calibration::Null::new(case.domain.name, &search::answer(&case.recorded()).json))
        })?;
        print!("{}", calibration::table(&said));
        return Ok(());
    }
    let mut cases = planned(&domains, arguments.seed);
    cases.retain(is_chosen);
    if let Some(folder) = &arguments.write {
        cases.iter().try_for_each(|case| case.recorded().write(folder))?;
        return Ok(());
    }
    if let Some(folder) = &arguments.out {
        fs::create_dir_all(folder)?;
    }
    let answers = Answers::default();
    let scores = each(&cases, arguments.threads, |case| {
        let score = scored(case, &answers, arguments.out.as_deref())?;
        println!("{}", score.line());
        Ok(score)
    })?;
    if let Some(folder) = &arguments.out {
        let rows: Vec<String> = scores.iter().map(Score::row).collect();
        fs::write(folder.join("cases.csv"), format!("{}\n{}\n", Score::HEADER, rows.join("\n")))?;
    }
    print!("\n{}", table::of(&scores));
    Ok(())
}

/// What was said of cases that may have twins.
#[derive(Debug, Default)]
struct Answers {
    said: Mutex<BTreeMap<String, Said>>,
}

impl Answers {
    /// What is said of a twin's original: what was said already, or what a search says now.
    fn of_the_original(&self, twin: &Planned) -> Said {
        let original = twin.original();
        let known = self.said.lock().ok().and_then(|said| said.get(&original.name()).cloned());
        known.unwrap_or_else(|| {
            let case = original.recorded();
            Said::of(&search::answer(&case), &case)
        })
    }
}

fn scored(planned: &Planned, answers: &Answers, out: Option<&Path>) -> Result<Score, String> {
    let case = planned.recorded();
    let answer = search::answer(&case);
    let said = Said::of(&answer, &case);
    if let Some(folder) = out {
        let path = folder.join(format!("{}.json", case.name));
        fs::write(path, format!("{:#}\n", answer.json)).map_err(|error| error.to_string())?;
    }
    if planned.twin.is_some() {
        return Ok(Score::of_twin(&case, &answer, &said, &answers.of_the_original(planned)));
    }
    if let Ok(mut all) = answers.said.lock() {
        all.insert(case.name.clone(), said.clone());
    }
    Ok(Score::new(&case, &answer, &said))
}

/// Does this with each case, so many at a time; the results are in the order of the cases.
fn each<T: Send>(
    cases: &[Planned],
    threads: usize,
    work: impl Fn(&Planned) -> Result<T, String> + Sync,
) -> Result<Vec<T>, String> {
    let next = AtomicUsize::new(0);
    let done = Mutex::new(Vec::new());
    let take = || {
        while let Some((k, case)) = {
            let k = next.fetch_add(1, Ordering::Relaxed);
            cases.get(k).map(|case| (k, case))
        } {
            let result = work(case);
            if let Ok(mut done) = done.lock() {
                done.push((k, result));
            }
        }
    };
    std::thread::scope(|scope| {
        for _ in 1..threads {
            scope.spawn(take);
        }
        take();
    });
    let mut done = done.into_inner().map_err(|error| error.to_string())?;
    done.sort_by_key(|(k, _)| *k);
    done.into_iter().map(|(_, result)| result).collect()
}

fn chosen(name: Option<&str>) -> Result<Vec<&'static Domain>, String> {
    let mut domains = domains::all();
    if let Some(name) = name {
        let names: Vec<&str> = domains.iter().map(|domain| domain.name).collect();
        let names = names.join(", ");
        domains.retain(|domain| domain.name == name);
        if domains.is_empty() {
            return Err(format!("no domain is called `{name}`; choose from {names}"));
        }
    }
    Ok(domains)
}

fn parse(mut words: impl Iterator<Item = String>) -> Result<Arguments, Box<dyn Error>> {
    let threads = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
    let (domain, kind, out, write, nulls) = (None, None, None, None, None);
    let mut arguments =
        Arguments { seed: 1, domain, kind, threads, out, write, verify: false, nulls };
    while let Some(word) = words.next() {
        if word == "--verify" {
            arguments.verify = true;
            continue;
        }
        let value = words.next().ok_or_else(|| format!("`{word}` wants a value"))?;
        match word.as_str() {
            "--seed" => arguments.seed = value.parse()?,
            "--domain" => arguments.domain = Some(value),
            "--kind" => {
                let kind = Kind::ALL.into_iter().find(|kind| kind.word() == value);
                arguments.kind = Some(kind.ok_or_else(|| format!("no kind is called `{value}`"))?);
            }
            "--nulls" => arguments.nulls = Some(value.parse()?),
            "--threads" => arguments.threads = value.parse::<usize>()?.max(1),
            "--out" => arguments.out = Some(PathBuf::from(value)),
            "--write" => arguments.write = Some(PathBuf::from(value)),
            _ => return Err(format!("unknown option `{word}`").into()),
        }
    }
    Ok(arguments)
}
