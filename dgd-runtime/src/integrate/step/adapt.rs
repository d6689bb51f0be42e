//! Acts on the verdict on a step: chooses the size of the next one, or the error if there is none.

use crate::error::IntegrateError;
use crate::integrate::controller::Controller;
use crate::integrate::methods::family::{ErrorScale, JudgedStep};
use crate::integrate::methods::stepper::StepFailure;
use crate::integrate::simulation::Simulation;
use crate::integrate::step::judge::TriedStep;
use crate::solution::Solution;
use crate::solved::SolvableSystem;

/// Distance, as a fraction of the span, before the point of no continuation at which a run may end.
const NEAR: f64 = 1e-9;

/// An error this large, in units of the tolerance, says little about the right step size.
const FAR_OFF: f64 = 10.0;

impl<S: SolvableSystem> Simulation<'_, S> {
    /// Chooses the next step after an accepted one.
    #[inline]
    pub(super) fn adapt_to_acceptance(&mut self, tried: &TriedStep, controller: &mut Controller) {
        let scale = ErrorScale {
            tolerances: self.tolerances,
            y: self.y.as_ref(),
            sizes: self.sizes.as_ref(),
            directions: self.directions.as_ref(),
        };
        self.stepper.adapt_to_acceptance(tried.judged(), &scale, controller);
    }

    /// Chooses the next step after a rejected one. Returns whether (t, y) itself may be the cause.
    fn adapt_to_rejection(&mut self, tried: &TriedStep, controller: &mut Controller) -> bool {
        let is_suspect = self.stepper.adapt_to_rejection(tried.judged(), controller);
        let is_far_off = tried.error.is_finite() && tried.error > FAR_OFF * FAR_OFF;
        if is_far_off && self.stepper.traits.wants_all_derivatives() {
            controller.limit(tried.h, self.transient_step());
        }
        is_suspect
    }

    /// Retries from (t, y) with another step, if possible.
    pub(super) fn reject(
        &mut self,
        tried: &TriedStep,
        controller: &mut Controller,
        times: &[f64],
        solution: &mut Solution,
    ) -> Result<(), IntegrateError> {
        solution.statistics.rejected += 1;
        let TriedStep { h, remaining, error, .. } = *tried;
        let is_suspect = self.adapt_to_rejection(tried, controller);
        // Below this a step does not advance t reliably, and stages are indistinguishable.
        let least = 4.0 * f64::EPSILON * self.t.abs().max(f64::EPSILON * self.span);
        if controller.h > least {
            if is_suspect && let Some(h) = self.after_rejection(h, remaining, times, solution) {
                controller.h = h;
                // The step leads off a singular point, where sensitivities ended.
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
        Err(self.no_step_is_small_enough(tried))
    }

    /// Continues with shorter steps up to the point where a delay becomes negative, and ends there.
    pub(super) fn step_less_far(
        &mut self,
        tried: &TriedStep,
        error: IntegrateError,
        controller: &mut Controller,
        solution: &mut Solution,
    ) -> Result<(), IntegrateError> {
        if tried.h <= NEAR * self.span {
            return Err(error);
        }
        solution.statistics.rejected += 1;
        let judged = JudgedStep { h: tried.h, error: f64::NAN };
        self.stepper.adapt_to_rejection(judged, controller);
        Ok(())
    }

    fn no_step_is_small_enough(&mut self, tried: &TriedStep) -> IntegrateError {
        let TriedStep { h, error, outcome, .. } = *tried;
        match outcome {
            Err(StepFailure::Singular { row }) => self.singular_iteration(h, row),
            Err(StepFailure::NotConverged { unknown }) => self.newton_diverged(h, unknown),
            Err(StepFailure::NotFinite { t, what }) => self.evaluation_not_finite(t, what),
            Err(StepFailure::Unsettled) => self.step_size_too_small(h),
            Ok(()) if error.is_finite() => self.step_size_too_small(h),
            Ok(()) => self.not_finite(h),
        }
    }
}
