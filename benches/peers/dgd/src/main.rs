//! The problems, solved with dgd: `.dgd` files by `dgd::model!`, run by the public façade.

mod ensemble;
mod fit;

use std::process::ExitCode;

use dgd::{
    Column, Inputs, Interpolation, Method, Options, Problem, Solution, System, find_method,
    simulate, simulate_with_sensitivities,
};
use peers_problems::request::{Answer, Failure, Request, answer};
use peers_problems::two_state::{SPEEDS, STRETCHES};

mod models {
    dgd::model!("../../../../models/bench_two_state.dgd", as ode);
    dgd::model!("../../../../models/bench_two_state.dgd", flow = static, as dae);
    dgd::model!("recording.dgd", as recording);
    dgd::model!("recording.dgd", sensitivities = [M, c0, c2], as fitted);
}

fn main() -> ExitCode {
    answer(|request| match request.case.as_str() {
        "p1a" | "p1b" => jump(request, &models::ode::Model),
        "p2a" | "p2b" => jump(request, &models::dae::Model),
        "p5a" | "p5b" => {
            let (inputs, times) = recorded(request)?;
            run(request, &models::recording::Model, &inputs, &times)
        }
        "fit" => {
            let (inputs, times) = recorded(request)?;
            fit::solve(request, &models::fitted::Model, inputs, times, options(request)?)
        }
        "p4" => ensemble::solve(request, &models::ode::Model, options(request)?),
        case => Err(format!("no program for {case}").into()),
    })
}

/// The pump's speed jumps at 100 s; outputs at whole seconds.
fn jump(request: &Request, system: &impl System) -> Result<(), Failure> {
    let (inputs, outputs) = stretches()?;
    run(request, system, &inputs, &outputs)
}

/// The jump of the speed, and the whole seconds.
fn stretches() -> Result<(Inputs, Vec<f64>), Failure> {
    let times: Vec<f64> = STRETCHES.iter().map(|(from, _, _)| f64::from(*from)).collect();
    let column = Column { name: "w", interpolation: Interpolation::Hold, values: &SPEEDS };
    Ok((Inputs::recorded(&times, &[column])?, (0..=1000).map(f64::from).collect()))
}

/// Inputs of 6000 s at 1 Hz, and their times.
fn recorded(request: &Request) -> Result<(Inputs, Vec<f64>), Failure> {
    let samples = request.recording()?;
    let times: Vec<f64> = (0..samples.len()).map(|k| k as f64).collect();
    let w: Vec<f64> = samples.iter().map(|sample| sample.w).collect();
    let q_b: Vec<f64> = samples.iter().map(|sample| sample.q_b).collect();
    let q_tf: Vec<f64> = samples.iter().map(|sample| sample.q_tf).collect();
    let held = |name, values| Column { name, interpolation: Interpolation::Hold, values };
    let columns = [held("w", &w), held("q_b", &q_b), held("q_tf", &q_tf)];
    Ok((Inputs::recorded(&times, &columns)?, times))
}

/// Both tolerances are relative to sizes that the model gives: of the unknowns, and of the parameters.
fn options(request: &Request) -> Result<Options, Failure> {
    let method: &'static Method = find_method(&request.method)?;
    Ok(Options { rtol: request.rtol, atol: 0.01 * request.rtol, method, ..Options::default() })
}

fn run(
    request: &Request,
    system: &impl System,
    inputs: &Inputs,
    times: &[f64],
) -> Result<(), Failure> {
    let p: Vec<f64> = system.signature().parameters.iter().map(|x| x.value).collect();
    let options = options(request)?;
    let problem = Problem { system, p: &p, inputs, start: &[] };
    let simulation =
        if request.with_sensitivities() { simulate_with_sensitivities } else { simulate };
    request.measure(
        || Ok(simulation(&problem, times, &options)?),
        |solution| Answer { values: rows(&solution, &p), steps: solution.statistics.steps },
    )
}

/// States, then sensitivities to θ = p/p_nominal: ∂y/∂θ = p_nominal ∂y/∂p.
fn rows(solution: &Solution, p: &[f64]) -> Vec<f64> {
    let mut rows = Vec::new();
    for k in 0..solution.times.len() {
        rows.extend_from_slice(solution.y(k));
        if solution.n_s > 0 {
            for (s, p) in solution.s(k).chunks_exact(solution.n).zip(p) {
                rows.extend(s.iter().map(|s| s * p));
            }
        }
    }
    rows
}
