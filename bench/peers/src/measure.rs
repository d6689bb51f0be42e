//! Runs every program, method and tolerance in turn, for several rounds.
//!
//! A temporary disturbance of the machine then affects all of them, and the shortest time of several rounds is
//! undisturbed.

use std::path::Path;
use std::process::Stdio;

use crate::arguments::Arguments;
use crate::catalogue::{CASES, Case};
use crate::error::{self, Reference};
use crate::installed::Installed;

/// Exit code of a program that cannot run on this machine, as in `problems`.
const LEFT_OUT: i32 = 77;

/// Runs that take longer are not repeated in further rounds, s.
const LONG: f64 = 5.0;

/// Results of a method of a program for a case.
#[derive(Debug)]
pub(crate) struct Row {
    /// The case.
    pub(crate) case: &'static Case,
    /// The peer's name.
    pub(crate) peer: &'static str,
    /// Its method.
    pub(crate) method: &'static str,
    /// One for each tolerance of the case.
    pub(crate) cells: Vec<Result<Cell, Missing>>,
}

/// The reason why there is no answer.
#[derive(Debug, Clone)]
pub(crate) enum Missing {
    /// The program cannot do it on this machine, for this reason.
    LeftOut(String),
    /// It failed.
    Failed(String),
}

/// Results of a method at a tolerance.
#[derive(Debug, Clone)]
pub(crate) struct Cell {
    /// The shortest run of all rounds, s.
    pub(crate) least: f64,
    /// The median of the rounds' medians, s.
    pub(crate) median: f64,
    /// Steps of the solver; evaluations if only those are reported, otherwise 0.
    pub(crate) steps: usize,
    /// The largest difference from the reference.
    pub(crate) error: f64,
    /// Peak of the program's memory, bytes, if reported.
    pub(crate) memory: Option<f64>,
    /// The report of a fit on its parameters; usually empty.
    pub(crate) says: String,
    medians: Vec<f64>,
}

impl Cell {
    /// A cell of one round.
    pub(crate) fn new(least: f64, median: f64, steps: usize, error: f64) -> Self {
        let (memory, says) = (None, String::new());
        Self { least, median, steps, error, memory, says, medians: vec![median] }
    }
}

/// Measures everything that was requested.
pub(crate) fn rows(folder: &Path, programs: &[Installed], arguments: &Arguments) -> Vec<Row> {
    let mut rows = Vec::new();
    for case in CASES {
        let mut plan: Vec<(&Installed, Row)> = Vec::new();
        for program in programs {
            let methods = program.peer.methods.iter().find(|(name, _)| *name == case.name);
            if !arguments.asks_for(case.name, program.peer.name) {
                continue;
            }
            for method in methods.map_or(&[][..], |(_, methods)| methods) {
                plan.push((
                    program,
                    Row { case, peer: program.peer.name, method, cells: Vec::new() },
                ));
            }
        }
        if plan.is_empty() {
            continue;
        }
        let reference = Reference::read(&folder.join("data"), case);
        for round in 0..arguments.rounds {
            eprintln!("{}, round {} of {}", case.name, round + 1, arguments.rounds);
            for (program, row) in &mut plan {
                for (k, rtol) in case.tolerances.iter().enumerate() {
                    let before = row.cells.get(k).and_then(|cell| cell.as_ref().ok());
                    if before.is_some_and(|cell| cell.least > LONG) {
                        continue;
                    }
                    let cell = reference.as_ref().map_err(failed).and_then(|reference| {
                        run(folder, program, row, *rtol, arguments.span, reference)
                    });
                    if round == 0 {
                        row.cells.push(cell);
                    } else {
                        merge(&mut row.cells[k], cell);
                    }
                }
            }
        }
        rows.extend(plan.into_iter().map(|(_, row)| row));
    }
    rows
}

/// Runs a program once, which repeats the work for `span` seconds.
fn run(
    folder: &Path,
    program: &Installed,
    row: &Row,
    rtol: f64,
    span: f64,
    reference: &Reference,
) -> Result<Cell, Missing> {
    let file = std::env::temp_dir().join(format!("dgd-peers-{}.bin", std::process::id()));
    let output = program
        .command()
        .args([row.case.name, row.method, &rtol.to_string(), &span.to_string()])
        .args([&folder.join("data"), &file])
        .stdin(Stdio::null())
        .output()
        .map_err(|error| failed(&error))?;
    if !output.status.success() {
        let stderr = String::from_utf8_lossy(&output.stderr);
        let message = stderr.lines().last().unwrap_or("it says nothing").to_owned();
        return Err(match output.status.code() {
            Some(LEFT_OUT) => Missing::LeftOut(message),
            _ => Missing::Failed(message),
        });
    }
    let values = error::read(&file);
    std::fs::remove_file(&file).map_err(|error| failed(&error))?;
    let error = values.and_then(|values| reference.error(&values));
    let error = error.map_err(|error| failed(&error))?;
    let stdout = String::from_utf8_lossy(&output.stdout);
    let value = |name: &str| {
        let words = stdout.lines().filter_map(|line| line.split_once(' '));
        words.into_iter().find_map(|(first, rest)| (first == name).then_some(rest.trim()))
    };
    let number = |name: &str| {
        let number = value(name).and_then(|text| text.parse::<f64>().ok());
        number.ok_or_else(|| Missing::Failed(format!("it does not tell `{name}`")))
    };
    let cell = Cell::new(number("least")?, number("median")?, number("steps")? as usize, error);
    let says = value("says").unwrap_or_default().to_owned();
    Ok(Cell { memory: number("memory").ok(), says, ..cell })
}

fn failed(error: &impl ToString) -> Missing {
    Missing::Failed(error.to_string())
}

/// Merges the cell of another round.
fn merge(cell: &mut Result<Cell, Missing>, other: Result<Cell, Missing>) {
    match (cell, other) {
        (Ok(cell), Ok(other)) => {
            cell.least = cell.least.min(other.least);
            cell.medians.extend(other.medians);
            cell.medians.sort_unstable_by(f64::total_cmp);
            cell.median = cell.medians[cell.medians.len() / 2];
            cell.error = cell.error.max(other.error);
            cell.memory = other.memory.into_iter().chain(cell.memory).reduce(f64::min);
        }
        (cell @ Ok(_), Err(message)) => *cell = Err(message),
        (Err(_), _) => {}
    }
}
