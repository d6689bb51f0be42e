//! What dgd and other solvers need for the same work, measured in one run.
//!
//! ```text
//!   installed   programs built, or what is missing and how to get it
//!      │
//!   measure     every program, method and tolerance in turn, and that for several rounds
//!      │
//!   error       what each gave, against references that are carried in
//!      │
//!   table       times with errors beside them, and ratios at equal error
//! ```
//!
//! What is compared is in [`catalogue`].

mod arguments;
mod catalogue;
mod error;
mod installed;
mod machine;
mod measure;
mod ratio;
mod table;

use std::path::Path;
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
    let programs = installed::programs(folder, &arguments);
    let rows = measure::rows(folder, &programs, &arguments);
    println!("{}", machine::header(folder, &programs));
    for case in catalogue::CASES {
        print!("{}", table::of_case(case, &rows));
    }
    print!("{}", table::of_targets(&rows));
    let (failures, disagreements) = table::complaints(&rows);
    for complaint in failures.iter().chain(&disagreements) {
        eprintln!("{complaint}");
    }
    if failures.is_empty() && disagreements.is_empty() {
        ExitCode::SUCCESS
    } else {
        ExitCode::FAILURE
    }
}
