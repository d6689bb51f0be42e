//! Fits to the recording with noise, from initial values that are 30 % off.

use dgd_identify::{Fit, NoiseSource, OutputErrorProblem, Recording, fit};
use dgd_runtime::{Inputs, Options, SolvableSystem};
use peers_problems::request::{Answer, Failure, Request};
use peers_problems::two_state::{
    FIT_NOISE, FIT_START, RANK_START, SIX_NOISE, SIX_START, nominal, nominal_six, square_losses,
};

/// M, c0 and c2. `inputs` are those of the recording; the model has sensitivities to the three parameters.
pub(crate) fn solve(
    request: &Request,
    system: &(impl SolvableSystem + Clone + Send + 'static),
    inputs: Inputs,
    times: Vec<f64>,
    options: Options,
) -> Result<(), Failure> {
    let p = off(nominal(), &FIT_START);
    let wanted = Wanted { p: &p, readings: measured(request)?, stopping: Stopping::Usual };
    estimate(request, system, (inputs, times), options, wanted, |found| {
        let theta = FIT_START.map(|(position, _)| found.p[position] / nominal()[position]);
        Answer::new(theta.to_vec(), found.evaluations)
    })
}

/// M, c0, c2 and F, where the data determine only a combination of the last two.
pub(crate) fn too_free(
    request: &Request,
    system: &(impl SolvableSystem + Clone + Send + 'static),
    inputs: Inputs,
    times: Vec<f64>,
    options: Options,
) -> Result<(), Failure> {
    let p = off(nominal(), &RANK_START);
    let wanted = Wanted { p: &p, readings: measured(request)?, stopping: Stopping::Usual };
    estimate(request, system, (inputs, times), options, wanted, |found| {
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

/// M, c0, c1, c2, F and F1, from four instruments.
pub(crate) fn six(
    request: &Request,
    system: &(impl SolvableSystem + Clone + Send + 'static),
    inputs: Inputs,
    times: Vec<f64>,
    options: Options,
) -> Result<(), Failure> {
    let nominal = nominal_six();
    let p: Vec<f64> = nominal.iter().zip(SIX_START).map(|(p, factor)| p * factor).collect();
    let readings = columns(&request.instruments()?, SIX_NOISE);
    let wanted = Wanted { p: &p, readings, stopping: Stopping::AtSixDigits };
    estimate(request, system, (inputs, times), options, wanted, |found| {
        let theta = found.p.iter().zip(nominal).map(|(p, nominal)| p / nominal);
        Answer::new(theta.collect(), found.evaluations)
    })
}

/// Multiplies some parameters by factors.
fn off(mut p: [f64; 5], start: &[(usize, f64)]) -> [f64; 5] {
    for (position, factor) in start {
        p[*position] *= factor;
    }
    p
}

/// Readings of each output, with their noise.
type Readings = Vec<(Vec<f64>, f64)>;

/// Readings of h and q.
fn measured(request: &Request) -> Result<Readings, Failure> {
    Ok(columns(&request.measured()?, FIT_NOISE))
}

fn columns<const N: usize>(rows: &[[f64; N]], noise: [f64; N]) -> Readings {
    let column = |(k, sigma)| (rows.iter().map(|row: &[f64; N]| row[k]).collect(), sigma);
    noise.into_iter().enumerate().map(column).collect()
}

/// Stopping criterion of a fit.
enum Stopping {
    /// A thousandth of a standard deviation from the minimum.
    Usual,
    /// Six accurate digits of the weakest estimate, which is closer.
    AtSixDigits,
}

/// The input of a fit.
struct Wanted<'a> {
    /// Initial values.
    p: &'a [f64],
    readings: Readings,
    stopping: Stopping,
}

fn estimate(
    request: &Request,
    system: &(impl SolvableSystem + Clone + Send + 'static),
    (inputs, times): (Inputs, Vec<f64>),
    options: Options,
    wanted: Wanted<'_>,
    answer: impl FnOnce(Fit) -> Answer,
) -> Result<(), Failure> {
    let Wanted { p, readings, stopping } = wanted;
    let (columns, sigmas): (Vec<_>, Vec<_>) = readings.into_iter().unzip();
    let recordings = [Recording::new(times, inputs, columns.into_iter().map(Some).collect())];
    let mut problem = OutputErrorProblem {
        noise: sigmas.into_iter().map(|sigma| Some(NoiseSource::Known(sigma))).collect(),
        options,
        ..OutputErrorProblem::new(system, p, &recordings)
    };
    if matches!(stopping, Stopping::AtSixDigits) {
        problem.stopping.reduction = 1e-16;
        problem.negligible_reduction = 0.0;
    }
    request.measure(
        || {
            let fitted = fit(&problem)?;
            if fitted.termination.is_converged() { Ok(fitted) } else { Err("not converged".into()) }
        },
        answer,
    )
}
