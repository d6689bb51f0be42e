//! Modes and the state of their transitions during a run.

use crate::algebraic::PieceAutomata;
use crate::discrete::SwitchSchedule;
use crate::discrete::clock::ClockTick;
use crate::discrete::state_selection::selecting;
use crate::integrate::enclosure::Enclosures;
use crate::integrate::events::past::PastValues;
use crate::integrate::events::saltation::Saltation;
use crate::integrate::events::scan::TransitionWatch;
use crate::integrate::events::simultaneous::SimultaneousTransitions;
use crate::solved::SolvableSystem;
use crate::system::{Crossing, Discrete, EvaluationPoint, Transition, Trigger};

/// Intervals that have shrunk this many times in a row are expected to keep shrinking.
const SHRINKING: usize = 4;

/// Discrete numbers, and work space for instants at which they change. A model without any does not use it.
pub(in crate::integrate) struct HybridState {
    pub(in crate::integrate) schedule: SwitchSchedule,
    pub(super) n_automata: usize,
    /// Pieces of algebraic equations.
    pub(in crate::integrate) pieces: PieceAutomata,
    /// For each automaton, whether it selects states, so that its transitions are not events.
    selecting: Vec<bool>,
    /// For each automaton, whether its discrete number is a count.
    counting: Vec<bool>,
    /// For each transition, the one that indicates a flutter: for a knot the one in the opposite direction, for others
    /// the transition itself.
    back: Vec<usize>,
    /// For each transition, whether its condition has been false since its mode was entered.
    pub(in crate::integrate) armed: Vec<bool>,
    /// How far an event function may exceed its threshold without triggering: by the excess at which the solution
    /// stopped sliding along the threshold, or by rounding errors if the solution starts on the threshold or has just
    /// passed it. Infinite until that is known.
    pub(in crate::integrate) slack: Vec<f64>,
    /// The rounding of event functions of time that have just passed their thresholds, and until when it counts.
    pub(super) rounding: Vec<f64>,
    pub(super) calm_until: f64,
    /// The transition at which the last step was cut.
    pub(in crate::integrate) located: Option<usize>,
    /// The size of the last step along which event functions were sampled.
    pub(in crate::integrate) sampled: f64,
    /// The size of the last step that should have been cut at a corner but could not be.
    pub(in crate::integrate) uncut: f64,
    /// Event functions, and the same at the ends of the interval that brackets an event.
    pub(in crate::integrate) e: Vec<f64>,
    pub(in crate::integrate) low: Vec<f64>,
    pub(in crate::integrate) high: Vec<f64>,
    /// Enclosures along parts of a step, including the past values that they read, with the watch state of each
    /// transition.
    pub(in crate::integrate) enclosures: Enclosures,
    pub(in crate::integrate) past: PastValues,
    pub(in crate::integrate) watching: Vec<TransitionWatch>,
    /// For each unknown, whether it is algebraic and an event function that is watched within the step reads it.
    pub(super) watched: Vec<bool>,
    /// Whether there is such an unknown.
    pub(super) watches_algebraic: bool,
    /// Event functions around the last crossing, at three points of the step.
    pub(in crate::integrate) around: [Vec<f64>; 3],
    /// The transition that became due only by a turn within the step, and how far beyond its threshold the event
    /// function turns.
    pub(in crate::integrate) turned: Option<(usize, f64)>,
    /// For each transition, whether slopes jump, so that a touch is of consequence.
    pub(super) jumps: Vec<bool>,
    /// For each transition, the fraction of the step at which its event function came to its threshold.
    pub(super) reached: Vec<Option<f64>>,
    /// The transition whose threshold is touched where the step is cut.
    pub(super) touched: Option<usize>,
    /// Transitions at one time: that time, and their number.
    pub(in crate::integrate) crowd: (f64, usize),
    /// The times at which each transition was made.
    pub(in crate::integrate) occurrences: Vec<TransitionOccurrences>,
    /// Transitions at one time.
    pub(in crate::integrate) simultaneous: SimultaneousTransitions,
    /// Ticks at one time that act.
    pub(super) ticks: Vec<ClockTick>,
    /// ∂t/∂θ of the times of conditions.
    pub(super) dtimes: Vec<f64>,
    pub(in crate::integrate) saltation: Saltation,
}

impl HybridState {
    pub(in crate::integrate) fn new<S: SolvableSystem>(
        system: &S,
        p: &[f64],
        from: f64,
        n_s: usize,
    ) -> Self {
        let signature = system.signature();
        let discrete = &signature.discrete;
        let mut schedule = SwitchSchedule::new(system, p, from);
        let n_e = discrete.transitions().count();
        let mut dtimes = vec![0.0; discrete.n_time_conditions * n_s];
        if !dtimes.is_empty() {
            let point = EvaluationPoint { t: from, y: &[], u: &[], p, z: &schedule.z };
            system.condition_time_sensitivities(point, &mut dtimes);
            schedule.tell_apart(&dtimes, n_s);
        }
        let enclosures = Enclosures::new(&discrete.event_formulas);
        Self {
            schedule,
            n_automata: discrete.automata.len(),
            pieces: PieceAutomata::new(discrete, signature.unknowns.len()),
            selecting: selecting(signature).collect(),
            counting: discrete.automata.iter().map(|a| a.kind.counts()).collect(),
            back: ways_back(discrete),
            slack: vec![0.0; n_e],
            rounding: vec![0.0; n_e],
            calm_until: f64::INFINITY,
            located: None,
            sampled: 0.0,
            uncut: f64::INFINITY,
            armed: discrete.transitions().map(|(_, t)| t.trigger == Trigger::Level).collect(),
            e: vec![0.0; n_e],
            low: vec![0.0; n_e],
            high: vec![0.0; n_e],
            past: PastValues::new(enclosures.inputs(), signature.past().first),
            enclosures,
            watching: vec![TransitionWatch::No; n_e],
            watched: vec![false; if n_e == 0 { 0 } else { signature.unknowns.len() }],
            watches_algebraic: false,
            around: std::array::from_fn(|_| vec![0.0; n_e]),
            turned: None,
            jumps: discrete
                .transitions()
                .map(|(of, _)| !discrete.automata[of].kind.keeps_slopes())
                .collect(),
            reached: vec![None; n_e],
            touched: None,
            crowd: (from, 0),
            occurrences: vec![TransitionOccurrences::NONE; n_e],
            simultaneous: SimultaneousTransitions::new(signature, n_s),
            ticks: Vec::with_capacity(discrete.clocks.len()),
            dtimes,
            saltation: Saltation::new(signature, n_s),
        }
    }

    /// The discrete numbers.
    #[inline]
    pub(in crate::integrate) fn z(&self) -> &[f64] {
        &self.schedule.z
    }

    /// Time at which the next condition on time switches; infinity if none does.
    #[inline]
    pub(in crate::integrate) fn next_switch(&self) -> f64 {
        self.schedule.next_time()
    }

    #[inline]
    pub(in crate::integrate) fn has_transitions(&self) -> bool {
        !self.armed.is_empty()
    }

    /// Whether a transition that leaves this mode can be due.
    pub(in crate::integrate) fn watches(
        &self,
        transition: usize,
        automaton: usize,
        from: usize,
    ) -> bool {
        self.is_event(automaton) && self.armed[transition] && self.is_active(automaton, from)
    }

    /// Whether transitions of an automaton are events: those that select states are not.
    pub(in crate::integrate) fn is_event(&self, automaton: usize) -> bool {
        !self.selecting[automaton]
    }

    /// ∂t/∂θ of the times of conditions, n_c × n_s by columns.
    pub(in crate::integrate) fn dtimes(&self) -> &[f64] {
        &self.dtimes
    }

    /// Whether states are selected during the run.
    #[inline]
    pub(in crate::integrate) fn selects_states(&self) -> bool {
        self.selecting.contains(&true)
    }

    /// Whether this value of its event function makes the k-th transition due.
    pub(in crate::integrate) fn is_past(&self, k: usize, crossing: Crossing, e: f64) -> bool {
        crossing.is_past(e) && e.abs() > self.slack[k].max(self.rounding[k])
    }

    /// Whether a corner has been passed less than `calm` ago.
    pub(in crate::integrate) fn flutters(&self, k: usize, t: f64, calm: f64) -> bool {
        t - self.occurrences[k].last < calm
    }

    /// Records that a corner was passed, and waits for the way back. The next knot of a table is another corner: a
    /// solution that flutters about a knot passes it the other way.
    pub(in crate::integrate) fn pass_corner(&mut self, k: usize, t: f64) {
        self.occurrences[self.back[k]].last = t;
        self.armed[k] = false;
    }

    /// The time between the last two occurrences of a transition; infinity if there were none.
    pub(in crate::integrate) fn last_interval(&self, transition: usize) -> f64 {
        self.occurrences[transition].interval
    }

    /// Whether the transition leaves the mode that its automaton is in.
    pub(in crate::integrate) fn is_active(&self, automaton: usize, from: usize) -> bool {
        self.counting[automaton] || self.z()[automaton] == from as f64
    }
}

/// For each transition, the one that indicates a flutter.
fn ways_back(discrete: &Discrete) -> Vec<usize> {
    let transitions: Vec<(usize, &Transition)> = discrete.transitions().collect();
    let back = |(k, (of, transition)): (usize, &(usize, &Transition))| {
        let kind = discrete.automata[*of].kind;
        let is_back = |(other, next): &(usize, &Transition)| {
            other == of && next.crossing != transition.crossing
        };
        let counts_knots = kind.counts() && kind.only_ends_steps();
        transitions.iter().position(is_back).filter(|_| counts_knots).unwrap_or(k)
    };
    transitions.iter().enumerate().map(back).collect()
}

/// Occurrences of a transition: the time of the last, the interval before it, and how many times in a row that interval
/// has shrunk.
#[derive(Debug, Clone, Copy)]
pub(in crate::integrate) struct TransitionOccurrences {
    last: f64,
    interval: f64,
    shrinking: usize,
    count: usize,
}

impl TransitionOccurrences {
    pub(in crate::integrate) const NONE: Self =
        Self { last: f64::NEG_INFINITY, interval: f64::INFINITY, shrinking: 0, count: 0 };

    /// Whether the last one was at most `soon` before t.
    pub(super) fn is_within(&self, soon: f64, t: f64) -> bool {
        t - self.last <= soon
    }

    /// Records the transition at `t`. Returns how many times it has been made if it would be made infinitely often
    /// within `soon`.
    ///
    /// Intervals that shrink by the ratio r add up to T r/(1 − r) after the last one, T.
    pub(super) fn accumulates(&mut self, t: f64, soon: f64) -> Option<usize> {
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
