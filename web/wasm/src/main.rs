//! Runs the cases on this machine: prints the lines of the case whose index is the argument.

use std::process::ExitCode;

use dgd_wasm::CASES;

fn main() -> ExitCode {
    let position = std::env::args().nth(1).and_then(|text| text.parse::<usize>().ok());
    let Some(case) = position.and_then(|position| CASES.get(position)) else {
        eprintln!("usage: dgd-wasm 0..{}", CASES.len());
        return ExitCode::FAILURE;
    };
    print!("{}", case.lines());
    ExitCode::SUCCESS
}
