//! The trait that compiled models implement: the contract between the compiler and the runtime.
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
//! A model with modes, or with conditions on time, also depends on discrete numbers z, which change only at events:
//! first the mode of each automaton, counted from 0, then for each condition on time 1 where it holds and 0 where it
//! does not. M, f, w, the event functions e and the resets r depend on them.
//!
//! With the chosen directions θ, parameters and start values, the sensitivities S = ∂y/∂θ obey
//!
//! ```text
//!   M Ṡ = g(t, y, S, u, p) = ∂f/∂y S + ∂f/∂θ
//! ```
//!
//! All numbers are in SI units. Matrices with a [`Pattern`] are given by their non-zeros in its
//! order; dense ones are stored column by column: `s[j * n + i]` is ∂yᵢ/∂θⱼ.

pub mod storage;

use crate::codegen::taylor::{KeptSeries, NoTaylorSeries, SeriesTerms};

pub use dgd_signature::{
    Automaton, AutomatonKind, Clock, Conserved, Crossing, DelayedInput, DelayedUnknown,
    DifferentiatedInput, Direction, Discrete, Features, Input, Interpolation, JumpKind, Labels,
    List, Output, Parameter, PastLayout, Pattern, Signature, Text, Transition, Trigger, Unit,
    Unknown, Unknowns, arrays,
};
pub use storage::Storage;

/// A point at which a model is evaluated. Lengths are those of [`Signature`].
#[derive(Debug, Clone, Copy)]
pub struct EvaluationPoint<'a> {
    /// Time, s.
    pub t: f64,
    /// Unknowns.
    pub y: &'a [f64],
    /// Inputs: the declared ones, then the delayed ones, then the slopes of the delayed ones, then the past of delayed
    /// unknowns ([`PastLayout`]).
    pub u: &'a [f64],
    /// Parameters.
    pub p: &'a [f64],
    /// Discrete numbers; none for models without modes and conditions on time.
    pub z: &'a [f64],
}

/// A compiled model.
///
/// | symbol | length | |
/// |---|---|---|
/// | `y`, `f` | n | unknowns and right-hand sides |
/// | `u`, `udot` | n_u | inputs and their slopes, delayed inputs included |
/// | `p` | n_p | all parameters |
/// | `s`, `g` | n · n_s | sensitivities to the n_s chosen directions, and their right-hand sides |
/// | `w` | n_w | outputs |
/// | `z` | n_z | discrete numbers: modes of automata, then conditions on time |
/// | `e`, `r` | n_e, n_r | event functions and resets, transition by transition |
///
/// # Panics
///
/// Methods panic if a slice has a different length.
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

    /// Features that the signature may have; solvers skip code for all others.
    const FEATURES: Features = Features::ANY;

    /// Names, sizes, units, defaults and sparsity.
    fn signature(&self) -> &Signature;

    /// f(t, y, u, p).
    fn rhs(&self, at: EvaluationPoint<'_>, f: &mut [f64]);

    /// f, ∂f/∂y and df/dt = ∂f/∂t + ∂f/∂u u̇ along the inputs' slopes, in one pass.
    fn linearize(
        &self,
        at: EvaluationPoint<'_>,
        udot: &[f64],
        f: &mut [f64],
        jacobian: &mut [f64],
        dfdt: &mut [f64],
    );

    /// f and g = ∂f/∂y S + ∂f/∂θ, in one pass.
    fn sensitivity_rhs(&self, at: EvaluationPoint<'_>, s: &[f64], f: &mut [f64], g: &mut [f64]);

    /// The results of [`System::linearize`], and the same for g: g, ∂g/∂y and dg/dt.
    ///
    /// Row `j * n + i` of ∂g/∂y is ∂/∂y (Σₖ ∂fᵢ/∂yₖ Sₖⱼ + ∂fᵢ/∂θⱼ).
    #[allow(clippy::too_many_arguments)]
    fn sensitivity_linearize(
        &self,
        at: EvaluationPoint<'_>,
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
    fn parameter_jacobian(&self, at: EvaluationPoint<'_>, values: &mut [f64]);

    /// Non-zeros of ∂f/∂u, n × n_u.
    fn input_jacobian(&self, at: EvaluationPoint<'_>, values: &mut [f64]);

    /// ∂f/∂t at fixed y, u, p.
    fn time_derivative(&self, at: EvaluationPoint<'_>, values: &mut [f64]);

    /// Outputs w.
    fn outputs(&self, at: EvaluationPoint<'_>, w: &mut [f64]);

    /// Non-zeros of ∂w/∂y (n_w × n), ∂w/∂u (n_w × n_u) and ∂w/∂p (n_w × n_p), and ∂w/∂t (n_w).
    fn output_jacobians(
        &self,
        at: EvaluationPoint<'_>,
        dwdy: &mut [f64],
        dwdu: &mut [f64],
        dwdp: &mut [f64],
        dwdt: &mut [f64],
    );

    /// w and ∂w/∂θ = ∂w/∂y S + ∂w/∂θ|_y, n_w × n_s dense by columns.
    fn output_sensitivities(
        &self,
        at: EvaluationPoint<'_>,
        s: &[f64],
        w: &mut [f64],
        dw: &mut [f64],
    );

    /// Start values y₀(u, p); guesses where the unknown is algebraic. `at.y` is not read.
    fn start(&self, at: EvaluationPoint<'_>, y: &mut [f64]);

    /// ∂y₀/∂θ, n × n_s; rows of algebraic unknowns are overwritten by the solver. `at.y` is not read. The contribution
    /// of a start value of an element that is itself a direction is left to
    /// [`Problem::start_sensitivities`](crate::Problem::start_sensitivities).
    fn start_sensitivities(&self, at: EvaluationPoint<'_>, s: &mut [f64]);

    /// The residuals of the start equations: r, one for each. A system without them need not implement this.
    fn start_equations(&self, at: EvaluationPoint<'_>, rest: &mut [f64]) {
        let _ = at;
        rest.fill(0.0);
    }

    /// dr/dθ = ∂r/∂y S + ∂r/∂θ of the start equations, and ∂r/∂y, both dense by columns.
    fn start_equation_sensitivities(
        &self,
        at: EvaluationPoint<'_>,
        s: &[f64],
        drest: &mut [f64],
        drestdy: &mut [f64],
    ) {
        let _ = (at, s, drest, drestdy);
    }

    /// The n_τ delays τ. Only `at.p` is read. A system without delays need not implement this.
    fn delays(&self, _at: EvaluationPoint<'_>, tau: &mut [f64]) {
        tau.fill(0.0);
    }

    /// ∂τ/∂θ, n_τ × n_s dense by columns. Only `at.p` is read.
    fn delay_sensitivities(&self, _at: EvaluationPoint<'_>, dtau: &mut [f64]) {
        dtau.fill(0.0);
    }

    /// The variable delays.
    fn varying_delays(&self, at: EvaluationPoint<'_>, tau: &mut [f64]) {
        let _ = at;
        tau.fill(0.0);
    }

    /// dτ/dθ = ∂τ/∂y S + ∂τ/∂θ of the variable delays, and ∂τ/∂y, both dense by columns, and ∂τ/∂t + ∂τ/∂u u̇.
    #[allow(clippy::too_many_arguments)]
    fn varying_delay_sensitivities(
        &self,
        at: EvaluationPoint<'_>,
        udot: &[f64],
        s: &[f64],
        dtau: &mut [f64],
        dtaudy: &mut [f64],
        dtaudt: &mut [f64],
    ) {
        let _ = (at, udot, s, dtau, dtaudy, dtaudt);
    }

    /// The value of each delayed unknown at a time before the start (0 if the model does not give it), and its first
    /// two derivatives with respect to t. `at.y` and `at.u` are not read.
    fn histories(
        &self,
        at: EvaluationPoint<'_>,
        values: &mut [f64],
        rates: &mut [f64],
        curvatures: &mut [f64],
    ) {
        let _ = (at, values, rates, curvatures);
    }

    /// The derivatives of these values with respect to the directions, n_v × n_s dense by columns, and their slopes.
    fn history_sensitivities(&self, at: EvaluationPoint<'_>, s: &mut [f64], rates: &mut [f64]) {
        let _ = (at, s, rates);
    }

    /// The diagonal of M in the modes `at.z`, n ones and zeros. `at.y` is not read.
    fn mass(&self, at: EvaluationPoint<'_>, mass: &mut [f64]) {
        let _ = at;
        self.signature().write_mass(mass);
    }

    /// The times at which conditions on time switch, and their discrete numbers from then on. They depend only on
    /// parameters.
    fn condition_times(&self, at: EvaluationPoint<'_>, times: &mut [f64], after: &mut [f64]) {
        let _ = (at, times, after);
    }

    /// Derivatives of those times with respect to the directions, n_c × n_s dense by columns.
    fn condition_time_sensitivities(&self, at: EvaluationPoint<'_>, dtimes: &mut [f64]) {
        let _ = (at, dtimes);
    }

    /// Event functions e of all transitions, including those of other modes.
    fn event_functions(&self, at: EvaluationPoint<'_>, e: &mut [f64]) {
        let _ = (at, e);
    }

    /// Non-zeros of ∂e/∂θ at fixed unknowns and of ∂e/∂y, and ∂e/∂t + ∂e/∂u u̇.
    fn event_derivatives(
        &self,
        at: EvaluationPoint<'_>,
        udot: &[f64],
        de: &mut [f64],
        dedy: &mut [f64],
        dedt: &mut [f64],
    ) {
        let _ = (at, udot, de, dedy, dedt);
    }

    /// Values r of all resets, evaluated just before the transition.
    fn resets(&self, at: EvaluationPoint<'_>, r: &mut [f64]) {
        let _ = (at, r);
    }

    /// Non-zeros of ∂r/∂θ at fixed unknowns and of ∂r/∂y, and ∂r/∂t + ∂r/∂u u̇.
    fn reset_derivatives(
        &self,
        at: EvaluationPoint<'_>,
        udot: &[f64],
        dr: &mut [f64],
        drdy: &mut [f64],
        drdt: &mut [f64],
    ) {
        let _ = (at, udot, dr, drdy, drdt);
    }

    /// Jumps of the single unknowns, n₁ of them, on entering the modes `at.z`: their [`JumpKind`]s as numbers, c, the
    /// residuals of the constraints of these modes, and the non-zeros of H, where jumps and impulses d solve
    ///
    /// ```text
    ///   H d = −c(y)
    /// ```
    ///
    /// in the rows of unknowns that have an equation. Only of models with a matrix of jumps.
    fn jumps(
        &self,
        at: EvaluationPoint<'_>,
        kinds: &mut [f64],
        rests: &mut [f64],
        jacobian: &mut [f64],
    ) {
        let _ = (at, kinds, rests, jacobian);
    }

    /// ∂c/∂y S + ∂c/∂θ (n₁ × n_s dense by columns) and ∂c/∂t + ∂c/∂u u̇ of these, and the same for each non-zero of H.
    #[allow(clippy::too_many_arguments)]
    fn jump_sensitivities(
        &self,
        at: EvaluationPoint<'_>,
        udot: &[f64],
        s: &[f64],
        drests: &mut [f64],
        drestsdt: &mut [f64],
        djacobian: &mut [f64],
        djacobiandt: &mut [f64],
    ) {
        let _ = (at, udot, s, drests, drestsdt, djacobian, djacobiandt);
    }

    /// The number of series that [`System::taylor`] and [`System::sensitivity_taylor`] store.
    ///
    /// # Errors
    ///
    /// [`NoTaylorSeries`] for a model that has no Taylor series; the two must not be called then.
    fn taylor_series(&self) -> Result<KeptSeries, NoTaylorSeries> {
        Err(NoTaylorSeries::NotCompiled)
    }

    /// The Taylor series of the solution through `at`, with inputs that are straight lines, up to an order from 1 to
    /// [`MOST_ORDER`](crate::codegen::taylor::MOST_ORDER): yₖ in
    ///
    /// ```text
    ///   y(t + τh) = Σₖ yₖ τᵏ
    /// ```
    ///
    /// order by order, n numbers each. `kept` is work space for the stored series.
    fn taylor(
        &self,
        at: EvaluationPoint<'_>,
        udot: &[f64],
        h: f64,
        order: usize,
        kept: &mut [SeriesTerms],
        y: &mut [f64],
    ) {
        let _ = (at, udot, h, order, kept, y);
    }

    /// [`System::taylor`], and the series of S: the coefficient of order k of ∂yᵢ/∂θⱼ is `s[(k * n + i) * n_s + j]`, of
    /// which order 0 is given.
    #[allow(clippy::too_many_arguments)]
    fn sensitivity_taylor(
        &self,
        at: EvaluationPoint<'_>,
        udot: &[f64],
        h: f64,
        order: usize,
        kept: &mut [SeriesTerms],
        y: &mut [f64],
        s: &mut [f64],
    ) {
        let _ = (at, udot, h, order, kept, y, s);
    }

    /// F = M ẏ − f. ∂F/∂ẏ = M, and the other derivatives of F are those of −f.
    fn residual(&self, at: EvaluationPoint<'_>, ydot: &[f64], residual: &mut [f64]) {
        let mut mass = Self::Vector::zeros(residual.len());
        self.mass(at, mass.as_mut());
        self.rhs(at, residual);
        for ((r, mass), ydot) in residual.iter_mut().zip(mass.as_ref()).zip(ydot) {
            *r = if *mass == 0.0 { -*r } else { ydot - *r };
        }
    }
}
