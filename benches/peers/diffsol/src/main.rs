//! The problems, solved with diffsol: dense nalgebra matrices for two states, sparse faer for lines.
//!
//! A restart has no interface of its own for models that are closures: what changes at one is in
//! cells that the closures read.

mod jump;
mod line;
mod recording;
mod two_state;

use std::process::ExitCode;

use peers_problems::request::answer;

fn main() -> ExitCode {
    answer(|request| match (request.case.split_once('-'), request.case.as_str()) {
        (Some(("p3", cells)), _) => line::solve(request, cells.parse()?),
        (_, "p1a" | "p2a") => jump::states(request),
        (_, "p1b" | "p2b") => jump::sensitivities(request),
        (_, "p4") => jump::ensemble_of_sets(request),
        (_, "p5a" | "p5b") => recording::solve(request),
        (_, case) => Err(format!("no program for {case}").into()),
    })
}
