//! Steady states in families: conserved combinations keep their values, and everything else is at rest.
//!
//! Where c₁ᵀẋ = 0, …, some equations of 0 = f follow from the others, and 0 = f has a family of solutions. Each
//! conserved combination is held, in place of the equation of its naming state:
//!
//! ```text
//!   0 = f_i(y)  for all equations but those,      0 = cₖᵀ (x − x₀)
//! ```
//!
//! which has as many equations as before, and is regular if the steady state is the only one with those values.

use nalgebra::{DMatrix, DVector};

use super::conserved::{ConservedCombination, left_null};
use super::elimination::Elimination;
use super::error::SteadyStateError;
use super::point::OperatingPoint;
use super::{LinearSlopes, SlopeColumns, singular};
use crate::algebraic::{AlgebraicPoint, AlgebraicSystem, add_terms};
use crate::linalg::full::FullLu;
use crate::linalg::norm::Tolerances;
use crate::problem::Problem;
use crate::solved::SolvableSystem;
use crate::system::{EvaluationPoint, Storage};

/// Distances of test points from the start, in sizes of the unknowns.
const DISTANCES: [f64; 5] = [0.03, 0.1, 0.3, 0.01, 1e-3];
/// Minimum number of test points at which the equations must be solvable.
const LEAST_POINTS: usize = 2;
/// Products with c below this fraction of their terms are rounding.
const ROUNDING: f64 = 1e-9;
/// Maximum number of Newton corrections, the smallest damping factor, and the size of the last correction.
const MOST_CORRECTIONS: usize = 100;
const LEAST_DAMPING: f64 = 1.0 / 4096.0;
const CORRECTED: f64 = 1e-11;
/// Corrections this small that stop shrinking are rounding.
const STALLED: f64 = 1e-7;
/// Tolerances of algebraic unknowns.
const POLISHED: Tolerances = Tolerances { rtol: 1e-10, atol: 1e-10 };

/// The equations whose steady states are sought.
pub(super) struct SteadyEquations<'a, S: SolvableSystem> {
    pub problem: &'a Problem<'a, S>,
    pub t: f64,
    /// Inputs without delays.
    pub u: &'a [f64],
    /// Sizes of the unknowns.
    pub sizes: &'a [f64],
}

/// The states' equations at a point, with algebraic unknowns eliminated.
struct OfStates {
    states: Vec<usize>,
    a: DMatrix<f64>,
    b: DMatrix<f64>,
    /// ẋ.
    rates: Vec<f64>,
}

impl<S: SolvableSystem> SteadyEquations<'_, S> {
    /// Combinations that are conserved in the modes `z`, with their values at `y`. Includes those that drift: their
    /// rates do not depend on the states.
    pub(super) fn conserved(
        &self,
        y: &[f64],
        z: &[f64],
        start: &[f64],
    ) -> Vec<ConservedCombination> {
        let Some(y) = self.consistent(y, z) else { return Vec::new() };
        let Some(here) = self.slopes(&y, self.u, z) else { return Vec::new() };
        let moved = DISTANCES.iter().enumerate().filter_map(|(k, distance)| {
            let moved = self.consistent(&self.moved(&y, *distance, k), z)?;
            let slopes_there = self.slopes(&moved, self.u, z)?;
            (slopes_there.states == here.states).then_some(slopes_there.a)
        });
        let mut slopes: Vec<DMatrix<f64>> = moved.collect();
        if slopes.len() < LEAST_POINTS {
            return Vec::new();
        }
        slopes.push(here.a.clone());
        let mut conserved = self.named(&slopes, &here.states, &y, start, true);
        for own in &mut conserved {
            own.whatever_inputs = self.is_beyond_inputs(own, &y, z);
        }
        conserved
    }

    /// The conserved sums near `y`, if `y` and neighbouring points are at rest.
    pub(super) fn conserved_close(
        &self,
        y: &[f64],
        z: &[f64],
        start: &[f64],
    ) -> Vec<ConservedCombination> {
        let slopes = self.consistent(y, z).and_then(|y| self.slopes(&y, self.u, z));
        slopes.map_or_else(Vec::new, |here| {
            self.named(std::slice::from_ref(&here.a), &here.states, y, start, false)
        })
    }

    fn named(
        &self,
        slopes: &[DMatrix<f64>],
        states: &[usize],
        y: &[f64],
        start: &[f64],
        is_linear: bool,
    ) -> Vec<ConservedCombination> {
        let sizes: Vec<f64> = states.iter().map(|i| self.sizes[*i]).collect();
        let combination = |(c, name): (Vec<f64>, usize)| {
            let terms = states.iter().copied().zip(c).filter(|(_, c)| *c != 0.0).collect();
            let candidate = ConservedCombination {
                terms,
                named_by: states[name],
                value: 0.0,
                at_start: 0.0,
                whatever_inputs: false,
                is_linear,
            };
            ConservedCombination {
                value: candidate.value(y),
                at_start: candidate.value(start),
                ..candidate
            }
        };
        left_null(slopes, &sizes).into_iter().map(combination).collect()
    }

    /// A combination that changes at a rate that does not depend on the states, if any.
    pub(super) fn drift(
        &self,
        conserved: &[ConservedCombination],
        y: &[f64],
        z: &[f64],
    ) -> Option<SteadyStateError> {
        let y = self.consistent(y, z)?;
        let here = self.slopes(&y, self.u, z)?;
        let position = |unknown: &usize| here.states.binary_search(unknown).ok();
        let signature = self.problem.system.signature();
        let (_, jacobian) = self.residuals(&y, z);
        let mut sizes = vec![0.0; y.len()];
        add_terms(&mut sizes, &signature.jacobian, jacobian.as_ref(), &y);
        add_terms(&mut sizes, &signature.jacobian, jacobian.as_ref(), self.sizes);
        let rate = |own: &ConservedCombination| {
            own.terms.iter().filter_map(|(i, c)| Some(c * here.rates[position(i)?])).sum::<f64>()
        };
        let terms = |own: &ConservedCombination| {
            own.terms.iter().map(|(i, c)| c.abs() * sizes[*i]).sum::<f64>()
        };
        let drifting = |own: &&ConservedCombination| rate(own).abs() > ROUNDING * terms(own);
        let sum = conserved.iter().find(drifting)?;
        let unit = signature.unknowns.unit(sum.named_by);
        let others = sum.terms.iter().filter(|(i, _)| *i != sum.named_by);
        Some(SteadyStateError::Drifts {
            t: self.t,
            equation: signature.equations.get(sum.named_by).to_string(),
            unknown: signature.unknowns.name(sum.named_by).to_string(),
            with: others.map(|(i, _)| signature.unknowns.name(*i).to_string()).collect(),
            rate: rate(sum) / unit.factor,
            unit: unit.symbol.to_string(),
        })
    }

    /// Solves 0 = f for `y` with conserved combinations held at their values. Returns whether that succeeds.
    pub(super) fn solve(
        &self,
        conserved: &[ConservedCombination],
        y: &mut Vec<f64>,
        z: &[f64],
    ) -> bool {
        let norm = |step: &DVector<f64>| {
            step.iter().zip(self.sizes).map(|(x, size)| (x / size).abs()).fold(0.0, f64::max)
        };
        let mut before = f64::INFINITY;
        for _ in 0..MOST_CORRECTIONS {
            let (left, matrix) = self.equations(conserved, y, z);
            let lu = FullLu::new(matrix, self.sizes);
            let Some(step) = lu.solve(&-left) else { return false };
            let size = norm(&step);
            if !size.is_finite() {
                return false;
            }
            if size <= CORRECTED || (size <= STALLED && size >= 0.5 * before) {
                return true;
            }
            before = size;
            let mut part = 1.0;
            loop {
                let trial: Vec<f64> = y.iter().zip(&step).map(|(y, x)| y + part * x).collect();
                let (left, _) = self.equations(conserved, &trial, z);
                // A test that does not depend on how equations are scaled.
                let next = lu.solve(&-left).map_or(f64::NAN, |next| norm(&next));
                if next <= (1.0 - 0.25 * part) * size {
                    *y = trial;
                    break;
                }
                part *= 0.5;
                if part < LEAST_DAMPING {
                    return false;
                }
            }
        }
        false
    }

    /// The equation and the unknown that stay undetermined even with conserved combinations held.
    pub(super) fn open(
        &self,
        conserved: &[ConservedCombination],
        y: &[f64],
        z: &[f64],
    ) -> Option<(usize, usize)> {
        let (_, mut matrix) = self.equations(conserved, y, z);
        for (mut column, size) in matrix.column_iter_mut().zip(self.sizes) {
            column *= *size;
        }
        singular::open(&matrix)
    }

    /// Residuals of the equations, and their derivatives with respect to the unknowns.
    fn equations(
        &self,
        conserved: &[ConservedCombination],
        y: &[f64],
        z: &[f64],
    ) -> (DVector<f64>, DMatrix<f64>) {
        let n = y.len();
        let pattern = &self.problem.system.signature().jacobian;
        let (f, jacobian) = self.residuals(y, z);
        let mut left = DVector::from_column_slice(f.as_ref());
        let mut matrix = DMatrix::zeros(n, n);
        pattern.for_each(jacobian.as_ref(), |row, column, value| matrix[(row, column)] = value);
        for own in conserved {
            left[own.named_by] = own.value(y) - own.value;
            matrix.row_mut(own.named_by).fill(0.0);
            for (state, c) in &own.terms {
                matrix[(own.named_by, *state)] = *c;
            }
        }
        (left, matrix)
    }

    fn residuals(&self, y: &[f64], z: &[f64]) -> (S::Vector, S::Jacobian) {
        let system = self.problem.system;
        let signature = system.signature();
        let (mut f, mut dfdt) = (S::Vector::zeros(y.len()), S::Vector::zeros(y.len()));
        let mut jacobian = S::Jacobian::zeros(signature.jacobian.len());
        let still = S::Inputs::zeros(signature.n_u());
        let point = EvaluationPoint { t: self.t, y, u: self.u, p: self.problem.p, z };
        system.linearize(point, still.as_ref(), f.as_mut(), jacobian.as_mut(), dfdt.as_mut());
        (f, jacobian)
    }

    /// `y` with algebraic unknowns that satisfy their equations.
    fn consistent(&self, y: &[f64], z: &[f64]) -> Option<Vec<f64>> {
        let system = self.problem.system;
        let mut y = y.to_vec();
        let mut mass = S::Vector::zeros(y.len());
        let point = EvaluationPoint { t: self.t, y: &y, u: self.u, p: self.problem.p, z };
        system.mass(point, mass.as_mut());
        let mut equations = AlgebraicSystem::new(system);
        equations.enter_modes(mass.as_ref());
        let mut jacobian = S::Jacobian::zeros(system.signature().jacobian.len());
        let place = AlgebraicPoint { t: self.t, u: self.u, p: self.problem.p, z };
        let solved = equations.make_consistent(
            system,
            place,
            &mut y,
            jacobian.as_mut(),
            self.sizes,
            POLISHED,
        );
        solved.ok()?;
        y.iter().all(|y| y.is_finite()).then_some(y)
    }

    fn slopes(&self, y: &[f64], u: &[f64], z: &[f64]) -> Option<OfStates> {
        let operating_point =
            OperatingPoint { t: self.t, y: y.to_vec(), u: u.to_vec(), z: z.to_vec() };
        let columns = SlopeColumns::new(self.problem, &operating_point).ok()?;
        let (system, point) = (self.problem.system, operating_point.point(self.problem.p));
        let slopes = LinearSlopes::new(system, point, &columns.places, columns.len()).ok()?;
        let elimination = Elimination::new(system, point, &slopes.f).ok()?;
        let rows = elimination.of_states(&slopes.f);
        let n = elimination.states.len();
        let rates: Vec<f64> = elimination.states.iter().map(|i| slopes.rates[*i]).collect();
        let is_finite = rows.iter().chain(&rates).all(|value| value.is_finite());
        is_finite.then(|| OfStates {
            a: rows.columns(0, n).into_owned(),
            b: rows.columns(n, rows.ncols() - n).into_owned(),
            rates,
            states: elimination.states,
        })
    }

    /// A nearby point, in a direction that avoids symmetries.
    fn moved(&self, y: &[f64], distance: f64, k: usize) -> Vec<f64> {
        let pairs = y.iter().zip(self.sizes).enumerate();
        pairs.map(|(i, (y, size))| y + distance * size * spread(i, k)).collect()
    }

    /// Whether a combination is conserved for any inputs, tested at nearby points with other inputs.
    fn is_beyond_inputs(&self, own: &ConservedCombination, y: &[f64], z: &[f64]) -> bool {
        let signature = self.problem.system.signature();
        let read = signature.past().held().start.min(self.u.len());
        let mut known = 0;
        for (k, distance) in DISTANCES.iter().enumerate() {
            let mut u = self.u.to_vec();
            for (i, u) in u[..read].iter_mut().enumerate() {
                let unit = signature.inputs.get(i).map_or(1.0, |input| input.unit.factor);
                *u += distance * u.abs().max(unit.abs()) * spread(i + y.len(), k);
            }
            let there = SteadyEquations { u: &u, ..*self };
            let moved = there.consistent(&self.moved(y, *distance, k), z);
            let Some(found) = moved.and_then(|y| there.slopes(&y, &u, z)) else { continue };
            let columns = found.a.column_iter().chain(found.b.column_iter());
            let product = |column: &dyn Fn(usize) -> f64| {
                let terms = own
                    .terms
                    .iter()
                    .filter_map(|(i, c)| Some(c * column(found.states.binary_search(i).ok()?)));
                let terms: Vec<f64> = terms.collect();
                let size: f64 = terms.iter().map(|term| term.abs()).sum();
                terms.iter().sum::<f64>().abs() <= ROUNDING * size
            };
            if !columns.into_iter().all(|column| product(&|row| column[row])) {
                return false;
            }
            known += 1;
        }
        known >= LEAST_POINTS
    }
}

/// A number between −1 and 1 for each unknown and point.
fn spread(i: usize, k: usize) -> f64 {
    // Multiples of irrational numbers, modulo one.
    let turns = (i as f64 + 1.0) * 0.618_033_988_75 + (k as f64 + 1.0) * 0.754_877_666_25;
    2.0 * (turns * (k as f64 + 1.0)).fract() - 1.0
}
