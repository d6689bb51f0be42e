//! P3: the line from a short file, of any number of cells.

use dgd::{Inputs, Options, Problem, System, simulate};
use dgd_compiler::pipeline::Directions;
use peers_problems::line::END;
use peers_problems::request::{Answer, Failure, Request};

use crate::{declared, loaded, options};

/// p₁ at whole seconds; the model is read and compiled before the runs, as the peers' are.
pub(crate) fn solve(request: &Request) -> Result<(), Failure> {
    let cells = request.size().ok_or("how many cells?")?;
    let system = loaded::model("line.dgd", &Directions::None, &[format!("N={cells}")])?;
    let p = declared(&system);
    let inputs = Inputs::constant(&[]);
    let times: Vec<f64> = (0..=END).map(f64::from).collect();
    let problem = Problem { system: &system, p: &p, inputs: &inputs, start: &[] };
    // The sizes that the file gives are a million times an absolute tolerance of 1, as for the peers.
    let options = Options { atol: request.rtol, ..options(request)? };
    let first = system
        .signature()
        .unknowns
        .iter()
        .position(|unknown| unknown.name == "p[1]")
        .ok_or("no pressure in the first cell")?;
    request.measure(
        || Ok(simulate(&problem, &times, &options)?),
        |solution| {
            let values = (0..solution.times.len()).map(|k| solution.y(k)[first]).collect();
            Answer::new(values, solution.statistics.steps)
        },
    )
}
