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
use super::watch::Samples;
use crate::discrete::Schedule;
use crate::error::IntegrateError;
use crate::problem::Problem;
use crate::solution::{Event, Solution};
use crate::state_selection::selecting;
use crate::system::{Point, System, Trigger};

/// Transitions within this part of the simulated time happen at one time.
const ONE_TIME: f64 = 1e-9;
/// So many transitions at one time are expected to go on without end, and for each transition of the
/// model so many more.
const MOST_TRANSITIONS: usize = 100;
const MORE_FOR_EACH: usize = 10;
/// Intervals that have shrunk so often in sequence are expected to go on so.
const SHRINKING: usize = 4;

/// Discrete numbers, and work space for instants at which they change; nothing of it is used by a
/// model that has none.
pub(super) struct Hybrid {
    pub(super) schedule: Schedule,
    n_automata: usize,
    /// Whether each automaton chooses states, so that its transitions are no events.
    selecting: Vec<bool>,
    /// Whether the condition of a transition has been false since its mode was entered.
    armed: Vec<bool>,
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
    crowd: (f64, usize),
    /// When each transition was made.
    pasts: Vec<Past>,
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
            armed: discrete.transitions().map(|(_, t)| t.trigger == Trigger::Level).collect(),
            e: vec![0.0; n_e],
            low: vec![0.0; n_e],
            high: vec![0.0; n_e],
            samples: Samples::new(n_e),
            turned: None,
            crowd: (from, 0),
            pasts: vec![Past::NONE; n_e],
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

    /// Whether the transition acts when its condition is true.
    pub(super) fn armed(&self, transition: usize) -> bool {
        self.armed[transition]
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
struct Past {
    last: f64,
    interval: f64,
    shrinking: usize,
    count: usize,
}

impl Past {
    const NONE: Self =
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
    pub(super) fn switch_conditions(
        &mut self,
        solution: &mut Solution,
    ) -> Result<(), IntegrateError> {
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
    pub(super) fn settle(&mut self, solution: &mut Solution) -> Result<(), IntegrateError> {
        if !self.discrete.has_transitions() {
            return Ok(());
        }
        loop {
            self.evaluate_events();
            let Some(due) = self.due() else {
                self.arm();
                return Ok(());
            };
            self.make_transition(due, solution)?;
        }
    }

    /// e at (t, y).
    fn evaluate_events(&mut self) {
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
                && transition.crossing.is_past(hybrid.e[*k])
        });
        due.map(|(k, _)| k)
    }

    /// Arms the transitions whose condition is false by the event functions as they are in `e`.
    pub(super) fn arm(&mut self) {
        let hybrid = &mut self.discrete;
        let transitions = self.problem.system.signature().discrete.transitions();
        for (k, (automaton, transition)) in transitions.enumerate() {
            if hybrid.is_active(automaton, transition.from)
                && !transition.crossing.is_past(hybrid.e[k])
            {
                hybrid.armed[k] = true;
            }
        }
    }

    /// Makes a transition: resets, the new mode, consistent values.
    fn make_transition(&mut self, k: usize, solution: &mut Solution) -> Result<(), IntegrateError> {
        let discrete = &self.problem.system.signature().discrete;
        let Some((position, transition)) = discrete.transitions().nth(k) else {
            unreachable!("there are as many event functions as transitions")
        };
        let automaton = &discrete.automata[position];
        let most = MOST_TRANSITIONS + MORE_FOR_EACH * self.discrete.armed.len();
        let (since, count) = &mut self.discrete.crowd;
        if self.t - *since > ONE_TIME * self.span {
            (*since, *count) = (self.t, 0);
        }
        *count += 1;
        let accumulates = self.discrete.pasts[k].accumulates(self.t, ONE_TIME * self.span);
        let endless = if *count > most { Some(most) } else { accumulates };
        if let Some(transitions) = endless {
            let automaton = automaton.name.to_string();
            return Err(IntegrateError::EndlessEvents { t: self.t, automaton, transitions });
        }

        self.reset(k, solution);
        self.discrete.schedule.z[position] = transition.to as f64;
        for (armed, (other, next)) in self.discrete.armed.iter_mut().zip(discrete.transitions()) {
            *armed &= other != position || next.trigger == Trigger::Level;
        }
        self.take_over(solution)?;
        solution.events.push(Event {
            t: self.t,
            automaton: automaton.name.clone(),
            from: automaton.modes[transition.from].clone(),
            to: automaton.modes[transition.to].clone(),
        });
        Ok(())
    }
}
