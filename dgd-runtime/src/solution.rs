//! The result of a simulation.

use std::fmt;

use dgd_signature::number::{short, with_unit};

use crate::integrate::RunMemory;
use crate::signal::LimitSide;
use crate::system::{Signature, Text, Unit};

/// Values at the requested times.
#[derive(Debug, Clone, PartialEq)]
pub struct Solution {
    /// Number of unknowns n, or of the chosen ones.
    pub n: usize,
    /// Number of directions n_s; 0 without sensitivities.
    pub n_s: usize,
    /// The requested times, s.
    pub times: Vec<f64>,
    /// Unknowns, n numbers per time.
    pub y: Vec<f64>,
    /// Outputs, n_w numbers per time; only of a run that evaluates them on its way
    /// ([`simulate_observed`](crate::simulate_observed)).
    pub w: Vec<f64>,
    /// Sensitivities, n · n_s numbers per time in the order of [`System`](crate::System); NaN where
    /// they are undefined.
    pub s: Vec<f64>,
    /// Values at the delayed times of outputs, one entry for each delay that an output has.
    pub delayed_outputs: Vec<DelayedOutputValues>,
    /// Number of discrete numbers n_z; 0 without modes and conditions on time.
    pub n_z: usize,
    /// Discrete numbers, n_z per time: modes, then conditions on time.
    pub z: Vec<f64>,
    /// Number of values about delayed unknowns; 0 if no output reads them and they were not requested.
    pub n_past: usize,
    /// The past of delayed unknowns ([`PastLayout`](crate::system::PastLayout)), n_past values per time.
    pub past: Vec<f64>,
    /// Transitions between modes, in the order in which they happened.
    pub events: Vec<Event>,
    /// Folds of algebraic equations, at which unknowns jump, in the order in which they were met.
    pub folds: Vec<Fold>,
    /// States that have jumped where modes changed, without a sum that the equations conserve; each once.
    pub jumps: Vec<Jump>,
    /// Where and why sensitivities are undefined.
    pub undefined: Vec<UndefinedSensitivity>,
    /// Thresholds on which the run began, so that sensitivities are one-sided.
    pub one_sided: Vec<OneSided>,
    /// State for continuing this run; only of a resumable run ([`WantedResults::Resumed`](crate::WantedResults)).
    pub memory: Option<RunMemory>,
    /// Counts of the work done.
    pub statistics: Statistics,
}

/// Values at the times t − τ, for each requested time t.
#[derive(Debug, Clone, PartialEq)]
pub struct DelayedOutputValues {
    /// Position among the model's delays.
    pub delay: usize,
    /// τ, s.
    pub tau: f64,
    /// t − τ, s, clamped to the times at which the solution is known.
    pub times: Vec<f64>,
    /// Unknowns, n numbers per time.
    pub y: Vec<f64>,
    /// Sensitivities, n · n_s numbers per time.
    pub s: Vec<f64>,
    /// Discrete numbers, n_z per time.
    pub z: Vec<f64>,
    /// The past of delayed unknowns, as many values per time as in the solution.
    pub past: Vec<f64>,
}

/// A time interval on which sensitivities are undefined.
///
/// Sensitivities of algebraic unknowns solve ∂f_a/∂y_a S_a = −(∂f_a/∂y_d S_d + ∂f_a/∂θ). Where the matrix is singular
/// they do not exist, and S_d, which is driven by them, cannot be continued: first derivatives cannot say whether a
/// perturbed solution would leave the singular point at the same time, later, or never. From the step that meets the
/// first singular point, all sensitivities are therefore undefined to the end of the simulation. The states are still
/// integrated.
#[derive(Debug, Clone, PartialEq)]
pub struct UndefinedSensitivity {
    /// Start of the interval, s.
    pub from: f64,
    /// Its end, s.
    pub until: f64,
    /// The equation whose derivative with respect to the algebraic unknowns vanishes or depends linearly on those of
    /// others; or the automaton that only grazes its threshold, everything that changed at one time, or the loop whose
    /// rows jump.
    pub equation: String,
    /// Which of these.
    pub cause: UndefinedCause,
}

/// A threshold on which a run began. Sensitivities to parameters that move it are derivatives on the side that the run
/// took: in the other direction the solution passes the threshold, or does not.
#[derive(Debug, Clone, PartialEq)]
pub struct OneSided {
    /// The time, s.
    pub t: f64,
    /// The automaton whose threshold it is.
    pub threshold: String,
    /// Parameters and start values that move it.
    pub directions: Vec<String>,
}

impl fmt::Display for OneSided {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { t, threshold, directions } = self;
        let names: Vec<String> = directions.iter().map(|name| format!("`{name}`")).collect();
        write!(
            f,
            "derivatives to {} are one-sided: at t = {t} s the solution starts at a threshold, `{threshold}`",
            names.join(", ")
        )
    }
}

/// Why sensitivities are undefined.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum UndefinedCause {
    /// An equation no longer determines an algebraic unknown.
    Singular,
    /// The solution grazes a threshold: a perturbed solution may miss it.
    Grazing,
    /// Events coincide that need not, and their order would make a difference.
    Simultaneous,
    /// The rows of a loop jump, and are too many for events.
    Unlocated,
    /// An algebraic unknown jumps at a fold of its equations.
    Fold,
}

/// A jump of algebraic unknowns at a fold: a point at which the solution that was followed ends, and another one goes
/// on.
#[derive(Debug, Clone, PartialEq)]
pub struct Fold {
    /// Time, s.
    pub t: f64,
    /// The unknown that jumps furthest, relative to its tolerance.
    pub unknown: String,
    /// Its unit.
    pub unit: Unit,
    /// Its value before, SI.
    pub from: f64,
    /// Its value after, SI.
    pub to: f64,
    /// The switch at which the solution ends; `None` at the start of a run.
    pub automaton: Option<Text>,
}

impl fmt::Display for Fold {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { t, unknown, unit, from, to, automaton } = self;
        let [from, to] = [from, to].map(|si| with_unit(short(unit.from_si(*si), 6), &unit.symbol));
        write!(
            f,
            "`{unknown}` jumps from {from} to {to} at t = {} s, as there the equations have no solution next to the one \
             before (a fold)",
            short(*t, 9)
        )?;
        match automaton {
            Some(automaton) => write!(f, ", beyond `{automaton}`"),
            None => Ok(()),
        }
    }
}

/// A transition between modes.
#[derive(Debug, Clone, PartialEq)]
pub struct Event {
    /// Time, s.
    pub t: f64,
    /// The automaton.
    pub automaton: Text,
    /// The mode left.
    pub from: Text,
    /// The mode entered.
    pub to: Text,
}

/// A state that jumped on entering modes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Jump {
    /// The time of the first jump, s.
    pub t: f64,
    /// Position of the unknown.
    pub unknown: usize,
    /// Its value just before.
    pub from: f64,
    /// Its value just after.
    pub to: f64,
    /// Its cause.
    pub cause: JumpCause,
    /// How often it has jumped for that cause.
    pub times: usize,
}

/// Why a state jumps, or should.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum JumpCause {
    /// The equations of the new modes force it, and no sum that it takes part in is conserved.
    Forced,
    /// Its derivative has an impulse of a size that the equations do not give; it has kept its value.
    Lost,
}

impl fmt::Display for UndefinedSensitivity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { from, until, equation, cause } = self;
        // Just after a start at 0 there are many zeros after the decimal point.
        let is_tiny = *from != 0.0 && from.abs() < 1e-5;
        let from = if is_tiny { format!("{from:e}") } else { from.to_string() };
        write!(f, "sensitivities are undefined from t = {from} s to {until} s, where ")?;
        match cause {
            UndefinedCause::Singular => {
                write!(f, "equation `{equation}` no longer determines an algebraic unknown")
            }
            UndefinedCause::Fold => write!(f, "`{equation}` jumps at a fold of its equations"),
            UndefinedCause::Simultaneous => {
                write!(f, "`{equation}` happen at one time, in an order that matters")
            }
            UndefinedCause::Unlocated => write!(
                f,
                "the rows of `{equation}` jump: they are too many to be followed one by one"
            ),
            UndefinedCause::Grazing => {
                write!(f, "`{equation}` changes its mode at a threshold that is only touched")
            }
        }
    }
}

/// Counts of the work done.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Statistics {
    /// Accepted steps.
    pub steps: usize,
    /// Rejected steps.
    pub rejected: usize,
    /// Evaluations of f, with or without g.
    pub evaluations: usize,
    /// Evaluations of f with its Jacobian.
    pub linearizations: usize,
    /// Factorisations, for steps and for consistent values.
    pub factorisations: usize,
    /// Segments of smooth inputs.
    pub segments: usize,
    /// Equal steps per sample; 0 if steps were adaptive.
    pub per_sample: u32,
}

impl Solution {
    /// Keeps only the unknowns at the positions `chosen`, in this order.
    pub(crate) fn keep(&mut self, chosen: &[usize]) {
        let rows = self.y.chunks_exact(self.n.max(1));
        self.y = rows.flat_map(|row| chosen.iter().map(|i| row[*i])).collect();
        self.n = chosen.len();
    }

    /// Records a jump, or counts it if the unknown has jumped before.
    pub(crate) fn note_jump(&mut self, jump: Jump) {
        let same = |other: &&mut Jump| other.unknown == jump.unknown && other.cause == jump.cause;
        match self.jumps.iter_mut().find(same) {
            Some(earlier) => earlier.times += 1,
            None => self.jumps.push(jump),
        }
    }

    /// Number of times.
    pub fn len(&self) -> usize {
        self.times.len()
    }

    /// Whether there are no times.
    pub fn is_empty(&self) -> bool {
        self.times.is_empty()
    }

    /// Unknowns at the k-th time.
    pub fn y(&self, k: usize) -> &[f64] {
        &self.y[k * self.n..(k + 1) * self.n]
    }

    /// Sensitivities at the k-th time: `s(k)[j * n + i]` is ∂yᵢ/∂θⱼ.
    pub fn s(&self, k: usize) -> &[f64] {
        let len = self.n * self.n_s;
        &self.s[k * len..(k + 1) * len]
    }

    /// Discrete numbers at the k-th time.
    pub fn z(&self, k: usize) -> &[f64] {
        &self.z[k * self.n_z..(k + 1) * self.n_z]
    }

    /// The past of delayed unknowns at the k-th time.
    pub fn past(&self, k: usize) -> &[f64] {
        &self.past[k * self.n_past..(k + 1) * self.n_past]
    }

    /// An empty solution of a run with n_s directions.
    pub fn empty(signature: &Signature, n_s: usize) -> Self {
        Self {
            n: signature.unknowns.len(),
            n_s,
            times: Vec::new(),
            y: Vec::new(),
            w: Vec::new(),
            s: Vec::new(),
            delayed_outputs: Vec::new(),
            n_z: signature.discrete.len(),
            z: Vec::new(),
            n_past: 0,
            past: Vec::new(),
            events: Vec::new(),
            folds: Vec::new(),
            jumps: Vec::new(),
            undefined: Vec::new(),
            one_sided: Vec::new(),
            memory: None,
            statistics: Statistics::default(),
        }
    }

    /// Clears all values and counts of work.
    pub(crate) fn forget_rows(&mut self) {
        self.times.clear();
        self.y.clear();
        self.w.clear();
        self.s.clear();
        self.z.clear();
        self.past.clear();
        self.folds.clear();
        self.undefined.clear();
        self.one_sided.clear();
        self.statistics = Statistics::default();
    }

    /// Which limit the values at the k-th time represent.
    pub fn side(&self, k: usize) -> LimitSide {
        side(&self.times, k)
    }
}

/// Which limit the k-th of the requested `times` means.
///
/// A time that occurs twice means just before and just after a jump of the inputs or an event. One that occurs once
/// means just after, at the end too: a row of a recording holds the inputs that apply from there on. At the start only
/// just after exists. A time that occurs more than twice belongs to replicates, and means just after.
pub fn side(times: &[f64], k: usize) -> LimitSide {
    let t = times[k];
    let is_first_of_two = times.get(k + 1) == Some(&t)
        && times.get(k + 2) != Some(&t)
        && (k == 0 || times[k - 1] != t);
    if t > times[0] && is_first_of_two { LimitSide::Left } else { LimitSide::Right }
}
