//! Equal steps per sample of recorded inputs, with the number chosen once.
//!
//! If inputs change every second, a method of order five has to step there anyway, and searching for a better step
//! costs more than making it. Here there is no search: every segment of the inputs gets a fixed number of equal steps,
//! none is rejected, and a run is a smooth function of parameters and start values whose derivatives are its
//! sensitivities. In a fit, cost and gradient of every trial belong to the same steps.
//!
//! ```text
//!   n steps per sample → largest local error e of the run, in units of the tolerance
//!   n ← n e^(1/k) until e ≤ 1                  e ~ h^k
//! ```
//!
//! Models with modes, conditions on time or delays need steps that end elsewhere ([`error::refusal`]). If all unknowns
//! are differential and the method is explicit, [`sweep`] is the loop: written once for the unknowns with and without
//! sensitivities ([`carried`]), and for every method that makes steps of a given size ([`fixed_step`]). Work with such
//! a method is a [`FixedStepTask`], so that only [`dispatch`] distinguishes methods. Rosenbrock methods make the steps
//! of the general loop ([`rosenbrock`]).

// Lengths are constants if storage has a fixed size, but only after inlining.
#![allow(clippy::inline_always)]

mod carried;
mod choice;
mod count;
mod error;
mod grid;
mod method;
mod rosenbrock;
mod segment_inputs;
mod sweep;
mod taylor;
mod tsit5;

use std::num::NonZeroU32;

use crate::error::IntegrateError;
use crate::integrate::methods::catalogue::MethodKind;
use crate::integrate::methods::family::EndEquations;
use crate::integrate::methods::stepper::SensitivityWorkspace;
use crate::integrate::methods::tableaux::{EqualSteps, RungeKuttaTableau};
use crate::integrate::methods::taylor::order;
use crate::integrate::request;
use crate::integrate::simulation::Simulation;
use crate::integrate::watched::RunMonitor;
use crate::problem::{Options, Problem};
use crate::signal::Segment;
use crate::solution::Solution;
use crate::solved::SolvableSystem;
use carried::{CarriedState, UnknownsOnly, WithSensitivities};
use choice::head;
pub use choice::{PerSampleChoice, choose_per_sample, inputs_change_by_sample, stiffness};
pub(crate) use choice::{RunErrors, measure, per_sample_of_head};
use count::StepCount;
pub use error::PerSampleError;
use error::verify;
use grid::{StepGrid, sample_interval};
use method::FixedStep;
pub(crate) use sweep::SampleSink;
use sweep::{ErrorGauge, RunSchedule, sweep};
use taylor::FixedTaylor;
use tsit5::FixedTsit5;

/// How step sizes are chosen.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Steps {
    /// Chosen by the task: adaptive in a simulation; in a fit to recordings whose inputs change from sample to sample,
    /// equal steps per sample, as many as the error demands, if the model allows it. A fit then also chooses between
    /// the default method and an explicit one.
    #[default]
    Automatic,
    /// As long as the error allows.
    Adaptive,
    /// Equal steps between samples. The sample interval is the mean distance of the requested times or of the points at
    /// which inputs change, whichever is shorter; longer segments of the inputs get more steps, shorter ones get one.
    PerSample(PerSample),
}

/// Number of steps in a sample interval.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PerSample {
    /// As many as keep the local error of every step below the tolerance. A fit considers only the errors of the
    /// unknowns: its sensitivities are the derivatives of its computed solution, whatever the steps.
    Automatic,
    /// This number, whatever the error.
    Exactly(NonZeroU32),
}

/// Runs with equal steps per sample.
pub(super) fn run<S: SolvableSystem>(
    problem: &Problem<'_, S>,
    times: &[f64],
    options: &Options,
    per_sample: PerSample,
    directions: Option<SensitivityWorkspace<S>>,
    solution: &mut Solution,
) -> Result<(), IntegrateError> {
    let Some(&from) = times.first() else { return Ok(()) };
    verify(problem, options.method).map_err(IntegrateError::PerSample)?;
    solution.times.reserve(times.len());
    solution.y.reserve(solution.n * times.len());
    solution.s.reserve(solution.n * solution.n_s * times.len());
    let with_sensitivities = directions.is_some();
    let count = StepCount::new(per_sample, options.method.name);
    if !is_swept(options.method.kind) {
        return rosenbrock::run(problem, times, options, count, solution);
    }
    let mut simulation = Simulation::new(problem, options, from, directions);
    simulation.start(solution)?;
    if with_sensitivities {
        whole_run::<S, WithSensitivities<S>>(&simulation, times, options, count, solution)
    } else {
        whole_run::<S, UnknownsOnly<S>>(&simulation, times, options, count, solution)
    }
}

fn whole_run<S: SolvableSystem, C: CarriedState<S>>(
    simulation: &Simulation<'_, S>,
    times: &[f64],
    options: &Options,
    count: StepCount,
    solution: &mut Solution,
) -> Result<(), IntegrateError> {
    // For Taylor series the order is chosen first, then the number of steps.
    let kind = match options.method.kind {
        MethodKind::Taylor(None) if count.is_open() => {
            let lowest = choice::lowest_order::<S, C>(simulation, times);
            lowest.map_or(options.method.kind, |method| method.kind)
        }
        kind => kind,
    };
    let task = WholeRun::<S, C>::new(simulation, times, count, solution);
    dispatch(simulation.problem.system, kind, options.rtol, task)
}

/// Whether [`stream`](crate::model::stream) can run with these options.
pub fn can_stream<S: SolvableSystem>(problem: &Problem<'_, S>, options: &Options) -> bool {
    let is_fixed = matches!(options.steps, Steps::PerSample(PerSample::Exactly(_)));
    is_fixed && is_swept(options.method.kind) && verify(problem, options.method).is_ok()
}

/// Runs with sensitivities and a fixed number of steps per sample, and stores nothing: each requested time goes to the
/// sink as it is reached.
pub(crate) fn stream<S: SolvableSystem>(
    problem: &Problem<'_, S>,
    times: &[f64],
    options: &Options,
    sink: &mut impl SampleSink,
) -> Result<(), IntegrateError> {
    let Steps::PerSample(per_sample @ PerSample::Exactly(_)) = options.steps else {
        unreachable!("the number of steps is given");
    };
    request::verify(problem, times, options)?;
    let Some(&from) = times.first() else { return Ok(()) };
    let mut solution = Solution::empty(problem.system.signature(), 0);
    let directions = Some(SensitivityWorkspace::new(problem.system));
    let mut simulation = Simulation::new(problem, options, from, directions);
    simulation.start(&mut solution)?;
    let count = StepCount::new(per_sample, options.method.name);
    let task = StreamedRun::<S, WithSensitivities<S>, _>::new(&simulation, times, count, sink);
    dispatch(problem.system, options.method.kind, options.rtol, task)
}

/// Work to do with a method that makes steps of a given size.
trait FixedStepTask<S: SolvableSystem, C: CarriedState<S>> {
    type Done;

    fn run_with<M: FixedStep<S, C>>(self, method: M) -> Self::Done;
}

/// Does a task with the method of this kind; [`verify`] has checked that there is one.
#[inline(always)]
fn dispatch<S: SolvableSystem, C: CarriedState<S>, T: FixedStepTask<S, C>>(
    system: &S,
    kind: MethodKind,
    rtol: f64,
    task: T,
) -> T::Done {
    match kind {
        MethodKind::Explicit(RungeKuttaTableau {
            equal_steps: Some(EqualSteps::Tsit5), ..
        }) => task.run_with(FixedTsit5::new(system)),
        MethodKind::Taylor(asked) => {
            let n_s = if C::HAS_SENSITIVITIES { system.signature().directions.len() } else { 0 };
            task.run_with(FixedTaylor::new(system, order(asked, rtol), n_s))
        }
        _ => unreachable!("only methods that make equal steps get here"),
    }
}

/// Whether [`sweep`] is the loop for this kind of method.
fn is_swept(kind: MethodKind) -> bool {
    kind.traits().solves != EndEquations::Linear
}

/// A run with a given number of steps, into a sink.
struct StreamedRun<'a, S: SolvableSystem, C, K> {
    problem: Problem<'a, S>,
    times: &'a [f64],
    max_steps: usize,
    watched: Option<&'static RunMonitor>,
    count: StepCount,
    start: C,
    sink: &'a mut K,
}

impl<'a, S: SolvableSystem, C: CarriedState<S>, K: SampleSink> StreamedRun<'a, S, C, K> {
    fn new(
        simulation: &Simulation<'a, S>,
        times: &'a [f64],
        count: StepCount,
        sink: &'a mut K,
    ) -> Self {
        let Simulation { problem, max_steps, watched, .. } = *simulation;
        let (start, _) = started(simulation);
        Self { problem: *problem, times, max_steps, watched, count, start, sink }
    }
}

impl<S: SolvableSystem, C: CarriedState<S>, K: SampleSink> FixedStepTask<S, C>
    for StreamedRun<'_, S, C, K>
{
    type Done = Result<(), IntegrateError>;

    fn run_with<M: FixedStep<S, C>>(self, mut method: M) -> Self::Done {
        let Self { problem, times, max_steps, watched, mut count, mut start, sink } = self;
        let Problem { system, p, inputs, .. } = problem;
        let grid = StepGrid::new(sample_interval(inputs, times), count.n);
        let course = RunSchedule { system, p, inputs, times, grid, max_steps, watched };
        match sweep(&course, &mut method, &mut start, None, sink) {
            Ok(_) => Ok(()),
            Err(stopped) => stopped.into_error(max_steps, |t| count.refuse(t)),
        }
    }
}

/// A run to all requested times into a solution; if the number of steps is to be found, first over the beginning.
struct WholeRun<'a, S: SolvableSystem, C> {
    problem: Problem<'a, S>,
    times: &'a [f64],
    max_steps: usize,
    watched: Option<&'static RunMonitor>,
    count: StepCount,
    start: C,
    gauge: ErrorGauge<C>,
    solution: &'a mut Solution,
}

impl<'a, S: SolvableSystem, C: CarriedState<S>> WholeRun<'a, S, C> {
    fn new(
        simulation: &Simulation<'a, S>,
        times: &'a [f64],
        count: StepCount,
        solution: &'a mut Solution,
    ) -> Self {
        let (start, sizes) = started(simulation);
        let gauge = ErrorGauge::new(simulation.tolerances, sizes);
        let Simulation { problem, max_steps, watched, .. } = *simulation;
        Self { problem: *problem, times, max_steps, watched, count, start, gauge, solution }
    }
}

impl<S: SolvableSystem, C: CarriedState<S>> FixedStepTask<S, C> for WholeRun<'_, S, C> {
    type Done = Result<(), IntegrateError>;

    fn run_with<M: FixedStep<S, C>>(self, mut method: M) -> Self::Done {
        let Self { problem, times, max_steps, watched, mut count, start, mut gauge, solution } =
            self;
        let Problem { system, p, inputs, .. } = problem;
        let interval = sample_interval(inputs, times);
        let mut rows = if count.is_open() { head(times) } else { times.len() };
        loop {
            solution.forget_rows();
            solution.statistics.per_sample = count.n;
            gauge.reset();
            let gauged = if count.is_open() { Some(&mut gauge) } else { None };
            let grid = StepGrid::new(interval, count.n);
            let times_now = &times[..rows];
            let course =
                RunSchedule { system, p, inputs, times: times_now, grid, max_steps, watched };
            let mut now = start.clone();
            match sweep(&course, &mut method, &mut now, gauged, solution) {
                Ok(steps) => {
                    solution.statistics.steps = steps;
                    solution.statistics.evaluations = steps * M::EVALUATIONS;
                    solution.statistics.segments = course.segments();
                    if count.settle(gauge.measured(), method.exponent())? {
                        if rows == times.len() {
                            return Ok(());
                        }
                        rows = times.len();
                    }
                }
                Err(stopped) => stopped.into_error(max_steps, |t| count.refuse(t))?,
            }
        }
    }
}

/// The numbers that a run advances, at its start, and their sizes.
fn started<S: SolvableSystem, C: CarriedState<S>>(simulation: &Simulation<'_, S>) -> (C, C) {
    let system = simulation.problem.system;
    let (mut start, mut sizes) = (C::zeros(system), C::zeros(system));
    let directions = simulation.directions.as_ref();
    let s = directions.map_or(&[][..], |d| d.s.as_ref());
    let sizes_of_s = directions.map_or(&[][..], |d| d.sizes.as_ref());
    start.set(simulation.y.as_ref(), s);
    sizes.set(simulation.sizes.as_ref(), sizes_of_s);
    (start, sizes)
}

impl SampleSink for Solution {
    #[inline(always)]
    fn take(&mut self, t: f64, _segment: Segment<'_>, y: &[f64], s: &[f64]) {
        self.times.push(t);
        self.y.extend_from_slice(y);
        self.s.extend_from_slice(s);
    }
}

/// A sink that stores nothing.
struct DiscardingSink;

impl SampleSink for DiscardingSink {
    #[inline(always)]
    fn take(&mut self, _t: f64, _segment: Segment<'_>, _y: &[f64], _s: &[f64]) {}
}
