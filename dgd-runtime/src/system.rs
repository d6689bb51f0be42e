//! What a compiled model is to the solvers: the contract between the compiler and the runtime.
//!
//! A model is the semi-explicit differential-algebraic system
//!
//! ```text
//!   M ẏ = f(t, y, u, p),   M = diag(1 or 0),   F(t, y, ẏ, u, p) = M ẏ − f = 0
//!   w = w(t, y, u, p)
//!   y(t₀) = y₀(u(t₀), p)         (a guess where M is 0)
//! ```
//!
//! of index 1 at most: ∂f_a/∂y_a is structurally non-singular over the rows and columns where M is
//! zero. Row i belongs to unknown i: where Mᵢ is one it reads ẏᵢ = fᵢ.
//!
//! A model with modes, or with conditions on time, also depends on discrete numbers z, which change
//! at events only: first the mode of each automaton, counted from 0, then for each condition on
//! time 1 where it holds and 0 where it does not. M, f, w, the event functions e and the resets r
//! depend on them.
//!
//! With the chosen directions θ, parameters and start values, the sensitivities S = ∂y/∂θ obey
//!
//! ```text
//!   M Ṡ = g(t, y, S, u, p) = ∂f/∂y S + ∂f/∂θ
//! ```
//!
//! All numbers are in SI units. Matrices with a [`Pattern`] are given by their non-zeros in its
//! order; dense ones are stored column by column: `s[j * n + i]` is ∂yᵢ/∂θⱼ.

use std::borrow::Cow;

use crate::arrays::{Labels, Unknowns};
use crate::ensemble::lanes::{self, LanePoint, LaneStorage, Lanes};
use crate::error::Failure;
use crate::integrate::{self, Wanted};
use crate::linalg::Factorisation;
use crate::problem::{Options, Problem};
use crate::solution::Solution;
use crate::taylor::{KeptSeries, NoTaylor, Terms};

pub use crate::pattern::Pattern;

/// Numbers of a size that is known when the program is compiled, `[f64; N]`, or when it runs,
/// `Vec<f64>`.
pub trait Storage: AsRef<[f64]> + AsMut<[f64]> + Clone {
    /// As many numbers for each of several members of an ensemble.
    type Lanes: LaneStorage;
    /// The square of as many.
    type LaneSquare: LaneStorage;

    /// Whether their number is known when the program is compiled.
    const FIXED: bool;

    /// `len` zeros.
    ///
    /// # Panics
    ///
    /// If the size is fixed and is not `len`.
    fn zeros(len: usize) -> Self;

    /// The numbers, to be put back: an array is copied, so that it can be in registers for a while, and
    /// a vector is moved.
    #[must_use]
    fn take(&mut self) -> Self;
}

impl<const N: usize> Storage for [f64; N] {
    type Lanes = [Lanes; N];
    type LaneSquare = [[Lanes; N]; N];

    const FIXED: bool = true;

    #[inline]
    fn zeros(len: usize) -> Self {
        assert_eq!(len, N, "storage of fixed size");
        [0.0; N]
    }

    #[inline]
    fn take(&mut self) -> Self {
        *self
    }
}

impl Storage for Vec<f64> {
    type Lanes = Vec<Lanes>;
    type LaneSquare = Vec<Lanes>;

    const FIXED: bool = false;

    fn zeros(len: usize) -> Self {
        vec![0.0; len]
    }

    #[inline]
    fn take(&mut self) -> Self {
        std::mem::take(self)
    }
}

/// Where a model is evaluated. Lengths are those of [`Signature`].
#[derive(Debug, Clone, Copy)]
pub struct Point<'a> {
    /// Time, s.
    pub t: f64,
    /// Unknowns.
    pub y: &'a [f64],
    /// Inputs: the declared ones, then the delayed ones, then the slopes of the delayed ones, then what
    /// is known of delayed unknowns ([`PastLayout`]).
    pub u: &'a [f64],
    /// Parameters.
    pub p: &'a [f64],
    /// Discrete numbers; none for models without modes and conditions on time.
    pub z: &'a [f64],
}

/// What models of a type may have. A solver of models that never have it does not look for it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Features {
    /// Discrete numbers: modes, or conditions on time.
    pub events: bool,
    /// Inputs or unknowns that equations read late.
    pub past: bool,
    /// Algebraic unknowns, in some mode.
    pub algebraic: bool,
}

impl Features {
    /// Whatever a model can have.
    pub const ANY: Self = Self { events: true, past: true, algebraic: true };

    /// Whether a model like this keeps to them.
    pub fn cover(self, signature: &Signature) -> bool {
        let delayed = signature.delayed_inputs.len() + signature.delayed_unknowns.len();
        let algebraic = signature.unknowns.iter().any(|unknown| !unknown.differential);
        (self.events || signature.discrete.is_empty())
            && (self.past || delayed == 0)
            && (self.algebraic || !algebraic)
    }
}

/// A compiled model.
///
/// | symbol | length | |
/// |---|---|---|
/// | `y`, `f` | n | unknowns and right-hand sides |
/// | `u`, `udot` | n_u | inputs and their slopes, delayed inputs included |
/// | `p` | n_p | parameters, all of them |
/// | `s`, `g` | n · n_s | sensitivities to the n_s chosen directions, and their right-hand sides |
/// | `w` | n_w | outputs |
/// | `z` | n_z | discrete numbers: modes of automata, then conditions on time |
/// | `e`, `r` | n_e, n_r | event functions and resets, transition by transition |
///
/// # Panics
///
/// Methods panic when a slice has another length.
pub trait System {
    /// n numbers.
    type Vector: Storage;
    /// n · n_s numbers.
    type Sensitivity: Storage;
    /// n_u numbers.
    type Inputs: Storage;
    /// Non-zeros of ∂f/∂y.
    type Jacobian: Storage;
    /// Non-zeros of ∂g/∂y.
    type SensitivityJacobian: Storage;
    /// How W = M c − ∂f/∂y is factorised.
    type Factorisation: Factorisation;

    /// What the signature may have; it never has what is not here.
    const FEATURES: Features = Features::ANY;

    /// Names, sizes, units, defaults and sparsity.
    fn signature(&self) -> &Signature;

    /// f(t, y, u, p).
    fn rhs(&self, at: Point<'_>, f: &mut [f64]);

    /// f, ∂f/∂y and df/dt = ∂f/∂t + ∂f/∂u u̇ along the inputs' slopes, in one pass.
    fn linearize(
        &self,
        at: Point<'_>,
        udot: &[f64],
        f: &mut [f64],
        jacobian: &mut [f64],
        dfdt: &mut [f64],
    );

    /// f and g = ∂f/∂y S + ∂f/∂θ, in one pass.
    fn sensitivity_rhs(&self, at: Point<'_>, s: &[f64], f: &mut [f64], g: &mut [f64]);

    /// What [`System::linearize`] gives, and the same of g: g, ∂g/∂y and dg/dt.
    ///
    /// Row `j * n + i` of ∂g/∂y is ∂/∂y (Σₖ ∂fᵢ/∂yₖ Sₖⱼ + ∂fᵢ/∂θⱼ).
    #[allow(clippy::too_many_arguments)]
    fn sensitivity_linearize(
        &self,
        at: Point<'_>,
        udot: &[f64],
        s: &[f64],
        f: &mut [f64],
        jacobian: &mut [f64],
        dfdt: &mut [f64],
        g: &mut [f64],
        dgdy: &mut [f64],
        dgdt: &mut [f64],
    );

    /// Non-zeros of ∂f/∂p, n × n_p, all parameters.
    fn parameter_jacobian(&self, at: Point<'_>, values: &mut [f64]);

    /// Non-zeros of ∂f/∂u, n × n_u.
    fn input_jacobian(&self, at: Point<'_>, values: &mut [f64]);

    /// ∂f/∂t at fixed y, u, p.
    fn time_derivative(&self, at: Point<'_>, values: &mut [f64]);

    /// Outputs w.
    fn outputs(&self, at: Point<'_>, w: &mut [f64]);

    /// Non-zeros of ∂w/∂y (n_w × n), ∂w/∂u (n_w × n_u) and ∂w/∂p (n_w × n_p), and ∂w/∂t (n_w).
    fn output_jacobians(
        &self,
        at: Point<'_>,
        dwdy: &mut [f64],
        dwdu: &mut [f64],
        dwdp: &mut [f64],
        dwdt: &mut [f64],
    );

    /// w and ∂w/∂θ = ∂w/∂y S + ∂w/∂θ|_y, n_w × n_s dense by columns.
    fn output_sensitivities(&self, at: Point<'_>, s: &[f64], w: &mut [f64], dw: &mut [f64]);

    /// Start values y₀(u, p); guesses where the unknown is algebraic. `at.y` is not read.
    fn start(&self, at: Point<'_>, y: &mut [f64]);

    /// ∂y₀/∂θ, n × n_s; rows of algebraic unknowns are overwritten by the solver. `at.y` is not
    /// read.
    fn start_sensitivities(&self, at: Point<'_>, s: &mut [f64]);

    /// The delays τ, n_τ of them. Only `at.p` is read. A system without delays need not say so.
    fn delays(&self, _at: Point<'_>, tau: &mut [f64]) {
        tau.fill(0.0);
    }

    /// ∂τ/∂θ, n_τ × n_s dense by columns. Only `at.p` is read.
    fn delay_sensitivities(&self, _at: Point<'_>, dtau: &mut [f64]) {
        dtau.fill(0.0);
    }

    /// The delays that vary.
    fn varying_delays(&self, at: Point<'_>, tau: &mut [f64]) {
        let _ = at;
        tau.fill(0.0);
    }

    /// dτ/dθ = ∂τ/∂y S + ∂τ/∂θ of the delays that vary, and ∂τ/∂y, both dense by columns, and
    /// ∂τ/∂t + ∂τ/∂u u̇.
    #[allow(clippy::too_many_arguments)]
    fn varying_delay_sensitivities(
        &self,
        at: Point<'_>,
        udot: &[f64],
        s: &[f64],
        dtau: &mut [f64],
        dtaudy: &mut [f64],
        dtaudt: &mut [f64],
    ) {
        let _ = (at, udot, s, dtau, dtaudy, dtaudt);
    }

    /// What each delayed unknown was at a time before the start, 0 where the model does not say, with
    /// two derivatives to t. `at.y` and `at.u` are not read.
    fn histories(
        &self,
        at: Point<'_>,
        values: &mut [f64],
        rates: &mut [f64],
        curvatures: &mut [f64],
    ) {
        let _ = (at, values, rates, curvatures);
    }

    /// The derivatives of that to the directions, n_v × n_s dense by columns, and their slopes.
    fn history_sensitivities(&self, at: Point<'_>, s: &mut [f64], rates: &mut [f64]) {
        let _ = (at, s, rates);
    }

    /// The diagonal of M in the modes `at.z`, n ones and zeros. `at.y` is not read.
    fn mass(&self, at: Point<'_>, mass: &mut [f64]) {
        let _ = at;
        self.signature().write_mass(mass);
    }

    /// When conditions on time switch, and their discrete numbers from then on. They depend on
    /// parameters only.
    fn condition_times(&self, at: Point<'_>, times: &mut [f64], after: &mut [f64]) {
        let _ = (at, times, after);
    }

    /// Derivatives of those times to the directions, n_c × n_s dense by columns.
    fn condition_time_sensitivities(&self, at: Point<'_>, dtimes: &mut [f64]) {
        let _ = (at, dtimes);
    }

    /// Event functions e of all transitions, those of other modes too.
    fn event_functions(&self, at: Point<'_>, e: &mut [f64]) {
        let _ = (at, e);
    }

    /// ∂e/∂y S + ∂e/∂θ (n_e × n_s dense by columns), non-zeros of ∂e/∂y, and ∂e/∂t + ∂e/∂u u̇.
    fn event_sensitivities(
        &self,
        at: Point<'_>,
        udot: &[f64],
        s: &[f64],
        de: &mut [f64],
        dedy: &mut [f64],
        dedt: &mut [f64],
    ) {
        let _ = (at, udot, s, de, dedy, dedt);
    }

    /// Values r of all resets, read before the transition.
    fn resets(&self, at: Point<'_>, r: &mut [f64]) {
        let _ = (at, r);
    }

    /// ∂r/∂y S + ∂r/∂θ (n_r × n_s dense by columns), non-zeros of ∂r/∂y, and ∂r/∂t + ∂r/∂u u̇.
    fn reset_sensitivities(
        &self,
        at: Point<'_>,
        udot: &[f64],
        s: &[f64],
        dr: &mut [f64],
        drdy: &mut [f64],
        drdt: &mut [f64],
    ) {
        let _ = (at, udot, s, dr, drdy, drdt);
    }

    /// How many series [`System::taylor`] and [`System::sensitivity_taylor`] keep.
    ///
    /// # Errors
    ///
    /// [`NoTaylor`] for a model that has no Taylor series; the two must not be called then.
    fn taylor_series(&self) -> Result<KeptSeries, NoTaylor> {
        Err(NoTaylor::NotCompiled)
    }

    /// The Taylor series of the solution through `at`, whose inputs are straight lines, up to an order
    /// from 1 to [`MOST_ORDER`](crate::taylor::MOST_ORDER): yₖ in
    ///
    /// ```text
    ///   y(t + τh) = Σₖ yₖ τᵏ
    /// ```
    ///
    /// order by order, n numbers each. `kept` is work space of as many series as it takes.
    fn taylor(
        &self,
        at: Point<'_>,
        udot: &[f64],
        h: f64,
        order: usize,
        kept: &mut [Terms],
        y: &mut [f64],
    ) {
        let _ = (at, udot, h, order, kept, y);
    }

    /// [`System::taylor`], with the series of S: those of order k at `s[(k * n + i) * n_s + j]` for
    /// ∂yᵢ/∂θⱼ, of which order 0 is given.
    #[allow(clippy::too_many_arguments)]
    fn sensitivity_taylor(
        &self,
        at: Point<'_>,
        udot: &[f64],
        h: f64,
        order: usize,
        kept: &mut [Terms],
        y: &mut [f64],
        s: &mut [f64],
    ) {
        let _ = (at, udot, h, order, kept, y, s);
    }

    /// Integrates the system, for [`simulate`](crate::simulate) and
    /// [`simulate_with_sensitivities`](crate::simulate_with_sensitivities).
    ///
    /// A system whose sizes are known at run time only may hand the problem to one that is the same
    /// with its sizes as constants.
    ///
    /// # Errors
    ///
    /// [`Failure`], with what was reached.
    fn integrate(
        problem: &Problem<'_, Self>,
        times: &[f64],
        options: &Options,
        wanted: Wanted<'_>,
    ) -> Result<Solution, Failure>
    where
        Self: Sized,
    {
        integrate::integrate(problem, times, options, wanted)
    }

    /// [`System::rhs`] for several members of an ensemble: the same bits. Only models without discrete
    /// numbers, small enough for lanes, are asked.
    #[inline]
    fn rhs_lanes(&self, at: LanePoint<'_>, f: &mut [Lanes]) {
        lanes::rhs_of_any(self, at, f);
    }

    /// [`System::linearize`] for several members of an ensemble.
    #[inline]
    fn linearize_lanes(
        &self,
        at: LanePoint<'_>,
        udot: &[Lanes],
        f: &mut [Lanes],
        jacobian: &mut [Lanes],
        dfdt: &mut [Lanes],
    ) {
        lanes::linearize_any(self, at, udot, f, jacobian, dfdt);
    }

    /// [`System::outputs`] for several members of an ensemble, or several times of one.
    #[inline]
    fn outputs_lanes(&self, at: LanePoint<'_>, w: &mut [Lanes]) {
        lanes::outputs_of_any(self, at, w);
    }

    /// F = M ẏ − f. ∂F/∂ẏ = M, and the other derivatives of F are those of −f.
    fn residual(&self, at: Point<'_>, ydot: &[f64], residual: &mut [f64]) {
        let mut mass = Self::Vector::zeros(residual.len());
        self.mass(at, mass.as_mut());
        self.rhs(at, residual);
        for ((r, mass), ydot) in residual.iter_mut().zip(mass.as_ref()).zip(ydot) {
            *r = if *mass == 0.0 { -*r } else { ydot - *r };
        }
    }
}

/// Names, sizes, units, defaults and sparsity of a compiled model.
///
/// Borrowed and static for generated models, owned for loaded ones.
#[derive(Debug, Clone, PartialEq)]
pub struct Signature {
    /// The model's name.
    pub name: Text,
    /// Unknowns y, n of them.
    pub unknowns: Unknowns,
    /// Label of the equation behind row i of f.
    pub equations: Labels,
    /// Parameters p.
    pub parameters: List<Parameter>,
    /// Inputs, as declared.
    pub inputs: List<Input>,
    /// Distinct delays τ, as formulas write them.
    pub delays: List<Text>,
    /// Distinct delays that vary, as formulas write them: of time, inputs and differential unknowns.
    pub varying_delays: List<Text>,
    /// Inputs that the equations read late: u has them, and then their slopes, behind `inputs`.
    pub delayed_inputs: List<DelayedInput>,
    /// Unknowns that the equations read late: u has what is known of them ([`PastLayout`]) behind the
    /// inputs.
    pub delayed_unknowns: List<DelayedUnknown>,
    /// Inputs that equations are differentiated through to bring the index to 1.
    pub differentiated_inputs: List<DifferentiatedInput>,
    /// Outputs w.
    pub outputs: List<Output>,
    /// Chosen directions θ.
    pub directions: List<Direction>,
    /// Where ∂f/∂y is not zero: n × n.
    pub jacobian: Pattern,
    /// Where ∂g/∂y is not zero: (n · n_s) × n.
    pub sensitivity_jacobian: Pattern,
    /// Where ∂f/∂p is not zero: n × n_p.
    pub parameter_jacobian: Pattern,
    /// Where ∂f/∂u is not zero: n × n_u.
    pub input_jacobian: Pattern,
    /// Where ∂w/∂y, ∂w/∂u and ∂w/∂p are not zero.
    pub output_jacobians: [Pattern; 3],
    /// Modes, transitions and conditions on time.
    pub discrete: Discrete,
}

/// Modes, transitions and conditions on time.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Discrete {
    /// Automata; z begins with their modes.
    pub automata: List<Automaton>,
    /// Number of conditions on time n_c, which follow in z.
    pub n_time_conditions: usize,
    /// Where ∂e/∂y is not zero: n_e × n.
    pub event_jacobian: Pattern,
    /// Where ∂r/∂y is not zero: n_r × n.
    pub reset_jacobian: Pattern,
}

/// What an automaton stands for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum AutomatonKind {
    /// A `modes` block.
    Modes,
    /// A `when`: one mode, and a transition from it to itself.
    When,
    /// An unknown with bounds: free, or at one of them.
    Saturation,
    /// Which unknowns are states, of those that constraints tie together. The solution is the same
    /// in all of its modes, and each is left for the one in which the constraints determine the
    /// others best.
    States,
    /// A switch whose value jumps: below its surface (0), above it (1), or sliding along it (2). Its
    /// first transition leads from below to above.
    Switch,
    /// A switch whose slope jumps: steps end at its surface, and nothing else happens there.
    Corner,
}

/// When a transition acts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Trigger {
    /// Once its condition becomes true: not while it has been true since the mode was entered.
    Edge,
    /// Whenever its condition is true.
    Level,
    /// If its condition is true at once in the mode that the solution enters at a surface.
    Entry,
    /// If its condition is true at the start of a run: the first such is the mode to start in.
    Start,
}

/// A `modes` block of the model, or what else changes at events.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Automaton {
    /// What it stands for.
    pub kind: AutomatonKind,
    /// Its name.
    pub name: Text,
    /// Names of its modes.
    pub modes: List<Text>,
    /// The mode it starts in where no transition at the start says another.
    pub start: usize,
    /// Which mode follows which.
    pub transitions: List<Transition>,
}

/// A transition between modes, when its event function passes zero.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Transition {
    /// Position of the mode that it leaves; the number of modes where it leaves none, at the start.
    pub from: usize,
    /// Position of the mode that it enters.
    pub to: usize,
    /// In which direction its event function passes zero.
    pub crossing: Crossing,
    /// When it acts.
    pub trigger: Trigger,
    /// Positions of the unknowns that it resets.
    pub resets: List<usize>,
}

/// In which direction an event function passes zero.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Crossing {
    /// From below.
    Rises,
    /// From above.
    Falls,
}

impl Crossing {
    /// Whether this value of the event function lies beyond the threshold.
    #[inline]
    pub fn is_past(self, e: f64) -> bool {
        match self {
            Crossing::Rises => e > 0.0,
            Crossing::Falls => e < 0.0,
        }
    }
}

impl Discrete {
    /// No modes and no conditions on time.
    pub const NONE: Self = Self {
        automata: List::Borrowed(&[]),
        n_time_conditions: 0,
        event_jacobian: Pattern::EMPTY,
        reset_jacobian: Pattern::EMPTY,
    };

    /// Number of discrete numbers n_z.
    pub fn len(&self) -> usize {
        self.automata.len() + self.n_time_conditions
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Transitions of all automata, each with its automaton's position, in the order of the event
    /// functions and resets.
    pub fn transitions(&self) -> impl Iterator<Item = (usize, &Transition)> {
        let automata = self.automata.iter().enumerate();
        automata.flat_map(|(k, automaton)| automaton.transitions.iter().map(move |t| (k, t)))
    }
}

/// Text that a generated model borrows and a loaded one owns.
pub type Text = Cow<'static, str>;

/// A list that a generated model borrows and a loaded one owns.
pub type List<T> = Cow<'static, [T]>;

/// A unit as the model declares it: SI = value · factor + offset.
#[derive(Debug, Clone, PartialEq)]
pub struct Unit {
    /// As written.
    pub symbol: Text,
    /// SI units in one of it.
    pub factor: f64,
    /// SI value at its zero.
    pub offset: f64,
}

impl Unit {
    /// The value in this unit of one in SI.
    pub fn from_si(&self, si: f64) -> f64 {
        (si - self.offset) / self.factor
    }
}

/// Something that sensitivities are taken to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Direction {
    /// The parameter at this position.
    Parameter(usize),
    /// The start value of the unknown at this position.
    Start(usize),
}

impl Signature {
    /// n_u, the length of u.
    pub fn n_u(&self) -> usize {
        let past = self.past();
        past.first + past.len()
    }

    /// Where u has what is known of delayed unknowns.
    pub fn past(&self) -> PastLayout {
        PastLayout {
            first: self.inputs.len() + 2 * self.delayed_inputs.len(),
            n_v: self.delayed_unknowns.len(),
            n_s: self.directions.len(),
        }
    }

    /// The diagonal of M in the modes that the model starts in.
    ///
    /// # Panics
    ///
    /// If there are not as many numbers as unknowns.
    pub fn write_mass(&self, mass: &mut [f64]) {
        self.unknowns.write_mass(mass);
    }

    /// What the j-th direction is called: a parameter by its name, a start value as `x(0)`.
    ///
    /// # Panics
    ///
    /// If there is no such direction.
    pub fn direction_name(&self, j: usize) -> Text {
        match self.directions[j] {
            Direction::Parameter(i) => self.parameters[i].name.clone(),
            Direction::Start(i) => format!("{}(0)", self.unknowns.name(i)).into(),
        }
    }

    /// The unit of the j-th direction.
    ///
    /// # Panics
    ///
    /// If there is no such direction.
    pub fn direction_unit(&self, j: usize) -> &Unit {
        match self.directions[j] {
            Direction::Parameter(i) => &self.parameters[i].unit,
            Direction::Start(i) => self.unknowns.unit(i),
        }
    }
}

/// An unknown of the system.
#[derive(Debug, Clone, PartialEq)]
pub struct Unknown {
    /// Name in the model.
    pub name: Text,
    /// Declared unit.
    pub unit: Unit,
    /// Size for tolerances, SI; `None`: the size of its start value.
    pub nominal: Option<f64>,
    /// Whether row i is ẏᵢ = fᵢ in the modes that the model starts in; otherwise 0 = fᵢ.
    pub differential: bool,
}

/// A parameter.
#[derive(Debug, Clone, PartialEq)]
pub struct Parameter {
    /// Name in the model.
    pub name: Text,
    /// Declared unit.
    pub unit: Unit,
    /// Declared value, SI.
    pub value: f64,
    /// Lower bound, SI; minus infinity without one.
    pub lower: f64,
    /// Upper bound, SI; infinity without one.
    pub upper: f64,
    /// Size for scaling, SI; `None`: its value, or 1 in the declared unit where that is zero.
    pub nominal: Option<f64>,
    /// Whether its logarithm is estimated.
    pub log: bool,
    /// Whether it is left alone by estimators unless asked for.
    pub fixed: bool,
}

/// How an input goes on between two samples.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Interpolation {
    /// The sample holds until the next.
    Hold,
    /// A straight line to the next sample.
    Linear,
}

/// An input.
#[derive(Debug, Clone, PartialEq)]
pub struct Input {
    /// Name in the model.
    pub name: Text,
    /// Declared unit.
    pub unit: Unit,
    /// Between samples.
    pub interpolation: Interpolation,
}

/// An input read late, u(t − τ).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct DelayedInput {
    /// Position of the input.
    pub input: usize,
    /// Position of the delay τ.
    pub delay: usize,
}

/// An unknown read late, x(t − τ).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct DelayedUnknown {
    /// Position of the unknown.
    pub unknown: usize,
    /// Position of the delay τ, or among those that vary.
    pub delay: usize,
    /// Whether its delay varies.
    pub varies: bool,
    /// Whether the model says what it was before the start ([`System::histories`]); otherwise that is
    /// what it starts with.
    pub has_history: bool,
}

/// Where u has what is known of the n_v delayed unknowns, each x looked up at α = t − τ.
///
/// | numbers | |
/// |---|---|
/// | n_v | 1 where x is read at α, 0 where it is read at t, whatever the others say |
/// | n_v | x(α) |
/// | n_v | ẋ(α) |
/// | n_v | ẍ(α) |
/// | n_v n_s | ∂x/∂θⱼ at α, by columns |
/// | n_v n_s | their slopes |
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PastLayout {
    /// Inputs before it.
    pub first: usize,
    /// Delayed unknowns n_v.
    pub n_v: usize,
    /// Directions n_s.
    pub n_s: usize,
}

impl PastLayout {
    /// Number of all of them.
    pub fn len(self) -> usize {
        (4 + 2 * self.n_s) * self.n_v
    }

    /// Whether nothing is read late.
    pub fn is_empty(self) -> bool {
        self.n_v == 0
    }
}

/// An input that an equation is differentiated through: where it jumps, states would have to.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DifferentiatedInput {
    /// Position of the input.
    pub input: usize,
    /// Label of the equation.
    pub equation: Text,
}

/// An output.
#[derive(Debug, Clone, PartialEq)]
pub struct Output {
    /// Name in the model.
    pub name: Text,
    /// Declared unit.
    pub unit: Unit,
    /// Standard deviation of the sensor's white error, SI.
    pub noise: Option<f64>,
    /// Which delay it is read late by: w(t) is what [`System::outputs`] gives at t − τ.
    pub delay: Option<usize>,
}
