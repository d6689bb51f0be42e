//! Judges a step that has been tried.

use crate::error::IntegrateError;
use crate::integrate::methods::family::JudgedStep;
use crate::integrate::methods::stepper::StepFailure;
use crate::integrate::simulation::Simulation;
use crate::linalg::norm::{larger, largest_block};
use crate::solved::SolvableSystem;

/// A step that has been tried.
pub(super) struct TriedStep {
    /// Its size, and its end.
    pub(super) h: f64,
    pub(super) t_new: f64,
    /// The distance to the time at which steps must end.
    pub(super) remaining: f64,
    /// The square of its error in units of the tolerance; NaN if it could not be evaluated.
    pub(super) error: f64,
    pub(super) outcome: Result<(), StepFailure>,
}

impl TriedStep {
    pub(super) fn judged(&self) -> JudgedStep {
        JudgedStep { h: self.h, error: self.error }
    }
}

/// The decision about a step.
pub(super) enum StepVerdict {
    /// Its error is within the tolerance.
    Accept,
    /// Its error is within the tolerance, and at this fraction of it a transition is due or can be armed.
    Threshold { part: f64 },
    /// Its error is within the tolerance, but a condition may change infinitely often right after its start.
    Unresolved(Box<IntegrateError>),
    /// Its error is within the tolerance, but a variable delay reaches a mark before its end.
    Mark,
    /// A variable delay becomes negative.
    ReadsAhead(Box<IntegrateError>),
    /// Its error is too large, and it passes a corner at which it may be cut.
    Corner,
    /// Its error is too large.
    Reject,
    /// It could not be evaluated.
    Fail,
}

impl<S: SolvableSystem> Simulation<'_, S> {
    /// Computes the error of the last tried step, of size h towards `end`.
    #[inline]
    pub(super) fn tried(
        &mut self,
        h: f64,
        end: f64,
        outcome: Result<(), StepFailure>,
    ) -> TriedStep {
        let error = match outcome {
            Ok(()) => self.error(),
            Err(_) => f64::NAN,
        };
        let mut error = if error > 1.0 { self.error_beyond_rounding(h, error) } else { error };
        if S::FEATURES.events && error <= 1.0 && self.discrete.has_transitions() {
            self.choose_watching();
            error = larger(error, self.error_within(h));
        }
        let remaining = end - self.t;
        let t_new = if h < remaining { self.t + h } else { end };
        TriedStep { h, t_new, remaining, error, outcome }
    }

    /// Judges the last tried step.
    #[inline]
    pub(super) fn judge(&mut self, tried: &TriedStep) -> StepVerdict {
        let TriedStep { h, t_new, error, .. } = *tried;
        // NaN compares false: a step that could not be evaluated is not accepted.
        if error <= 1.0 {
            if let Some(error) = self.reads_ahead(h) {
                return StepVerdict::ReadsAhead(Box::new(error));
            }
            if self.reaches_mark(t_new) {
                return StepVerdict::Mark;
            }
            if S::FEATURES.events && self.discrete.has_transitions() {
                return match self.watch(h, t_new) {
                    Ok(None) => StepVerdict::Accept,
                    Ok(Some(part)) => StepVerdict::Threshold { part },
                    Err(error) => StepVerdict::Unresolved(Box::new(error)),
                };
            }
            return StepVerdict::Accept;
        }
        if !error.is_finite() {
            return StepVerdict::Fail;
        }
        if self.passes_corner(h, t_new) { StepVerdict::Corner } else { StepVerdict::Reject }
    }

    /// Square of the local error of the last tried step, in units of the tolerance.
    #[inline]
    pub(in crate::integrate) fn error(&self) -> f64 {
        let (y, y_new) = (self.y.as_ref(), self.stepper.y_new.as_ref());
        let e = self.stepper.local_error();
        let error = self.tolerances.mean_square(e, y, y_new, self.sizes.as_ref());
        larger(error, self.sensitivity_error())
    }

    /// Square of the local error of the sensitivities of the last tried step.
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
}
