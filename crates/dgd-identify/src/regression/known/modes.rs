//! Modes of a system at each sample, and unknowns that follow from measured ones.
//!
//! A model with modes is simulated from one sample to the next, with the current parameters of the regression. At every
//! sample readings replace all unknowns that they determine. So conditions are evaluated on readings, including noise;
//! an unknown without readings, such as the level in a line while it drains, follows its own equations, and counts as
//! known if these contain no estimated parameter and read no other such unknown.

use dgd_runtime::integrate::RunMemory;
use dgd_runtime::model::Model;
use dgd_runtime::{
    Discrete, EvaluationPoint, Options, Pattern, PriorState, Problem, Solution, WantedResults,
};

use crate::recording::Recording;

/// The name of an automaton whose modes need memory, if there is one.
pub(crate) fn remembered(system: &dyn Model) -> Option<String> {
    let signature = system.signature();
    let bounds_a_state = |discrete: &Discrete, k: usize| {
        let mut resets = discrete.automata[k].transitions.iter().flat_map(|t| t.resets.iter());
        resets.any(|i| signature.unknowns.is_differential(*i))
    };
    let discrete = &signature.discrete;
    let decides = |k: &usize| {
        let kind = discrete.automata[*k].kind;
        kind.is_declared() || (kind.is_bound() && bounds_a_state(discrete, *k))
    };
    let automaton = (0..discrete.automata.len()).find(decides);
    automaton.map(|k| discrete.automata[k].name.to_string())
}

/// A run that is corrected by readings at every sample.
pub(crate) struct CorrectedRun<'a> {
    system: &'a dyn Model,
    p: &'a [f64],
    recording: &'a Recording,
    options: Options,
    memory: Option<RunMemory>,
    /// Unknowns: simulated up to a sample, and corrected by the readings there.
    pub y: Vec<f64>,
    simulated: Vec<f64>,
    /// The second of two samples with the same time.
    second: Option<CorrectedState>,
    /// Unknowns determined by readings at the previous sample, and those carried from there.
    carried: Option<(Vec<bool>, Vec<bool>)>,
}

/// State of the run at a sample.
#[derive(Debug, Clone)]
pub(crate) struct CorrectedState {
    /// Discrete numbers of its row, and those just before inputs take their values there.
    pub z: Vec<f64>,
    pub z_before: Vec<f64>,
    /// Unknowns, as simulated up to there.
    pub y: Vec<f64>,
    /// Whether an event occurred since the previous sample.
    pub is_cut: bool,
}

impl<'a> CorrectedRun<'a> {
    /// A run at the first sample, where `y` is a guess.
    pub(crate) fn new(
        system: &'a dyn Model,
        p: &'a [f64],
        recording: &'a Recording,
        y: Vec<f64>,
    ) -> Self {
        let simulated = y.clone();
        let options = Options::default();
        Self {
            system,
            p,
            recording,
            options,
            memory: None,
            y,
            simulated,
            second: None,
            carried: None,
        }
    }

    /// State of the run at the k-th sample, called for one sample after another; `None` if the model cannot be
    /// simulated up to there.
    pub(crate) fn next(&mut self, k: usize) -> Option<CorrectedState> {
        if let Some(second) = self.second.take() {
            return Some(second);
        }
        let times = &self.recording.times;
        let t = times[k];
        let begins = k == 0 || times[k - 1] == t;
        // The left limit, then the right one.
        let times_wanted = if begins { vec![t] } else { vec![times[k - 1], t, t] };
        let solution = [&self.y, &self.simulated].iter().find_map(|y| {
            let start: Vec<(usize, f64)> = y.iter().copied().enumerate().collect();
            self.run(&start, &times_wanted)
        })?;
        let last = solution.len() - 1;
        let left = last.saturating_sub(1);
        let is_cut = !solution.events.is_empty();
        let carried = |row: usize| CorrectedState {
            z: solution.z(row).to_vec(),
            z_before: solution.z(left).to_vec(),
            y: solution.y(row).to_vec(),
            is_cut,
        };
        let (now, second) = if times.get(k + 1) == Some(&t) && !begins {
            (carried(left), Some(carried(last)))
        } else {
            (carried(last), None)
        };
        self.memory.clone_from(&solution.memory);
        self.y.copy_from_slice(solution.y(last));
        self.simulated.copy_from_slice(solution.y(last));
        self.second = second;
        Some(now)
    }

    /// Unknowns simulated up to the last sample, without its readings.
    pub(crate) fn simulated(&self) -> &[f64] {
        &self.simulated
    }

    /// Applies the readings of a sample, and returns the unknowns that are carried in addition; `free` are the
    /// positions of the estimated parameters.
    pub(crate) fn keep(
        &mut self,
        free: &[usize],
        given: &[bool],
        y: &[f64],
        is_known: &mut [bool],
    ) {
        if self.carried.as_ref().is_none_or(|(of, _)| of != given) {
            self.carried = Some((given.to_vec(), carries(self.system, free, given)));
        }
        let Some((_, carried)) = &self.carried else { return };
        for (i, is_known) in is_known.iter_mut().enumerate() {
            if given[i] {
                self.y[i] = y[i];
            }
            *is_known = given[i] || carried[i];
        }
    }

    fn run(&self, start: &[(usize, f64)], times: &[f64]) -> Option<Solution> {
        let Self { system, p, .. } = *self;
        let problem = Problem { system: &system, p, inputs: &self.recording.inputs, start };
        let before = PriorState { memory: self.memory.as_ref(), ..PriorState::default() };
        let wanted = WantedResults::Resumed(before);
        dgd_runtime::SolvableSystem::integrate(&problem, times, &self.options, wanted).ok()
    }
}

/// Whether the reading of an unknown that a transition resets is closer to the reset value than to the value in `at`,
/// which a run without the transition has reached.
pub(crate) fn is_reset(
    system: &dyn Model,
    at: EvaluationPoint<'_>,
    given: &[bool],
    y: &[f64],
) -> bool {
    let discrete = &system.signature().discrete;
    let transitions =
        || discrete.transitions().flat_map(|(k, of)| of.resets.iter().map(move |i| (k, *i)));
    let mut r = vec![0.0; transitions().count()];
    system.resets(at, &mut r);
    transitions().zip(&r).any(|((automaton, i), r)| {
        let kind = discrete.automata[automaton].kind;
        kind.is_declared() && given[i] && (y[i] - r).abs() < (y[i] - at.y[i]).abs()
    })
}

/// The unknowns that a run carries although parameters are estimated: those whose equations contain none of these, and
/// read no unknown that is neither determined by readings nor carried.
fn carries(system: &dyn Model, free: &[usize], is_given: &[bool]) -> Vec<bool> {
    let signature = system.signature();
    let has_free = |pattern: &Pattern, row: usize| {
        pattern.positions().any(|(r, c)| r == row && free.contains(&c))
    };
    let n = signature.unknowns.len();
    let mut carries: Vec<bool> =
        (0..n).map(|i| !has_free(&signature.parameter_jacobian, i)).collect();
    loop {
        let spoilt = signature
            .jacobian
            .positions()
            .find(|(row, column)| carries[*row] && !is_given[*column] && !carries[*column]);
        match spoilt {
            Some((row, _)) => carries[row] = false,
            None => return carries,
        }
    }
}
