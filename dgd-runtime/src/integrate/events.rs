//! Modes and conditions on time: what changes at single points of time, and what follows.
//!
//! A condition on time switches at a time that is known beforehand; a step ends there. A transition
//! is due when its event function e passes zero in its direction: at the end of a step, which is then
//! shortened to the point where that happens ([`super::locate`]), or when inputs or other modes jump.
//! A transition whose condition holds when its mode is entered acts only after it has been false; it
//! is *armed* from then on.
//!
//! All that happens at one time is one instant ([`super::instant`]): one cause, and the transitions
//! that follow from it one after another until nothing is due.

use super::Simulation;
use super::simultaneous::Together;
use super::watch::Samples;
use crate::discrete::{Schedule, choose_sides, choose_start_modes};
use crate::error::IntegrateError;
use crate::problem::Problem;
use crate::solution::{Event, Solution};
use crate::state_selection::selecting;
use crate::system::{Crossing, Point, System, Trigger};

/// Transitions within this part of the simulated time happen at one time.
const ONE_TIME: f64 = 1e-9;
/// So many transitions at one time are expected to go on without end, and for each transition of the
/// model so many more.
const MOST_TRANSITIONS: usize = 100;
const MORE_FOR_EACH: usize = 10;
/// Intervals that have shrunk so often in sequence are expected to go on so.
const SHRINKING: usize = 4;
/// The mode of a switch in which the solution slides along its surface.
pub(super) const SLIDING: usize = 2;
/// A slack that is still to be taken: what errors within the tolerance make of an event function, or what
/// rounding does.
const OF_TOLERANCE: f64 = f64::INFINITY;
const OF_ROUNDING: f64 = f64::NEG_INFINITY;
/// Rounding of an unknown that a step has added up, in units of its last place.
const ROUNDINGS: f64 = 8.0;

/// Discrete numbers, and work space for instants at which they change; nothing of it is used by a
/// model that has none.
pub(super) struct Hybrid {
    pub(super) schedule: Schedule,
    n_automata: usize,
    /// Whether each automaton chooses states, so that its transitions are no events.
    selecting: Vec<bool>,
    /// Whether the condition of a transition has been false since its mode was entered.
    pub(super) armed: Vec<bool>,
    /// How far beyond its threshold an event function may be without consequences: as far as it was
    /// when the solution came back from sliding along it, and as far as rounding takes it where the
    /// solution starts on the threshold or has just passed it; infinite until that is known.
    pub(super) slack: Vec<f64>,
    /// The transition that the last step was cut at.
    pub(super) located: Option<usize>,
    /// The size of the last step that was to be cut at a corner, and could not be.
    pub(super) uncut: f64,
    /// Whether nothing but corners is watched.
    only_corners: bool,
    /// Event functions, and the same at the ends of the interval that holds an event.
    pub(super) e: Vec<f64>,
    pub(super) low: Vec<f64>,
    pub(super) high: Vec<f64>,
    /// The same along a step.
    pub(super) samples: Samples,
    /// The transition that only a turn within the step made due, and how far beyond its threshold the
    /// event function turns.
    pub(super) turned: Option<(usize, f64)>,
    /// Transitions at one time: since when, and how many.
    pub(super) crowd: (f64, usize),
    /// When each transition was made.
    pub(super) pasts: Vec<Past>,
    /// Transitions at one time.
    pub(super) together: Together,
    /// ∂t/∂θ of the times of conditions.
    dtimes: Vec<f64>,
    pub(super) instant: super::instant::Instant,
}

impl Hybrid {
    pub(super) fn new<S: System>(system: &S, p: &[f64], from: f64, n_s: usize) -> Self {
        let signature = system.signature();
        let discrete = &signature.discrete;
        let mut schedule = Schedule::new(system, p, from);
        let n_e = discrete.transitions().count();
        let mut dtimes = vec![0.0; discrete.n_time_conditions * n_s];
        if !dtimes.is_empty() {
            let at = Point { t: from, y: &[], u: &[], p, z: &[] };
            system.condition_time_sensitivities(at, &mut dtimes);
            schedule.tell_apart(&dtimes, n_s);
        }
        Self {
            schedule,
            n_automata: discrete.automata.len(),
            selecting: selecting(signature).collect(),
            slack: vec![0.0; n_e],
            located: None,
            uncut: f64::INFINITY,
            only_corners: discrete.automata.iter().all(|a| a.kind.only_ends_steps()),
            armed: discrete.transitions().map(|(_, t)| t.trigger == Trigger::Level).collect(),
            e: vec![0.0; n_e],
            low: vec![0.0; n_e],
            high: vec![0.0; n_e],
            samples: Samples::new(n_e),
            turned: None,
            crowd: (from, 0),
            pasts: vec![Past::NONE; n_e],
            together: Together::new(signature, n_s),
            dtimes,
            instant: super::instant::Instant::new(signature, n_s),
        }
    }

    /// The discrete numbers.
    #[inline]
    pub(super) fn z(&self) -> &[f64] {
        &self.schedule.z
    }

    /// When the next condition on time switches; infinity when none does.
    #[inline]
    pub(super) fn next_switch(&self) -> f64 {
        self.schedule.next_time()
    }

    #[inline]
    pub(super) fn has_transitions(&self) -> bool {
        !self.armed.is_empty()
    }

    /// Whether a transition that leaves this mode can be due.
    pub(super) fn watches(&self, transition: usize, automaton: usize, from: usize) -> bool {
        self.is_event(automaton) && self.armed[transition] && self.is_active(automaton, from)
    }

    /// Whether transitions of an automaton are events: those that choose states are not.
    pub(super) fn is_event(&self, automaton: usize) -> bool {
        !self.selecting[automaton]
    }

    /// Whether states are chosen on the way.
    #[inline]
    pub(super) fn selects_states(&self) -> bool {
        self.selecting.contains(&true)
    }

    /// Whether this value of its event function makes the k-th transition due.
    pub(super) fn is_past(&self, k: usize, crossing: Crossing, e: f64) -> bool {
        crossing.is_past(e) && e.abs() > self.slack[k]
    }

    /// Whether interior points of steps need not be looked at.
    pub(super) fn only_corners(&self) -> bool {
        self.only_corners
    }

    /// Whether a corner has been passed less than `calm` ago.
    pub(super) fn flutters(&self, k: usize, t: f64, calm: f64) -> bool {
        t - self.pasts[k].last < calm
    }

    /// Takes note of a corner that is passed, and waits for the way back.
    pub(super) fn pass_corner(&mut self, k: usize, t: f64) {
        self.pasts[k].last = t;
        self.armed[k] = false;
    }

    /// How long the transition was made after the time before; infinity where it was not.
    pub(super) fn last_interval(&self, transition: usize) -> f64 {
        self.pasts[transition].interval
    }

    /// Whether the transition leaves the mode that its automaton is in.
    pub(super) fn is_active(&self, automaton: usize, from: usize) -> bool {
        self.z()[automaton] == from as f64
    }
}

/// When a transition was made: the last time, how long that was after the time before, and for how
/// many times in sequence that has become less.
#[derive(Debug, Clone, Copy)]
pub(super) struct Past {
    last: f64,
    interval: f64,
    shrinking: usize,
    count: usize,
}

impl Past {
    pub(super) const NONE: Self =
        Self { last: f64::NEG_INFINITY, interval: f64::INFINITY, shrinking: 0, count: 0 };

    /// Takes in the transition at `t`; how often it has been made, where it will be made infinitely
    /// often within `soon`.
    ///
    /// Intervals that shrink by the ratio r add up to T r/(1 − r) from the last one, T, on.
    fn accumulates(&mut self, t: f64, soon: f64) -> Option<usize> {
        let interval = t - self.last;
        let ratio = interval / self.interval;
        self.count += 1;
        self.shrinking =
            if self.interval.is_finite() && ratio < 1.0 { self.shrinking + 1 } else { 0 };
        (self.last, self.interval) = (t, interval);
        let ends = self.shrinking >= SHRINKING && interval * ratio < soon * (1.0 - ratio);
        ends.then_some(self.count)
    }
}

impl<S: System> Simulation<'_, S> {
    /// Switches the conditions on time that switch now.
    #[inline]
    pub(super) fn switch_conditions(
        &mut self,
        solution: &mut Solution,
    ) -> Result<(), IntegrateError> {
        if !S::FEATURES.events {
            return Ok(());
        }
        while self.discrete.next_switch() == self.t {
            let hybrid = &mut self.discrete;
            let n_c = hybrid.z().len() - hybrid.n_automata;
            let condition = hybrid.schedule.next_condition().unwrap_or(0);
            for (tau, column) in hybrid.instant.tau.iter_mut().zip(hybrid.dtimes.chunks_exact(n_c))
            {
                *tau = column[condition];
            }
            self.begin_instant(solution);
            self.discrete.schedule.switch(self.discrete.n_automata);
            self.take_over(solution)?;
            self.settle(solution)?;
            self.mark_instant();
        }
        Ok(())
    }

    /// Makes the transitions that are due now, one after another, until none is.
    #[inline]
    pub(super) fn settle(&mut self, solution: &mut Solution) -> Result<(), IntegrateError> {
        if !S::FEATURES.events || !self.discrete.has_transitions() {
            return Ok(());
        }
        loop {
            let torn_off = self.evaluate_events_at_jump();
            self.take_slack();
            if let Some(k) = torn_off {
                self.make_transition(k, solution)?;
                // It has not come back from sliding: the surface has gone.
                self.set_slack_beside(k, OF_ROUNDING);
                continue;
            }
            let Some(due) = self.due() else {
                self.arm();
                return Ok(());
            };
            self.make_transition(due, solution)?;
        }
    }

    /// Where a solution leaves a surface that it has slid along, it does so tangentially: how far an
    /// event function is beyond its threshold there, and what errors of the unknowns within the
    /// tolerance make of it, says nothing of a return. Where it starts on a surface, or has just passed
    /// it, what rounding makes of it says nothing.
    fn take_slack(&mut self) {
        self.take_slack_of(OF_TOLERANCE, self.tolerances.rtol, self.tolerances.atol);
        let rounding = ROUNDINGS * f64::EPSILON;
        self.take_slack_of(OF_ROUNDING, rounding, rounding);
    }

    /// The slacks that are marked, for unknowns that are known to these tolerances.
    fn take_slack_of(&mut self, mark: f64, rtol: f64, atol: f64) {
        if !self.discrete.slack.contains(&mark) {
            return;
        }
        self.take_errors(rtol, atol);
        let Hybrid { slack, e, high, .. } = &mut self.discrete;
        for ((slack, error), e) in slack.iter_mut().zip(high.iter()).zip(e.iter()) {
            if *slack == mark {
                // What has passed a threshold by more than rounding has passed it.
                let own = if mark == OF_ROUNDING { 0.0 } else { 2.0 * e.abs() };
                *slack = error.max(own);
            }
        }
    }

    /// What errors of all unknowns within these tolerances make of event functions, in `high`.
    fn take_errors(&mut self, rtol: f64, atol: f64) {
        let Problem { system, p, .. } = *self.problem;
        let Hybrid { schedule, e, low, high, .. } = &mut self.discrete;
        let (y, u) = (self.y.as_ref(), self.drive.at(self.t, self.y.as_ref()));
        high.fill(0.0);
        for i in 0..y.len() {
            let moved = self.row.as_mut();
            moved.copy_from_slice(y);
            moved[i] += rtol * y[i].abs() + atol * self.sizes.as_ref()[i];
            let at = Point { t: self.t, y: self.row.as_ref(), u, p, z: &schedule.z };
            system.event_functions(at, low);
            for ((error, moved), e) in high.iter_mut().zip(low.iter()).zip(e.iter()) {
                *error += (moved - e).abs();
            }
        }
    }

    /// e at (t, y), where inputs or unknowns may just have jumped. The transition of a switch from sliding to the
    /// side of its surface that the solution is on now, where the jump has torn the two apart.
    fn evaluate_events_at_jump(&mut self) -> Option<usize> {
        let discrete = &self.problem.system.signature().discrete;
        // Of each switch that slides, the event function of its surface before.
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
        let Hybrid { e, high, .. } = &self.discrete;
        let (k, automaton, _) =
            before.into_iter().find(|(k, _, before)| (e[*k] - before).abs() > high[*k])?;
        let crossing = if e[k] > 0.0 { Crossing::Rises } else { Crossing::Falls };
        let left = transitions().find(|(_, (of, transition))| {
            *of == automaton && transition.from == SLIDING && transition.crossing == crossing
        });
        left.map(|(k, _)| k)
    }

    /// Of all transitions of the automaton that the k-th belongs to.
    fn set_slack_beside(&mut self, k: usize, slack: f64) {
        let discrete = &self.problem.system.signature().discrete;
        let of = discrete.transitions().nth(k).map(|(automaton, _)| automaton);
        for (other, (automaton, _)) in discrete.transitions().enumerate() {
            if Some(automaton) == of {
                self.discrete.slack[other] = slack;
            }
        }
    }

    /// e at (t, y).
    pub(super) fn evaluate_events(&mut self) {
        let Problem { system, p, .. } = *self.problem;
        let u = self.drive.at(self.t, self.y.as_ref());
        let at = Point { t: self.t, y: self.y.as_ref(), u, p, z: &self.discrete.schedule.z };
        system.event_functions(at, &mut self.discrete.e);
    }

    /// The first transition that is due by the event functions as they are in `e`.
    pub(super) fn due(&self) -> Option<usize> {
        let hybrid = &self.discrete;
        let mut transitions = self.problem.system.signature().discrete.transitions().enumerate();
        let due = transitions.find(|(k, (automaton, transition))| {
            hybrid.watches(*k, *automaton, transition.from)
                && hybrid.is_past(*k, transition.crossing, hybrid.e[*k])
        });
        due.map(|(k, _)| k)
    }

    /// Whether the k-th transition is due by the event functions as they are in `e`.
    pub(super) fn is_due(&self, k: usize) -> bool {
        let hybrid = &self.discrete;
        let mut transitions = self.problem.system.signature().discrete.transitions();
        transitions.nth(k).is_some_and(|(automaton, transition)| {
            hybrid.watches(k, automaton, transition.from)
                && hybrid.is_past(k, transition.crossing, hybrid.e[k])
        })
    }

    /// Arms the transitions whose condition is false by the event functions as they are in `e`.
    pub(super) fn arm(&mut self) {
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
                hybrid.armed[k] = true;
            }
        }
    }

    /// Begins in the modes that conditions on the start choose.
    pub(super) fn begin_modes(&mut self) {
        if !S::FEATURES.events {
            return;
        }
        let Problem { system, p, .. } = *self.problem;
        let u = self.drive.at(self.t, self.y.as_ref());
        let Hybrid { e, schedule, .. } = &mut self.discrete;
        let before = schedule.z.clone();
        choose_start_modes(system, (self.t, self.y.as_ref(), u, p), e, &mut schedule.z);
        if schedule.z != before {
            let mut mass = self.algebraic.mass.clone();
            let at = Point { t: self.t, y: &[], u, p, z: &schedule.z };
            system.mass(at, mass.as_mut());
            self.algebraic.enter_modes(mass.as_ref());
        }
    }

    /// Begins on the sides of switches and bounds that the start values are on.
    pub(super) fn begin_switches(&mut self) {
        if !S::FEATURES.events {
            return;
        }
        let Problem { system, p, .. } = *self.problem;
        let place = (self.t, self.y.as_ref(), self.drive.at(self.t, self.y.as_ref()), p);
        choose_sides(system, place, &mut self.discrete.e, &mut self.discrete.schedule.z);
        let discrete = &system.signature().discrete;
        for (slack, (automaton, _)) in self.discrete.slack.iter_mut().zip(discrete.transitions()) {
            if discrete.automata[automaton].kind.has_surface() {
                *slack = OF_ROUNDING;
            }
        }
    }

    /// Makes a transition: resets, the new mode, consistent values.
    pub(super) fn make_transition(
        &mut self,
        k: usize,
        solution: &mut Solution,
    ) -> Result<(), IntegrateError> {
        let discrete = &self.problem.system.signature().discrete;
        let Some((position, transition)) = discrete.transitions().nth(k) else {
            unreachable!("there are as many event functions as transitions")
        };
        let automaton = &discrete.automata[position];
        if automaton.kind.only_ends_steps() {
            // Slopes have changed, values have not.
            self.discrete.pass_corner(k, self.t);
            return self.make_consistent(solution);
        }
        self.verify_end(k, &automaton.name)?;
        let has_surface = automaton.kind.has_surface();
        // A side that does not lead onto the surface was left by rounding, and one that the solution has
        // slid along has let it go.
        let may_slide = has_surface && self.discrete.located == Some(k) && {
            self.evaluate_events();
            self.entry(position).is_some()
        };

        self.reset(k, solution);
        self.discrete.schedule.z[position] = transition.to as f64;
        let slack = match (has_surface, transition.from == SLIDING) {
            (true, true) => OF_TOLERANCE,
            (true, false) => OF_ROUNDING,
            (false, _) => 0.0,
        };
        for (other, (of, next)) in discrete.transitions().enumerate() {
            if of == position {
                self.discrete.armed[other] = next.trigger == Trigger::Level;
                self.discrete.slack[other] = slack;
            }
        }
        self.take_over(solution)?;
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

    /// Lets a solution that has just entered one side of a surface, and is pushed back from there,
    /// slide along it.
    fn slide(&mut self, position: usize, solution: &mut Solution) -> Result<(), IntegrateError> {
        self.evaluate_events();
        match self.entry(position) {
            Some(k) => self.make_transition(k, solution),
            None => Ok(()),
        }
    }

    /// The transition to sliding from the side that a switch is on, where that side leads onto its
    /// surface by the event functions as they are in `e`.
    fn entry(&self, position: usize) -> Option<usize> {
        let hybrid = &self.discrete;
        let discrete = &self.problem.system.signature().discrete;
        let mut transitions = discrete.transitions().enumerate();
        let found = transitions.find(|(k, (of, transition))| {
            *of == position
                && transition.trigger == Trigger::Entry
                && hybrid.is_active(*of, transition.from)
                && transition.crossing.is_past(hybrid.e[*k])
        });
        found.map(|(k, _)| k)
    }

    /// Whether events come to an end.
    fn verify_end(&mut self, k: usize, automaton: &str) -> Result<(), IntegrateError> {
        let most = MOST_TRANSITIONS + MORE_FOR_EACH * self.discrete.armed.len();
        let (since, count) = &mut self.discrete.crowd;
        if self.t - *since > ONE_TIME * self.span {
            (*since, *count) = (self.t, 0);
        }
        *count += 1;
        let crowded = (*count > most).then_some(most);
        let accumulates = self.discrete.pasts[k].accumulates(self.t, ONE_TIME * self.span);
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
