//! Compares the time that dgd and other solvers take for the same work, in one run.
//!
//! ```text
//!   installed   programs built, or missing requirements with advice (install)
//!      │
//!   measure     every program, method and tolerance in turn, and that for several rounds
//!      │
//!   error       errors relative to stored references
//!      │           user_crate   a user's crate, built from scratch and again
//!   table       times with errors, and the targets
//!      │
//!   record      the table in docs/speed.md, everything in results.md
//! ```
//!
//! The problems are in [`catalogue`].

mod arguments;
mod catalogue;
mod error;
mod install;
mod installed;
mod machine;
mod measure;
mod ratio;
mod record;
mod table;
mod user_crate;

use std::path::{Path, PathBuf};
use std::process::ExitCode;

fn main() -> ExitCode {
    let arguments = match arguments::parse(std::env::args().skip(1)) {
        Ok(arguments) => arguments,
        Err(message) => {
            eprintln!("{message}");
            return ExitCode::from(2);
        }
    };
    let folder = Path::new(env!("CARGO_MANIFEST_DIR"));
    let root: PathBuf = folder.components().collect::<PathBuf>().join("../..");
    let programs = installed::programs(folder, &arguments);
    let rows = measure::rows(folder, &programs, &arguments);
    let (mut failures, disagreements) = table::complaints(&rows);
    let builds = if arguments.asks_for("build", catalogue::OURS) {
        eprintln!("a user's crate");
        user_crate::build(&root).map_err(|message| failures.push(format!("build: {message}"))).ok()
    } else {
        None
    };

    let header = machine::header(folder, &programs);
    let bars = table::of_bars(&rows, builds.as_ref());
    let cases: String = catalogue::CASES.iter().map(|case| table::of_case(case, &rows)).collect();
    let results = format!("{header}\n{bars}\n{cases}{}", table::of_growth(&rows));
    println!("{results}");
    if arguments.record
        && let Err(message) = record::write(folder, &root, &format!("{bars}\n{header}"), &results)
    {
        failures.push(message);
    }
    for complaint in failures.iter().chain(&disagreements) {
        eprintln!("{complaint}");
    }
    if failures.is_empty() && disagreements.is_empty() {
        ExitCode::SUCCESS
    } else {
        ExitCode::FAILURE
    }
}
