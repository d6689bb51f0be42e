//! Answers requests of the driver.

use std::process::ExitCode;

use peers_problems::request::answer;

fn main() -> ExitCode {
    answer(peer_dgd::solve)
}
