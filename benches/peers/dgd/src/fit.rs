//! Fits to the recording with noise, from values that are 30 % off.

use dgd::identify::{Fit, Noise, OutputErrorProblem, Recording, fit};
use dgd::{Inputs, Options, System};
use peers_problems::request::{Answer, Failure, Request};
use peers_problems::two_state::{FIT_NOISE, FIT_START, RANK_START, nominal, square_losses};

/// M, c0 and c2. `inputs` are those of the recording; the model has sensitivities to the three.
pub(crate) fn solve(
    request: &Request,
    system: &(impl System + Clone + Send),
    inputs: Inputs,
    times: Vec<f64>,
    options: Options,
) -> Result<(), Failure> {
    estimate(request, system, (inputs, times), options, &FIT_START, |found| {
        let theta = FIT_START.map(|(position, _)| found.p[position] / nominal()[position]);
        Answer::new(theta.to_vec(), found.evaluations)
    })
}

/// M, c0, c2 and F, of which data determines only a sum of the last two.
pub(crate) fn too_free(
    request: &Request,
    system: &(impl System + Clone + Send),
    inputs: Inputs,
    times: Vec<f64>,
    options: Options,
) -> Result<(), Failure> {
    estimate(request, system, (inputs, times), options, &RANK_START, |found| {
        let sum = square_losses(&found.p) / square_losses(&nominal());
        let theta = |position: usize| found.p[position] / nominal()[position];
        let undetermined = found.undetermined.iter().map(|combination| {
            let terms = combination.terms.iter().map(|term| {
                format!("{} by {:+.2}", found.estimates[term.estimate].name, term.change)
            });
            terms.collect::<Vec<_>>().join(" with ")
        });
        let says = match undetermined.collect::<Vec<_>>() {
            none if none.is_empty() => "converged".to_owned(),
            some => format!("not determined: {}", some.join("; ")),
        };
        let values = vec![theta(0), theta(1), sum];
        Answer { says, ..Answer::new(values, found.evaluations) }
    })
}

/// `start` is which parameters are free, and by what factors they start off.
fn estimate(
    request: &Request,
    system: &(impl System + Clone + Send),
    (inputs, times): (Inputs, Vec<f64>),
    options: Options,
    start: &[(usize, f64)],
    answer: impl FnOnce(Fit) -> Answer,
) -> Result<(), Failure> {
    let measured = request.measured()?;
    let column = |k: usize| Some(measured.iter().map(|row| row[k]).collect());
    let recordings = [Recording::new(times, inputs, vec![column(0), column(1)])];
    let mut p = nominal();
    for (position, factor) in start {
        p[*position] *= factor;
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
        answer,
    )
}
