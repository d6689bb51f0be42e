//! Equal steps per sample for stiff models and those with algebraic unknowns, by the general loop's
//! own steps: what is consistent after a jump, and where sensitivities end, is the same.

use super::grid::{Grid, sample_interval};
use super::{Count, PerSample, PerSampleError};
use crate::error::IntegrateError;
use crate::integrate::stepper::Failed;
use crate::integrate::{Simulation, Stop, Variables, larger};
use crate::problem::Options;
use crate::solution::Solution;
use crate::system::System;

impl<S: System> Simulation<'_, S> {
    /// Runs to all `times`; a number of steps that turns out to be too small is made larger, and the
    /// run made again.
    pub(super) fn equal_steps(
        mut self,
        times: &[f64],
        per_sample: PerSample,
        options: &Options,
        solution: &mut Solution,
    ) -> Result<(), IntegrateError> {
        let (from, until) = (times[0], times[times.len() - 1]);
        let interval = sample_interval(self.problem.inputs, times);
        let exponent = self.method.kind.estimate_order(options.rtol) + 1;
        let mut count = Count::new(per_sample, self.method.name);
        loop {
            solution.forget_rows();
            solution.statistics.per_sample = count.n;
            let grid = Grid::new(interval, count.n);
            match self.run_over(times, until, grid, solution) {
                Ok(largest) => {
                    if count.settle(largest, 0.0, exponent)? {
                        return Ok(());
                    }
                }
                Err(IntegrateError::PerSample(PerSampleError::NotFinite { t, .. })) => {
                    count.refuse(t)?;
                }
                Err(error) => return Err(error),
            }
            let directions = self.directions.take();
            let directions = directions.or_else(|| {
                (solution.n_s > 0).then(|| super::Directions::new(self.problem.system))
            });
            self = Simulation::new(self.problem, options, from, directions);
        }
    }

    /// One run over the grid; gives the square of its largest local error.
    fn run_over(
        &mut self,
        times: &[f64],
        until: f64,
        grid: Grid,
        solution: &mut Solution,
    ) -> Result<f64, IntegrateError> {
        self.start(solution)?;
        self.record_now(times, solution);
        self.span = until - self.t;
        let mut largest = 0.0;
        while self.t < until {
            let (begin, end) = (self.t, self.stop().min(until));
            let count = grid.steps(end - begin);
            if solution.statistics.steps + count > self.max_steps {
                return Err(self.too_many_steps(self.max_steps));
            }
            let h = (end - begin) / count as f64;
            for k in 1..=count {
                let t_new = if k == count { end } else { begin + k as f64 * h };
                self.linearize_for_step(solution);
                let outcome = self.try_step(h, Variables::All, solution);
                if outcome != Ok(()) || !self.is_finite() {
                    return Err(self.too_long(h, outcome));
                }
                largest = larger(self.error(), largest);
                let stop = if t_new == self.stop() { Stop::Change } else { Stop::None };
                self.accept(t_new, stop, times, solution);
            }
            if self.t == self.segment_end && solution.times.len() < times.len() {
                self.enter_next_segment(solution)?;
                self.record_now(times, solution);
            }
        }
        Ok(largest)
    }

    /// Whether the step tried last leads to numbers.
    fn is_finite(&self) -> bool {
        let finite = |values: &[f64]| values.iter().all(|value| value.is_finite());
        finite(self.stepper.y_new.as_ref())
            && self.directions.as_ref().is_none_or(|d| finite(d.s_new.as_ref()))
    }

    fn too_long(&self, h: f64, outcome: Result<(), Failed>) -> IntegrateError {
        match outcome {
            Err(Failed::Singular { row }) => self.singular_iteration(h, row),
            _ => IntegrateError::PerSample(PerSampleError::NotFinite {
                t: self.t,
                per_sample: 1,
                method: self.method.name,
            }),
        }
    }
}
