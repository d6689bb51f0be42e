//! The `dgd` command.

use std::process::ExitCode;

use dgd_scratch::Scratch;

/// Allocator that implements `--memory`; a library cannot choose it for the programs that use it.
#[global_allocator]
static ALLOCATOR: Scratch = Scratch;

fn main() -> ExitCode {
    dgd_cli::run()
}
