//! Equal steps per sample for stiff models and those with algebraic unknowns, made of the general loop's steps: it
//! treats consistency after jumps and the end of sensitivities in the same way.

use super::choice::{RunErrors, head};
use super::count::StepCount;
use super::error::PerSampleError;
use super::grid::{StepGrid, sample_interval};
use crate::error::IntegrateError;
use crate::integrate::methods::stepper::{SensitivityWorkspace, StepFailure};
use crate::integrate::simulation::{Simulation, StepOutcome, StepVariables};
use crate::linalg::norm::larger;
use crate::problem::{Options, Problem};
use crate::solution::Solution;
use crate::solved::SolvableSystem;

/// Runs to all `times`; if the number of steps turns out to be too small, increases it and repeats the run.
pub(super) fn run<S: SolvableSystem>(
    problem: &Problem<'_, S>,
    times: &[f64],
    options: &Options,
    mut count: StepCount,
    solution: &mut Solution,
) -> Result<(), IntegrateError> {
    let interval = sample_interval(problem.inputs, times);
    let exponent = options.method.kind.estimate_order(options.rtol) + 1;
    let mut rows = if count.is_open() { head(times) } else { times.len() };
    loop {
        solution.forget_rows();
        let directions = (solution.n_s > 0).then(|| SensitivityWorkspace::new(problem.system));
        let mut simulation = Simulation::new(problem, options, times[0], directions);
        let grid = StepGrid::new(interval, count.n);
        match measure(&mut simulation, &times[..rows], grid, solution) {
            Ok(measured) => {
                if count.settle(measured, exponent)? {
                    if rows == times.len() {
                        return Ok(());
                    }
                    rows = times.len();
                }
            }
            Err(IntegrateError::PerSample(PerSampleError::NotFinite { t, .. })) => {
                count.refuse(t)?;
            }
            Err(error) => return Err(error),
        }
    }
}

/// One run over the grid, which also measures errors.
pub(super) fn measure<S: SolvableSystem>(
    simulation: &mut Simulation<'_, S>,
    times: &[f64],
    grid: StepGrid,
    solution: &mut Solution,
) -> Result<RunErrors, IntegrateError> {
    solution.statistics.per_sample = grid.per_sample();
    let outcome = simulation.step_equally(times, grid, solution);
    for stretch in &mut solution.undefined {
        stretch.until = simulation.t;
    }
    Ok(RunErrors { largest: outcome?, stiffness: 0.0 })
}

impl<S: SolvableSystem> Simulation<'_, S> {
    /// One run over the grid; returns the square of its largest local error.
    fn step_equally(
        &mut self,
        times: &[f64],
        grid: StepGrid,
        solution: &mut Solution,
    ) -> Result<f64, IntegrateError> {
        let until = times[times.len() - 1];
        self.span = until - self.t;
        self.start(solution)?;
        self.record_now(times, solution);
        let mut largest = 0.0;
        while self.t < until {
            let (begin, end) = (self.t, self.stop().min(until));
            let count = grid.steps(end - begin);
            if solution.statistics.steps + count > self.max_steps {
                return Err(self.too_many_steps(self.max_steps));
            }
            let h = (end - begin) / count as f64;
            for k in 1..=count {
                if let Some(watched) = self.watched {
                    watched.passes(self.t)?;
                }
                let t_new = if k == count { end } else { begin + k as f64 * h };
                self.linearize_for_step(solution);
                let outcome = self.try_step(h, StepVariables::All, solution);
                if outcome != Ok(()) || !self.is_finite() {
                    return Err(self.too_long(h, grid.per_sample(), outcome));
                }
                largest = larger(self.error(), largest);
                let stop =
                    if t_new == self.stop() { StepOutcome::Change } else { StepOutcome::None };
                self.accept(t_new, stop, times, solution);
            }
            if self.t == self.segment_end && solution.times.len() < times.len() {
                self.enter_next_segment(solution)?;
                self.record_now(times, solution);
            }
        }
        Ok(largest)
    }

    /// Whether the last tried step gives finite values.
    fn is_finite(&self) -> bool {
        let finite = |values: &[f64]| values.iter().all(|value| value.is_finite());
        finite(self.stepper.y_new.as_ref())
            && self.directions.as_ref().is_none_or(|d| finite(d.s_new.as_ref()))
    }

    fn too_long(
        &self,
        h: f64,
        per_sample: u32,
        outcome: Result<(), StepFailure>,
    ) -> IntegrateError {
        match outcome {
            Err(StepFailure::Singular { row }) => self.singular_iteration(h, row),
            _ => IntegrateError::PerSample(PerSampleError::NotFinite {
                t: self.t,
                per_sample,
                method: self.method.name,
            }),
        }
    }
}
