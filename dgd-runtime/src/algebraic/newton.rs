//! Newton's iteration for algebraic unknowns, and the equation at fault if it fails.

use super::singularity::CONVERGED;
use super::{
    AlgebraicPoint, AlgebraicSystem, InputsAt, ROUNDING, add_scaled, add_terms, is_rounding, mask,
};
use crate::algebraic::readings::readings;
use crate::error::InitialError;
use crate::linalg::Factorisation;
use crate::linalg::blocks::{blocks, is_singular};
use crate::linalg::norm::Tolerances;
use crate::solved::SolvableSystem;
use crate::system::{EvaluationPoint, Pattern};

const MOST_ITERATIONS: usize = 100;
/// The smallest damping factor λ tried.
pub(super) const LEAST_DAMPING: f64 = 1.0 / 4096.0;
/// How many times a guess at which the equations are singular is moved.
const MOST_NUDGES: u32 = 3;

/// Error weights of a correction.
#[derive(Clone, Copy)]
pub(crate) struct CorrectionWeights<'a> {
    pub(crate) sizes: &'a [f64],
    pub(crate) tolerances: Tolerances,
}

impl<S: SolvableSystem> AlgebraicSystem<S> {
    /// Solves 0 = f_a for the algebraic unknowns, from the guess in `y`; `jacobian` is work space.
    pub(crate) fn make_consistent(
        &mut self,
        system: &S,
        at: AlgebraicPoint<'_, impl InputsAt>,
        y: &mut [f64],
        jacobian: &mut [f64],
        sizes: &[f64],
        tolerances: Tolerances,
    ) -> Result<(), InitialError> {
        if self.is_empty() {
            return Ok(());
        }
        self.solve(system, at, y, jacobian, sizes, tolerances)
    }

    /// The same, whether or not the type of models has algebraic unknowns.
    pub(crate) fn solve(
        &mut self,
        system: &S,
        at: AlgebraicPoint<'_, impl InputsAt>,
        y: &mut [f64],
        jacobian: &mut [f64],
        sizes: &[f64],
        tolerances: Tolerances,
    ) -> Result<(), InitialError> {
        self.solve_nudged(
            system,
            at,
            y,
            jacobian,
            CorrectionWeights { sizes, tolerances },
            MOST_NUDGES,
        )
    }

    /// The same from a close guess, which is not moved if the equations are singular there.
    pub(crate) fn solve_nearby(
        &mut self,
        system: &S,
        at: AlgebraicPoint<'_, impl InputsAt>,
        y: &mut [f64],
        jacobian: &mut [f64],
        sizes: &[f64],
        tolerances: Tolerances,
    ) -> Result<(), InitialError> {
        self.solve_nudged(system, at, y, jacobian, CorrectionWeights { sizes, tolerances }, 0)
    }

    fn solve_nudged(
        &mut self,
        system: &S,
        at: AlgebraicPoint<'_, impl InputsAt>,
        y: &mut [f64],
        jacobian: &mut [f64],
        weights: CorrectionWeights<'_>,
        most_nudges: u32,
    ) -> Result<(), InitialError> {
        let AlgebraicPoint { t, mut u, p, z } = at;
        let CorrectionWeights { sizes, tolerances } = weights;
        let signature = system.signature();
        let pattern = &signature.jacobian;
        let equation = |row: usize| signature.equations.get(row).to_string();
        let mut nudges = 0;

        for iteration in 1..=MOST_ITERATIONS {
            system.linearize(
                EvaluationPoint { t, y, u: u.evaluate(y), p, z },
                self.zero_slopes.as_ref(),
                self.f.as_mut(),
                jacobian,
                self.dfdt.as_mut(),
            );
            mask(self.f.as_mut(), self.mass.as_ref());
            let not_finite = self.f.as_ref().iter().position(|f| !f.is_finite()).or_else(|| {
                let mut entries = pattern.positions().zip(jacobian.iter());
                let mass = self.mass.as_ref();
                let undefined = entries.find(|((row, _), j)| mass[*row] == 0.0 && !j.is_finite());
                undefined.map(|((row, _), _)| row)
            });
            if let Some(row) = not_finite {
                let operands =
                    readings(system, EvaluationPoint { t, y, u: u.evaluate(y), p, z }, row);
                return Err(InitialError::NotFinite { equation: equation(row), t, at: operands });
            }
            if self.f.as_ref().iter().all(|f| *f == 0.0) {
                return Ok(());
            }

            // −∂f_a/∂y_a δ = f_a
            let factorised = self.factorise(pattern, jacobian, sizes);
            self.correction.as_mut().copy_from_slice(self.f.as_ref());
            let norm = if factorised.is_ok() {
                self.factorisation.solve(self.correction.as_mut());
                // Keeps rounding of the elimination out of the given values.
                mask(self.correction.as_mut(), self.mass.as_ref());
                tolerances.mean_square(self.correction.as_ref(), y, y, sizes)
            } else {
                f64::INFINITY
            };
            if !norm.is_finite() {
                if is_rounding(&self.f, &self.mass, &mut self.trial, pattern, jacobian, y) {
                    return Ok(());
                }
                if nudges == most_nudges {
                    let row = factorised.err().map_or(largest(self.f.as_ref()), |e| e.row);
                    let point = EvaluationPoint { t, y, u: u.evaluate(y), p, z };
                    return Err(self.singular(system, point, row, jacobian, sizes));
                }
                nudges += 1;
                self.nudge(y, sizes, nudges);
                continue;
            }
            if norm <= CONVERGED * CONVERGED {
                add_scaled(y, 1.0, self.correction.as_ref());
                return Ok(());
            }

            // λ is accepted if the next correction with this matrix is smaller.
            let mut lambda = 1.0;
            while lambda >= LEAST_DAMPING {
                self.trial.as_mut().copy_from_slice(y);
                add_scaled(self.trial.as_mut(), lambda, self.correction.as_ref());
                let trial = self.trial.as_ref();
                system.rhs(
                    EvaluationPoint { t, y: trial, u: u.evaluate(trial), p, z },
                    self.next.as_mut(),
                );
                mask(self.next.as_mut(), self.mass.as_ref());
                self.factorisation.solve(self.next.as_mut());
                let next = tolerances.mean_square(self.next.as_ref(), y, y, sizes);
                let contraction = 1.0 - 0.25 * lambda;
                if next <= contraction * contraction * norm {
                    break;
                }
                lambda *= 0.5;
            }
            if lambda >= LEAST_DAMPING {
                y.copy_from_slice(self.trial.as_ref());
            } else if is_rounding(&self.f, &self.mass, &mut self.trial, pattern, jacobian, y) {
                return Ok(());
            } else if nudges < most_nudges {
                nudges += 1;
                self.nudge(y, sizes, nudges);
            } else {
                let point = EvaluationPoint { t, y, u: u.evaluate(y), p, z };
                return Err(self.not_converged(system, point, weights, jacobian, iteration));
            }
        }
        let point = EvaluationPoint { t, y, u: u.evaluate(y), p, z };
        Err(self.not_converged(system, point, weights, jacobian, MOST_ITERATIONS))
    }

    /// Moves algebraic unknowns by their sizes: q|q| has zero slope at a guess of zero, and almost none near it.
    fn nudge(&self, y: &mut [f64], sizes: &[f64], times: u32) {
        for ((y, size), mass) in y.iter_mut().zip(sizes).zip(self.mass.as_ref()) {
            *y += (1.0 - mass) * size * f64::from(times);
        }
    }

    pub(super) fn not_converged(
        &self,
        system: &S,
        at: EvaluationPoint<'_>,
        weights: CorrectionWeights<'_>,
        jacobian: &[f64],
        iterations: usize,
    ) -> InitialError {
        let CorrectionWeights { sizes, tolerances } = weights;
        let signature = system.signature();
        let EvaluationPoint { t, y, .. } = at;
        let row = self.first_unsolved(&signature.jacobian, jacobian, y);
        let correction = self.correction.as_ref();
        let relative = |i: usize| correction[i].abs() / tolerances.weight(y[i], sizes[i]);
        let unknown =
            (0..y.len()).max_by(|&i, &j| relative(i).total_cmp(&relative(j))).unwrap_or(0);
        InitialError::NotConverged {
            t,
            iterations,
            equation: signature.equations.get(row).to_string(),
            residual: self.f.as_ref()[row],
            unknown: signature.unknowns.name(unknown).to_string(),
            correction: correction[unknown],
            at: readings(system, at, row),
        }
    }

    /// The equation with the largest residual in the first unsolved block: later blocks read unknowns of this one, so
    /// the fault is not theirs.
    fn first_unsolved(&self, pattern: &Pattern, jacobian: &[f64], y: &[f64]) -> usize {
        let f = self.f.as_ref();
        let mut terms = vec![0.0; f.len()];
        add_terms(&mut terms, pattern, jacobian, y);
        let relative = |row: usize| f[row].abs() / terms[row].max(f64::MIN_POSITIVE);
        let unsolved = |block: &Vec<usize>| {
            let rows = block.iter().copied().filter(|row| f[*row].abs() > ROUNDING * terms[*row]);
            rows.max_by(|i, j| relative(*i).total_cmp(&relative(*j)))
        };
        let blocks = blocks(pattern, jacobian, self.mass.as_ref());
        blocks.iter().find_map(unsolved).unwrap_or_else(|| largest(f))
    }

    /// The equation with the largest residual in the singular block; `row` if no block is singular by itself.
    pub(crate) fn singular(
        &self,
        system: &S,
        at: EvaluationPoint<'_>,
        row: usize,
        jacobian: &[f64],
        sizes: &[f64],
    ) -> InitialError {
        let signature = system.signature();
        let pattern = &signature.jacobian;
        let f = self.f.as_ref();
        let blocks = blocks(pattern, jacobian, self.mass.as_ref());
        let block = blocks.into_iter().find(|block| is_singular(block, pattern, jacobian, sizes));
        let block = block.unwrap_or_else(|| vec![row]);
        let mut terms = vec![0.0; f.len()];
        add_terms(&mut terms, pattern, jacobian, sizes);
        let relative = |row: usize| f[row].abs() / terms[row].max(f64::MIN_POSITIVE);
        let first = block.iter().copied().max_by(|i, j| relative(*i).total_cmp(&relative(*j)));
        let row = first.unwrap_or(row);
        let label = |row: usize| signature.equations.get(row).to_string();
        InitialError::Singular {
            equation: label(row),
            t: at.t,
            residual: f[row],
            together: block.into_iter().filter(|other| *other != row).map(label).collect(),
            at: readings(system, at, row),
        }
    }
}

fn largest(values: &[f64]) -> usize {
    (0..values.len()).max_by(|&i, &j| values[i].abs().total_cmp(&values[j].abs())).unwrap_or(0)
}
