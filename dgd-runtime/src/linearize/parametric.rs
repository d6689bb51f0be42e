//! A linear model and its derivatives with respect to θ, including the motion of the operating point.
//!
//! ```text
//!   ẋ = r + A (x − x₀) + B (u − u₀)
//!   w = w₀ + C (x − x₀) + D (u − u₀)           A, B, C, D, r, x₀ and w₀ are functions of θ
//! ```
//!
//! The point y₀(θ) moves with S = dy₀/dθ: at rest 0 = f(y₀, u₀, θ) gives ∂f/∂y S = −∂f/∂θ, and a run gives its own
//! sensitivities. Derivatives of the equations are the compiled ones, of g = ∂f/∂y S + ∂f/∂θ:
//!
//! ```text
//!   ∂g/∂y = d(∂f/∂y)/dθ,   ∂g/∂u = d(∂f/∂u)/dθ          along y₀(θ)
//! ```
//!
//! Only first derivatives of outputs are compiled. d(∂w/∂y)/dθ and d(∂w/∂u)/dθ are central differences of these along
//! (S, θ), extrapolated from two steps.
//!
//! Columns of B and D are those of u as equations read it: declared inputs, delayed ones, slopes of delayed ones.

use nalgebra::{DMatrix, DVector};

use super::elimination::Elimination;
use super::error::{LinearizeError, NotLinearised};
use super::point::OperatingPoint;
use super::steady::steady_state;
use super::{LinearSlopes, poles};
use crate::observe::delay::delay_sensitivities;
use crate::problem::{Options, Problem, parameter_size, unknown_sizes};
use crate::signal::Inputs;
use crate::solved::SolvableSystem;
use crate::system::{Direction, EvaluationPoint, Storage};

/// Step of the differences, in sizes: truncation and rounding errors are both about 1e-12.
const STEP: f64 = 1e-3;

/// The point at which a recording is linearised.
#[derive(Debug, Clone, PartialEq)]
pub enum LinearAt {
    /// The steady state with these inputs, SI: [`Inputs::mean`] gives the recording's mean.
    Rest(Vec<f64>),
    /// The point that the recording's run reaches at this time, s.
    Reached(f64),
}

impl LinearAt {
    /// The operating point of a run that begins at `from`.
    ///
    /// # Errors
    ///
    /// [`NotLinearised::NoSteadyState`], [`NotLinearised::Run`].
    pub fn point<S: SolvableSystem>(
        &self,
        problem: &Problem<'_, S>,
        from: f64,
        options: &Options,
    ) -> Result<OperatingPoint, NotLinearised> {
        match self {
            Self::Rest(u) => {
                let inputs = Inputs::constant(u);
                steady_state(&Problem { inputs: &inputs, ..*problem }, from, options)
                    .map_err(NotLinearised::NoSteadyState)
            }
            Self::Reached(t) => {
                OperatingPoint::reached(problem, from, *t, options).map_err(NotLinearised::Run)
            }
        }
    }
}

/// The matrices of a linear model, or their derivatives with respect to one of θ.
#[derive(Debug, Clone)]
pub struct LinearMatrices {
    /// A.
    pub a: DMatrix<f64>,
    /// B.
    pub b: DMatrix<f64>,
    /// C.
    pub c: DMatrix<f64>,
    /// D.
    pub d: DMatrix<f64>,
    /// r.
    pub rates: DVector<f64>,
    /// x₀.
    pub x: DVector<f64>,
    /// u₀.
    pub u: DVector<f64>,
    /// w₀.
    pub w: DVector<f64>,
}

/// A linear model close to a point that moves with θ.
pub struct ParametricModel {
    /// Positions of the states among the unknowns.
    pub states: Vec<usize>,
    /// Sizes of the states.
    pub sizes: Vec<f64>,
    /// The model itself.
    pub model: LinearMatrices,
    /// Derivatives by direction; `None` for one that the model does not depend on. Empty if none were requested.
    pub slopes: Vec<Option<LinearMatrices>>,
}

impl ParametricModel {
    /// The linear model of a run over these times, with its derivatives if requested.
    pub fn new<S: SolvableSystem>(
        problem: &Problem<'_, S>,
        at: &LinearAt,
        times: &[f64],
        options: &Options,
        with_slopes: bool,
    ) -> Result<Self, NotLinearised> {
        let system = problem.system;
        let signature = system.signature();
        if let Some(delayed) = signature.delayed_unknowns.first() {
            let unknown = signature.unknowns.name(delayed.unknown).to_string();
            return Err(NotLinearised::LateUnknown { unknown });
        }
        let from = times.first().copied().unwrap_or(0.0);
        let run = match at {
            LinearAt::Reached(t) if with_slopes => {
                let reached =
                    OperatingPoint::reached_with_sensitivities(problem, from, *t, options);
                Some(reached.map_err(NotLinearised::Run)?)
            }
            LinearAt::Reached(_) | LinearAt::Rest(_) => None,
        };
        let (point, of_run) = match run {
            Some((point, s)) => (point, Some(s)),
            None => (at.point(problem, from, options)?, None),
        };
        let place = point.point(problem.p);
        let linear = PointDerivatives::new(system, place).map_err(NotLinearised::NoModel)?;
        verify_still(system, place, &linear, times)?;
        let model = linear.matrices(&point);
        if let LinearAt::Rest(_) = at {
            let poles = poles::eigenvalues(&model.a).map_err(NotLinearised::NoModel)?;
            let unstable = poles.iter().filter(|pole| pole.re > pole.rounding);
            if let Some(pole) = unstable.max_by(|a, b| a.re.total_cmp(&b.re)) {
                return Err(NotLinearised::Unstable { t: point.t, re: pole.re });
            }
        }
        let mut sizes = vec![0.0; point.y.len()];
        unknown_sizes(system, &point.y, &mut sizes);
        let slopes = if with_slopes {
            let along =
                MovingDerivatives { problem, point: &point, linear: &linear, sizes: &sizes };
            along.slopes(of_run).map_err(NotLinearised::NoModel)?
        } else {
            Vec::new()
        };
        let states = linear.elimination.states;
        let sizes = states.iter().map(|i| sizes[*i]).collect();
        Ok(Self { states, sizes, model, slopes })
    }
}

/// Checks that the model does not depend on time, by evaluating it at the point at other times of the run.
fn verify_still<S: SolvableSystem>(
    system: &S,
    at: EvaluationPoint<'_>,
    linear: &PointDerivatives,
    times: &[f64],
) -> Result<(), NotLinearised> {
    let signature = system.signature();
    let (Some(first), Some(last)) = (times.first(), times.last()) else { return Ok(()) };
    // Two times, in case one is a period of the model.
    for part in [0.618, 1.0] {
        let t = first + part * (last - first);
        let now = &linear.slopes;
        let then = PointDerivatives::new(system, EvaluationPoint { t, ..at })
            .map_err(NotLinearised::NoModel)?
            .slopes;
        let moves = |a: &DMatrix<f64>, b: &DMatrix<f64>, row: usize| a.row(row) != b.row(row);
        let equation = (0..now.f.nrows())
            .find(|i| moves(&now.f, &then.f, *i) || now.rates[*i] != then.rates[*i])
            .map(|i| signature.equations.get(i).to_string());
        let output = || {
            let moved = (0..now.w.nrows())
                .find(|i| moves(&now.w, &then.w, *i) || now.outputs[*i] != then.outputs[*i]);
            moved.map(|i| signature.outputs[i].name.to_string())
        };
        if let Some(equation) = equation.or_else(output) {
            return Err(NotLinearised::ReadsTime { equation });
        }
    }
    Ok(())
}

/// Non-zeros of ∂w/∂y and ∂w/∂u.
fn output_jacobians<S: SolvableSystem>(system: &S, at: EvaluationPoint<'_>) -> [Vec<f64>; 2] {
    let signature = system.signature();
    let [w_y, w_u, w_p] = &signature.output_jacobians;
    let (mut dwdy, mut dwdu) = (vec![0.0; w_y.len()], vec![0.0; w_u.len()]);
    let (mut dwdp, mut dwdt) = (vec![0.0; w_p.len()], vec![0.0; signature.outputs.len()]);
    system.output_jacobians(at, &mut dwdy, &mut dwdu, &mut dwdp, &mut dwdt);
    [dwdy, dwdu]
}

/// All derivatives at a point, and the unknowns that are states there.
struct PointDerivatives {
    slopes: LinearSlopes,
    elimination: Elimination,
}

impl PointDerivatives {
    fn new<S: SolvableSystem>(system: &S, at: EvaluationPoint<'_>) -> Result<Self, LinearizeError> {
        let signature = system.signature();
        let n = signature.unknowns.len();
        if n > super::MOST_UNKNOWNS {
            return Err(LinearizeError::TooLarge { n, most: super::MOST_UNKNOWNS });
        }
        let n_u = signature.n_u();
        let places: Vec<Option<usize>> = (0..n_u).map(Some).collect();
        let slopes = LinearSlopes::new(system, at, &places, n_u)?;
        let elimination = Elimination::new(system, at, &slopes.f)?;
        Ok(Self { slopes, elimination })
    }

    fn matrices(&self, at: &OperatingPoint) -> LinearMatrices {
        let states = &self.elimination.states;
        let of_states = |values: &[f64]| DVector::from_fn(states.len(), |i, _| values[states[i]]);
        let rows = self.elimination.of_states(&self.slopes.f);
        let outputs = self.elimination.reduced(&self.slopes.w);
        self.split(
            &rows,
            &outputs,
            [
                of_states(&self.slopes.rates),
                of_states(&at.y),
                DVector::from_column_slice(&at.u),
                DVector::from_column_slice(&self.slopes.outputs),
            ],
        )
    }

    /// Rows of the states and of the outputs by states, then inputs; r, x₀, u₀ and w₀.
    fn split(
        &self,
        rows: &DMatrix<f64>,
        outputs: &DMatrix<f64>,
        [rates, x, u, w]: [DVector<f64>; 4],
    ) -> LinearMatrices {
        let n_x = self.elimination.states.len();
        let n_u = rows.ncols() - n_x;
        LinearMatrices {
            a: rows.columns(0, n_x).into_owned(),
            b: rows.columns(n_x, n_u).into_owned(),
            c: outputs.columns(0, n_x).into_owned(),
            d: outputs.columns(n_x, n_u).into_owned(),
            rates,
            x,
            u,
            w,
        }
    }
}

/// Derivatives along a moving point.
struct MovingDerivatives<'a, S> {
    problem: &'a Problem<'a, S>,
    point: &'a OperatingPoint,
    linear: &'a PointDerivatives,
    /// Sizes of all unknowns.
    sizes: &'a [f64],
}

/// g and its derivatives, with dg/dt along one slope of the inputs.
struct EquationDerivatives<S: SolvableSystem> {
    g: S::Sensitivity,
    dgdy: S::SensitivityJacobian,
    dgdt: S::Sensitivity,
}

impl<S: SolvableSystem> MovingDerivatives<'_, S> {
    /// Derivatives by direction, with the sensitivities of a run that led to the point, or of the steady state.
    fn slopes(
        &self,
        of_run: Option<Vec<f64>>,
    ) -> Result<Vec<Option<LinearMatrices>>, LinearizeError> {
        let signature = self.problem.system.signature();
        let (n, n_u) = (signature.unknowns.len(), signature.n_u());
        let n_s = signature.directions.len();
        let at_rest = of_run.is_none();
        let s = of_run.map_or_else(|| self.of_rest(), Ok)?;
        let moved = self.inputs_moved();

        // ∂g/∂y and ∂g/∂u: the latter along each input that f reads.
        let still = self.equations(&s, None);
        let mut f = vec![DMatrix::zeros(n, n + n_u); n_s];
        for ((row, column), value) in
            signature.sensitivity_jacobian.positions().zip(still.dgdy.as_ref())
        {
            f[row / n.max(1)][(row % n.max(1), column)] += *value;
        }
        let mut read: Vec<usize> = signature.input_jacobian.positions().map(|(_, k)| k).collect();
        read.sort_unstable();
        read.dedup();
        for k in read {
            let along = self.equations(&s, Some(k));
            let both = along.dgdt.as_ref().iter().zip(still.dgdt.as_ref());
            for (position, (along, still)) in both.enumerate() {
                f[position / n][(position % n, n + k)] = along - still;
            }
        }
        self.forget_slopes(&mut f);

        let mut outputs = vec![0.0; signature.outputs.len()];
        let mut dw = vec![0.0; outputs.len() * n_s];
        let place = self.point.point(self.problem.p);
        self.problem.system.output_sensitivities(place, &s, &mut outputs, &mut dw);
        let slopes = f.iter().enumerate().map(|(j, f)| {
            let is_parameter = matches!(signature.directions[j], Direction::Parameter(_));
            if at_rest && !is_parameter {
                return Ok(None);
            }
            if let Some(at) = f.iter().position(|value| !value.is_finite()) {
                let equation = signature.equations.get(at % n).to_string();
                return Err(LinearizeError::NotFinite { t: self.point.t, equation });
            }
            let part = |all: &[f64], len: usize| all[j * len..(j + 1) * len].to_vec();
            let (s, u) = (part(&s, n), part(&moved, n_u));
            let w = self.outputs_slope(j, &s, &u)?;
            let elimination = &self.linear.elimination;
            let of_states = |values: &[f64]| {
                DVector::from_iterator(
                    elimination.states.len(),
                    elimination.states.iter().map(|i| values[*i]),
                )
            };
            let follows = elimination.slope(f);
            let states = |rows: &DMatrix<f64>| rows.select_rows(&elimination.states);
            let rows =
                elimination.reduced_slope(&states(&self.linear.slopes.f), &states(f), &follows);
            let outputs = elimination.reduced_slope(&self.linear.slopes.w, &w, &follows);
            // r is ẋ at the point, where u is u₀: at rest it stays zero.
            let rates = of_states(&part(still.g.as_ref(), n));
            let dw = DVector::from_vec(part(&dw, signature.outputs.len()));
            let parts = [rates, of_states(&s), DVector::from_vec(u), dw];
            Ok(Some(self.linear.split(&rows, &outputs, parts)))
        });
        slopes.collect()
    }

    /// S of a steady state, from ∂f/∂y S = −∂f/∂θ.
    fn of_rest(&self) -> Result<Vec<f64>, LinearizeError> {
        let system = self.problem.system;
        let signature = system.signature();
        let (n, n_s) = (signature.unknowns.len(), signature.directions.len());
        let place = self.point.point(self.problem.p);
        let none = vec![0.0; n * n_s];
        let (mut f, mut g) = (vec![0.0; n], vec![0.0; n * n_s]);
        system.sensitivity_rhs(place, &none, &mut f, &mut g);
        // Unknowns are scaled by their sizes, rows by their largest entries.
        let mut matrix = self.linear.slopes.f.columns(0, n).into_owned();
        for (mut column, size) in matrix.column_iter_mut().zip(self.sizes) {
            column *= *size;
        }
        let mut right = -DMatrix::from_column_slice(n, n_s, &g);
        for i in 0..n {
            let largest = matrix.row(i).amax();
            if largest > 0.0 {
                matrix.row_mut(i).unscale_mut(largest);
                right.row_mut(i).unscale_mut(largest);
            }
        }
        let is_solved = matrix.lu().solve_mut(&mut right);
        for (mut row, size) in right.row_iter_mut().zip(self.sizes) {
            row *= *size;
        }
        let open = (!is_solved).then_some(0);
        let open = open.or_else(|| right.iter().position(|value| !value.is_finite()));
        match open {
            None => Ok(right.as_slice().to_vec()),
            Some(at) => {
                let equation = signature.equations.get(at % n.max(1)).to_string();
                Err(LinearizeError::NotFinite { t: self.point.t, equation })
            }
        }
    }

    /// du₀/dθ, by columns: delayed inputs change with their delays.
    fn inputs_moved(&self) -> Vec<f64> {
        let signature = self.problem.system.signature();
        let (n_in, n_delayed) = (signature.inputs.len(), signature.delayed_inputs.len());
        let (n_u, n_s) = (signature.n_u(), signature.directions.len());
        let mut moved = vec![0.0; n_u * n_s];
        if n_delayed > 0 {
            let dtau = delay_sensitivities(self.problem);
            for (column, dtau) in
                moved.chunks_exact_mut(n_u).zip(dtau.chunks_exact(signature.delays.len()))
            {
                for (k, delayed) in signature.delayed_inputs.iter().enumerate() {
                    column[n_in + k] = -self.point.u[n_in + n_delayed + k] * dtau[delayed.delay];
                }
            }
        }
        moved
    }

    fn equations(&self, s: &[f64], moving: Option<usize>) -> EquationDerivatives<S> {
        let system = self.problem.system;
        let signature = system.signature();
        let (n, n_s) = (signature.unknowns.len(), signature.directions.len());
        let mut udot = S::Inputs::zeros(signature.n_u());
        if let Some(k) = moving {
            udot.as_mut()[k] = 1.0;
        }
        let (mut f, mut dfdt) = (S::Vector::zeros(n), S::Vector::zeros(n));
        let mut jacobian = S::Jacobian::zeros(signature.jacobian.len());
        let mut g = S::Sensitivity::zeros(n * n_s);
        let mut dgdt = S::Sensitivity::zeros(n * n_s);
        let mut dgdy = S::SensitivityJacobian::zeros(signature.sensitivity_jacobian.len());
        system.sensitivity_linearize(
            self.point.point(self.problem.p),
            udot.as_ref(),
            s,
            f.as_mut(),
            jacobian.as_mut(),
            dfdt.as_mut(),
            g.as_mut(),
            dgdy.as_mut(),
            dgdt.as_mut(),
        );
        EquationDerivatives { g, dgdy, dgdt }
    }

    /// Removes the contribution of moving delays, −∂f/∂v v̇ dτ/dθ, for which g reads the slopes of delayed inputs: it
    /// is not a derivative of ∂f/∂v̇.
    fn forget_slopes(&self, f: &mut [DMatrix<f64>]) {
        let signature = self.problem.system.signature();
        let n = signature.unknowns.len();
        let (n_in, n_delayed) = (signature.inputs.len(), signature.delayed_inputs.len());
        if n_delayed == 0 {
            return;
        }
        let dtau = delay_sensitivities(self.problem);
        let reads_slope = |k: usize| {
            let slope = n_in + n_delayed + k;
            signature.input_jacobian.positions().any(|(_, column)| column == slope)
        };
        for (f, dtau) in f.iter_mut().zip(dtau.chunks_exact(signature.delays.len())) {
            for (k, delayed) in signature.delayed_inputs.iter().enumerate() {
                if reads_slope(k) {
                    let by_delayed =
                        self.linear.slopes.f.column(n + n_in + k) * dtau[delayed.delay];
                    let mut column = f.column_mut(n + n_in + n_delayed + k);
                    column += by_delayed;
                }
            }
        }
    }

    /// d(∂w/∂(y, u))/dθⱼ along (s, du₀/dθⱼ).
    fn outputs_slope(
        &self,
        j: usize,
        s: &[f64],
        u: &[f64],
    ) -> Result<DMatrix<f64>, LinearizeError> {
        let Problem { system, p, .. } = *self.problem;
        let signature = system.signature();
        let n = signature.unknowns.len();
        let parameter = match signature.directions[j] {
            Direction::Parameter(i) => {
                let of_value = signature.parameters[i].log && p[i] != 0.0;
                let size = if of_value { p[i].abs() } else { parameter_size(system, i) };
                Some((i, size))
            }
            Direction::Start(_) => None,
        };
        let moved = s.iter().zip(self.sizes).map(|(s, size)| (s / size).abs());
        let fastest = moved.fold(parameter.map_or(0.0, |(_, size)| 1.0 / size), f64::max);
        let mut slope = DMatrix::zeros(signature.outputs.len(), n + signature.n_u());
        if fastest == 0.0 {
            return Ok(slope);
        }
        let difference = |step: f64| {
            let side = |step: f64| {
                let mut p = p.to_vec();
                if let Some((i, _)) = parameter {
                    p[i] += step;
                }
                let move_by = |values: &[f64], slopes: &[f64]| -> Vec<f64> {
                    values.iter().zip(slopes).map(|(value, slope)| value + step * slope).collect()
                };
                let (y, u) = (move_by(&self.point.y, s), move_by(&self.point.u, u));
                let OperatingPoint { t, z, .. } = self.point;
                output_jacobians(system, EvaluationPoint { t: *t, y: &y, u: &u, p: &p, z })
            };
            let ([above_y, above_u], [below_y, below_u]) = (side(step), side(-step));
            let difference = |above: Vec<f64>, below: Vec<f64>| -> Vec<f64> {
                above
                    .iter()
                    .zip(&below)
                    .map(|(above, below)| (above - below) / (2.0 * step))
                    .collect()
            };
            [difference(above_y, below_y), difference(above_u, below_u)]
        };
        let step = STEP / fastest;
        let (coarse, fine) = (difference(step), difference(0.5 * step));
        let [w_y, w_u, _] = &signature.output_jacobians;
        for ((pattern, first), (coarse, fine)) in
            [(w_y, 0), (w_u, n)].into_iter().zip(coarse.iter().zip(&fine))
        {
            for ((row, column), (coarse, fine)) in pattern.positions().zip(coarse.iter().zip(fine))
            {
                let value = (4.0 * fine - coarse) / 3.0;
                if !value.is_finite() {
                    let equation = signature.outputs[row].name.to_string();
                    return Err(LinearizeError::NotFinite { t: self.point.t, equation });
                }
                slope[(row, first + column)] += value;
            }
        }
        Ok(slope)
    }
}
