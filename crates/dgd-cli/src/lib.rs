//! The `dgd` command: arguments, and the commands.

mod args;
mod command;
mod command_line;
mod console;
mod crash;
mod failure;
mod interrupt;
mod picture;
mod progress;
mod scratch;
mod table_file;
mod tail;
mod targets;

use std::ffi::{OsStr, OsString};
use std::path::PathBuf;
use std::process::ExitCode;

use clap::Parser;
use dgd_compiler::diagnostics::visible;

use args::{Cli, Command};
pub use command::emit::run_commands;
use console::Console;
use failure::CommandError;
use targets::{CommandFiles, OutputTargets};

/// Runs the command line of this process.
///
/// Exit codes: 0 done, 1 the model or data has errors or a check found something, 2 wrong usage, 3 the computation
/// failed, 70 a bug in dgd itself, 130 cancelled with Ctrl-C.
pub fn run() -> ExitCode {
    ExitCode::from(run_words(std::env::args_os().skip(1).collect()))
}

/// Runs a command line that another program received, such as a script interpreter: the arguments after `dgd`. A
/// process runs one. The exit code is that of [`run`]; wrong usage and Ctrl-C end the process.
pub fn run_words(words: Vec<OsString>) -> u8 {
    command_line::set(words);
    match crash::caught(run_once) {
        Ok(code) => code,
        Err(crash) => {
            console::complain(&format!("error: {}", visible(&crash.to_string())));
            crash::CRASHED
        }
    }
}

/// The same for a program with another command: `start` is the command before dgd's arguments, and `file` the file with
/// its code. Jobs start it again.
pub fn run_words_of(start: Vec<OsString>, file: PathBuf, words: Vec<OsString>) -> u8 {
    command_line::set_program(start, file);
    run_words(words)
}

fn run_once() -> u8 {
    let cli = parsed();
    // A computation that can be cancelled handles Ctrl-C by itself.
    let files = CommandFiles::new(&cli.command);
    if !files.handles_ctrl_c {
        interrupt::mind();
    }
    let console = Console::new(&cli.global);
    let result = scratch::limit(&cli.command, &cli.global)
        .and_then(|()| OutputTargets::verified(&files, &cli.global))
        .and_then(|targets| perform(&cli.command, console.writing(&targets)));
    match result {
        Ok(()) => 0,
        Err(error) => {
            let console =
                if matches!(cli.command, Command::Track(_)) { console.in_lines() } else { console };
            console.failure(&error);
            error.exit_code()
        }
    }
}

/// The command line. Wrong usage ends the process here, with 2.
fn parsed() -> Cli {
    let words = std::iter::once(OsStr::new("dgd")).chain(command_line::words());
    Cli::try_parse_from(words).unwrap_or_else(|error| {
        let text = error.to_string();
        if error.use_stderr() && command_line::wants_json() {
            console::last_words(text.strip_prefix("error: ").unwrap_or(&text).trim());
            std::process::exit(error.exit_code());
        }
        let shown = visible(&text);
        // Arguments are quoted as typed, and a shell pattern may have inserted a file's name.
        if error.use_stderr() && shown != text {
            console::complain(shown.trim_end());
            std::process::exit(error.exit_code());
        }
        error.exit()
    })
}

fn perform(command: &Command, console: Console<'_>) -> Result<(), CommandError> {
    match command {
        Command::New(args) => command::new::run(args, console),
        Command::Check(args) => command::check::run(args, console),
        Command::Fmt(args) => command::fmt::run(args, console),
        Command::Emit(args) => command::emit::run(args, console),
        Command::Explain(args) => command::explain::run(args, console),
        Command::Simulate(args) => command::simulate::run(args, console),
        Command::Watch(args) => command::watch::run(args, console),
        Command::Sensitivity(args) => command::sensitivity::run(args, console),
        Command::Linearize(args) => command::linearize::run(args, console),
        Command::Invert(args) => command::invert::run(args, console),
        Command::Fit(args) => command::fit::run(args, console),
        Command::Compare(args) => command::compare::run(args, console),
        Command::Track(args) => command::track::run(args, console),
        Command::Discover(args) => command::discover::run(args, console),
        Command::Adopt(args) => command::adopt::run(args, console),
        Command::Screen(args) => command::screen::run(args, console),
        Command::Job(args) => command::job::run(args, console),
        Command::Methods => command::methods::run(console),
        Command::Schema => command::schema::run(console),
        Command::Completions(args) => command::shells::run(args, console),
        Command::Man(args) => command::man::run(args, console),
        Command::Lsp(_) => command::lsp::run(),
    }
}

/// Whether these arguments after `dgd` are a valid command line; otherwise the error.
///
/// For tests of the documentation: nothing is run, and no file is read.
///
/// # Errors
///
/// The message that `dgd` would print on standard error.
pub fn verify_arguments(words: &[String]) -> Result<(), String> {
    let line = std::iter::once("dgd").chain(words.iter().map(String::as_str));
    match Cli::try_parse_from(line) {
        // `--help` and `--version` are not mistakes.
        Err(error) if error.use_stderr() => Err(error.to_string()),
        Ok(_) | Err(_) => Ok(()),
    }
}
