//! Start values from the first measured outputs.

use std::fmt;

use nalgebra::{DMatrix, DVector};

use crate::error::IntegrateError;
use crate::integrate::drive::InputCursor;
use crate::integrate::start::consistent::{ConsistentStart, consistent_start};
use crate::linalg::full::FullLu;
use crate::linalg::norm::Tolerances;
use crate::problem::{Options, Problem, unknown_sizes};
use crate::signal::LimitSide;
use crate::solved::SolvableSystem;
use crate::system::EvaluationPoint;

/// Maximum number of corrections.
const MOST_ITERATIONS: usize = 50;

/// A correction below this fraction of every unknown's size ends the iteration.
const CONVERGED: f64 = 1e-10;

/// Directions whose effect on the outputs is below this fraction of the strongest are left alone.
const UNSEEN: f64 = 1e-8;

/// Start values of the differential unknowns that make the outputs at `t` equal the measured ones.
///
/// Gauss–Newton on w(y₀) = w_measured: with G = dw/dy_d, which includes the response of algebraic unknowns, the
/// correction Δ minimises |N⁻¹ (w_measured − w − G Δ)|, where N is the outputs' noise. If the outputs do not determine
/// all unknowns, it is the shortest correction in units of the unknowns' sizes, so that undetermined directions keep
/// the model's start value. A model without differential unknowns, or without measured outputs, gives no start values.
///
/// `measured` and `noise` have one entry for each output; outputs without a measurement are left out.
///
/// # Errors
///
/// [`MeasuredStartError`]: no consistent values, or no convergence.
pub fn start_from_outputs<S: SolvableSystem>(
    problem: &Problem<'_, S>,
    t: f64,
    measured: &[Option<f64>],
    noise: &[f64],
    options: &Options,
) -> Result<Vec<(usize, f64)>, MeasuredStartError> {
    let system = problem.system;
    let signature = system.signature();
    let n = signature.unknowns.len();
    let outputs: Vec<usize> = (0..measured.len()).filter(|i| measured[*i].is_some()).collect();

    let mut consistent =
        consistent_start(problem, t, options).map_err(MeasuredStartError::Start)?;
    let mut sizes = vec![0.0; n];
    unknown_sizes(system, &consistent.y, &mut sizes);
    let inputs =
        problem.inputs_read().map_err(|e| MeasuredStartError::Start(IntegrateError::Inputs(e)))?;
    let read = Problem { inputs: &inputs, ..*problem };
    let segment = inputs.segment(inputs.segment_at(t, LimitSide::Right));
    let tolerances = Tolerances { rtol: options.rtol, atol: options.atol };
    let mut drive = InputCursor::new(&read, segment, t, 0, tolerances);

    let mut w = vec![0.0; signature.outputs.len()];
    for _ in 0..MOST_ITERATIONS {
        let ConsistentStart { y, z, .. } = &consistent;
        let point = EvaluationPoint { t, y, u: drive.evaluate(t, y), p: problem.p, z };
        let mut mass = vec![0.0; n];
        system.mass(point, &mut mass);
        let (differential, algebraic): (Vec<usize>, Vec<usize>) =
            (0..n).partition(|i| mass[*i] != 0.0);
        if differential.is_empty() || outputs.is_empty() {
            // There are no unknowns to find or no measurements: the model's start applies.
            return Ok(Vec::new());
        }
        system.outputs(point, &mut w);
        let slopes = output_slopes(system, point, &differential, &algebraic)
            .ok_or(MeasuredStartError::Undetermined { t })?;
        // Rows are divided by the noise, columns multiplied by the size.
        let g = DMatrix::from_fn(outputs.len(), differential.len(), |row, column| {
            slopes[(outputs[row], column)] * sizes[differential[column]] / noise[outputs[row]]
        });
        let rest = DVector::from_fn(outputs.len(), |row, _| {
            (measured[outputs[row]].unwrap_or(w[outputs[row]]) - w[outputs[row]])
                / noise[outputs[row]]
        });
        let svd = g.svd(true, true);
        let cutoff = svd.singular_values.max() * UNSEEN;
        let correction =
            svd.solve(&rest, cutoff).map_err(|_| MeasuredStartError::Undetermined { t })?;
        if correction.iter().any(|c| !c.is_finite()) {
            return Err(MeasuredStartError::Undetermined { t });
        }

        let start: Vec<(usize, f64)> = differential
            .iter()
            .zip(correction.iter())
            .map(|(i, c)| (*i, y[*i] + c * sizes[*i]))
            .collect();
        if correction.amax() <= CONVERGED {
            return Ok(start);
        }
        // Algebraic unknowns start from their current values.
        let guess = algebraic.iter().map(|i| (*i, y[*i]));
        let start: Vec<(usize, f64)> = start.into_iter().chain(guess).collect();
        let next = Problem { start: &start, ..*problem };
        consistent = consistent_start(&next, t, options).map_err(MeasuredStartError::Start)?;
    }
    Err(MeasuredStartError::NotConverged { t, iterations: MOST_ITERATIONS })
}

/// dw/dy_d = ∂w/∂y_d − ∂w/∂y_a (∂f_a/∂y_a)⁻¹ ∂f_a/∂y_d, n_w × number of differential unknowns; `None` if the algebraic
/// unknowns are not determined.
fn output_slopes<S: SolvableSystem>(
    system: &S,
    at: EvaluationPoint<'_>,
    differential: &[usize],
    algebraic: &[usize],
) -> Option<DMatrix<f64>> {
    let signature = system.signature();
    let n = signature.unknowns.len();
    let (n_w, n_u) = (signature.outputs.len(), signature.n_u());
    let [by_y, by_u, by_p] = &signature.output_jacobians;
    let mut dwdy = vec![0.0; by_y.len()];
    let (mut dwdu, mut dwdp) = (vec![0.0; by_u.len()], vec![0.0; by_p.len()]);
    system.output_jacobians(at, &mut dwdy, &mut dwdu, &mut dwdp, &mut vec![0.0; n_w]);
    let mut w_y = DMatrix::zeros(n_w, n);
    for ((row, column), value) in by_y.positions().zip(&dwdy) {
        w_y[(row, column)] = *value;
    }
    let of_differential = w_y.select_columns(differential);
    if algebraic.is_empty() {
        return Some(of_differential);
    }

    let mut values = vec![0.0; signature.jacobian.len()];
    let (mut f, mut dfdt) = (vec![0.0; n], vec![0.0; n]);
    system.linearize(at, &vec![0.0; n_u], &mut f, &mut values, &mut dfdt);
    let mut f_y = DMatrix::zeros(n, n);
    for ((row, column), value) in signature.jacobian.positions().zip(&values) {
        f_y[(row, column)] = *value;
    }
    let f_a = f_y.select_rows(algebraic);
    let mut sizes = vec![0.0; n];
    unknown_sizes(system, at.y, &mut sizes);
    let sizes: Vec<f64> = algebraic.iter().map(|i| sizes[*i]).collect();
    let factors = FullLu::new(f_a.select_columns(algebraic), &sizes);
    let response = factors.solve(&f_a.select_columns(differential))?;
    Some(of_differential - w_y.select_columns(algebraic) * response)
}

/// Why measured outputs give no start values.
#[derive(Debug, Clone, PartialEq)]
pub enum MeasuredStartError {
    /// There are no consistent values.
    Start(IntegrateError),
    /// The outputs' derivatives are not finite, or the algebraic unknowns not determined.
    Undetermined {
        /// The time, s.
        t: f64,
    },
    /// The corrections do not converge.
    NotConverged {
        /// The time, s.
        t: f64,
        /// Corrections made.
        iterations: usize,
    },
}

impl fmt::Display for MeasuredStartError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Start(error) => error.fmt(f),
            Self::Undetermined { t } => {
                write!(f, "the outputs measured at t = {t} s do not determine start values")
            }
            Self::NotConverged { t, iterations } => write!(
                f,
                "no start values reproduce the outputs measured at t = {t} s, after {iterations} \
                 corrections"
            ),
        }
    }
}

impl std::error::Error for MeasuredStartError {}
