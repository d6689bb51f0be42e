//! Transitions between modes: finds those that are due, and makes them.

use crate::discrete::{choose_sides, choose_start_modes, count_steps_of};
use crate::error::IntegrateError;
use crate::integrate::events::hybrid::HybridState;
use crate::integrate::methods::stepper::StepEnd;
use crate::integrate::simulation::Simulation;
use crate::problem::Problem;
use crate::solution::{Event, Solution};
use crate::solved::SolvableSystem;
use crate::system::{AutomatonKind, Crossing, EvaluationPoint, Trigger};

/// Transitions within this fraction of a step are one action, and endless ones within this fraction of the run.
const ONE_TIME: f64 = 1e-9;
/// More transitions at one time than this, plus this number for each transition of the model, are taken as endless.
const MOST_TRANSITIONS: usize = 100;
const MORE_FOR_EACH: usize = 10;
/// The mode of a switch in which the solution slides along its surface.
pub(in crate::integrate) const SLIDING: usize = 2;
/// Markers of slacks still to be computed: the change of an event function by errors within the tolerance, or by
/// rounding.
const OF_TOLERANCE: f64 = f64::INFINITY;
pub(super) const OF_ROUNDING: f64 = f64::NEG_INFINITY;
/// Rounding error of an unknown after a step, in units in the last place.
const ROUNDINGS: f64 = 8.0;

impl<S: SolvableSystem> Simulation<'_, S> {
    /// Makes the transitions that are due now, one after another, until none is.
    #[inline]
    pub(in crate::integrate) fn settle(
        &mut self,
        solution: &mut Solution,
    ) -> Result<(), IntegrateError> {
        if !S::FEATURES.events || !self.discrete.has_transitions() {
            return Ok(());
        }
        loop {
            let torn_off = self.evaluate_events_at_jump();
            self.take_slack();
            if let Some(k) = torn_off {
                self.make_transition(k, solution)?;
                // It did not come back from sliding: the surface has disappeared.
                self.set_slack_beside(k, OF_ROUNDING);
                continue;
            }
            let Some(due) = self.due() else {
                self.arm(StepEnd::Start, self.t);
                return Ok(());
            };
            self.follow_threshold(due, solution);
            self.make_transition(due, solution)?;
        }
    }

    /// Computes slacks. A solution that stops sliding along a surface leaves it tangentially: neither the excess of an
    /// event function over its threshold there, nor its change by errors within the tolerance, indicates a return.
    /// Where a solution starts on a surface or has just passed it, a change by rounding is meaningless.
    fn take_slack(&mut self) {
        self.take_slack_of(OF_TOLERANCE, self.tolerances.rtol, self.tolerances.atol);
        let rounding = ROUNDINGS * f64::EPSILON;
        self.take_slack_of(OF_ROUNDING, rounding, rounding);
        self.take_roundings(StepEnd::Start, self.t);
    }

    /// Computes the marked slacks, for unknowns with these tolerances.
    fn take_slack_of(&mut self, mark: f64, rtol: f64, atol: f64) {
        if !self.discrete.slack.contains(&mark) {
            return;
        }
        self.take_errors(rtol, atol);
        let HybridState { slack, e, high, .. } = &mut self.discrete;
        for ((slack, error), e) in slack.iter_mut().zip(high.iter()).zip(e.iter()) {
            if *slack == mark {
                // A value that exceeds the threshold by more than rounding has passed it.
                let threshold = if mark == OF_ROUNDING { 0.0 } else { 2.0 * e.abs() };
                *slack = error.max(threshold);
            }
        }
    }

    /// Computes the marked roundings, at an end of the last tried step: how much event functions change by rounding of
    /// time.
    fn take_roundings(&mut self, end: StepEnd, t: f64) {
        if !self.discrete.rounding.contains(&OF_ROUNDING) {
            return;
        }
        let Problem { system, p, .. } = *self.problem;
        let y = match end {
            StepEnd::Start => self.y.as_ref(),
            StepEnd::End => self.stepper.y_new.as_ref(),
        };
        let (u, udot) = self.drive.with_slope(t, y);
        let HybridState { schedule, rounding, calm_until, saltation, .. } = &mut self.discrete;
        let point = EvaluationPoint { t, y, u, p, z: &schedule.z };
        let slopes = saltation.take_event_derivatives(system, point, udot);
        let of_time = ROUNDINGS * f64::EPSILON * t.abs();
        for (own, slope) in rounding.iter_mut().zip(slopes) {
            if *own == OF_ROUNDING {
                let change = (slope * of_time).abs();
                // Where a function has no slope nothing follows from it.
                *own = if change.is_finite() { change } else { 0.0 };
            }
        }
        *calm_until = t + of_time;
    }

    /// Writes to `high` how much event functions change by errors of all unknowns within these tolerances.
    pub(super) fn take_errors(&mut self, rtol: f64, atol: f64) {
        self.take_errors_at(StepEnd::Start, self.t, rtol, atol);
    }

    /// The same at an end of the last tried step, with the event functions there in `e`.
    fn take_errors_at(&mut self, end: StepEnd, t: f64, rtol: f64, atol: f64) {
        let Problem { system, p, .. } = *self.problem;
        let HybridState { schedule, e, low, high, .. } = &mut self.discrete;
        let y = match end {
            StepEnd::Start => self.y.as_ref(),
            StepEnd::End => self.stepper.y_new.as_ref(),
        };
        let u = self.drive.evaluate(t, y);
        high.fill(0.0);
        for i in 0..y.len() {
            let moved = self.row.as_mut();
            moved.copy_from_slice(y);
            moved[i] += rtol * y[i].abs() + atol * self.sizes.as_ref()[i];
            let point = EvaluationPoint { t, y: self.row.as_ref(), u, p, z: &schedule.z };
            system.event_functions(point, low);
            for ((error, moved), e) in high.iter_mut().zip(low.iter()).zip(e.iter()) {
                *error += (moved - e).abs();
            }
        }
    }

    /// How much the k-th event function changes by errors of the unknowns within the tolerance, at the end of the last
    /// tried step, with the event functions there in `e`.
    pub(super) fn error_of_event(&mut self, k: usize, t_new: f64) -> f64 {
        self.take_errors_at(StepEnd::End, t_new, self.tolerances.rtol, self.tolerances.atol);
        self.discrete.high[k]
    }

    /// Evaluates e at (t, y), where inputs or unknowns may just have jumped. If the jump took a sliding solution off
    /// its surface, returns the transition of the switch to the side on which the solution is now.
    fn evaluate_events_at_jump(&mut self) -> Option<usize> {
        let discrete = &self.problem.system.signature().discrete;
        // For each sliding switch, the old event function of its surface.
        let transitions = || discrete.transitions().enumerate();
        let before: Vec<(usize, usize, f64)> = transitions()
            .filter(|(_, (automaton, transition))| {
                discrete.automata[*automaton].kind.has_surface()
                    && transition.trigger == Trigger::Level
                    && transition.crossing == Crossing::Rises
                    && transition.from != SLIDING
                    && self.discrete.is_active(*automaton, SLIDING)
            })
            .map(|(k, (automaton, _))| (k, automaton, self.discrete.e[k]))
            .collect();
        self.evaluate_events();
        if before.iter().all(|(k, _, e)| self.discrete.e[*k] == *e) {
            return None;
        }
        self.take_errors(self.tolerances.rtol, self.tolerances.atol);
        let HybridState { e, high, .. } = &self.discrete;
        let (k, automaton, _) =
            before.into_iter().find(|(k, _, before)| (e[*k] - before).abs() > high[*k])?;
        let crossing = if e[k] > 0.0 { Crossing::Rises } else { Crossing::Falls };
        let left = transitions().find(|(_, (of, transition))| {
            *of == automaton && transition.from == SLIDING && transition.crossing == crossing
        });
        left.map(|(k, _)| k)
    }

    /// Sets the slack of all transitions of the automaton of the k-th.
    fn set_slack_beside(&mut self, k: usize, slack: f64) {
        let discrete = &self.problem.system.signature().discrete;
        let owner = discrete.transitions().nth(k).map(|(automaton, _)| automaton);
        for (other, (automaton, _)) in discrete.transitions().enumerate() {
            if Some(automaton) == owner {
                self.discrete.slack[other] = slack;
            }
        }
    }

    /// Evaluates e at (t, y).
    pub(in crate::integrate) fn evaluate_events(&mut self) {
        let Problem { system, p, .. } = *self.problem;
        let u = self.drive.evaluate(self.t, self.y.as_ref());
        let point =
            EvaluationPoint { t: self.t, y: self.y.as_ref(), u, p, z: &self.discrete.schedule.z };
        system.event_functions(point, &mut self.discrete.e);
    }

    /// Whether (t, y) is at a corner, so that ∂f/∂y may be that of the side which the solution leaves.
    pub(in crate::integrate) fn is_at_corner(&mut self) -> bool {
        if !S::FEATURES.events || !self.discrete.has_transitions() {
            return false;
        }
        self.evaluate_events();
        let discrete = &self.problem.system.signature().discrete;
        let mut transitions = discrete.transitions().zip(&self.discrete.e);
        transitions.any(|((of, _), e)| *e == 0.0 && discrete.automata[of].kind.keeps_slopes())
    }

    /// The first transition that is due according to the event functions in `e`.
    pub(in crate::integrate) fn due(&self) -> Option<usize> {
        let hybrid = &self.discrete;
        let mut transitions = self.problem.system.signature().discrete.transitions().enumerate();
        let due = transitions.find(|(k, (automaton, transition))| {
            hybrid.watches(*k, *automaton, transition.from)
                && hybrid.is_past(*k, transition.crossing, hybrid.e[*k])
        });
        due.map(|(k, _)| k)
    }

    /// Whether the k-th transition is due according to the event functions in `e`.
    pub(in crate::integrate) fn is_due(&self, k: usize) -> bool {
        let hybrid = &self.discrete;
        let mut transitions = self.problem.system.signature().discrete.transitions();
        transitions.nth(k).is_some_and(|(automaton, transition)| {
            hybrid.watches(k, automaton, transition.from)
                && hybrid.is_past(k, transition.crossing, hybrid.e[k])
        })
    }

    /// Counts the knots that have been passed without an event, from the event functions in `e`.
    fn count_knots(&mut self) {
        let discrete = &self.problem.system.signature().discrete;
        for (position, automaton) in discrete.automata.iter().enumerate() {
            if !(automaton.kind.counts() && automaton.kind.only_ends_steps()) {
                continue;
            }
            let HybridState { schedule, e, .. } = &mut self.discrete;
            let before = schedule.z[position];
            count_steps_of(discrete, position, e, &mut schedule.z);
            let passed = schedule.z[position] - before;
            for (k, (of, _)) in discrete.transitions().enumerate() {
                if of == position {
                    self.discrete.e[k] -= passed;
                }
            }
        }
    }

    /// Arms the transitions whose condition is false according to the event functions in `e`, at an end of the last tried
    /// step. A function of time that has just passed its threshold may come back by rounding: for a few roundings of time
    /// it is due beyond its own rounding only.
    pub(in crate::integrate) fn arm(&mut self, end: StepEnd, t: f64) {
        self.count_knots();
        let hybrid = &mut self.discrete;
        let transitions = self.problem.system.signature().discrete.transitions();
        for (k, (automaton, transition)) in transitions.enumerate() {
            if !hybrid.is_active(automaton, transition.from) {
                continue;
            }
            if transition.crossing.is_past(hybrid.e[k]) {
                continue;
            }
            if hybrid.e[k].abs() > hybrid.slack[k] {
                hybrid.slack[k] = 0.0;
            }
            if matches!(transition.trigger, Trigger::Edge | Trigger::Level) {
                if !hybrid.armed[k] && hybrid.enclosures.reads(k).time {
                    hybrid.rounding[k] = OF_ROUNDING;
                }
                hybrid.armed[k] = true;
            }
        }
        self.take_roundings(end, t);
    }

    /// Forgets roundings of thresholds that were passed a while ago.
    pub(super) fn end_calm(&mut self) {
        if self.t > self.discrete.calm_until {
            self.discrete.rounding.fill(0.0);
            self.discrete.calm_until = f64::INFINITY;
        }
    }

    /// Begins in the modes that the start conditions choose.
    pub(in crate::integrate) fn begin_modes(&mut self) {
        if !S::FEATURES.events {
            return;
        }
        let Problem { system, p, .. } = *self.problem;
        let u = self.drive.evaluate(self.t, self.y.as_ref());
        let HybridState { e, schedule, .. } = &mut self.discrete;
        let before = schedule.z.clone();
        choose_start_modes(
            system,
            EvaluationPoint { t: self.t, y: self.y.as_ref(), u, p, z: &[] },
            e,
            &mut schedule.z,
        );
        if schedule.z != before {
            let mut mass = self.algebraic.mass.clone();
            let point = EvaluationPoint { t: self.t, y: &[], u, p, z: &schedule.z };
            system.mass(point, mass.as_mut());
            self.algebraic.enter_modes(mass.as_ref());
        }
    }

    /// Begins on the sides of switches and bounds that the start values are on.
    pub(in crate::integrate) fn begin_switches(&mut self) {
        if !S::FEATURES.events {
            return;
        }
        let Problem { system, p, .. } = *self.problem;
        let u = self.drive.evaluate(self.t, self.y.as_ref());
        let point = EvaluationPoint { t: self.t, y: self.y.as_ref(), u, p, z: &[] };
        choose_sides(system, point, &mut self.discrete.e, &mut self.discrete.schedule.z);
        let discrete = &system.signature().discrete;
        for (slack, (automaton, _)) in self.discrete.slack.iter_mut().zip(discrete.transitions()) {
            if discrete.automata[automaton].kind.has_surface() {
                *slack = OF_ROUNDING;
            }
        }
    }

    /// Makes a transition: resets, the new mode, consistent values.
    pub(in crate::integrate) fn make_transition(
        &mut self,
        k: usize,
        solution: &mut Solution,
    ) -> Result<(), IntegrateError> {
        let discrete = &self.problem.system.signature().discrete;
        let Some((position, transition)) = discrete.transitions().nth(k) else {
            unreachable!("there are as many event functions as transitions")
        };
        let automaton = &discrete.automata[position];
        if automaton.kind.ends_runs() {
            return Err(IntegrateError::TableLeft { t: self.t, what: automaton.name.to_string() });
        }
        if automaton.kind.is_piece() {
            self.verify_end(k, &automaton.name)?;
            return self.enter_pieces(Some(position), solution);
        }
        if automaton.kind.only_ends_steps() || self.has_just_acted(position, k) {
            // Only slopes change, not values.
            self.discrete.pass_corner(k, self.t);
            return self.make_consistent(solution);
        }
        // Ticks of clocks do not depend on the solution, so they cannot be endless.
        if transition.trigger != Trigger::Clock {
            self.verify_end(k, &automaton.name)?;
        }
        let has_surface = automaton.kind.has_surface();
        // If the old side does not lead onto the surface, it was left by rounding, or the solution stopped sliding
        // along it.
        let may_slide = has_surface && self.discrete.located == Some(k) && {
            self.evaluate_events();
            self.entry(position).is_some()
        };

        self.reset(k, solution);
        if automaton.kind.counts() {
            self.evaluate_events();
            let HybridState { schedule, e, .. } = &mut self.discrete;
            count_steps_of(discrete, position, e, &mut schedule.z);
        } else {
            self.discrete.schedule.z[position] = transition.to as f64;
        }
        let slack = match (has_surface, transition.from == SLIDING) {
            (true, true) => OF_TOLERANCE,
            (true, false) => OF_ROUNDING,
            (false, _) => 0.0,
        };
        for (other, (of, next)) in discrete.transitions().enumerate() {
            if of == position {
                self.discrete.armed[other] = next.trigger == Trigger::Level;
                self.discrete.slack[other] = slack;
                self.discrete.reached[other] = None;
                if self.discrete.enclosures.reads(other).time {
                    self.discrete.rounding[other] = OF_ROUNDING;
                }
            }
        }
        self.take_over(automaton.kind.is_declared().then_some(k), solution)?;
        if automaton.kind.counts() || transition.trigger == Trigger::Clock {
            return Ok(());
        }
        solution.events.push(Event {
            t: self.t,
            automaton: automaton.name.clone(),
            from: automaton.modes[transition.from].clone(),
            to: automaton.modes[transition.to].clone(),
        });
        if has_surface && self.discrete.located.take() == Some(k) && may_slide {
            self.slide(position, solution)?;
        }
        Ok(())
    }

    /// Makes a solution slide along a surface if it has just entered one side and is pushed back from there.
    fn slide(&mut self, position: usize, solution: &mut Solution) -> Result<(), IntegrateError> {
        self.evaluate_events();
        match self.entry(position) {
            Some(k) => self.make_transition(k, solution),
            None => Ok(()),
        }
    }

    /// The transition of a switch from its current side to sliding, if that side leads onto its surface according to
    /// the event functions in `e`.
    fn entry(&self, position: usize) -> Option<usize> {
        let hybrid = &self.discrete;
        let discrete = &self.problem.system.signature().discrete;
        let mut transitions = discrete.transitions().enumerate();
        let transition_met = transitions.find(|(k, (of, transition))| {
            *of == position
                && transition.trigger == Trigger::Entry
                && hybrid.is_active(*of, transition.from)
                && transition.crossing.is_past(hybrid.e[*k])
        });
        transition_met.map(|(k, _)| k)
    }

    /// Whether another condition of the same action was already met at this time, so that the action has happened.
    fn has_just_acted(&self, position: usize, k: usize) -> bool {
        let discrete = &self.problem.system.signature().discrete;
        let automaton = &discrete.automata[position];
        if automaton.kind != AutomatonKind::When || automaton.transitions.len() == 1 {
            return false;
        }
        let soon = self.at_once(ONE_TIME);
        discrete.transitions().enumerate().any(|(other, (of, next))| {
            of == position
                && other != k
                && next.trigger == Trigger::Edge
                && self.discrete.occurrences[other].is_within(soon, self.t)
        })
    }

    /// Checks that events come to an end.
    fn verify_end(&mut self, k: usize, automaton: &str) -> Result<(), IntegrateError> {
        let most = MOST_TRANSITIONS + MORE_FOR_EACH * self.discrete.armed.len();
        let (since, count) = &mut self.discrete.crowd;
        if self.t - *since > ONE_TIME * self.span {
            (*since, *count) = (self.t, 0);
        }
        *count += 1;
        let crowded = (*count > most).then_some(most);
        let accumulates = self.discrete.occurrences[k].accumulates(self.t, ONE_TIME * self.span);
        match crowded.or(accumulates) {
            Some(transitions) => Err(IntegrateError::EndlessEvents {
                t: self.t,
                automaton: automaton.to_owned(),
                transitions,
            }),
            None => Ok(()),
        }
    }
}
