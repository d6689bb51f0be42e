//! Equal steps per sample of recorded inputs, their number chosen once.
//!
//! Where inputs change every second, that is where a method of order five has to step anyway, and
//! looking for a better step costs more than making it. Here nothing is looked for: every segment of
//! the inputs gets so many equal steps, none is rejected, and a run is a smooth function of parameters
//! and start values whose derivatives are its sensitivities. In a fit, cost and gradient of every trial
//! belong to the same steps.
//!
//! ```text
//!   one step per sample → largest local error e of the whole run, in units of the tolerance
//!   n ← n e^(1/k) until e ≤ 1                  e ~ h^k
//! ```
//!
//! Models with modes, conditions on time or delays need steps that end elsewhere ([`error::refusal`]).
//! Non-stiff ones are run by [`sweep`], which is written once for the unknowns alone and for unknowns
//! and sensitivities ([`carried`]) and for every method that makes steps of given size
//! ([`fixed_step`]); those with algebraic unknowns by the general loop's steps ([`rosenbrock`]).

// Lengths are constants where storage has a fixed size, and only once inlined there.
#![allow(clippy::inline_always)]

mod carried;
mod error;
mod fixed_step;
mod grid;
mod rosenbrock;
mod sweep;
mod tsit5;

use std::num::NonZeroU32;

use super::catalogue::MethodKind;
use super::stepper::Directions;
use super::tableaux::TSIT5;
use super::{Simulation, larger};
use crate::error::IntegrateError;
use crate::linalg::norm::Tolerances;
use crate::problem::{Options, Problem};
use crate::signal::Segment;
use crate::solution::Solution;
use crate::system::System;
use carried::{Carried, Unknowns, WithSensitivities};
pub use error::PerSampleError;
use error::{makes_equal_steps, refusal};
use fixed_step::{Equations, FixedStep};
use grid::{Grid, sample_interval};
use sweep::{Course, Gauge, Sink, Stopped, sweep};
use tsit5::Tsit5;

/// How long steps are.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Steps {
    /// As the task wants them: in a simulation as long as the error allows; in a fit to recordings with
    /// inputs that change from sample to sample, as many per sample as the error demands, by a method
    /// that suits the model, where the model allows it.
    #[default]
    Automatic,
    /// As long as the error allows.
    Adaptive,
    /// Equal steps between samples. A sample interval is the mean distance of the asked times or of the
    /// points at which inputs change, whichever is the shorter; longer segments of the inputs get more
    /// steps, shorter ones get one.
    PerSample(PerSample),
}

/// How many steps a sample interval gets.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PerSample {
    /// As many as keep the local error of every step below the tolerance.
    Automatic,
    /// So many, whatever the error.
    Exactly(NonZeroU32),
}

/// More steps per sample are not tried.
const MOST: u32 = 64;

/// Runs with equal steps per sample.
pub(super) fn run<S: System>(
    problem: &Problem<'_, S>,
    times: &[f64],
    options: &Options,
    per_sample: PerSample,
    directions: Option<Directions<S>>,
    solution: &mut Solution,
) -> Result<(), IntegrateError> {
    let Some(&from) = times.first() else { return Ok(()) };
    if let Some(reason) = refusal(problem) {
        return Err(IntegrateError::PerSample(reason));
    }
    if !makes_equal_steps(options.method) {
        let method = options.method.name;
        return Err(IntegrateError::PerSample(PerSampleError::Method { method }));
    }
    solution.times.reserve(times.len());
    solution.y.reserve(solution.n * times.len());
    solution.s.reserve(solution.n * solution.n_s * times.len());
    let with_sensitivities = directions.is_some();
    let mut simulation = Simulation::new(problem, options, from, directions);
    match options.method.kind {
        MethodKind::Explicit(tableau) if std::ptr::eq(tableau, &raw const TSIT5) => {
            simulation.start(solution)?;
            if !simulation.algebraic.is_empty() {
                return Err(simulation.unsuited_method());
            }
            if with_sensitivities {
                let method = Tsit5::<S, WithSensitivities<S>>::new(problem.system);
                Run { simulation, times, per_sample, method }.to_the_end(solution)
            } else {
                let method = Tsit5::<S, Unknowns<S>>::new(problem.system);
                Run { simulation, times, per_sample, method }.to_the_end(solution)
            }
        }
        _ => simulation.equal_steps(times, per_sample, options, solution),
    }
}

/// A run that has started, by one method.
struct Run<'a, S: System, M> {
    simulation: Simulation<'a, S>,
    times: &'a [f64],
    per_sample: PerSample,
    method: M,
}

impl<S: System, M> Run<'_, S, M> {
    fn to_the_end<C: Carried<S>>(mut self, solution: &mut Solution) -> Result<(), IntegrateError>
    where
        M: FixedStep<S, C>,
    {
        let Simulation { problem, tolerances, method, max_steps, .. } = self.simulation;
        let Problem { system, p, inputs, .. } = *problem;
        let (start, sizes): (C, C) = started(&self.simulation);
        let interval = sample_interval(inputs, self.times);
        let mut count = Count::new(self.per_sample, method.name);
        loop {
            solution.forget_rows();
            let mut gauge = Gauge::new(tolerances, &sizes);
            let gauged = if count.is_open() { Some(&mut gauge) } else { None };
            let grid = Grid::new(interval, count.n);
            let equations = Equations { system, p };
            let course = Course { equations, inputs, times: self.times, grid, max_steps };
            let mut now = start.clone();
            let outcome = sweep(&course, &mut self.method, &mut now, gauged, solution);
            solution.statistics.per_sample = count.n;
            let steps = match outcome {
                Ok(steps) => steps,
                Err(Stopped::TooMany { t }) => {
                    return Err(IntegrateError::TooManySteps { t, steps: max_steps });
                }
                Err(Stopped::NotFinite { t }) => {
                    count.refuse(t)?;
                    continue;
                }
            };
            solution.statistics.steps = steps;
            solution.statistics.evaluations = steps * M::EVALUATIONS;
            if count.settle(gauge.largest, gauge.stiffness, M::EXPONENT)? {
                return Ok(());
            }
        }
    }
}

/// What a run carries on where it starts, and the sizes of that.
fn started<S: System, C: Carried<S>>(simulation: &Simulation<'_, S>) -> (C, C) {
    let system = simulation.problem.system;
    let (mut start, mut sizes) = (C::zeros(system), C::zeros(system));
    let directions = simulation.directions.as_ref();
    let s = directions.map_or(&[][..], |d| d.s.as_ref());
    let sizes_of_s = directions.map_or(&[][..], |d| d.sizes.as_ref());
    start.set(simulation.y.as_ref(), s);
    sizes.set(simulation.sizes.as_ref(), sizes_of_s);
    (start, sizes)
}

/// The number of steps per sample while it is sought.
struct Count {
    n: u32,
    wanted: PerSample,
    method: &'static str,
}

impl Count {
    fn new(wanted: PerSample, method: &'static str) -> Self {
        let n = match wanted {
            PerSample::Automatic => 1,
            PerSample::Exactly(n) => n.get(),
        };
        Self { n, wanted, method }
    }

    fn is_open(&self) -> bool {
        self.wanted == PerSample::Automatic
    }

    /// Takes note of a run that went beyond all numbers from `t` on.
    fn refuse(&mut self, t: f64) -> Result<(), IntegrateError> {
        if self.is_open() && self.n < MOST {
            self.n = (2 * self.n).min(MOST);
            return Ok(());
        }
        let (per_sample, method) = (self.n, self.method);
        Err(IntegrateError::PerSample(PerSampleError::NotFinite { t, per_sample, method }))
    }

    /// Takes note of the errors of a whole run; whether they are small enough.
    fn settle(
        &mut self,
        largest: f64,
        stiffness: f64,
        exponent: u32,
    ) -> Result<bool, IntegrateError> {
        if !self.is_open() {
            return Ok(true);
        }
        let part = larger(largest.powf(0.5 / f64::from(exponent)), stiffness);
        if part <= 1.0 {
            return Ok(true);
        }
        if self.n == MOST {
            return Err(IntegrateError::PerSample(PerSampleError::Inaccurate {
                per_sample: self.n,
                method: self.method,
                error: largest.sqrt(),
            }));
        }
        // NaN makes it the most.
        let n = (f64::from(self.n) * part).ceil().min(f64::from(MOST)) as u32;
        self.n = n.max(self.n + 1);
        Ok(false)
    }
}

impl<C> Gauge<C> {
    fn new<S: System>(tolerances: Tolerances, sizes: &C) -> Self
    where
        C: Carried<S>,
    {
        let (sizes, error) = (sizes.clone(), sizes.clone());
        Self { tolerances, sizes, error, largest: 0.0, stiffness: 0.0 }
    }
}

impl<S: System, C: Carried<S>> Sink<S, C> for Solution {
    #[inline(always)]
    fn take(&mut self, t: f64, _segment: Segment<'_>, x: &C) {
        self.times.push(t);
        self.y.extend_from_slice(x.y());
        self.s.extend_from_slice(x.s());
    }
}
