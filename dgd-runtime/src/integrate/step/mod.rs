//! One step: prepares it, tries it, judges it, and acts on the verdict.

mod adapt;
mod diagnose;
mod initial_step;
mod judge;
mod prepare;

use crate::error::IntegrateError;
use crate::integrate::controller::Controller;
use crate::integrate::methods::stepper::{StepFailure, StepTrial};
use crate::integrate::simulation::{Simulation, StepOutcome, StepVariables, base};
use crate::linalg::sums;
use crate::solution::Solution;
use crate::solved::SolvableSystem;
use judge::StepVerdict;

impl<S: SolvableSystem> Simulation<'_, S> {
    /// Tries one step towards `end`, and records requested values if it is accepted.
    #[inline]
    pub(in crate::integrate) fn step(
        &mut self,
        controller: &mut Controller,
        times: &[f64],
        end: f64,
        solution: &mut Solution,
    ) -> Result<(), IntegrateError> {
        self.begin_sums();
        let h = self.prepare(controller, end, solution)?;
        let outcome = self.try_step(h, StepVariables::All, solution);
        let tried = self.tried(h, end, outcome);
        match self.judge(&tried) {
            StepVerdict::Accept => {
                self.accept(tried.t_new, self.stop_at(tried.t_new), times, solution);
                self.adapt_to_acceptance(&tried, controller);
                self.reselect_states(solution)
            }
            StepVerdict::Threshold { part } => {
                self.step_to_threshold(controller, h, part, tried.t_new, times, solution)
            }
            StepVerdict::Unresolved(error) => Err(*error),
            // The next step ends there.
            StepVerdict::Mark => Ok(()),
            StepVerdict::ReadsAhead(error) => {
                self.step_less_far(&tried, *error, controller, solution)
            }
            StepVerdict::Corner => {
                if self.step_to_corner(h, tried.t_new, times, solution)? {
                    return Ok(());
                }
                self.reject(&tried, controller, times, solution)
            }
            StepVerdict::Reject | StepVerdict::Fail => {
                self.reject(&tried, controller, times, solution)
            }
        }
    }

    /// Tries a step of size h; one that reads itself is made consistent.
    #[inline]
    pub(in crate::integrate) fn try_step(
        &mut self,
        h: f64,
        variables: StepVariables,
        solution: &mut Solution,
    ) -> Result<(), StepFailure> {
        self.forget_trial();
        self.attempt(h, variables, solution)?;
        self.close_step(h, variables, solution)
    }

    /// Makes one attempt at a step of size h.
    #[inline]
    pub(in crate::integrate) fn attempt(
        &mut self,
        h: f64,
        variables: StepVariables,
        solution: &mut Solution,
    ) -> Result<(), StepFailure> {
        let base = base(self.problem, &self.algebraic, &self.discrete, self.t);
        let sizes = self.sizes.as_ref();
        let trial = StepTrial { base, y: &self.y, h, sizes, tolerances: self.tolerances };
        let directions = self.directions.as_mut().filter(|_| variables == StepVariables::All);
        let statistics = &mut solution.statistics;
        let outcome = self.stepper.attempt(trial, &mut self.drive, directions, statistics);
        self.linearized &= !std::mem::take(&mut self.stepper.moved);
        outcome
    }

    /// Takes the values of conserved sums.
    #[inline]
    fn begin_sums(&mut self) {
        if S::FEATURES.conserved && !self.stepper.sums.is_empty() {
            let s = self.directions.as_ref().map(|d| d.s.as_ref());
            sums::begin(&mut self.stepper.sums, self.y.as_ref(), s);
        }
    }

    /// Puts the end of the last tried step onto conserved sums.
    #[inline]
    fn close_sums(&mut self) {
        if S::FEATURES.conserved && !self.stepper.sums.is_empty() {
            let s = self.directions.as_mut().map(|d| d.s_new.as_mut());
            sums::close(&self.stepper.sums, self.stepper.y_new.as_mut(), s);
        }
    }

    /// Whether inputs or modes change at the end of a step.
    #[inline]
    fn stop_at(&self, t_new: f64) -> StepOutcome {
        if t_new == self.stop() { StepOutcome::Change } else { StepOutcome::None }
    }

    /// Records the requested times of an accepted step, and moves to its end.
    #[inline]
    pub(in crate::integrate) fn accept(
        &mut self,
        t_new: f64,
        stop: StepOutcome,
        times: &[f64],
        solution: &mut Solution,
    ) {
        solution.statistics.steps += 1;
        self.linearized = false;
        self.corrected = false;
        if !self.algebraic.is_empty() && self.directions.is_some() {
            self.look_for_singular_point(t_new, solution);
        }
        self.close_sums();
        self.remember_step(t_new);
        self.record_step(t_new, stop, times, solution);
        let h = t_new - self.t;
        self.stepper.advance(h, &self.algebraic.mass, self.directions.as_mut());
        std::mem::swap(&mut self.y, &mut self.stepper.y_new);
        if let Some(d) = &mut self.directions {
            std::mem::swap(&mut d.s, &mut d.s_new);
        }
        self.t = t_new;
    }
}
