//! Locates the point in a step at which a transition is due.
//!
//! y(t + h) is the result of a step of size h, so that the event function is zero to rounding at the end of the
//! shortened step, with the accuracy of the method. The bracketing interval is narrowed by the Illinois variant of
//! regula falsi, and by bisection where that is slow.
//!
//! # Source
//!
//! Dowell and Jarratt, A modified regula falsi method for computing the root of an equation, BIT 11
//! (1971) 168–174.

use crate::algebraic::AlgebraicPoint;
use crate::error::IntegrateError;
use crate::integrate::controller::Controller;
use crate::integrate::drive::InstantInputs;
use crate::integrate::methods::stepper::StepFailure;
use crate::integrate::simulation::{Simulation, StepOutcome, StepVariables};
use crate::problem::Problem;
use crate::solution::Solution;
use crate::solved::SolvableSystem;
use crate::system::{Crossing, EvaluationPoint};

/// The interval is narrowed to this fraction of the step.
const NARROW: f64 = 1e-13;
/// Steps that end at corners need not be shorter than this fraction of the run, whatever their error.
const NO_NEARER: f64 = 1e-9;
/// A step that ends beyond a knot by less than this part of it is cut there.
const NEARLY: f64 = 0.99;
/// The size of a step that just passes a knot, in sizes of the step up to there.
const BEYOND_KNOT: f64 = 1.0 + 1e-6;
/// Number of trials after which the interval is halved, however slow regula falsi is.
const HALVED: usize = 8;
/// Halving alone narrows any interval to rounding within this many trials.
const MOST_TRIALS: usize = 48 * HALVED;

impl<S: SolvableSystem> Simulation<'_, S> {
    /// Shortens the last tried step to the first transition due in it, and makes the transition.
    pub(in crate::integrate) fn step_to_event(
        &mut self,
        controller: &mut Controller,
        h: f64,
        t_new: f64,
        times: &[f64],
        solution: &mut Solution,
    ) -> Result<(), IntegrateError> {
        let located = self.locate(h, solution);
        let Ok(cut) = located else {
            // The full step succeeded, but a shorter one did not.
            controller.abandon(h);
            solution.statistics.rejected += 1;
            return Ok(());
        };
        if let Some(error) = self.error_of_cut(cut, times) {
            controller.reject(cut, error);
            solution.statistics.rejected += 1;
            return Ok(());
        }
        if self.has_passed_pieces(h, cut) {
            controller.h = cut * BEYOND_KNOT;
            solution.statistics.rejected += 1;
            return Ok(());
        }
        let again = self.end_at_event(h, cut, t_new, times, solution)?;
        // The transition may recur after as short an interval as last time, whatever the error allows.
        controller.h = controller.h.min(again);
        Ok(())
    }

    /// Whether a step that was cut well before its end passes a knot of a table. A multistep method is cut along its
    /// polynomial, which is that of the whole step, so that it has to make a step of its own up to there.
    fn has_passed_pieces(&self, h: f64, cut: f64) -> bool {
        let mut transitions = self.problem.system.signature().discrete.transitions();
        let automata = &self.problem.system.signature().discrete.automata;
        self.stepper.traits.is_multistep()
            && cut < NEARLY * h
            && self.due().and_then(|due| transitions.nth(due)).is_some_and(|(automaton, _)| {
                let kind = automata[automaton].kind;
                kind.counts() && kind.only_ends_steps()
            })
    }

    /// The error of a step that was cut at an event, if it is too large. The whole step may have been accurate by
    /// chance only, as beyond a pole on the other side of the threshold; at a corner, sensitivities follow the slopes
    /// after it, which stages at the end see; and the whole step may have passed a piece of a table without a stage in
    /// it. A step nearer to the event leaves less for the one that ends there.
    fn error_of_cut(&self, cut: f64, times: &[f64]) -> Option<f64> {
        let span = times.last()? - times.first()?;
        let mut transitions = self.problem.system.signature().discrete.transitions();
        let (automaton, _) = transitions.nth(self.due()?)?;
        let kind = self.problem.system.signature().discrete.automata[automaton].kind;
        let is_multistep = self.stepper.traits.is_multistep();
        let sees_slopes = self.directions.is_some() && !is_multistep;
        let is_judged = if kind.only_ends_steps() {
            cut > NO_NEARER * span && (kind.counts() || sees_slopes)
        } else {
            !is_multistep
        };
        if !is_judged {
            return None;
        }
        let error = self.error();
        (error > 1.0 && error.is_finite()).then_some(error)
    }

    /// Accepts the step that was cut at an event, and makes the event. Returns how soon it may recur.
    pub(in crate::integrate) fn end_at_event(
        &mut self,
        h: f64,
        cut: f64,
        t_new: f64,
        times: &[f64],
        solution: &mut Solution,
    ) -> Result<f64, IntegrateError> {
        let due = self.due();
        let t_event = if cut < h { self.t + cut } else { t_new };
        self.accept(t_event, StepOutcome::Change, times, solution);
        self.stepper.restart();
        if let Some(due) = due {
            self.make_events(due, solution)?;
        } else {
            self.begin_sample();
            self.settle(solution)?;
        }
        self.mark_instant();
        // Other changes at this time come first.
        if t_event < self.stop() {
            self.record_now(times, solution);
        }
        Ok(due.map_or(f64::INFINITY, |due| self.discrete.last_interval(due)))
    }

    /// The size of the step that just passes the first threshold. It is the last tried step, with the event functions
    /// at its end in `e`.
    pub(in crate::integrate) fn locate(
        &mut self,
        h: f64,
        solution: &mut Solution,
    ) -> Result<f64, StepFailure> {
        let Problem { system, p, .. } = *self.problem;
        let (mut low, mut high) = (0.0, h);
        self.discrete.high.copy_from_slice(&self.discrete.e);
        {
            let u = self.drive.evaluate(self.t, self.y.as_ref());
            let point = EvaluationPoint {
                t: self.t,
                y: self.y.as_ref(),
                u,
                p,
                z: &self.discrete.schedule.z,
            };
            system.event_functions(point, &mut self.discrete.low);
        }
        let narrow = (4.0 * f64::EPSILON * self.t.abs()).max(NARROW * h);
        let mut stayed = RetainedEnd { side: BracketEnd::None, times: 0 };
        let mut trials = 0;
        while high - low > narrow && trials < MOST_TRIALS {
            trials += 1;
            let middle = 0.5 * (low + high);
            // Regula falsi is slow if the event function is very uneven.
            let is_halving = trials % HALVED == 0;
            let root = if is_halving { middle } else { self.earliest_root(low, high) };
            let inside = 0.5 * narrow.min(high - low);
            let trial = root.clamp(low + inside, high - inside);
            self.step_to(trial, StepVariables::Unknowns, solution)?;
            self.evaluate_at_end(trial);
            if self.due().is_some() {
                high = trial;
                self.discrete.high.copy_from_slice(&self.discrete.e);
                stayed.again(BracketEnd::Low);
                if stayed.times > 1 {
                    self.discrete.low.iter_mut().for_each(|e| *e *= 0.5);
                }
            } else {
                low = trial;
                self.discrete.low.copy_from_slice(&self.discrete.e);
                stayed.again(BracketEnd::High);
                if stayed.times > 1 {
                    self.discrete.high.iter_mut().for_each(|e| *e *= 0.5);
                }
            }
        }
        self.step_to(high, StepVariables::All, solution)?;
        self.evaluate_at_end(high);
        Ok(high)
    }

    /// Sets `y_new`, and `s_new` for all variables, to the solution after h, which is at most the size of the last
    /// tried step.
    pub(in crate::integrate) fn step_to(
        &mut self,
        h: f64,
        variables: StepVariables,
        solution: &mut Solution,
    ) -> Result<(), StepFailure> {
        if self.stepper.traits.is_multistep() {
            let directions = self.directions.as_mut().filter(|_| variables == StepVariables::All);
            self.stepper.shorten(h, self.y.as_ref(), directions);
        } else {
            self.try_step(h, variables, solution)?;
        }
        self.satisfy_equations(h);
        Ok(())
    }

    /// Solves for the algebraic unknowns after h, if watched event functions read some. A step satisfies their
    /// equations only to tolerance, and an event function just past a threshold would come back with the event, or pass
    /// it far too early if a piece beyond is steep.
    fn satisfy_equations(&mut self, h: f64) {
        if !self.discrete.watches_algebraic {
            return;
        }
        let Problem { system, p, .. } = *self.problem;
        let Some(work) = self.projection.as_mut() else { return };
        let y = self.row.as_mut();
        y.copy_from_slice(self.stepper.y_new.as_ref());
        let u = InstantInputs { drive: &mut self.drive, t: self.t + h };
        let point = AlgebraicPoint { t: self.t + h, u, p, z: self.discrete.schedule.z.as_slice() };
        let (jacobian, sizes) = (work.jacobian.as_mut(), self.sizes.as_ref());
        let solved =
            self.algebraic.make_consistent(system, point, y, jacobian, sizes, self.tolerances);
        if solved.is_ok() {
            self.stepper.y_new.as_mut().copy_from_slice(y);
        }
    }

    pub(in crate::integrate) fn evaluate_at_end(&mut self, h: f64) {
        let Problem { system, p, .. } = *self.problem;
        let t = self.t + h;
        let u = self.drive.evaluate(t, self.stepper.y_new.as_ref());
        let point = EvaluationPoint {
            t,
            y: self.stepper.y_new.as_ref(),
            u,
            p,
            z: &self.discrete.schedule.z,
        };
        system.event_functions(point, &mut self.discrete.e);
    }

    /// The earliest root of the secants of the event functions that pass their thresholds.
    fn earliest_root(&self, low: f64, high: f64) -> f64 {
        let (at_low, at_high) = (&self.discrete.low, &self.discrete.high);
        let transitions = self.problem.system.signature().discrete.transitions().enumerate();
        let mut earliest = high;
        for (k, (automaton, transition)) in transitions {
            // A transition is not due if its event function exceeds the threshold by no more than the slack.
            let slack = match transition.crossing {
                Crossing::Rises => self.discrete.slack[k],
                Crossing::Falls => -self.discrete.slack[k],
            };
            let (a, b) = (at_low[k] - slack, at_high[k] - slack);
            if self.discrete.watches(k, automaton, transition.from)
                && transition.crossing.is_past(b)
                && !transition.crossing.is_past(a)
            {
                earliest = earliest.min(low + (high - low) * (a / (a - b)));
            }
        }
        earliest
    }
}

/// An end of the interval.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum BracketEnd {
    None,
    Low,
    High,
}

/// The end that stayed in the last trials, and for how many trials.
struct RetainedEnd {
    side: BracketEnd,
    times: u32,
}

impl RetainedEnd {
    fn again(&mut self, now: BracketEnd) {
        self.times = if self.side == now { self.times + 1 } else { 1 };
        self.side = now;
    }
}
