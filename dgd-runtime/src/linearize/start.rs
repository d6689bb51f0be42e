//! The start of a run at rest, or by start equations, and its derivatives with respect to θ.
//!
//! ```text
//!   0 = f(y₀, u₀, θ)  for all equations but those of states that name conserved sums,
//!   cₖᵀ y₀ = cₖᵀ x₀                                    x₀: the declared start values
//!
//!   ∂f/∂y S = −∂f/∂θ,      cₖᵀ S = cₖᵀ dx₀/dθ − dcₖᵀ/dθ (y₀ − x₀)
//! ```
//!
//! dcₖ/dθ is a difference, as coefficients are those of a null space.

use nalgebra::DMatrix;

use super::conserved::ConservedCombination;
use super::held::SteadyEquations;
use super::steady::{SteadyState, rest};
use crate::error::InitialError;
use crate::integrate::start::consistent::start_values;
use crate::integrate::start::equations::start_by_equations;
use crate::problem::{Options, Problem, parameter_size, unknown_sizes};
use crate::signal::{Inputs, LimitSide};
use crate::solved::SolvableSystem;
use crate::system::{Direction, EvaluationPoint, Storage};

/// Steps of differences of coefficients, in sizes of parameters.
const STEP: f64 = 1e-4;

/// Writes the unknowns at rest with the inputs at `t` into `y`, starting from the declared start values, and their
/// derivatives with respect to θ into `s`; or, if the model has start equations, unknowns that satisfy these.
///
/// If start values of all unknowns are given, nothing is written: a run starts there.
///
/// # Errors
///
/// [`InitialError::NoRest`], [`InitialError::NoStart`], and that of a start value which is not finite.
pub fn find_start<S: SolvableSystem>(
    problem: &Problem<'_, S>,
    t: f64,
    options: &Options,
    y: &mut [f64],
    s: Option<&mut [f64]>,
) -> Result<(), InitialError> {
    let n = y.len();
    let signature = problem.system.signature();
    if !signature.start_is_found() || problem.start.len() >= n {
        return Ok(());
    }
    if !signature.starts_at_rest {
        return start_by_equations(problem, t, options, y, s);
    }
    let no_rest = |reason: String| InitialError::NoRest { t, reason };
    let inputs = problem.inputs_read().map_err(|error| no_rest(error.to_string()))?;
    let mut u = S::Inputs::zeros(inputs.len());
    inputs.value(t, LimitSide::Right, u.as_mut());
    let point = EvaluationPoint { t, y: &[], u: u.as_ref(), p: problem.p, z: &[] };
    let mut declared = vec![0.0; n];
    start_values(problem, point, &mut declared)?;
    let full: Vec<(usize, f64)> = declared.iter().copied().enumerate().collect();
    let constant = Inputs::constant(&u.as_ref()[..signature.inputs.len()]);
    let search = Problem { inputs: &constant, start: &full, ..*problem };
    let steady = rest(&search, t, options).map_err(|error| no_rest(error.to_string()))?;
    y.copy_from_slice(&steady.at.y);
    if let Some(s) = s {
        let slopes = StartSlopes { problem, rest: &steady, declared: &declared };
        let solved = slopes.of_start(point, s);
        solved.ok_or_else(|| {
            no_rest("derivatives to what is estimated are not defined there".to_owned())
        })?;
    }
    Ok(())
}

struct StartSlopes<'a, S: SolvableSystem> {
    problem: &'a Problem<'a, S>,
    rest: &'a SteadyState,
    declared: &'a [f64],
}

impl<S: SolvableSystem> StartSlopes<'_, S> {
    /// S, n × n_s by columns; `None` if it is not determined.
    fn of_start(&self, at: EvaluationPoint<'_>, s: &mut [f64]) -> Option<()> {
        let system = self.problem.system;
        let signature = system.signature();
        let (n, n_s) = (self.declared.len(), signature.directions.len());
        let mut of_declared = vec![0.0; n * n_s];
        self.problem.start_sensitivities(at, &mut of_declared);
        // At rest a delayed unknown equals its current value, and moves with it.
        let mut at_rest = self.rest.at.clone();
        at_rest.u[signature.past().held()].fill(0.0);
        let place = at_rest.point(self.problem.p);
        let none = vec![0.0; n * n_s];
        let (mut f, mut g) = (vec![0.0; n], vec![0.0; n * n_s]);
        system.sensitivity_rhs(place, &none, &mut f, &mut g);
        let still = S::Inputs::zeros(signature.n_u());
        let mut dfdt = vec![0.0; n];
        let mut jacobian = S::Jacobian::zeros(signature.jacobian.len());
        system.linearize(place, still.as_ref(), &mut f, jacobian.as_mut(), &mut dfdt);
        let mut matrix = DMatrix::zeros(n, n);
        for ((row, column), value) in signature.jacobian.positions().zip(jacobian.as_ref()) {
            matrix[(row, column)] += *value;
        }
        let mut right = -DMatrix::from_column_slice(n, n_s, &g);
        let moved = self.coefficients_moved()?;
        for (k, own) in self.rest.conserved.iter().enumerate() {
            let row = own.named_by;
            matrix.row_mut(row).fill(0.0);
            for (state, c) in &own.terms {
                matrix[(row, *state)] = *c;
            }
            for j in 0..n_s {
                let kept: f64 = own.terms.iter().map(|(i, c)| c * of_declared[j * n + i]).sum();
                let away = |i: usize| self.rest.at.y[i] - self.declared[i];
                let turned: f64 = (0..n).map(|i| moved[j][k][i] * away(i)).sum();
                right[(row, j)] = kept - turned;
            }
        }
        let mut sizes = vec![0.0; n];
        unknown_sizes(system, &self.rest.at.y, &mut sizes);
        // Unknowns in units of their sizes, rows in units of their largest entries.
        for (mut column, size) in matrix.column_iter_mut().zip(&sizes) {
            column *= *size;
        }
        for i in 0..n {
            let largest = matrix.row(i).amax();
            if largest > 0.0 {
                matrix.row_mut(i).unscale_mut(largest);
                right.row_mut(i).unscale_mut(largest);
            }
        }
        if !matrix.lu().solve_mut(&mut right) || right.iter().any(|value| !value.is_finite()) {
            return None;
        }
        for (mut row, size) in right.row_iter_mut().zip(&sizes) {
            row *= *size;
        }
        s.copy_from_slice(right.as_slice());
        Some(())
    }

    /// dcₖ/dθⱼ over all unknowns, by direction and combination.
    fn coefficients_moved(&self) -> Option<Vec<Vec<Vec<f64>>>> {
        let signature = self.problem.system.signature();
        let n = self.declared.len();
        let m = self.rest.conserved.len();
        let still = vec![vec![0.0; n]; m];
        let moved = signature.directions.iter().map(|direction| {
            let Direction::Parameter(i) = *direction else { return Some(still.clone()) };
            if m == 0 {
                return Some(Vec::new());
            }
            let step = STEP * parameter_size(self.problem.system, i);
            let [after, before] = [step, -step].map(|step| self.conserved_at(i, step));
            let (after, before) = (after?, before?);
            let difference = |a: &ConservedCombination, b: &ConservedCombination| {
                let mut slope = vec![0.0; n];
                for (sign, own) in [(1.0, a), (-1.0, b)] {
                    for (state, c) in &own.terms {
                        slope[*state] += sign * c / (2.0 * step);
                    }
                }
                slope
            };
            let pairs = after.iter().zip(&before);
            let names = |all: &[ConservedCombination]| {
                all.iter().map(|own| own.named_by).collect::<Vec<_>>()
            };
            let is_same =
                names(&after) == names(&self.rest.conserved) && names(&after) == names(&before);
            is_same.then(|| pairs.map(|(a, b)| difference(a, b)).collect())
        });
        moved.collect()
    }

    /// The conserved sums at the point with another value of a parameter.
    fn conserved_at(&self, parameter: usize, step: f64) -> Option<Vec<ConservedCombination>> {
        let mut p = self.problem.p.to_vec();
        p[parameter] += step;
        let problem = Problem { p: &p, ..*self.problem };
        let mut sizes = vec![0.0; self.declared.len()];
        unknown_sizes(self.problem.system, self.declared, &mut sizes);
        let point = &self.rest.at;
        let families =
            SteadyEquations { problem: &problem, t: point.t, u: &point.u, sizes: &sizes };
        let conserved = families.conserved(&point.y, &point.z, self.declared);
        (conserved.len() == self.rest.conserved.len()).then_some(conserved)
    }
}
