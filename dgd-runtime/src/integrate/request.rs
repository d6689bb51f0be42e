//! The public functions that simulate, and the checks of their arguments.

use crate::error::{BadRequest, Failure, IntegrateError};
use crate::integrate::catalogue::Method;
use crate::integrate::delay::history;
use crate::integrate::fixed_step::{self, Steps};
use crate::integrate::methods::family::EndEquations;
use crate::integrate::methods::stepper::SensitivityWorkspace;
use crate::integrate::simulation::Simulation;
use crate::observe::delay::DelayedOutputTimes;
use crate::observe::observe;
use crate::problem::{Options, Problem, WantedResults};
use crate::signal::InputError;
use crate::solution::Solution;
use crate::solved::SolvableSystem;
use crate::system::Signature;

/// Integrates from the first of the requested `times` to the last and returns the unknowns at all of them.
///
/// Times ascend; one that occurs twice means just before and just after a jump of the inputs, one that occurs
/// more often just after ([`side`](crate::side)).
///
/// # Errors
///
/// [`Failure`], with the part of the solution that was reached.
pub fn simulate<S: SolvableSystem>(
    problem: &Problem<'_, S>,
    times: &[f64],
    options: &Options,
) -> Result<Solution, Failure> {
    S::integrate(problem, times, options, WantedResults::Unknowns)
}

/// Like [`simulate`], but keeps only the unknowns at the positions `chosen`, in this order, so that a run of a large
/// model does not need memory for all of its unknowns at each time.
///
/// # Errors
///
/// [`Failure`], with the part of the solution that was reached.
pub fn simulate_chosen<S: SolvableSystem>(
    problem: &Problem<'_, S>,
    chosen: &[usize],
    times: &[f64],
    options: &Options,
) -> Result<Solution, Failure> {
    S::integrate(problem, times, options, WantedResults::Chosen(chosen))
}

/// Like [`simulate_chosen`], but also evaluates the outputs during the run, which may read any unknown;
/// [`observe`](crate::observe) returns them. So a run of a large model needs memory only for the requested values. If
/// an output has a delay, or steps are equal, all unknowns are kept during the run.
///
/// # Errors
///
/// [`Failure`], with the part of the solution that was reached.
pub fn simulate_observed<S: SolvableSystem>(
    problem: &Problem<'_, S>,
    chosen: &[usize],
    times: &[f64],
    options: &Options,
) -> Result<Solution, Failure> {
    let verified = problem.verify().map_err(IntegrateError::BadRequest);
    if let Err(error) = verified.and_then(|()| verify_chosen(problem, chosen)) {
        let partial = Box::new(Solution::empty(problem.system.signature(), 0));
        return Err(Failure { error, partial });
    }
    let outputs = &problem.system.signature().outputs;
    let is_late = outputs.iter().any(|output| output.delay.is_some());
    if !is_late && !matches!(options.steps, Steps::PerSample(_)) {
        return S::integrate(problem, times, options, WantedResults::Observed(chosen));
    }
    let observed = |mut solution: Solution| {
        solution.w = observe(problem, &solution).w;
        solution.keep(chosen);
        solution
    };
    match S::integrate(problem, times, options, WantedResults::Unknowns) {
        Ok(solution) => Ok(observed(solution)),
        Err(Failure { error, partial }) => {
            Err(Failure { error, partial: Box::new(observed(*partial)) })
        }
    }
}

/// Like [`simulate`], with the sensitivities of all unknowns to the model's directions.
///
/// # Errors
///
/// [`Failure`], with the part of the solution that was reached.
pub fn simulate_with_sensitivities<S: SolvableSystem>(
    problem: &Problem<'_, S>,
    times: &[f64],
    options: &Options,
) -> Result<Solution, Failure> {
    S::integrate(problem, times, options, WantedResults::Sensitivities)
}

/// Implements [`simulate`] and [`simulate_with_sensitivities`] for this type of system.
///
/// # Errors
///
/// [`Failure`], with the part of the solution that was reached.
pub fn integrate<S: SolvableSystem>(
    problem: &Problem<'_, S>,
    times: &[f64],
    options: &Options,
    wanted: WantedResults<'_>,
) -> Result<Solution, Failure> {
    run(problem, times, options, wanted)
}

/// Runs to all times that the outputs need, and returns the solution at the requested ones.
fn run<S: SolvableSystem>(
    problem: &Problem<'_, S>,
    times: &[f64],
    options: &Options,
    wanted: WantedResults<'_>,
) -> Result<Solution, Failure> {
    let signature = problem.system.signature();
    let chosen = wanted.chosen();
    let directions = wanted.with_sensitivities().then(|| SensitivityWorkspace::new(problem.system));
    let n_s = if directions.is_some() { signature.directions.len() } else { 0 };
    let mut solution = Solution::empty(signature, n_s);
    let reads_past = matches!(wanted, WantedResults::UnknownsAndPast)
        || wanted.is_remembered()
        || outputs_read_past(signature)
        || (n_s > 0 && signature.outputs.iter().any(|output| output.delay.is_some()));
    if chosen.is_none() && reads_past {
        solution.n_past = signature.past().len();
    }
    let verified = verify(problem, times, options).and_then(|()| {
        verify_chosen(problem, chosen.unwrap_or_default())?;
        history::verify(problem, n_s > 0)?;
        options.method.kind.verify(problem, options.method.name)?;
        let delayed =
            if wanted.is_remembered() { None } else { DelayedOutputTimes::new(problem, times)? };
        Ok((delayed, problem.inputs_read().map_err(IntegrateError::Inputs)?))
    });
    let (delayed, inputs) = match verified {
        Ok(verified) => verified,
        Err(error) => return Err(Failure { error, partial: Box::new(solution) }),
    };
    let read = Problem { inputs: &inputs, ..*problem };
    let all_times = delayed.as_ref().map_or(times, |delayed| &delayed.all);
    let outcome = match options.steps {
        Steps::PerSample(per_sample) => {
            let outcome =
                fixed_step::run(&read, all_times, options, per_sample, directions, &mut solution);
            if let Some(chosen) = chosen {
                solution.keep(chosen);
            }
            outcome
        }
        Steps::Automatic | Steps::Adaptive => {
            solution.n = chosen.map_or(solution.n, <[usize]>::len);
            run_to(&read, all_times, options, directions, wanted, &mut solution)
        }
    };
    if let Some(delayed) = delayed {
        solution = delayed.split(times, solution);
    }
    match outcome {
        Ok(()) => Ok(solution),
        Err(error) => Err(Failure { error, partial: Box::new(solution) }),
    }
}

/// Runs to `times`; the problem's inputs are those that the model reads.
fn run_to<'a, S: SolvableSystem>(
    problem: &'a Problem<'a, S>,
    times: &[f64],
    options: &Options,
    directions: Option<SensitivityWorkspace<S>>,
    wanted: WantedResults<'a>,
    solution: &mut Solution,
) -> Result<(), IntegrateError> {
    let (Some(&from), Some(&until)) = (times.first(), times.last()) else {
        return Ok(());
    };
    solution.times.reserve(times.len());
    solution.y.reserve(solution.n * times.len());
    solution.s.reserve(solution.n * solution.n_s * times.len());
    solution.z.reserve(solution.n_z * times.len());
    solution.past.reserve(solution.n_past * times.len());
    let mut simulation = Simulation::new(problem, options, from, directions);
    simulation.chosen = wanted.chosen();
    if let WantedResults::Observed(_) = wanted {
        let n_w = problem.system.signature().outputs.len();
        solution.w.reserve(n_w * times.len());
        simulation.observed = Some(vec![0.0; n_w]);
    }
    let before = wanted.resumed();
    simulation.resumed = before.memory;
    if let Some(past) = before.past {
        simulation.drive.resume_history(past, from);
    }
    let outcome = simulation.integrate(times, until, solution);
    if wanted.is_remembered() {
        solution.memory = Some(simulation.memory());
    }
    let reached = simulation.t;
    for stretch in &mut solution.undefined {
        stretch.until = reached;
    }
    outcome
}

/// Whether outputs may read the past of delayed unknowns, including in conditions, which have no derivatives.
fn outputs_read_past(signature: &Signature) -> bool {
    !signature.past().is_empty() && !signature.outputs.is_empty()
}

pub(super) fn verify<S: SolvableSystem>(
    problem: &Problem<'_, S>,
    times: &[f64],
    options: &Options,
) -> Result<(), IntegrateError> {
    problem.verify().map_err(IntegrateError::BadRequest)?;
    verify_request(times, options).map_err(IntegrateError::BadRequest)?;
    verify_built(problem, options.method)?;
    verify_inputs(problem, times).map_err(IntegrateError::Inputs)
}

/// Checks that this build has the factorisation that a run by the method, or the search for its start, needs.
fn verify_built<S: SolvableSystem>(
    problem: &Problem<'_, S>,
    method: &Method,
) -> Result<(), IntegrateError> {
    let is_factorised = method.kind.traits().solves != EndEquations::Nothing
        || problem.system.signature().unknowns.n_algebraic() > 0;
    if is_factorised {
        problem.verify_factorisation().map_err(IntegrateError::BadRequest)?;
    }
    Ok(())
}

/// Checks that the chosen unknowns exist.
fn verify_chosen<S: SolvableSystem>(
    problem: &Problem<'_, S>,
    chosen: &[usize],
) -> Result<(), IntegrateError> {
    let signature = problem.system.signature();
    let unknowns = signature.unknowns.len();
    match chosen.iter().find(|position| **position >= unknowns) {
        None => Ok(()),
        Some(&position) => {
            let model = signature.name.to_string();
            let error = BadRequest::ChosenNoUnknown { model, unknowns, position };
            Err(IntegrateError::BadRequest(error))
        }
    }
}

/// Checks that options and times are valid.
pub fn verify_request(times: &[f64], options: &Options) -> Result<(), BadRequest> {
    options.verify().and_then(|()| verify_times(times))
}

/// Checks that the inputs cover the times, and are smooth where they must be.
pub fn verify_inputs<S: SolvableSystem>(
    problem: &Problem<'_, S>,
    times: &[f64],
) -> Result<(), InputError> {
    match (times.first(), times.last()) {
        (Some(&from), Some(&until)) => {
            let covered = problem.inputs.cover(from, until);
            covered.and_then(|()| problem.verify_smooth(from, until))
        }
        _ => Ok(()),
    }
}

fn verify_times(times: &[f64]) -> Result<(), BadRequest> {
    // Counted without an early exit, so that the comparison vectorises. Values that ascend between two finite numbers
    // are finite.
    let ascending = times.iter().zip(times.iter().skip(1)).filter(|(t, next)| t < next).count();
    if let (Some(first), Some(last)) = (times.first(), times.last())
        && first.is_finite()
        && last.is_finite()
        && ascending + 1 == times.len()
    {
        return Ok(());
    }
    if let Some(index) = times.iter().position(|t| !t.is_finite()) {
        return Err(BadRequest::TimeNotFinite { index });
    }
    if let Some(pair) = times.windows(2).find(|pair| pair[1] < pair[0]) {
        return Err(BadRequest::TimeBackwards { at: pair[1], previous: pair[0] });
    }
    Ok(())
}
