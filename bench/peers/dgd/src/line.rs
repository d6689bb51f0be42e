//! P3: the line from a short file, with any number of cells.

use dgd_compiler::pipeline::SensitivityDirections;
use dgd_runtime::{Inputs, Options, Problem, System, simulate_chosen};
use peers_problems::line::END;
use peers_problems::request::{Answer, Failure, Request};

use crate::{declared, loaded, options};

/// p₁ at whole seconds; the model is read and compiled before the runs, like those of the peers.
pub(crate) fn solve(request: &Request) -> Result<(), Failure> {
    let cells = request.size().ok_or("how many cells?")?;
    let system = loaded::model("line.dgd", &SensitivityDirections::None, &[format!("N={cells}")])?;
    let p = declared(&system);
    let inputs = Inputs::constant(&[]);
    let times: Vec<f64> = (0..=END).map(f64::from).collect();
    let problem = Problem { system: &system, p: &p, inputs: &inputs, start: &[] };
    // The declared sizes are a million times an absolute tolerance of 1, as for the peers.
    let options = Options { atol: request.rtol, ..options(request)? };
    let unknowns = &system.signature().unknowns;
    let first = (0..unknowns.len()).find(|&i| unknowns.name(i) == "p[1]");
    let first = first.ok_or("no pressure in the first cell")?;
    request.measure(
        || Ok(simulate_chosen(&problem, &[first], &times, &options)?),
        |solution| Answer::new(solution.y.clone(), solution.statistics.steps),
    )
}
