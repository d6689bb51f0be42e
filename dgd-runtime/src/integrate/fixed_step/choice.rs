//! Chooses the method and the number of steps per sample, from runs over the beginning.
//!
//! | candidate | cost of a step |
//! |---|---|
//! | explicit | 11 |
//! | Taylor series of order p, the lowest that is accurate in one step | p + 2 |
//! | Rosenbrock | 33 |
//!
//! as measured on models of a few unknowns. The cheapest candidate is chosen. The choice is verified on the whole
//! recording: in a simulation by its own errors, in a fit by a run at its result.

use std::num::NonZeroU32;

use super::carried::{CarriedState, UnknownsOnly};
use super::count::{MOST, StepCount};
use super::error::{PerSampleError, verify};
use super::grid::{StepGrid, sample_interval, segments};
use super::method::FixedStep;
use super::sweep::{ErrorGauge, RunSchedule, sweep};
use super::taylor::FixedTaylor;
use super::{
    DiscardingSink, FixedStepTask, PerSample, Steps, dispatch, is_swept, rosenbrock, started,
};
use crate::error::IntegrateError;
use crate::integrate::methods::catalogue::{METHODS, Method, MethodKind, taylor_up_to};
use crate::integrate::methods::taylor::order;
use crate::integrate::simulation::Simulation;
use crate::integrate::watched::RunMonitor;
use crate::linalg::norm::larger;
use crate::problem::{Options, Problem};
use crate::solution::Solution;
use crate::solved::SolvableSystem;

/// The beginning of a run is one part in this many of its rows, with a minimum number of rows.
const PART: usize = 16;
const LEAST_ROWS: usize = 64;

/// Fraction of the tolerance that errors in the beginning may have, so that the series of lowest order is accurate
/// enough over the whole run: a higher order costs less than more steps.
const SPARE: f64 = 0.1;

/// Cost of a step.
fn cost(method: &Method) -> u32 {
    match method.kind {
        MethodKind::Taylor(_) => method.order + 2,
        MethodKind::Rosenbrock(tableau) => 4 * tableau.alpha.len() as u32 + 1,
        _ => 11,
    }
}

/// Errors of a run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RunErrors {
    /// Square of the largest local error, in units of the tolerance.
    pub largest: f64,
    /// The largest ratio of a step to the stability limit.
    pub stiffness: f64,
}

impl RunErrors {
    /// The number of steps per sample that is needed, if n were not enough.
    pub fn wants_more_than(self, n: u32, exponent: u32) -> Option<u32> {
        let share = larger(self.largest.powf(0.5 / f64::from(exponent)), self.stiffness);
        if share <= 1.0 {
            return None;
        }
        // NaN gives the maximum.
        let wanted = (f64::from(n) * share).ceil().min(f64::from(MOST)) as u32;
        Some(wanted.max(n + 1).min(MOST.max(n)))
    }
}

/// A method, and a number of steps per sample.
#[derive(Debug, Clone, Copy)]
pub struct PerSampleChoice {
    /// The method.
    pub method: &'static Method,
    /// Steps per sample.
    pub steps: NonZeroU32,
}

impl PerSampleChoice {
    /// The options with this choice.
    pub fn applied(self, options: Options) -> Options {
        let steps = Steps::PerSample(PerSample::Exactly(self.steps));
        Options { method: self.method, steps, ..options }
    }
}

/// The method that needs least work with equal steps per sample, and the number of steps with which the unknowns meet
/// the tolerance in the beginning of a run.
///
/// # Errors
///
/// [`IntegrateError::PerSample`] if no method can make equal steps for this model, or none is accurate enough with the
/// maximum number of steps; the other variants if the run cannot begin.
pub fn choose_per_sample<S: SolvableSystem>(
    problem: &Problem<'_, S>,
    times: &[f64],
    options: &Options,
) -> Result<PerSampleChoice, IntegrateError> {
    problem.verify().map_err(IntegrateError::BadRequest)?;
    let mut best: Option<(u32, PerSampleChoice)> = None;
    let mut first_error = None;
    for method in METHODS {
        let options = Options { method, ..*options };
        let verified = verify(problem, method)
            .map_err(IntegrateError::PerSample)
            .and_then(|()| candidate(problem, times, &options));
        match verified {
            Ok(choice) => {
                let cost = cost(choice.method) * choice.steps.get();
                if best.is_none_or(|(least, _)| cost < least) {
                    best = Some((cost, choice));
                }
            }
            Err(error) => {
                first_error.get_or_insert(error);
            }
        }
    }
    match (best, first_error) {
        (Some((_, choice)), _) => Ok(choice),
        (None, Some(error)) => Err(error),
        (None, None) => {
            let method = options.method.name;
            Err(IntegrateError::PerSample(PerSampleError::Method { method }))
        }
    }
}

/// The steps and cost that a method needs in the beginning of a run.
fn candidate<S: SolvableSystem>(
    problem: &Problem<'_, S>,
    times: &[f64],
    options: &Options,
) -> Result<PerSampleChoice, IntegrateError> {
    if let MethodKind::Taylor(None) = options.method.kind {
        let mut solution = Solution::empty(problem.system.signature(), 0);
        let mut simulation = Simulation::new(problem, options, times[0], None);
        simulation.start(&mut solution)?;
        if let Some(method) = lowest_order::<S, UnknownsOnly<S>>(&simulation, times) {
            return Ok(PerSampleChoice { method, steps: NonZeroU32::MIN });
        }
    }
    let n = per_sample_of_head(problem, times, options)?;
    let steps = NonZeroU32::new(n).unwrap_or(NonZeroU32::MIN);
    Ok(PerSampleChoice { method: options.method, steps })
}

/// The Taylor series of lowest order with which one step per sample keeps errors within the tolerance in the beginning
/// of a run; at most twice the order that suits the tolerance, which costs as much as two steps.
pub(super) fn lowest_order<S: SolvableSystem, C: CarriedState<S>>(
    simulation: &Simulation<'_, S>,
    times: &[f64],
) -> Option<&'static Method> {
    let system = simulation.problem.system;
    let n_s = if C::HAS_SENSITIVITIES { system.signature().directions.len() } else { 0 };
    let grid = StepGrid::new(sample_interval(simulation.problem.inputs, times), 1);
    taylor_up_to(2 * order(None, simulation.tolerances.rtol)).iter().find(|method| {
        let run = MeasuredRun::<S, C>::new(simulation, &times[..head(times)], grid);
        let measured = run.run_with(FixedTaylor::new(system, method.order as usize, n_s));
        measured.is_ok_and(|measured| measured.largest <= SPARE * SPARE)
    })
}

/// The number of rows in the beginning of a run.
pub(super) fn head(times: &[f64]) -> usize {
    (times.len() / PART).max(LEAST_ROWS).min(times.len())
}

/// The number of steps per sample that the beginning of a run needs for the unknowns to meet the tolerance.
pub(crate) fn per_sample_of_head<S: SolvableSystem>(
    problem: &Problem<'_, S>,
    times: &[f64],
    options: &Options,
) -> Result<u32, IntegrateError> {
    verify(problem, options.method).map_err(IntegrateError::PerSample)?;
    per_sample_within(problem, times, &times[..head(times)], options)
}

/// The number of steps per sample of a run to `times` that keeps the unknowns' errors within the tolerance up to the
/// last time of `part`.
fn per_sample_within<S: SolvableSystem>(
    problem: &Problem<'_, S>,
    times: &[f64],
    part: &[f64],
    options: &Options,
) -> Result<u32, IntegrateError> {
    let mut count = StepCount::new(PerSample::Automatic, options.method.name);
    let interval = sample_interval(problem.inputs, times);
    loop {
        match measure_on(problem, part, StepGrid::new(interval, count.n), options) {
            Ok(measured) => {
                if count.settle(measured, options.method.kind.estimate_order(options.rtol) + 1)? {
                    return Ok(count.n);
                }
            }
            Err(IntegrateError::PerSample(PerSampleError::NotFinite { t, .. })) => {
                count.refuse(t)?;
            }
            Err(error) => return Err(error),
        }
    }
}

/// The unknowns' errors in a run with a fixed number of steps per sample.
pub(crate) fn measure<S: SolvableSystem>(
    problem: &Problem<'_, S>,
    times: &[f64],
    per_sample: u32,
    options: &Options,
) -> Result<RunErrors, IntegrateError> {
    verify(problem, options.method).map_err(IntegrateError::PerSample)?;
    let interval = sample_interval(problem.inputs, times);
    measure_on(problem, times, StepGrid::new(interval, per_sample), options)
}

fn measure_on<S: SolvableSystem>(
    problem: &Problem<'_, S>,
    times: &[f64],
    grid: StepGrid,
    options: &Options,
) -> Result<RunErrors, IntegrateError> {
    let Some(&from) = times.first() else {
        return Ok(RunErrors { largest: 0.0, stiffness: 0.0 });
    };
    let mut solution = Solution::empty(problem.system.signature(), 0);
    let mut simulation = Simulation::new(problem, options, from, None);
    if !is_swept(options.method.kind) {
        return rosenbrock::measure(&mut simulation, times, grid, &mut solution);
    }
    simulation.start(&mut solution)?;
    let task = MeasuredRun::<S, UnknownsOnly<S>>::new(&simulation, times, grid);
    dispatch(problem.system, options.method.kind, options.rtol, task)
}

/// A run that measures errors.
struct MeasuredRun<'a, S: SolvableSystem, C> {
    problem: Problem<'a, S>,
    times: &'a [f64],
    max_steps: usize,
    watched: Option<&'static RunMonitor>,
    grid: StepGrid,
    start: C,
    gauge: ErrorGauge<C>,
    method: &'static Method,
}

impl<'a, S: SolvableSystem, C: CarriedState<S>> MeasuredRun<'a, S, C> {
    fn new(simulation: &Simulation<'a, S>, times: &'a [f64], grid: StepGrid) -> Self {
        let (start, sizes) = started(simulation);
        let gauge = ErrorGauge::new(simulation.tolerances, sizes);
        let Simulation { problem, max_steps, watched, method, .. } = *simulation;
        Self { problem: *problem, times, max_steps, watched, grid, start, gauge, method }
    }
}

impl<S: SolvableSystem, C: CarriedState<S>> FixedStepTask<S, C> for MeasuredRun<'_, S, C> {
    type Done = Result<RunErrors, IntegrateError>;

    fn run_with<M: FixedStep<S, C>>(self, mut stepper: M) -> Self::Done {
        let Self { problem, times, max_steps, watched, grid, mut start, mut gauge, method } = self;
        let Problem { system, p, inputs, .. } = problem;
        let course = RunSchedule { system, p, inputs, times, grid, max_steps, watched };
        match sweep(&course, &mut stepper, &mut start, Some(&mut gauge), &mut DiscardingSink) {
            Ok(_) => Ok(gauge.measured()),
            Err(stopped) => stopped.into_error(max_steps, |t| {
                let (per_sample, method) = (grid.per_sample(), method.name);
                Err(IntegrateError::PerSample(PerSampleError::NotFinite { t, per_sample, method }))
            }),
        }
    }
}

/// Whether inputs change in most sample intervals of a recording.
pub fn inputs_change_by_sample<S: SolvableSystem>(problem: &Problem<'_, S>, times: &[f64]) -> bool {
    match (times.first(), times.last()) {
        (Some(from), Some(until)) if from < until => {
            2 * segments(problem.inputs, *from, *until) >= times.len()
        }
        _ => false,
    }
}

/// The largest ratio of the sample interval to the stability limit of an explicit method, over a run with one step per
/// sample; `None` if the model cannot be run with such steps.
pub fn stiffness<S: SolvableSystem>(
    problem: &Problem<'_, S>,
    times: &[f64],
    options: &Options,
) -> Option<f64> {
    measure(problem, times, 1, options).ok().map(|measured| measured.stiffness)
}
