//! Validity of derivatives at the start: those of a solution that begins on a threshold are one-sided.
//!
//! On e(t₀, y₀, p) = 0 with ∂e/∂θ ≠ 0, a change of θ in one direction leaves the threshold behind, one in the other
//! puts it ahead. S is the derivative on the side that the run takes. Where only slopes jump, both sides agree if the
//! solution moves off the surface.

use crate::integrate::simulation::Simulation;
use crate::problem::{Problem, parameter_size};
use crate::solution::{OneSided, Solution, UndefinedCause, UndefinedSensitivity};
use crate::solved::SolvableSystem;
use crate::system::{Direction, EvaluationPoint, Signature, Trigger};

/// Event functions below this fraction of their terms are zero to rounding.
const ROUNDING: f64 = 16.0 * f64::EPSILON;
/// The name for conditions without one.
const ON_TIME: &str = "a condition on time";

impl<S: SolvableSystem> Simulation<'_, S> {
    /// Lists the thresholds on which the run begins, and ends sensitivities if rows jump unseen.
    pub(super) fn judge_derivatives(&mut self, solution: &mut Solution) {
        if self.directions.is_none() {
            return;
        }
        let discrete = &self.problem.system.signature().discrete;
        if let Some(label) = discrete.unlocated.first() {
            self.directions = None;
            let (equation, cause) = (label.to_string(), UndefinedCause::Unlocated);
            let (from, until) = (self.t, self.t);
            solution.undefined.push(UndefinedSensitivity { from, until, equation, cause });
            return;
        }
        if !S::FEATURES.events || self.resumed.is_some() {
            return;
        }
        self.list_conditions_on_time(solution);
        if self.discrete.has_transitions() && self.take_event_slopes(solution) {
            self.evaluate_events();
            self.list_thresholds(solution);
        }
    }

    /// Conditions on time that change at the start, at a time that depends on parameters.
    fn list_conditions_on_time(&self, solution: &mut Solution) {
        let Problem { system, p, .. } = *self.problem;
        let n = system.signature().discrete.n_time_conditions;
        if n == 0 {
            return;
        }
        let (mut times, mut after) = (vec![0.0; n], vec![0.0; n]);
        let point = EvaluationPoint { t: self.t, y: &[], u: &[], p, z: self.discrete.z() };
        system.condition_times(point, &mut times, &mut after);
        let columns = self.discrete.dtimes().chunks_exact(n);
        for clock in system.signature().discrete.clocks.iter() {
            // Its period.
            times[clock.condition + 1] = f64::NAN;
        }
        let moves = |dt: &[f64]| dt.iter().zip(&times).any(|(dt, t)| *t == self.t && *dt != 0.0);
        let moving = columns.enumerate().filter(|(_, dt)| moves(dt)).map(|(j, _)| j).collect();
        add(solution, system.signature(), self.t, ON_TIME, moving);
    }

    /// Thresholds of event functions, whose slopes have been taken.
    fn list_thresholds(&self, solution: &mut Solution) {
        let system = self.problem.system;
        let signature = system.signature();
        let discrete = &signature.discrete;
        let (y, sizes) = (self.y.as_ref(), self.sizes.as_ref());
        let slopes = &self.discrete.saltation;
        let n_e = self.discrete.e.len();
        // Terms of e and of ė.
        let mut terms = vec![0.0; n_e];
        let mut rates: Vec<f64> = slopes.dedt().iter().map(|slope| slope.abs()).collect();
        for ((row, column), slope) in discrete.event_jacobian.positions().zip(slopes.dedy()) {
            terms[row] += slope.abs() * (y[column].abs() + sizes[column]);
            rates[row] += (slope * slopes.ydot()[column]).abs();
        }
        let size_of = |j: usize| match signature.directions[j] {
            Direction::Parameter(position) => parameter_size(system, position),
            Direction::Start(i) => sizes[i],
        };
        let mut along = vec![0.0; signature.directions.len()];
        for (k, (automaton, transition)) in discrete.transitions().enumerate() {
            let automaton_declared = &discrete.automata[automaton];
            let is_threshold = matches!(transition.trigger, Trigger::Level | Trigger::Edge)
                && self.discrete.is_event(automaton)
                && self.discrete.is_active(automaton, transition.from)
                && !automaton_declared.kind.ends_runs()
                && self.discrete.e[k].abs() <= ROUNDING * terms[k];
            let moves_off = self.event_rate(k).0.abs() > ROUNDING * rates[k];
            if !is_threshold || (automaton_declared.kind.keeps_slopes() && moves_off) {
                continue;
            }
            self.event_along_directions(k, &mut along);
            let moves = |j: &usize| along[*j].abs() * size_of(*j) > ROUNDING * terms[k];
            let moving = (0..signature.directions.len()).filter(moves).collect();
            add(solution, signature, self.t, &automaton_declared.name, moving);
        }
    }
}

/// Adds a threshold, once, if derivatives in any of these directions are one-sided.
fn add(solution: &mut Solution, signature: &Signature, t: f64, what: &str, moving: Vec<usize>) {
    if moving.is_empty() || solution.one_sided.iter().any(|known| known.threshold == what) {
        return;
    }
    let directions = moving.into_iter().map(|j| signature.direction_name(j).to_string()).collect();
    solution.one_sided.push(OneSided { t, threshold: what.to_owned(), directions });
}
