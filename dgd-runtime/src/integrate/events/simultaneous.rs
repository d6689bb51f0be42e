//! Independent transitions that are due at the same time.
//!
//! Each is an instant of its own, with the derivatives τ of its own time, in the order of the model file. If the times
//! have the same derivatives, the transitions coincide in perturbed solutions too. If not, either may come first, and S
//! is defined only if the order makes no difference: so they are also made in reverse order, and the outcomes compared.

use crate::error::IntegrateError;
use crate::integrate::events::hybrid::TransitionOccurrences;
use crate::integrate::simulation::Simulation;
use crate::solution::{Solution, UndefinedCause, UndefinedSensitivity};
use crate::solved::SolvableSystem;
use crate::system::{AutomatonKind, Signature};

/// Event functions that pass zero within this fraction of a step, or of their rounding, count as simultaneous.
pub(super) const AT_ONCE: f64 = 1e-10;
/// Relative difference up to which derivatives of times, or outcomes of two orders, count as equal.
const SAME: f64 = 1e-6;

/// Simultaneous transitions, and the state needed to try them in another order.
pub(in crate::integrate) struct SimultaneousTransitions {
    /// The one at which the step was cut, then the others.
    due: Vec<usize>,
    before: TransitionState,
    reversed: TransitionState,
}

/// The state that transitions change.
#[derive(Default)]
struct TransitionState {
    y: Vec<f64>,
    s: Vec<f64>,
    z: Vec<f64>,
    mass: Vec<f64>,
    armed: Vec<bool>,
    slack: Vec<f64>,
    occurrences: Vec<TransitionOccurrences>,
    crowd: (f64, usize),
}

impl TransitionState {
    fn new(signature: &Signature, n_s: usize) -> Self {
        let (n, n_e) = (signature.unknowns.len(), signature.discrete.transitions().count());
        Self {
            y: vec![0.0; n],
            s: vec![0.0; n * n_s],
            z: vec![0.0; signature.discrete.len()],
            mass: vec![0.0; n],
            armed: vec![false; n_e],
            slack: vec![0.0; n_e],
            occurrences: vec![TransitionOccurrences::NONE; n_e],
            crowd: (0.0, 0),
        }
    }
}

impl SimultaneousTransitions {
    pub(in crate::integrate) fn new(signature: &Signature, n_s: usize) -> Self {
        let n_e = signature.discrete.transitions().count();
        let state = || TransitionState::new(signature, if n_e > 1 { n_s } else { 0 });
        Self { due: Vec::with_capacity(n_e), before: state(), reversed: state() }
    }
}

impl<S: SolvableSystem> Simulation<'_, S> {
    /// Makes the transition at which the step was cut, those due at the same time, and those that follow.
    pub(in crate::integrate) fn make_events(
        &mut self,
        k: usize,
        solution: &mut Solution,
    ) -> Result<(), IntegrateError> {
        if self.gather(k, solution) {
            self.verify_order(solution);
        }
        self.make_event(k, solution)?;
        for place in 1..self.discrete.simultaneous.due.len() {
            let other = self.discrete.simultaneous.due[place];
            self.evaluate_events();
            if self.is_due(other) {
                self.make_event(other, solution)?;
            }
        }
        self.discrete.located = None;
        self.settle(solution)
    }

    fn make_event(&mut self, k: usize, solution: &mut Solution) -> Result<(), IntegrateError> {
        self.begin_event(k, solution);
        self.discrete.located = Some(k);
        self.make_transition(k, solution)
    }

    /// Collects the transitions that are due now. Returns whether sensitivities may depend on the order.
    fn gather(&mut self, k: usize, solution: &mut Solution) -> bool {
        let discrete = &self.problem.system.signature().discrete;
        self.discrete.simultaneous.due.clear();
        self.discrete.simultaneous.due.push(k);
        let watched = discrete.transitions().enumerate().filter(|(other, (automaton, t))| {
            *other != k && self.discrete.watches(*other, *automaton, t.from)
        });
        if watched.count() == 0 {
            return false;
        }
        // Without sensitivities, only transitions past their thresholds count.
        let with_slopes =
            self.directions.is_some() && !self.is_continuous(k) && self.take_event_slopes(solution);
        let mut differs = false;
        for (other, (automaton, transition)) in discrete.transitions().enumerate() {
            if other == k || !self.discrete.watches(other, automaton, transition.from) {
                continue;
            }
            let e = self.discrete.e[other];
            let is_past = self.discrete.is_past(other, transition.crossing, e);
            if !with_slopes || self.is_continuous(other) {
                if is_past {
                    self.discrete.simultaneous.due.push(other);
                }
                continue;
            }
            let (rate, _) = self.event_rate(other);
            let is_near =
                transition.crossing.is_past(rate) && (e / rate).abs() <= self.at_once(AT_ONCE);
            if is_past || is_near {
                self.discrete.simultaneous.due.push(other);
                differs |= is_near && self.times_differ(k, other);
            }
        }
        differs
    }

    /// The time within which events count as simultaneous, at least this fraction of the step that led to them. It does
    /// not depend on the length of the run.
    pub(in crate::integrate) fn at_once(&self, part: f64) -> f64 {
        (part * self.discrete.sampled).max(16.0 * f64::EPSILON * self.t.abs())
    }

    /// Whether the times of two events have different derivatives.
    fn times_differ(&mut self, k: usize, other: usize) -> bool {
        let mut rows = std::mem::take(&mut self.discrete.saltation.rows);
        for (row, k) in rows.iter_mut().zip([k, other]) {
            self.event_along_directions(k, row);
        }
        let rates = [k, other].map(|k| self.event_rate(k).0);
        let [own, others] = &rows;
        let differ = own.iter().zip(others).any(|(a, b)| !is_same(a / rates[0], b / rates[1]));
        self.discrete.saltation.rows = rows;
        differ
    }

    /// Tries the transitions in both orders; ends sensitivities if the outcomes differ.
    fn verify_order(&mut self, solution: &mut Solution) {
        let agree = self.orders_agree(solution, Self::make_all);
        if self.directions.is_some() && !agree {
            let discrete = &self.problem.system.signature().discrete;
            let due = self.discrete.simultaneous.due.iter();
            let automata = due.filter_map(|k| discrete.transitions().nth(*k)).map(|(of, _)| of);
            self.end_sensitivities_of_order(automata.collect(), solution);
        }
    }

    /// Whether the changes by `make` have the same outcome in the reverse order. The state is restored afterwards.
    pub(super) fn orders_agree(
        &mut self,
        solution: &mut Solution,
        make: impl Fn(&mut Self, bool, &mut Solution) -> Result<(), IntegrateError>,
    ) -> bool {
        let (n_events, n_undefined) = (solution.events.len(), solution.undefined.len());
        let jumps = solution.jumps.clone();
        let n_folds = solution.folds.len();
        let simultaneous = &mut self.discrete.simultaneous;
        let mut before = std::mem::take(&mut simultaneous.before);
        let mut reversed = std::mem::take(&mut simultaneous.reversed);
        self.save(&mut before);
        let backward = make(self, true, solution);
        self.save(&mut reversed);
        self.restore(&before);
        let forward = make(self, false, solution);
        let agree = backward.is_ok() && forward.is_ok() && self.agrees_with(&reversed);
        self.restore(&before);
        (self.discrete.simultaneous.before, self.discrete.simultaneous.reversed) =
            (before, reversed);
        solution.events.truncate(n_events);
        solution.jumps = jumps;
        solution.folds.truncate(n_folds);
        if self.directions.is_some() {
            solution.undefined.truncate(n_undefined);
        }
        agree
    }

    fn save(&mut self, state: &mut TransitionState) {
        state.y.copy_from_slice(self.y.as_ref());
        if let Some(d) = &self.directions {
            state.s.copy_from_slice(d.s.as_ref());
        }
        let hybrid = &self.discrete;
        state.z.copy_from_slice(hybrid.z());
        state.mass.copy_from_slice(self.algebraic.mass.as_ref());
        state.armed.copy_from_slice(&hybrid.armed);
        state.slack.copy_from_slice(&hybrid.slack);
        state.occurrences.copy_from_slice(&hybrid.occurrences);
        state.crowd = hybrid.crowd;
    }

    fn restore(&mut self, state: &TransitionState) {
        self.y.as_mut().copy_from_slice(&state.y);
        if let Some(d) = &mut self.directions {
            d.s.as_mut().copy_from_slice(&state.s);
        }
        let hybrid = &mut self.discrete;
        hybrid.schedule.z.copy_from_slice(&state.z);
        hybrid.armed.copy_from_slice(&state.armed);
        hybrid.slack.copy_from_slice(&state.slack);
        hybrid.occurrences.copy_from_slice(&state.occurrences);
        hybrid.crowd = state.crowd;
        self.algebraic.enter_modes(&state.mass);
        self.evaluate_jumps();
        self.linearized = false;
    }

    fn make_all(&mut self, reversed: bool, solution: &mut Solution) -> Result<(), IntegrateError> {
        let n = self.discrete.simultaneous.due.len();
        for place in 0..n {
            let place = if reversed { n - 1 - place } else { place };
            let k = self.discrete.simultaneous.due[place];
            let discrete = &self.problem.system.signature().discrete;
            // Another transition may have left its mode.
            let mut transitions = discrete.transitions();
            if transitions.nth(k).is_some_and(|(a, t)| self.discrete.is_active(a, t.from)) {
                self.make_event(k, solution)?;
            }
        }
        Ok(())
    }

    /// Whether modes, unknowns and sensitivities equal those of the reverse order.
    fn agrees_with(&self, reversed: &TransitionState) -> bool {
        let Some(d) = &self.directions else { return true };
        let close =
            |a: f64, b: f64, size: f64| (a - b).abs() <= SAME * a.abs().max(b.abs()).max(size);
        let sizes = self.sizes.as_ref();
        let mut unknowns = self.y.as_ref().iter().zip(&reversed.y).zip(sizes);
        let mut sensitivities = d.s.as_ref().iter().zip(&reversed.s).zip(d.sizes.as_ref());
        self.discrete.z() == reversed.z
            && unknowns.all(|((a, b), size)| close(*a, *b, *size))
            && sensitivities.all(|((a, b), size)| close(*a, *b, *size))
    }

    /// Ends sensitivities where the order in which these automata act matters.
    pub(super) fn end_sensitivities_of_order(
        &mut self,
        automata: Vec<usize>,
        solution: &mut Solution,
    ) {
        self.directions = None;
        let discrete = &self.problem.system.signature().discrete;
        let mut names: Vec<String> = Vec::new();
        for automaton in automata {
            let automaton = &discrete.automata[automaton];
            let word = if automaton.kind == AutomatonKind::Every { "every " } else { "" };
            let name = format!("{word}{}", automaton.name);
            if !names.contains(&name) {
                names.push(name);
            }
        }
        solution.undefined.push(UndefinedSensitivity {
            from: self.t,
            until: self.t,
            equation: names.join("` and `"),
            cause: UndefinedCause::Simultaneous,
        });
    }
}

/// Whether derivatives of two times are equal.
pub(super) fn is_same(a: f64, b: f64) -> bool {
    (a - b).abs() <= SAME * a.abs().max(b.abs())
}
