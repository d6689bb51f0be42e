//! A fit of M, c0 and c2 to the recording with noise, from values that are 30 % off.

use dgd::identify::{Noise, OutputErrorProblem, Recording, fit};
use dgd::{Inputs, Options, System};
use peers_problems::request::{Answer, Failure, Request};
use peers_problems::two_state::{FIT_NOISE, FIT_START, nominal};

/// `inputs` are those of the recording; the model has sensitivities to the three.
pub(crate) fn solve(
    request: &Request,
    system: &(impl System + Clone + Send),
    inputs: Inputs,
    times: Vec<f64>,
    options: Options,
) -> Result<(), Failure> {
    let measured = request.measured()?;
    let column = |k: usize| Some(measured.iter().map(|row| row[k]).collect());
    let recordings = [Recording::new(times, inputs, vec![column(0), column(1)])];
    let mut p = nominal();
    for (position, factor) in FIT_START {
        p[position] *= factor;
    }
    let problem = OutputErrorProblem {
        noise: FIT_NOISE.map(|sigma| Some(Noise::Known(sigma))).to_vec(),
        options,
        ..OutputErrorProblem::new(system, &p, &recordings)
    };
    request.measure(
        || {
            let found = fit(&problem)?;
            if found.termination.is_converged() { Ok(found) } else { Err("not converged".into()) }
        },
        |found| Answer {
            values: FIT_START.map(|(position, _)| found.p[position] / nominal()[position]).to_vec(),
            steps: found.evaluations,
        },
    )
}
