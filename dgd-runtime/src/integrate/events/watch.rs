//! Detects crossings of thresholds within a step, not only at its end.
//!
//! A threshold that is crossed twice within one step would be missed at its end. So event functions are sampled along
//! the dense output at quarters of the step, and also where a parabola through three neighbouring samples has its
//! extremum beyond the threshold. The step is then repeated, shorter, to the first sample at which a transition is due,
//! or at which one can be armed that is due later in the step.
//!
//! A pair of crossings is missed if it lies between two samples and the parabola does not show it: if the event
//! function moves within a quarter of a step while the unknowns, which error control sees, do not. Time windows are
//! never missed, as steps end at them.

use crate::error::IntegrateError;
use crate::integrate::controller::Controller;
use crate::integrate::events::hybrid::Hybrid;
use crate::integrate::simulation::{Simulation, Stop, Variables};
use crate::problem::Problem;
use crate::solution::Solution;
use crate::solved::Solved;
use crate::system::{Crossing, Point};

/// Intervals between samples.
const INTERVALS: usize = 4;

/// A corner is looked for again after this many steps.
const CALM: f64 = 4.0;

/// A step that could not be cut at a corner is tried again when it has shrunk to this fraction.
const AGAIN: f64 = 0.1;

/// Event functions along a step.
pub(in crate::integrate) struct Samples {
    e: [Vec<f64>; INTERVALS + 1],
    turn: Vec<f64>,
}

impl Samples {
    pub(in crate::integrate) fn new(n_e: usize) -> Self {
        Self { e: std::array::from_fn(|_| vec![0.0; n_e]), turn: vec![0.0; n_e] }
    }
}

/// Curvatures below this fraction of the slope are rounding.
const STRAIGHT: f64 = 1e-9;

/// The fraction of the step at a sample.
fn part_of(sample: usize) -> f64 {
    sample as f64 / INTERVALS as f64
}

impl<S: Solved> Simulation<'_, S> {
    /// The fraction of the last tried step up to the first point where a transition is due or can be armed. If there is
    /// none, arms what can be armed at the end.
    pub(in crate::integrate) fn watch(&mut self, h: f64, t_new: f64) -> Option<f64> {
        let Problem { system, p, .. } = *self.problem;
        let hybrid = &mut self.discrete;
        let z = &hybrid.schedule.z;
        hybrid.uncut = f64::INFINITY;
        hybrid.sampled = h;
        let needed = if hybrid.only_corners() { INTERVALS } else { 0 };
        for (sample, e) in hybrid.samples.e.iter_mut().enumerate().skip(needed) {
            let (t, y) = match sample {
                0 => (self.t, self.y.as_ref()),
                INTERVALS => (t_new, self.stepper.y_new.as_ref()),
                _ => {
                    if sample == 1 {
                        self.stepper.prepare_dense(self.y.as_ref(), None);
                    }
                    let part = part_of(sample);
                    self.stepper.interpolate(part, self.y.as_ref(), self.row.as_mut());
                    (self.t + part * h, self.row.as_ref())
                }
            };
            let at = Point { t, y, u: self.drive.at(t, y), p, z };
            system.event_functions(at, e);
        }
        hybrid.e.copy_from_slice(&hybrid.samples.e[INTERVALS]);
        hybrid.turned = None;

        let mut first = f64::INFINITY;
        for (k, (automaton, transition)) in system.signature().discrete.transitions().enumerate() {
            let hybrid = &self.discrete;
            if hybrid.is_event(automaton) && hybrid.is_active(automaton, transition.from) {
                let kind = system.signature().discrete.automata[automaton].kind;
                let found = if kind.only_ends_steps() {
                    self.corner_at_end(k, transition.crossing, t_new, h)
                } else if self.discrete.armed[k] {
                    self.first_past(k, transition.crossing, h)
                } else {
                    self.first_to_arm(k, transition.crossing, h)
                };
                first = first.min(found.unwrap_or(f64::INFINITY));
            }
        }
        if first.is_finite() {
            return Some(first);
        }
        self.arm();
        None
    }

    /// Whether a corner is passed in the step. One that has just been passed is left to error control, since a solution
    /// may flutter about it.
    fn corner_at_end(&mut self, k: usize, crossing: Crossing, t_new: f64, h: f64) -> Option<f64> {
        let e = self.discrete.samples.e[INTERVALS][k];
        if !self.discrete.armed[k] || !crossing.is_past(e) {
            return None;
        }
        if self.discrete.flutters(k, t_new, CALM * h) {
            self.discrete.pass_corner(k, t_new);
            return None;
        }
        Some(1.0)
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

    /// How far beyond its threshold the event function of a located transition, which passes it at this rate, would go
    /// before it turns back, with the curvature of the samples around the crossing; infinity where it does not turn.
    ///
    /// ```text
    ///   e ≈ s x + q x²,   s q < 0:   s²/(4 |q|)
    /// ```
    pub(in crate::integrate) fn depth(&self, k: usize, crossing: Crossing, rate: f64) -> f64 {
        let samples = self.discrete.samples.e.each_ref().map(|e| e[k]);
        let past = samples.iter().position(|e| crossing.is_past(*e)).unwrap_or(INTERVALS);
        let middle = past.clamp(1, INTERVALS - 1);
        let [a, b, c] = [samples[middle - 1], samples[middle], samples[middle + 1]];
        let slope = rate * self.discrete.sampled / INTERVALS as f64;
        let curvature = 0.5 * (a + c) - b;
        if slope * curvature < 0.0 && curvature.abs() > STRAIGHT * slope.abs() {
            slope * slope / (4.0 * curvature.abs())
        } else {
            f64::INFINITY
        }
    }

    /// The fraction of the step at which an armed transition is due.
    fn first_past(&mut self, k: usize, crossing: Crossing, h: f64) -> Option<f64> {
        for sample in 1..=INTERVALS {
            if self.discrete.is_past(k, crossing, self.discrete.samples.e[sample][k]) {
                return Some(part_of(sample));
            }
            if sample > 1
                && let Some(turn) = self.turns_to(true, k, crossing, sample, h)
            {
                self.discrete.turned = Some((k, self.discrete.samples.turn[k].abs()));
                return Some(turn);
            }
        }
        None
    }

    /// The fraction of the step at which a transition can be armed that is due at the end.
    fn first_to_arm(&mut self, k: usize, crossing: Crossing, h: f64) -> Option<f64> {
        if !crossing.is_past(self.discrete.samples.e[INTERVALS][k]) {
            return None;
        }
        for sample in 1..INTERVALS {
            if let Some(turn) = self.turns_to(false, k, crossing, sample + 1, h) {
                return Some(turn);
            }
            if !crossing.is_past(self.discrete.samples.e[sample][k]) {
                return Some(part_of(sample));
            }
        }
        None
    }

    /// The extremum of the parabola through the three samples up to `last`, if it is beyond the threshold (or not
    /// beyond it) and the event function is so there too.
    fn turns_to(
        &mut self,
        beyond: bool,
        k: usize,
        crossing: Crossing,
        last: usize,
        h: f64,
    ) -> Option<f64> {
        let [a, b, c] = [last - 2, last - 1, last].map(|sample| self.discrete.samples.e[sample][k]);
        // e = b + s x + q x², x from −1 to 1, turns at x = −s/(2q), where it is b − s²/(4q).
        let (slope, curvature) = (0.5 * (c - a), 0.5 * (a + c) - b);
        let turn = -0.5 * slope / curvature;
        let value = b + 0.5 * slope * turn;
        // NaN compares false.
        let is_beyond = |hybrid: &Hybrid, e| {
            if beyond { hybrid.is_past(k, crossing, e) } else { !crossing.is_past(e) }
        };
        let turns = turn.abs() < 1.0 && is_beyond(&self.discrete, value);
        if !turns {
            return None;
        }
        let part = part_of(last - 1) + turn / INTERVALS as f64;
        if part * h <= 4.0 * f64::EPSILON * self.t.abs() {
            return None;
        }
        let Problem { system, p, .. } = *self.problem;
        let t = self.t + part * h;
        self.stepper.interpolate(part, self.y.as_ref(), self.row.as_mut());
        let hybrid = &mut self.discrete;
        let at = Point {
            t,
            y: self.row.as_ref(),
            u: self.drive.at(t, self.row.as_ref()),
            p,
            z: &hybrid.schedule.z,
        };
        system.event_functions(at, &mut hybrid.samples.turn);
        is_beyond(hybrid, hybrid.samples.turn[k]).then_some(part)
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
        if part >= 1.0 {
            return self.step_to_event(controller, h, t_new, times, solution);
        }
        let (h, t_new) = (part * h, self.t + part * h);
        let made = self.step_to(h, Variables::All, solution);
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
        self.arm();
        self.accept(t_new, Stop::None, times, solution);
        Ok(())
    }
}
