//! In which modes a system was at each sample, and unknowns that follow from what is measured.
//!
//! A model with modes is simulated from one sample to the next, with the parameters that the regression has so
//! far. At every sample readings take the place of all unknowns that they give. So conditions are those on
//! readings, noise included; what no reading gives, as the level in a line while it drains, goes along by its
//! own equations, and is as good as known where these have no parameter to be estimated and read nothing
//! else.

use dgd_runtime::integrate::Memory;
use dgd_runtime::model::Model;
use dgd_runtime::{Before, Discrete, Options, Pattern, Point, Problem, Solution, Wanted};

use crate::recording::Recording;

/// The name of an automaton whose modes are to be remembered, if there is one.
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
    let found = (0..discrete.automata.len()).find(decides);
    found.map(|k| discrete.automata[k].name.to_string())
}

/// A run that readings correct at every sample.
pub(crate) struct Carrier<'a> {
    system: &'a dyn Model,
    p: &'a [f64],
    recording: &'a Recording,
    options: Options,
    memory: Option<Memory>,
    /// Unknowns: as simulated up to a sample, and with what readings gave there.
    pub y: Vec<f64>,
    simulated: Vec<f64>,
    /// The second of two samples with one time.
    second: Option<Carried>,
    /// What readings gave at the sample before, and what is carried then.
    carried: Option<(Vec<bool>, Vec<bool>)>,
}

/// What the run says of a sample.
#[derive(Debug, Clone)]
pub(crate) struct Carried {
    /// Discrete numbers of its row, and just before inputs take their values there.
    pub z: Vec<f64>,
    pub z_before: Vec<f64>,
    /// Unknowns, as simulated up to there.
    pub y: Vec<f64>,
    /// Whether something happened since the sample before.
    pub is_cut: bool,
}

impl<'a> Carrier<'a> {
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

    /// What the run says of the k-th sample, one after the other; `None` where the model cannot be simulated
    /// up to there.
    pub(crate) fn next(&mut self, k: usize) -> Option<Carried> {
        if let Some(second) = self.second.take() {
            return Some(second);
        }
        let times = &self.recording.times;
        let t = times[k];
        let begins = k == 0 || times[k - 1] == t;
        // The left limit, then the right one.
        let asked = if begins { vec![t] } else { vec![times[k - 1], t, t] };
        let solution = [&self.y, &self.simulated].iter().find_map(|y| {
            let start: Vec<(usize, f64)> = y.iter().copied().enumerate().collect();
            self.run(&start, &asked)
        })?;
        let last = solution.len() - 1;
        let left = last.saturating_sub(1);
        let is_cut = !solution.events.is_empty();
        let carried = |row: usize| Carried {
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

    /// Unknowns as simulated up to the last sample, without what readings gave there.
    pub(crate) fn simulated(&self) -> &[f64] {
        &self.simulated
    }

    /// Takes in what readings give at a sample, and says what is known there beside that: what is carried, with
    /// parameters at these positions to be estimated.
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
        let before = Before { memory: self.memory.as_ref(), ..Before::default() };
        let wanted = Wanted::Resumed(before);
        dgd_runtime::Solved::integrate(&problem, times, &self.options, wanted).ok()
    }
}

/// Whether what readings give of an unknown that a transition resets is nearer to the value that it is reset to
/// than to that at `at`, which a run without the transition has come to.
pub(crate) fn is_reset(system: &dyn Model, at: Point<'_>, given: &[bool], y: &[f64]) -> bool {
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

/// Which unknowns a run carries although parameters are to be estimated: those whose equations have none of
/// these, and read no unknown that is neither given by readings nor carried.
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
