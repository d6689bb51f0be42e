//! Linearisation of a compiled model at a point: matrices, poles, steady states.
//!
//! ```text
//!   OperatingPoint::reached(problem, from, t, options)  the point of a run at a time
//!   steady_state(problem, t, options)                   a point at rest, 0 = f(t, y, u, p)
//!   rest(problem, t, options)                           likewise, with conserved sums fixed
//!   linearize(problem, point)                           → StateSpace: A, B, C, D
//!   StateSpace::poles()                                 → Poles
//!   LinearAt                                            where the linear model of a recording is
//! ```
//!
//! Close to the point, with deviations of the states x (the unknowns that have a derivative there), of the inputs u
//! and of the outputs w from their values at it,
//!
//! ```text
//!   ẋ = A x + B u + A₁ v
//!   w = C x + D u + C₁ v             v_k(t) = r_k(t − τ_k),  r = E x + F u + G v
//! ```
//!
//! where v are delayed unknowns, if there are any. Algebraic unknowns are eliminated: with d for rows and columns of
//! the states and a for those of the others,
//!
//! ```text
//!   0 = f_a  ⇒  ∂y_a/∂(x, u, v) = −(∂f_a/∂y_a)⁻¹ ∂f_a/∂(x, u, v)
//!   A = ∂f_d/∂y_d + ∂f_d/∂y_a ∂y_a/∂x,  and so on
//! ```
//!
//! All derivatives are the compiled ones. Modes and the sides of switches are those at the point: the linear model has
//! no transitions. Time itself is frozen, so the linear model of a time-dependent model, or at a point that is not at
//! rest, is valid only for a short while.

mod conserved;
mod elimination;
mod error;
mod exponential;
mod held;
mod parametric;
mod point;
mod poles;
mod singular;
mod start;
mod steady;

pub use nalgebra::DMatrix;

use crate::observe::delay::delays;
use crate::problem::Problem;
use crate::solved::SolvableSystem;
use crate::system::{EvaluationPoint, Pattern, Storage};
pub use conserved::ConservedCombination;
pub use elimination::Elimination;
pub use error::{LinearizeError, NotLinearised, SteadyStateError};
pub use parametric::LinearAt;
pub use point::OperatingPoint;
pub use poles::{Pole, Poles, Stability};
pub use start::find_start;
pub use steady::{SteadyState, rest, steady_state};

pub use exponential::Responses;
pub use parametric::{LinearMatrices, ParametricModel};

/// Maximum number of unknowns of a linear model, whose matrices are dense.
const MOST_UNKNOWNS: usize = 4000;

/// An external input of the linear model.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum LinearInput {
    /// The input at this position.
    Input(usize),
    /// The same, delayed by τ.
    Delayed {
        /// Position of the input.
        input: usize,
        /// τ, s.
        tau: f64,
    },
    /// The slope of a delayed input through which an equation was differentiated.
    Slope {
        /// Position of the input.
        input: usize,
        /// τ, s.
        tau: f64,
    },
}

impl LinearInput {
    /// Position of the input.
    pub fn input(self) -> usize {
        match self {
            LinearInput::Input(input)
            | LinearInput::Delayed { input, .. }
            | LinearInput::Slope { input, .. } => input,
        }
    }
}

/// A delayed unknown.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LinearDelay {
    /// Position of the unknown.
    pub unknown: usize,
    /// τ at the point, s. If τ varies, its derivatives are included in A, B, C and D.
    pub tau: f64,
}

/// A linear model close to an operating point.
///
/// | name | symbol | shape | unit |
/// |---|---|---|---|
/// | `a` | A | n_x × n_x | SI unit of the row's state, over that of the column's, per s |
/// | `b` | B | n_x × n_m | the same, over that of the column's channel |
/// | `c`, `d` | C, D | n_w × n_x, n_w × n_m | SI unit of the row's output, over that of the column |
/// | `delayed_a`, `delayed_c` | A₁, C₁ | n_x × n_v, n_w × n_v | the same with delayed unknowns for columns |
/// | `delayed_x`, `delayed_u`, `delayed_v` | E, F, G | n_v × n_x, n_v × n_m, n_v × n_v | of delayed unknowns |
/// | `by_x`, `by_u`, `by_v` | ∂y_a/∂(x, u, v) | n_a × n_x, n_a × n_m, n_a × n_v | of eliminated unknowns |
/// | `rates` | ẋ at the point | n_x | SI unit of the state, per s |
/// | `u`, `v`, `w` | at the point | n_m, n_v, n_w | SI units |
#[derive(Debug, Clone, PartialEq)]
pub struct StateSpace {
    /// Positions of the states among the unknowns.
    pub states: Vec<usize>,
    /// Positions of the unknowns that follow from the states.
    pub eliminated: Vec<usize>,
    /// External inputs: the declared inputs, then their delayed values and slopes that equations read.
    pub channels: Vec<LinearInput>,
    /// Delayed unknowns.
    pub delayed_unknowns: Vec<LinearDelay>,
    /// Delay τ of each output: its rows are those of w(t + τ).
    pub output_delays: Vec<f64>,
    /// ∂ẋ/∂x.
    pub a: DMatrix<f64>,
    /// ∂ẋ/∂u.
    pub b: DMatrix<f64>,
    /// ∂w/∂x.
    pub c: DMatrix<f64>,
    /// ∂w/∂u.
    pub d: DMatrix<f64>,
    /// ∂ẋ/∂v.
    pub delayed_a: DMatrix<f64>,
    /// ∂w/∂v.
    pub delayed_c: DMatrix<f64>,
    /// ∂r/∂x.
    pub delayed_x: DMatrix<f64>,
    /// ∂r/∂u.
    pub delayed_u: DMatrix<f64>,
    /// ∂r/∂v.
    pub delayed_v: DMatrix<f64>,
    /// ∂y_a/∂x.
    pub by_x: DMatrix<f64>,
    /// ∂y_a/∂u.
    pub by_u: DMatrix<f64>,
    /// ∂y_a/∂v.
    pub by_v: DMatrix<f64>,
    /// ẋ at the point: zero at rest.
    pub rates: Vec<f64>,
    /// Values of `channels` at the point.
    pub u: Vec<f64>,
    /// Values of the delayed unknowns at the point.
    pub v: Vec<f64>,
    /// Outputs at the point.
    pub w: Vec<f64>,
}

/// The linear model of `problem` close to `get`.
///
/// # Errors
///
/// [`LinearizeError`]: a derivative is not finite there, algebraic unknowns are not determined, the equations read the
/// slope of a delayed unknown, or there are too many unknowns for dense matrices.
///
/// # Panics
///
/// If the point belongs to another problem.
pub fn linearize<S: SolvableSystem>(
    problem: &Problem<'_, S>,
    at: &OperatingPoint,
) -> Result<StateSpace, LinearizeError> {
    let system = problem.system;
    let signature = system.signature();
    let n = signature.unknowns.len();
    if n > MOST_UNKNOWNS {
        return Err(LinearizeError::TooLarge { n, most: MOST_UNKNOWNS });
    }
    let point = at.point(problem.p);

    let columns = SlopeColumns::new(problem, at)?;
    let slopes = LinearSlopes::new(system, point, &columns.places, columns.len())?;
    let elimination = Elimination::new(system, point, &slopes.f)?;
    let (n_x, n_m) = (elimination.states.len(), columns.channels.len());
    let n_v = columns.delayed_unknowns.len();
    let split = |rows: &DMatrix<f64>| {
        let part = |from, count| rows.columns(from, count).into_owned();
        [part(0, n_x), part(n_x, n_m), part(n_x + n_m, n_v)]
    };
    let [a, b, delayed_a] = split(&elimination.of_states(&slopes.f));
    let [c, d, delayed_c] = split(&elimination.reduced(&slopes.w));
    let Elimination { states, eliminated, follows, .. } = elimination;
    let [by_x, by_u, by_v] = split(&follows);
    // r: a state itself, or the expression for an eliminated unknown.
    let mut sources = DMatrix::zeros(n_v, n_x + n_m + n_v);
    for (k, delayed) in columns.delayed_unknowns.iter().enumerate() {
        if let Ok(state) = states.binary_search(&delayed.unknown) {
            sources[(k, state)] = 1.0;
        } else {
            let row = eliminated.partition_point(|i| *i < delayed.unknown);
            sources.set_row(k, &follows.row(row));
        }
    }
    let [delayed_x, delayed_u, delayed_v] = split(&sources);

    let tau = delays(problem);
    let output_delays =
        signature.outputs.iter().map(|output| output.delay.map_or(0.0, |k| tau[k])).collect();
    let rates = states.iter().map(|i| slopes.rates[*i]).collect();
    Ok(StateSpace {
        states,
        eliminated,
        channels: columns.channels,
        delayed_unknowns: columns.delayed_unknowns,
        output_delays,
        a,
        b,
        c,
        d,
        delayed_a,
        delayed_c,
        delayed_x,
        delayed_u,
        delayed_v,
        by_x,
        by_u,
        by_v,
        rates,
        u: columns.u,
        v: columns.v,
        w: slopes.outputs,
    })
}

impl StateSpace {
    /// Poles of the linear model.
    ///
    /// With delayed unknowns there are infinitely many, and those furthest to the right are returned.
    ///
    /// # Errors
    ///
    /// [`LinearizeError::NoEigenvalues`] if the iteration does not converge.
    pub fn poles(&self) -> Result<Poles, LinearizeError> {
        poles::poles(self, &[])
    }

    /// The poles with conserved combinations, each of which gives a pole at exactly zero.
    ///
    /// # Errors
    ///
    /// [`LinearizeError::NoEigenvalues`] if the iteration does not converge.
    pub fn poles_beside(
        &self,
        conserved: &[ConservedCombination],
    ) -> Result<Poles, LinearizeError> {
        poles::poles(self, conserved)
    }
}

/// The meaning of the columns after those of the unknowns, and their positions in u.
struct SlopeColumns {
    channels: Vec<LinearInput>,
    delayed_unknowns: Vec<LinearDelay>,
    /// Their values at the point.
    u: Vec<f64>,
    v: Vec<f64>,
    /// For each number of u its column, counted from the end of the unknowns.
    places: Vec<Option<usize>>,
}

impl SlopeColumns {
    fn new<S: SolvableSystem>(
        problem: &Problem<'_, S>,
        at: &OperatingPoint,
    ) -> Result<Self, LinearizeError> {
        let signature = problem.system.signature();
        let tau = delays(problem);
        let (n_in, n_delayed) = (signature.inputs.len(), signature.delayed_inputs.len());
        let [_, of_outputs, _] = &signature.output_jacobians;
        let is_read = |column: usize| {
            let read = |pattern: &Pattern| pattern.positions().any(|(_, c)| c == column);
            read(&signature.input_jacobian) || read(of_outputs)
        };
        let mut places = vec![None; signature.n_u()];
        let (mut channels, mut u, mut v) = (Vec::new(), Vec::new(), Vec::new());
        for (i, (place, value)) in places.iter_mut().zip(&at.u).take(n_in).enumerate() {
            *place = Some(i);
            channels.push(LinearInput::Input(i));
            u.push(*value);
        }
        for (k, delayed) in signature.delayed_inputs.iter().enumerate() {
            let (input, tau) = (delayed.input, tau[delayed.delay]);
            if tau == 0.0 {
                places[n_in + k] = Some(input);
            } else if is_read(n_in + k) {
                places[n_in + k] = Some(channels.len());
                channels.push(LinearInput::Delayed { input, tau });
                u.push(at.u[n_in + k]);
            }
            if is_read(n_in + n_delayed + k) {
                places[n_in + n_delayed + k] = Some(channels.len());
                channels.push(LinearInput::Slope { input, tau });
                u.push(at.u[n_in + n_delayed + k]);
            }
        }

        let past = signature.past();
        let mut linear_delays = Vec::new();
        for (k, delayed) in signature.delayed_unknowns.iter().enumerate() {
            // With a delay of zero the value is the current one, which is in the Jacobian.
            if at.u[past.held().start + k] == 0.0 {
                continue;
            }
            let tau = if delayed.varies {
                let mut delays = vec![0.0; signature.varying_delays.len()];
                problem.system.varying_delays(at.point(problem.p), &mut delays);
                delays[delayed.delay]
            } else {
                tau[delayed.delay]
            };
            if is_read(past.rates().start + k) {
                let unknown = signature.unknowns.name(delayed.unknown).to_string();
                return Err(LinearizeError::LateSlope { unknown });
            }
            if is_read(past.values().start + k) {
                places[past.values().start + k] = Some(channels.len() + linear_delays.len());
                linear_delays.push(LinearDelay { unknown: delayed.unknown, tau });
                v.push(at.u[past.values().start + k]);
            }
        }
        Ok(Self { channels, delayed_unknowns: linear_delays, u, v, places })
    }

    fn len(&self) -> usize {
        self.channels.len() + self.delayed_unknowns.len()
    }
}

/// Derivatives with respect to the unknowns, then to the columns after them.
struct LinearSlopes {
    f: DMatrix<f64>,
    w: DMatrix<f64>,
    /// f itself, n numbers.
    rates: Vec<f64>,
    outputs: Vec<f64>,
}

impl LinearSlopes {
    /// For each number of u, `places` has its column after the unknowns; there are `many` of these.
    fn new<S: SolvableSystem>(
        system: &S,
        at: EvaluationPoint<'_>,
        places: &[Option<usize>],
        many: usize,
    ) -> Result<Self, LinearizeError> {
        let signature = system.signature();
        let n = signature.unknowns.len();
        let (n_w, len) = (signature.outputs.len(), n + many);
        let (mut f, mut dfdt) = (S::Vector::zeros(n), S::Vector::zeros(n));
        let mut by_y = S::Jacobian::zeros(signature.jacobian.len());
        let still = S::Inputs::zeros(signature.n_u());
        system.linearize(at, still.as_ref(), f.as_mut(), by_y.as_mut(), dfdt.as_mut());
        let mut by_u = vec![0.0; signature.input_jacobian.len()];
        system.input_jacobian(at, &mut by_u);
        let [w_y, w_u, w_p] = &signature.output_jacobians;
        let (mut dwdy, mut dwdu) = (vec![0.0; w_y.len()], vec![0.0; w_u.len()]);
        let mut dwdp = vec![0.0; w_p.len()];
        let mut outputs = vec![0.0; n_w];
        system.output_jacobians(at, &mut dwdy, &mut dwdu, &mut dwdp, &mut outputs);
        system.outputs(at, &mut outputs);

        let mut matrices = [DMatrix::zeros(n, len), DMatrix::zeros(n_w, len)];
        let parts = [
            (0, &signature.jacobian, by_y.as_ref(), true),
            (0, &signature.input_jacobian, &by_u, false),
            (1, w_y, &dwdy, true),
            (1, w_u, &dwdu, false),
        ];
        for (matrix, pattern, values, of_unknowns) in parts {
            for ((row, column), value) in pattern.positions().zip(values) {
                let place = if of_unknowns {
                    Some(column)
                } else {
                    places[column].map(|column| n + column)
                };
                let Some(place) = place else { continue };
                if !value.is_finite() {
                    let label = if matrix == 0 {
                        signature.equations.get(row)
                    } else {
                        signature.outputs[row].name.clone()
                    };
                    return Err(LinearizeError::NotFinite { t: at.t, equation: label.to_string() });
                }
                // An input with a delay of zero has two places in u but one column.
                matrices[matrix][(row, place)] += value;
            }
        }
        let [of_f, of_w] = matrices;
        Ok(Self { f: of_f, w: of_w, rates: f.as_ref().to_vec(), outputs })
    }
}
