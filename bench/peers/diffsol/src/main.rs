//! The problems solved with diffsol: dense nalgebra matrices for two states, sparse faer for lines.
//!
//! Models given as closures have no interface for restarts, so values that change at a restart are in cells that the
//! closures read.

mod jump;
mod line;
mod recording;
mod two_state;

use std::process::ExitCode;

use peers_problems::request::answer;

fn main() -> ExitCode {
    answer(|request| match request.problem() {
        "p1a" | "p2a" => jump::states(request),
        "p1b" | "p2b" => jump::sensitivities(request),
        "p3" => line::solve(request),
        "p4" => jump::ensemble_of_sets(request),
        "p5a" | "p5b" => recording::solve(request),
        problem => Err(format!("no program for {problem}").into()),
    })
}
