//! The problems solved with dgd: `.dgd` files by `dgd::model!` or loaded, run through the public interface.
//!
//! It is a library, so that the timed code is also the code whose instructions are counted.

mod fit;
mod line;
mod loaded;
mod sets;

use dgd_compiler::pipeline::SensitivityDirections;
use dgd_runtime::{
    InputColumn, Inputs, Interpolation, Method, Options, PerSample, Problem, Solution,
    SolvableSystem, Steps, find_method, simulate, simulate_with_sensitivities,
};
use peers_problems::request::{Answer, Failure, Request};
use peers_problems::two_state::{SPEEDS, STRETCHES};

mod models {
    dgd::model!("../../../../models/bench_two_state.dgd", as ode);
    dgd::model!("../../../../models/bench_two_state.dgd", flow = static, as dae);
    dgd::model!("recording.dgd", as recording);
    dgd::model!("recording.dgd", sensitivities = [M, c0, c2], as fitted);
    dgd::model!("recording.dgd", sensitivities = [M, c0, c2, F], as too_free);
    dgd::model!("instruments.dgd", as instruments);
}

/// The model of P1, relative to this package.
const TWO_STATE: &str = "../../../models/bench_two_state.dgd";
/// Suffix of a method for a loaded model, as opposed to one compiled by rustc.
const LOADED: &str = ", loaded";

/// Answers a request.
///
/// # Errors
///
/// The case is unknown, or a run fails.
pub fn solve(request: &Request) -> Result<(), Failure> {
    match request.problem() {
        "p1a" | "p1b" if request.method.ends_with(LOADED) => {
            jump(request, &loaded::model(TWO_STATE, &SensitivityDirections::All, &[])?)
        }
        "p1a" | "p1b" => jump(request, &models::ode::Model),
        "p2a" | "p2b" => jump(request, &models::dae::Model),
        "p3" => line::solve(request),
        "p4" => sets::solve(request, &models::ode::Model),
        "p5a" | "p5b" => {
            let (inputs, times) = recorded(request)?;
            run(request, &models::recording::Model, &inputs, &times)
        }
        "fit" => {
            let (inputs, times) = recorded(request)?;
            fit::solve(request, &models::fitted::Model, inputs, times, options(request)?)
        }
        "fit6" => {
            let (inputs, times) = recorded(request)?;
            fit::six(request, &models::instruments::Model, inputs, times, options(request)?)
        }
        "rank" => {
            let (inputs, times) = recorded(request)?;
            fit::too_free(request, &models::too_free::Model, inputs, times, options(request)?)
        }
        problem => Err(format!("no program for {problem}").into()),
    }
}

/// The pump's speed jumps at 100 s; outputs at whole seconds.
fn jump(request: &Request, system: &impl SolvableSystem) -> Result<(), Failure> {
    let (inputs, times) = jump_of_speed()?;
    run(request, system, &inputs, &times)
}

/// The inputs of P1, P2 and P4, and the times of their outputs.
fn jump_of_speed() -> Result<(Inputs, Vec<f64>), Failure> {
    let times: Vec<f64> = STRETCHES.iter().map(|(from, _, _)| f64::from(*from)).collect();
    let column = InputColumn { name: "w", interpolation: Interpolation::Hold, values: &SPEEDS };
    Ok((Inputs::recorded(&times, &[column])?, (0..=1000).map(f64::from).collect()))
}

/// Inputs over 6000 s at 1 Hz, and their times.
fn recorded(request: &Request) -> Result<(Inputs, Vec<f64>), Failure> {
    let samples = request.recording()?;
    let times: Vec<f64> = (0..samples.len()).map(|k| k as f64).collect();
    let w: Vec<f64> = samples.iter().map(|sample| sample.w).collect();
    let q_b: Vec<f64> = samples.iter().map(|sample| sample.q_b).collect();
    let q_tf: Vec<f64> = samples.iter().map(|sample| sample.q_tf).collect();
    let held_column =
        |name, values| InputColumn { name, interpolation: Interpolation::Hold, values };
    let columns = [held_column("w", &w), held_column("q_b", &q_b), held_column("q_tf", &q_tf)];
    Ok((Inputs::recorded(&times, &columns)?, times))
}

/// Both tolerances are relative to the model's sizes of unknowns and parameters.
///
/// A method's name means adaptive steps; `tsit5 per sample` and `tsit5 2 per sample` mean equal steps. `auto` is the
/// default of users.
fn options(request: &Request) -> Result<Options, Failure> {
    let words: Vec<&str> = request.method.trim_end_matches(LOADED).split(' ').collect();
    let (name, steps) = match words.as_slice() {
        ["auto"] => ("rodas5p", Steps::Automatic),
        [name] => (*name, Steps::Adaptive),
        [name, "per", "sample"] => (*name, Steps::PerSample(PerSample::Automatic)),
        [name, n, "per", "sample"] => (*name, Steps::PerSample(PerSample::Exactly(n.parse()?))),
        _ => return Err(format!("no method is called `{}`", request.method).into()),
    };
    let method: &'static Method = find_method(name)?;
    Ok(Options {
        rtol: request.rtol,
        atol: 0.01 * request.rtol,
        method,
        steps,
        ..Options::default()
    })
}

/// Parameter values declared in the model.
fn declared(system: &impl SolvableSystem) -> Vec<f64> {
    system.signature().parameters.iter().map(|x| x.value).collect()
}

fn run(
    request: &Request,
    system: &impl SolvableSystem,
    inputs: &Inputs,
    times: &[f64],
) -> Result<(), Failure> {
    let p = declared(system);
    let options = options(request)?;
    let problem = Problem { system, p: &p, inputs, start: &[] };
    let simulation =
        if request.with_sensitivities() { simulate_with_sensitivities } else { simulate };
    request.measure(
        || Ok(simulation(&problem, times, &options)?),
        |solution| Answer::new(rows(&solution, &p), solution.statistics.steps),
    )
}

/// States, then sensitivities with respect to θ = p/p_nominal: ∂y/∂θ = p_nominal ∂y/∂p.
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
