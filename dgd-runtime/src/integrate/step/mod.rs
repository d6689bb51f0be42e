//! One step: tried, judged, and what follows from the verdict.

mod diagnose;
mod initial_step;
mod prepare;

use crate::error::IntegrateError;
use crate::integrate::controller::Controller;
use crate::integrate::methods::catalogue::MethodKind;
use crate::integrate::methods::stepper::{Failed, Trial};
use crate::integrate::simulation::{Simulation, Stop, Variables, base};
use crate::linalg::norm::{larger, largest_block};
use crate::solution::Solution;
use crate::system::System;

/// So far before the point at which it can go on no more a run may end, in its span.
const NEAR: f64 = 1e-9;

/// An error this large, in units of the tolerance, says little of the step that would have been right.
const FAR_OFF: f64 = 10.0;

impl<S: System> Simulation<'_, S> {
    /// Tries one step, and records what was asked for if it is accepted.
    #[inline]
    pub(in crate::integrate) fn step(
        &mut self,
        controller: &mut Controller,
        times: &[f64],
        end: f64,
        solution: &mut Solution,
    ) -> Result<(), IntegrateError> {
        let tried = solution.statistics.steps + solution.statistics.rejected;
        if tried >= self.max_steps {
            return Err(self.too_many_steps(tried));
        }
        if !self.stepper.solves_algebraic() && !self.algebraic.is_empty() {
            return Err(self.unsuited_method());
        }
        if self.stepper.wants_slopes() {
            self.begin_stepper(controller, solution);
        } else if !self.linearized && self.stepper.wants_jacobian() {
            self.linearize_for_step(solution);
        }

        let remaining = end - self.t;
        if !self.linearized && self.stepper.wants_series() {
            self.expand(controller.h.min(remaining), solution);
        }
        let h = controller.propose(remaining).min(self.reach());
        let outcome = self.try_step(h, Variables::All, solution);
        let error = match outcome {
            Ok(()) => self.error(),
            Err(_) => f64::NAN,
        };
        let error = if error > 1.0 { self.error_beyond_rounding(h, error) } else { error };
        let t_new = if h < remaining { self.t + h } else { end };
        // NaN compares false: what could not be evaluated is not accepted.
        if error <= 1.0 {
            if let Some(error) = self.reads_ahead(h) {
                return self.step_less_far(h, error, controller, solution);
            }
            if self.reaches_mark(t_new) {
                return Ok(());
            }
            if S::FEATURES.events
                && self.discrete.has_transitions()
                && let Some(part) = self.watch(h, t_new)
            {
                return self.step_to_threshold(controller, (h, part), t_new, times, solution);
            }
            let stop = if t_new == self.stop() { Stop::Change } else { Stop::None };
            self.accept(t_new, stop, times, solution);
            if let MethodKind::Bdf(most) = self.method.kind {
                self.choose_order(h, error, most, controller);
            } else {
                controller.accept(h, error);
            }
            return self.reselect_states(solution);
        }

        if error.is_finite() && self.step_to_corner((h, t_new), times, solution)? {
            return Ok(());
        }
        solution.statistics.rejected += 1;
        let had_memory = self.stepper.is_multistep() && !self.stepper.is_at_beginning();
        if self.stepper.is_multistep() {
            self.reject_multistep(h, error, controller);
        } else if error.is_finite() {
            controller.reject(h, error);
            if error > FAR_OFF * FAR_OFF {
                controller.limit(h, self.transient_step());
            }
        } else {
            controller.abandon(h);
        }
        // Below this a step does not move t reliably, and stages cannot be told apart.
        let least = 4.0 * f64::EPSILON * self.t.abs().max(f64::EPSILON * self.span);
        if controller.h > least {
            if had_memory || (self.stepper.is_multistep() && error.is_finite()) {
                return Ok(());
            }
            if let Some(h) = self.after_rejection(h, remaining, times, solution) {
                controller.h = h;
                // It leads off a singular point, and sensitivities have ended there.
                self.begin_sample();
                self.settle(solution)?;
            }
            return Ok(());
        }
        if error.is_finite()
            && let Some(row) = self.unresolved_equation(h)
        {
            self.end_sensitivities(self.t, row, solution);
            return Ok(());
        }
        Err(match outcome {
            Err(Failed::Singular { row }) => self.singular_iteration(h, row),
            Err(Failed::NotConverged { unknown }) => self.newton_diverged(h, unknown),
            Err(Failed::NotFinite { t, spoilt }) => self.spoilt(t, spoilt),
            Err(Failed::Unsettled) => self.step_size_too_small(h),
            Ok(()) if error.is_finite() => self.step_size_too_small(h),
            Ok(()) => self.not_finite(h),
        })
    }

    /// Goes on with shorter steps up to where a delay falls below zero, and ends there.
    pub(in crate::integrate) fn step_less_far(
        &mut self,
        h: f64,
        error: IntegrateError,
        controller: &mut Controller,
        solution: &mut Solution,
    ) -> Result<(), IntegrateError> {
        if h <= NEAR * self.span {
            return Err(error);
        }
        solution.statistics.rejected += 1;
        if self.stepper.is_multistep() {
            self.reject_multistep(h, f64::NAN, controller);
        } else {
            controller.abandon(h);
        }
        Ok(())
    }

    /// Tries a step of size h; one that reads itself is made consistent with itself.
    #[inline]
    pub(in crate::integrate) fn try_step(
        &mut self,
        h: f64,
        variables: Variables,
        solution: &mut Solution,
    ) -> Result<(), Failed> {
        self.forget_trial();
        self.attempt(h, variables, solution)?;
        self.close_step(h, variables, solution)
    }

    /// Makes one attempt at a step of size h.
    #[inline]
    pub(in crate::integrate) fn attempt(
        &mut self,
        h: f64,
        variables: Variables,
        solution: &mut Solution,
    ) -> Result<(), Failed> {
        let base = base(self.problem, &self.algebraic, &self.discrete, self.t);
        let sizes = self.sizes.as_ref();
        let trial = Trial { base, y: &self.y, h, sizes, tolerances: self.tolerances };
        let directions = self.directions.as_mut().filter(|_| variables == Variables::All);
        let statistics = &mut solution.statistics;
        let outcome = self.stepper.attempt(trial, &mut self.drive, directions, statistics);
        self.linearized &= !std::mem::take(&mut self.stepper.moved);
        outcome
    }

    /// Square of the local error of the step tried last, in units of the tolerance.
    #[inline]
    pub(in crate::integrate) fn error(&self) -> f64 {
        let (y, y_new) = (self.y.as_ref(), self.stepper.y_new.as_ref());
        let e = self.stepper.local_error();
        let error = self.tolerances.mean_square(e, y, y_new, self.sizes.as_ref());
        larger(error, self.sensitivity_error())
    }

    /// Square of the local error of the sensitivities of the step tried last.
    #[inline]
    pub(in crate::integrate) fn sensitivity_error(&self) -> f64 {
        let Some(d) = &self.directions else {
            return 0.0;
        };
        let e = self.stepper.sensitivity_error(d);
        let (s, s_new) = (d.s.as_ref(), d.s_new.as_ref());
        let n = self.y.as_ref().len().max(1);
        largest_block(self.tolerances, n, e, s, s_new, d.sizes.as_ref())
    }

    /// Records the asked times of an accepted step, and moves on to its end.
    #[inline]
    pub(in crate::integrate) fn accept(
        &mut self,
        t_new: f64,
        stop: Stop,
        times: &[f64],
        solution: &mut Solution,
    ) {
        solution.statistics.steps += 1;
        self.linearized = false;
        self.corrected = false;
        if !self.algebraic.is_empty() && self.directions.is_some() {
            self.look_for_singular_point(t_new, solution);
        }
        self.remember_step(t_new);
        self.record_step(t_new, stop, times, solution);
        if let MethodKind::Explicit(tableau) = self.method.kind {
            self.stepper.note_stiffness(tableau, t_new - self.t);
        }
        self.stepper.advance(&self.algebraic.mass, self.directions.as_mut());
        std::mem::swap(&mut self.y, &mut self.stepper.y_new);
        if let Some(d) = &mut self.directions {
            std::mem::swap(&mut d.s, &mut d.s_new);
        }
        self.t = t_new;
    }
}
