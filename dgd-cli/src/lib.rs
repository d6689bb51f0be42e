//! The `dgd` command: arguments, data files, pictures, and the commands themselves.

mod args;
mod command;
mod console;
pub mod data;
mod failure;
mod figure;
mod load;
pub mod plot;
mod result;
mod run;
mod verify;

use std::process::ExitCode;

use clap::Parser;

use args::{Cli, Command};
use console::Console;

/// Runs the command line of this process.
///
/// Exit codes: 0 done, 1 the model or data has errors or a check found something, 2 wrong usage,
/// 3 the computation failed.
pub fn run() -> ExitCode {
    // Wrong usage ends the process here, with 2.
    let cli = Cli::parse();
    let console = Console::new(&cli.global);
    let result = match &cli.command {
        Command::Check(args) => command::check::run(args, console),
        Command::Fmt(args) => command::fmt::run(args, console),
        Command::Emit(args) => command::emit::run(args, console),
        Command::Explain(args) => command::explain::run(args, console),
        Command::Simulate(args) => command::simulate::run(args, console),
        Command::Sensitivity(args) => command::sensitivity::run(args, console),
        Command::Methods => command::methods::run(console),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            console.failure(&error);
            error.exit_code()
        }
    }
}
