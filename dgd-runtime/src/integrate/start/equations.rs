//! Start values that start equations determine, and how they move with θ.
//!
//! ```text
//!   0 = r(y₀, u₀, θ)   the start equations
//!   0 = f(y₀, u₀, θ)   the algebraic equations          x₀ as declared for all other states
//! ```
//!
//! Newton's method with damping finds the unknowns of which the declared values are guesses: as many states as there
//! are start equations, and the algebraic unknowns. With their columns C and the sensitivities S_K of the others,
//!
//! ```text
//!   ∂(r, f)/∂y_C S_C = −(∂(r, f)/∂θ + ∂(r, f)/∂y_K S_K)
//! ```

use nalgebra::{DMatrix, DVector};

use super::consistent::start_values;
use crate::discrete::{choose_sides, choose_start_modes, discrete_numbers};
use crate::error::InitialError;
use crate::integrate::drive::InputCursor;
use crate::linalg::norm::Tolerances;
use crate::problem::{Options, Problem, unknown_sizes};
use crate::signal::LimitSide;
use crate::solved::SolvableSystem;
use crate::system::{EvaluationPoint, Storage};

/// Maximum number of corrections, the smallest damping factor, and the size of the last correction.
const MOST_CORRECTIONS: usize = 100;
const LEAST_DAMPING: f64 = 1.0 / 4096.0;
const CORRECTED: f64 = 1e-11;
/// Corrections this small that stop shrinking are rounding.
const STALLED: f64 = 1e-7;
/// Fraction of the largest pivot below which a pivot is zero, unknowns in their sizes and rows in their largest entries.
const SINGULAR: f64 = 1e-12;
/// Maximum number of times that the modes at the start are chosen.
const MOST_CHOICES: usize = 8;

/// Writes start values that satisfy the start equations into `y`, and their derivatives with respect to θ into `s`.
///
/// # Errors
///
/// [`InitialError::NoStart`], and that of a start value which is not finite.
pub(crate) fn start_by_equations<S: SolvableSystem>(
    problem: &Problem<'_, S>,
    t: f64,
    options: &Options,
    y: &mut [f64],
    s: Option<&mut [f64]>,
) -> Result<(), InitialError> {
    let no_start = |reason: String| InitialError::NoStart { t, reason };
    let (system, p) = (problem.system, problem.p);
    let inputs = problem.inputs_read().map_err(|error| no_start(error.to_string()))?;
    let read = Problem { inputs: &inputs, ..*problem };
    let segment = inputs.segment(inputs.segment_at(t, LimitSide::Right));
    let tolerances = Tolerances { rtol: options.rtol, atol: options.atol };
    let mut drive = InputCursor::new(&read, segment, t, 0, tolerances);
    let mut start = vec![0.0; y.len()];
    let point = EvaluationPoint { t, y: &[], u: drive.evaluate(t, &start), p, z: &[] };
    start_values(problem, point, &mut start)?;
    // Active equations may depend on modes, and these on the start values found.
    let mut before: Option<Vec<f64>> = None;
    for _ in 0..MOST_CHOICES {
        let mut z = discrete_numbers(system, p, t);
        let mut e = vec![0.0; system.signature().discrete.transitions().count()];
        let point = EvaluationPoint { t, y: &start, u: drive.evaluate(t, &start), p, z: &[] };
        choose_start_modes(system, point, &mut e, &mut z);
        choose_sides(system, point, &mut e, &mut z);
        let mut search = StartSearch::new(problem, &mut drive, t, &z);
        if before.as_ref() == Some(&z) {
            y.copy_from_slice(&start);
            return match s {
                Some(s) => search.sensitivities(y, s).map_err(no_start),
                None => Ok(()),
            };
        }
        search.solve(&mut start).map_err(no_start)?;
        before = Some(z);
    }
    Err(no_start("the modes at the start change with what is found".to_owned()))
}

/// The equations of a start in given modes.
struct StartSearch<'a, 'b, S: SolvableSystem> {
    problem: &'a Problem<'a, S>,
    drive: &'a mut InputCursor<'b, S>,
    t: f64,
    z: &'a [f64],
    /// Positions of the unknowns that are found: states, then algebraic ones, whose rows are solved.
    wanted: Vec<usize>,
    /// Number of start equations.
    count: usize,
}

/// Residuals and their derivatives with respect to the sought start values, and to θ.
struct StartLinearization {
    left: DVector<f64>,
    matrix: DMatrix<f64>,
}

impl<'a, 'b, S: SolvableSystem> StartSearch<'a, 'b, S> {
    fn new(
        problem: &'a Problem<'a, S>,
        drive: &'a mut InputCursor<'b, S>,
        t: f64,
        z: &'a [f64],
    ) -> Self {
        let signature = problem.system.signature();
        let n = signature.unknowns.len();
        let mut mass = vec![0.0; n];
        let nothing = vec![0.0; n];
        let point = EvaluationPoint { t, y: &[], u: drive.evaluate(t, &nothing), p: problem.p, z };
        problem.system.mass(point, &mut mass);
        let states = signature.start_equations.iter().map(|equation| equation.unknown);
        let algebraic = (0..n).filter(|i| mass[*i] == 0.0);
        let wanted = states.chain(algebraic).collect();
        StartSearch { problem, drive, t, z, wanted, count: signature.start_equations.len() }
    }

    /// Solves for the sought start values, starting from those in `y`.
    fn solve(&mut self, y: &mut [f64]) -> Result<(), String> {
        let mut sizes = vec![0.0; y.len()];
        unknown_sizes(self.problem.system, y, &mut sizes);
        let sizes: Vec<f64> = self.wanted.iter().map(|i| sizes[*i]).collect();
        let mut before = f64::INFINITY;
        for _ in 0..MOST_CORRECTIONS {
            let StartLinearization { left, mut matrix } = self.linear(y)?;
            let scales = scaled(&mut matrix, &sizes);
            let norm = |left: &DVector<f64>| {
                left.iter().zip(&scales).map(|(r, scale)| (r / scale).powi(2)).sum::<f64>().sqrt()
            };
            let right = DVector::from_fn(left.len(), |i, _| -left[i] / scales[i]);
            let step = self.solved(matrix, right)?;
            let size = step.amax();
            let from: Vec<f64> = self.wanted.iter().map(|i| y[*i]).collect();
            let mut damping = 1.0;
            loop {
                for (k, i) in self.wanted.iter().enumerate() {
                    y[*i] = from[k] + damping * step[k] * sizes[k];
                }
                if size <= CORRECTED || size <= STALLED && size >= 0.5 * before {
                    return Ok(());
                }
                let is_better = self.residuals(y).is_some_and(|new| norm(&new) < norm(&left));
                if is_better {
                    break;
                }
                damping *= 0.5;
                if damping < LEAST_DAMPING {
                    return Err(self.not_met(&left, &scales, &from));
                }
            }
            before = size;
        }
        let left = self.residuals(y).unwrap_or_else(|| DVector::zeros(self.wanted.len()));
        let from: Vec<f64> = self.wanted.iter().map(|i| y[*i]).collect();
        Err(self.not_met(&left, &vec![1.0; left.len()], &from))
    }

    /// Replaces the sensitivities of the sought start values in `s`.
    fn sensitivities(&mut self, y: &[f64], s: &mut [f64]) -> Result<(), String> {
        let system = self.problem.system;
        let signature = system.signature();
        let (n, n_s) = (y.len(), signature.directions.len());
        let point = EvaluationPoint {
            t: self.t,
            y: &[],
            u: self.drive.evaluate(self.t, y),
            p: self.problem.p,
            z: self.z,
        };
        self.problem.start_sensitivities(point, s);
        for column in s.chunks_exact_mut(n) {
            for i in &self.wanted {
                column[*i] = 0.0;
            }
        }
        let point = EvaluationPoint {
            t: self.t,
            y,
            u: self.drive.evaluate(self.t, y),
            p: self.problem.p,
            z: self.z,
        };
        let (mut drest, mut drestdy) = (vec![0.0; self.count * n_s], vec![0.0; self.count * n]);
        system.start_equation_sensitivities(point, s, &mut drest, &mut drestdy);
        let (mut f, mut g) = (vec![0.0; n], vec![0.0; n * n_s]);
        system.sensitivity_rhs(point, s, &mut f, &mut g);
        let StartLinearization { mut matrix, .. } = self.linear(y)?;
        let mut sizes = vec![0.0; n];
        unknown_sizes(system, y, &mut sizes);
        let sizes: Vec<f64> = self.wanted.iter().map(|i| sizes[*i]).collect();
        let scales = scaled(&mut matrix, &sizes);
        let right = DMatrix::from_fn(self.wanted.len(), n_s, |row, j| {
            let derivative = match row.checked_sub(self.count) {
                None => drest[j * self.count + row],
                Some(_) => g[j * n + self.wanted[row]],
            };
            -derivative / scales[row]
        });
        for j in 0..n_s {
            let column = self.solved(matrix.clone(), right.column(j).into_owned())?;
            for ((i, value), size) in self.wanted.iter().zip(column.iter()).zip(&sizes) {
                s[j * n + i] = value * size;
            }
        }
        if s.iter().all(|value| value.is_finite()) {
            Ok(())
        } else {
            Err("derivatives to what is estimated are not defined there".to_owned())
        }
    }

    /// Residuals of start equations and algebraic equations; `None` if they are not finite.
    fn residuals(&mut self, y: &[f64]) -> Option<DVector<f64>> {
        let (p, z, t) = (self.problem.p, self.z, self.t);
        let point = EvaluationPoint { t, y, u: self.drive.evaluate(t, y), p, z };
        let (mut rest, mut f) = (vec![0.0; self.count], vec![0.0; y.len()]);
        self.problem.system.start_equations(point, &mut rest);
        self.problem.system.rhs(point, &mut f);
        let algebraic = self.wanted[self.count..].iter().map(|i| f[*i]);
        let left = DVector::from_iterator(self.wanted.len(), rest.into_iter().chain(algebraic));
        left.iter().all(|value| value.is_finite()).then_some(left)
    }

    /// Residuals, and their derivatives with respect to the sought start values.
    fn linear(&mut self, y: &[f64]) -> Result<StartLinearization, String> {
        let signature = self.problem.system.signature();
        let (n, n_s) = (y.len(), signature.directions.len());
        let left = self.residuals(y).ok_or("an equation is not finite there")?;
        let (p, z, t) = (self.problem.p, self.z, self.t);
        let point = EvaluationPoint { t, y, u: self.drive.evaluate(t, y), p, z };
        let (none, mut drest) = (vec![0.0; n * n_s], vec![0.0; self.count * n_s]);
        let mut drestdy = vec![0.0; self.count * n];
        self.problem.system.start_equation_sensitivities(point, &none, &mut drest, &mut drestdy);
        let still = S::Inputs::zeros(signature.n_u());
        let (mut f, mut dfdt) = (vec![0.0; n], vec![0.0; n]);
        let mut jacobian = S::Jacobian::zeros(signature.jacobian.len());
        self.problem.system.linearize(point, still.as_ref(), &mut f, jacobian.as_mut(), &mut dfdt);
        let mut place = vec![None; n];
        for (k, i) in self.wanted.iter().enumerate() {
            place[*i] = Some(k);
        }
        let row_of = |row: usize| place[row].filter(|k| *k >= self.count);
        let size = self.wanted.len();
        let mut matrix = DMatrix::zeros(size, size);
        for (k, i) in self.wanted.iter().enumerate() {
            for row in 0..self.count {
                matrix[(row, k)] = drestdy[i * self.count + row];
            }
        }
        for ((row, column), value) in signature.jacobian.positions().zip(jacobian.as_ref()) {
            if let (Some(row), Some(column)) = (row_of(row), place[column]) {
                matrix[(row, column)] += *value;
            }
        }
        if matrix.iter().any(|value| !value.is_finite()) {
            return Err("the derivative of an equation is not finite there".to_owned());
        }
        Ok(StartLinearization { left, matrix })
    }

    /// The solution of scaled equations.
    fn solved(
        &self,
        matrix: DMatrix<f64>,
        mut right: DVector<f64>,
    ) -> Result<DVector<f64>, String> {
        let lu = matrix.full_piv_lu();
        let pivots = lu.u().diagonal();
        let largest = pivots.amax();
        let is_regular = pivots.iter().all(|pivot| pivot.abs() > SINGULAR * largest);
        if is_regular && lu.solve_mut(&mut right) && right.iter().all(|value| value.is_finite()) {
            return Ok(right);
        }
        let signature = self.problem.system.signature();
        let name = |i: &usize| format!("`{}`", signature.unknowns.name(*i));
        let states: Vec<String> = self.wanted[..self.count].iter().map(name).collect();
        let labels =
            signature.start_equations.iter().map(|equation| format!("`{}`", equation.name));
        let labels: Vec<String> = labels.collect();
        let verb = if labels.len() == 1 { "does" } else { "do" };
        Err(format!("{} {verb} not determine {} there", labels.join(", "), states.join(", ")))
    }

    /// Which start equation is not met, and how close the search came.
    fn not_met(&self, left: &DVector<f64>, scales: &[f64], at: &[f64]) -> String {
        let signature = self.problem.system.signature();
        let scaled = |row: &usize| (left[*row] / scales[*row]).abs();
        let worst = (0..self.count).max_by(|a, b| scaled(a).total_cmp(&scaled(b))).unwrap_or(0);
        let states = self.wanted[..self.count].iter().zip(at).map(|(i, value)| {
            let unit = signature.unknowns.unit(*i);
            let value = unit.from_si(*value);
            format!("{} = {value:.4} {}", signature.unknowns.name(*i), unit.symbol)
        });
        let states: Vec<String> = states.collect();
        format!(
            "the search ends at {}, where `{}` is not met; another guess may help",
            states.join(", "),
            signature.start_equations[worst].name
        )
    }
}

/// Brings unknowns into units of their sizes, and rows into units of their largest entries, which are returned.
fn scaled(matrix: &mut DMatrix<f64>, sizes: &[f64]) -> Vec<f64> {
    for (mut column, size) in matrix.column_iter_mut().zip(sizes) {
        column *= *size;
    }
    let mut scales = Vec::with_capacity(matrix.nrows());
    for mut row in matrix.row_iter_mut() {
        let largest = row.amax();
        let scale = if largest > 0.0 { largest } else { 1.0 };
        row.unscale_mut(scale);
        scales.push(scale);
    }
    scales
}
