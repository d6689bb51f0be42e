//! Detects crossings of thresholds within a step, not only at its end.
//!
//! Event functions are enclosed along the step, with the dense output instead of the unknowns ([`super::scan`]): no
//! crossing is missed, however long the step is. The step is then repeated, shorter, to a point just behind the first
//! crossing, or to one at which a transition can be armed that is due later in the step.

use crate::error::IntegrateError;
use crate::integrate::controller::Controller;
use crate::integrate::events::hybrid::HybridState;
use crate::integrate::events::scan::ScanResult;
use crate::integrate::methods::stepper::StepEnd;
use crate::integrate::simulation::{Simulation, StepOutcome, StepVariables};
use crate::problem::Problem;
use crate::solution::Solution;
use crate::solved::SolvableSystem;
use crate::system::EvaluationPoint;

/// A corner is looked for again after this many steps.
pub(super) const CALM: f64 = 4.0;

/// A step that could not be cut at a corner is tried again when it has shrunk to this fraction.
const AGAIN: f64 = 0.1;

/// Curvatures below this fraction of the slope are rounding.
const STRAIGHT: f64 = 1e-9;
/// How far apart event functions are sampled around a crossing, as a fraction of the step.
const APART: f64 = 0.25;

/// A scan that has come this far, as a fraction of the run, without an end lets the step end there.
const FAR_ENOUGH: f64 = 1e-9;

impl<S: SolvableSystem> Simulation<'_, S> {
    /// The fraction of the last tried step up to the first point where a transition is due or can be armed. If there is
    /// none, arms those that can be armed at the end.
    ///
    /// # Errors
    ///
    /// A condition that may change infinitely often right after the start of the step.
    pub(in crate::integrate) fn watch(
        &mut self,
        h: f64,
        t_new: f64,
    ) -> Result<Option<f64>, IntegrateError> {
        let Problem { system, p, .. } = *self.problem;
        let y_new = self.stepper.y_new.as_ref();
        let point = EvaluationPoint {
            t: t_new,
            y: y_new,
            u: self.drive.evaluate(t_new, y_new),
            p,
            z: &self.discrete.schedule.z,
        };
        system.event_functions(point, &mut self.discrete.e);
        self.end_calm();
        self.discrete.uncut = f64::INFINITY;
        self.discrete.sampled = h;
        self.discrete.turned = None;
        match self.scan(h) {
            ScanResult::Nothing => {
                self.arm(StepEnd::End, t_new);
                Ok(None)
            }
            ScanResult::Until(part) => {
                self.sample_around(h, part);
                Ok(Some(part))
            }
            ScanResult::Stuck { part, .. } if part * h > FAR_ENOUGH * self.span => Ok(Some(part)),
            ScanResult::Stuck { part, k, .. } => {
                Err(self.unresolved_condition(self.t + part * h, k))
            }
        }
    }

    fn unresolved_condition(&self, t: f64, k: usize) -> IntegrateError {
        let discrete = &self.problem.system.signature().discrete;
        let automaton = discrete.transitions().nth(k).map(|(automaton, _)| automaton);
        let automaton =
            automaton.map_or_else(String::new, |k| discrete.automata[k].name.to_string());
        IntegrateError::UnresolvedCondition { t, automaton }
    }

    /// Whether the last tried step, whose error is too large, passes a corner at which it may be cut.
    #[inline]
    pub(in crate::integrate) fn passes_corner(&mut self, h: f64, t_new: f64) -> bool {
        // ∂f/∂y changes at a corner, so the last stages of sensitivities would see both values.
        if !S::FEATURES.events
            || self.directions.is_some()
            || !self.discrete.has_transitions()
            || h > AGAIN * self.discrete.uncut
        {
            return false;
        }
        self.evaluate_at_end(h);
        let discrete = &self.problem.system.signature().discrete;
        discrete.transitions().enumerate().any(|(k, (automaton, transition))| {
            discrete.automata[automaton].kind.only_ends_steps()
                && self.discrete.armed[k]
                && transition.crossing.is_past(self.discrete.e[k])
                && !self.discrete.flutters(k, t_new, CALM * h)
        })
    }

    /// Cuts the last tried step, whose error is too large, at the corner that it passes, if that makes the error small
    /// enough. Returns whether it did.
    pub(in crate::integrate) fn step_to_corner(
        &mut self,
        h: f64,
        t_new: f64,
        times: &[f64],
        solution: &mut Solution,
    ) -> Result<bool, IntegrateError> {
        self.discrete.uncut = h;
        let Ok(cut) = self.locate(h, solution) else { return Ok(false) };
        // NaN compares false.
        if self.error() <= 1.0 && self.reads_ahead(cut).is_none() {
            if self.reaches_mark(self.t + cut) {
                return Ok(true);
            }
            self.discrete.uncut = f64::INFINITY;
            self.end_at_event(h, cut, t_new, times, solution)?;
            return Ok(true);
        }
        Ok(false)
    }

    /// Samples event functions around the crossing at this fraction of the last tried step, of size h, for the
    /// curvature there.
    fn sample_around(&mut self, h: f64, part: f64) {
        if self.directions.is_none() {
            return;
        }
        let Problem { system, p, .. } = *self.problem;
        let middle = part.clamp(APART, 1.0 - APART);
        for (k, part) in [middle - APART, middle, middle + APART].into_iter().enumerate() {
            self.stepper.interpolate(part, self.y.as_ref(), self.row.as_mut());
            let t = self.t + part * h;
            let u = self.drive.evaluate(t, self.row.as_ref());
            let HybridState { schedule, around, .. } = &mut self.discrete;
            let point = EvaluationPoint { t, y: self.row.as_ref(), u, p, z: &schedule.z };
            system.event_functions(point, &mut around[k]);
        }
    }

    /// How far beyond its threshold the event function of a located transition, which passes it at this rate, would go
    /// before it turns back, with the curvature of the samples around the crossing; infinity if it does not turn there.
    ///
    /// ```text
    ///   e ≈ s x + q x²,   s q < 0:   s²/(4 |q|)
    /// ```
    pub(in crate::integrate) fn depth(&self, k: usize, rate: f64) -> f64 {
        let [a, b, c] = self.discrete.around.each_ref().map(|e| e[k]);
        let slope = rate * self.discrete.sampled * APART;
        let curvature = 0.5 * (a + c) - b;
        // A turn outside the samples would be extrapolated.
        let is_sampled = (c - a).abs() <= 4.0 * curvature.abs();
        if slope * curvature < 0.0 && is_sampled && curvature.abs() > STRAIGHT * slope.abs() {
            slope * slope / (4.0 * curvature.abs())
        } else {
            f64::INFINITY
        }
    }

    /// Repeats the last tried step up to the fraction that [`Simulation::watch`] found.
    pub(in crate::integrate) fn step_to_threshold(
        &mut self,
        controller: &mut Controller,
        h: f64,
        part: f64,
        t_new: f64,
        times: &[f64],
        solution: &mut Solution,
    ) -> Result<(), IntegrateError> {
        let touched = self.discrete.touched.take();
        if part >= 1.0 {
            return self.step_to_event(controller, h, t_new, times, solution);
        }
        if part == 0.0 {
            // The step before ended at a threshold, which this one leaves.
            self.end_at_touch(touched, solution);
            return Ok(());
        }
        let (h, t_new) = (part * h, self.t + part * h);
        let made = self.step_to(h, StepVariables::All, solution);
        if made.is_err() {
            // The full step succeeded, but a shorter one did not.
            controller.abandon(h);
            solution.statistics.rejected += 1;
            return Ok(());
        }
        self.evaluate_at_end(h);
        if self.due().is_some() {
            return self.step_to_event(controller, h, t_new, times, solution);
        }
        self.arm(StepEnd::End, t_new);
        self.accept(t_new, StepOutcome::None, times, solution);
        self.end_at_touch(touched, solution);
        Ok(())
    }
}
