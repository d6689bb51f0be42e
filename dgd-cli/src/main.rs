//! The `dgd` command.

use std::process::ExitCode;

fn main() -> ExitCode {
    dgd_cli::run()
}
