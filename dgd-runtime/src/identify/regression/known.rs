//! What readings say of the unknowns at each sample.
//!
//! ```text
//!   w_s(t, y, u, p) = measured          outputs without a parameter to be estimated
//!   f_a(t, y, u, p) = 0                 algebraic equations without one
//! ```
//!
//! are solved for y at each sample by Gauss and Newton, outputs weighted by their noise, equations so
//! heavily that they hold (Golub, Van Loan, 4th ed., §6.2.3). An unknown that they do not determine is
//! NaN there. Slopes of the others are those of [`super::slopes`].

use nalgebra::{DMatrix, DVector};

use crate::discrete::{choose_sides, discrete_numbers};
use crate::identify::error::{EstimateError, TrialFailed};
use crate::identify::recording::Recording;
use crate::identify::regression::error::RegressionError;
use crate::identify::regression::slopes::slopes;
use crate::identify::variables::first_start;
use crate::problem::{Problem, unknown_sizes};
use crate::signal::{Inputs, Side};
use crate::solution::side;
use crate::state_selection::select_states;
use crate::system::{Pattern, Point, System};

/// Corrections below this part of an unknown's size end the iteration.
const CONVERGED: f64 = 1e-10;
const MOST_ITERATIONS: usize = 30;
/// Singular values below this part of the largest, columns of length 1, determine nothing.
const UNSEEN: f64 = 1e-8;
/// An unknown takes part in what is not determined from this share of its square on.
const TAKES_PART: f64 = 1e-6;
/// Weight of an equation over that of the best output.
const EQUATION_WEIGHT: f64 = 1e4;
/// Samples on either side of a window of slopes, where no width is given.
const SAMPLES_EACH_SIDE: f64 = 5.0;

/// What determines the unknowns.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Sensors {
    /// Outputs without a parameter to be estimated, and their noise.
    pub outputs: Vec<(usize, f64)>,
    /// Algebraic equations without one.
    pub equations: Vec<usize>,
}

/// All samples of a recording.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Known {
    n: usize,
    n_u: usize,
    n_z: usize,
    /// Sample times, s.
    pub times: Vec<f64>,
    /// Samples before this one do not count.
    pub first: usize,
    y: Vec<f64>,
    ydot: Vec<f64>,
    u: Vec<f64>,
    /// Just before the sample.
    u_before: Vec<f64>,
    z: Vec<f64>,
}

impl Known {
    /// Where the rows of sample k are evaluated.
    pub(crate) fn point<'a>(&'a self, k: usize, p: &'a [f64]) -> Point<'a> {
        self.at(k, &self.u, p)
    }

    /// The same just before the inputs take their values at sample k.
    pub(crate) fn point_before<'a>(&'a self, k: usize, p: &'a [f64]) -> Point<'a> {
        self.at(k, &self.u_before, p)
    }

    fn at<'a>(&'a self, k: usize, u: &'a [f64], p: &'a [f64]) -> Point<'a> {
        let Self { n, n_u, n_z, .. } = *self;
        Point {
            t: self.times[k],
            y: &self.y[k * n..(k + 1) * n],
            u: &u[k * n_u..(k + 1) * n_u],
            p,
            z: &self.z[k * n_z..(k + 1) * n_z],
        }
    }

    /// Slopes of the unknowns at sample k.
    pub(crate) fn ydot(&self, k: usize) -> &[f64] {
        &self.ydot[k * self.n..(k + 1) * self.n]
    }

    /// Leaves out samples at which an unknown moves faster than its limit.
    pub(crate) fn keep_steady(&mut self, limits: &[(usize, f64)]) {
        for k in 0..self.times.len() {
            let slopes = &self.ydot[k * self.n..(k + 1) * self.n];
            // NaN is not known to be steady.
            let is_steady = limits.iter().all(|(i, limit)| slopes[*i].abs() <= *limit);
            if !is_steady {
                self.y[k * self.n..(k + 1) * self.n].fill(f64::NAN);
                self.ydot[k * self.n..(k + 1) * self.n].fill(f64::NAN);
            }
        }
    }

    /// What the recording at a position says.
    pub(crate) fn new<S: System>(
        system: &S,
        p: &[f64],
        (position, recording): (usize, &Recording),
        sensors: &Sensors,
        half_width: Option<f64>,
    ) -> Result<Self, RegressionError> {
        let signature = system.signature();
        let (n, n_u, n_z) = (signature.unknowns.len(), signature.n_u(), signature.discrete.len());
        let problem = Problem { system, p, inputs: &recording.inputs, start: &recording.start };
        let inputs = problem.inputs_read().map_err(RegressionError::Inputs)?;
        let times = recording.times.clone();
        let first = times.partition_point(|t| *t < recording.counts_from);
        let mut known = Self {
            n,
            n_u,
            n_z,
            first,
            y: vec![f64::NAN; n * times.len()],
            ydot: vec![f64::NAN; n * times.len()],
            u: vec![0.0; n_u * times.len()],
            u_before: vec![0.0; n_u * times.len()],
            z: vec![0.0; n_z * times.len()],
            times,
        };
        known.write_inputs(&inputs);
        if n > 0 {
            known.reconstruct(system, p, (position, recording), sensors)?;
            known.write_slopes(half_width);
        } else if n_z > 0 {
            for k in 0..known.times.len() {
                let z = discrete_numbers(system, p, known.times[k]);
                known.z[k * n_z..(k + 1) * n_z].copy_from_slice(&z);
            }
        }
        Ok(known)
    }

    fn write_inputs(&mut self, inputs: &Inputs) {
        if self.n_u == 0 {
            return;
        }
        let both = self.u.chunks_exact_mut(self.n_u).zip(self.u_before.chunks_exact_mut(self.n_u));
        for (k, (u, before)) in both.enumerate() {
            inputs.value(self.times[k], side(&self.times, k), u);
            inputs.value(self.times[k], Side::Left, before);
        }
    }

    fn reconstruct<S: System>(
        &mut self,
        system: &S,
        p: &[f64],
        (position, recording): (usize, &Recording),
        sensors: &Sensors,
    ) -> Result<(), RegressionError> {
        let Self { n, n_u, n_z, .. } = *self;
        let mut guess = first_start(system, p, recording).map_err(|reason| {
            let failed = TrialFailed { recording: position, reason };
            RegressionError::Variables(EstimateError::Start(failed))
        })?;
        let mut sizes = vec![0.0; n];
        unknown_sizes(system, &guess, &mut sizes);
        let mut solver = Solver::new(system, sensors, sizes);
        let n_e = system.signature().discrete.transitions().count();
        let mut e = vec![0.0; n_e];
        for k in 0..self.times.len() {
            let t = self.times[k];
            let u = &self.u[k * n_u..(k + 1) * n_u];
            let mut z = Vec::new();
            if n_z > 0 {
                z = discrete_numbers(system, p, t);
                select_states(system, Point { t, y: &guess, u, p, z: &[] }, &mut z, &mut e);
                choose_sides(system, (t, &guess, u, p), &mut e, &mut z);
            }
            let measured = |i: usize| recording.measured[i].as_ref().map_or(f64::NAN, |w| w[k]);
            let found = solver.solve(Point { t, y: &[], u, p, z: &z }, &measured, &mut guess);
            if let Some(determined) = found {
                for (i, determined) in determined.iter().enumerate() {
                    if *determined {
                        self.y[k * n + i] = guess[i];
                    }
                }
            }
            self.z[k * n_z..(k + 1) * n_z].copy_from_slice(&z);
        }
        Ok(())
    }

    fn write_slopes(&mut self, half_width: Option<f64>) {
        let half_width = half_width.or_else(|| usual_step(&self.times)).unwrap_or(1.0);
        for i in 0..self.n {
            let y: Vec<f64> = self.y.iter().copied().skip(i).step_by(self.n).collect();
            for (k, slope) in slopes(&self.times, &y, half_width).into_iter().enumerate() {
                self.ydot[k * self.n + i] = slope;
            }
        }
    }
}

/// The width of so many usual steps, and a little for rounding.
fn usual_step(times: &[f64]) -> Option<f64> {
    let mut steps: Vec<f64> =
        times.windows(2).map(|pair| pair[1] - pair[0]).filter(|step| *step > 0.0).collect();
    steps.sort_by(f64::total_cmp);
    steps.get(steps.len() / 2).map(|median| SAMPLES_EACH_SIDE * median * (1.0 + 1e-9))
}

/// Solves for y at one sample after the other.
struct Solver<'a, S> {
    system: &'a S,
    sensors: &'a Sensors,
    sizes: Vec<f64>,
    w: Vec<f64>,
    jacobians: [Vec<f64>; 3],
    dwdt: Vec<f64>,
    f: Vec<f64>,
    dfdt: Vec<f64>,
    dfdy: Vec<f64>,
    /// The last matrix, and what solves with it: linear sensors always have the same.
    last: Option<(DMatrix<f64>, Inverse)>,
}

/// A matrix's pseudo-inverse, and which columns it determines.
#[derive(Clone)]
struct Inverse {
    pseudo: DMatrix<f64>,
    determined: Vec<bool>,
}

impl<'a, S: System> Solver<'a, S> {
    fn new(system: &'a S, sensors: &'a Sensors, sizes: Vec<f64>) -> Self {
        let signature = system.signature();
        let (n, n_w) = (signature.unknowns.len(), signature.outputs.len());
        Self {
            system,
            sensors,
            sizes,
            w: vec![0.0; n_w],
            jacobians: [0, 1, 2].map(|of| vec![0.0; signature.output_jacobians[of].len()]),
            dwdt: vec![0.0; n_w],
            f: vec![0.0; n],
            dfdt: vec![0.0; n],
            dfdy: vec![0.0; signature.jacobian.len()],
            last: None,
        }
    }

    /// Moves the guess to the solution, and says which unknowns it determines; `None` where there is
    /// none, and then the guess stays.
    fn solve(
        &mut self,
        at: Point<'_>,
        measured: &dyn Fn(usize) -> f64,
        guess: &mut [f64],
    ) -> Option<Vec<bool>> {
        let mut y = guess.to_vec();
        for _ in 0..MOST_ITERATIONS {
            let (matrix, rest) = self.linearized(Point { y: &y, ..at }, measured)?;
            if !self.last.as_ref().is_some_and(|(last, _)| *last == matrix) {
                let inverse = Inverse::of(&matrix)?;
                self.last = Some((matrix, inverse));
            }
            let (_, inverse) = self.last.as_ref()?;
            let correction = &inverse.pseudo * rest;
            let mut largest = 0.0f64;
            for (i, correction) in correction.iter().enumerate() {
                if inverse.determined[i] {
                    y[i] += correction * self.sizes[i];
                    largest = largest.max(correction.abs() / (y[i] / self.sizes[i]).abs().max(1.0));
                }
            }
            if !largest.is_finite() {
                return None;
            }
            if largest <= CONVERGED {
                guess.copy_from_slice(&y);
                return Some(inverse.determined.clone());
            }
        }
        None
    }

    /// Weighted rows over unknowns in their sizes, and what is left of them.
    fn linearized(
        &mut self,
        at: Point<'_>,
        measured: &dyn Fn(usize) -> f64,
    ) -> Option<(DMatrix<f64>, DVector<f64>)> {
        let signature = self.system.signature();
        let n = signature.unknowns.len();
        let Sensors { outputs, equations } = self.sensors;
        let seen: Vec<(usize, f64)> =
            outputs.iter().copied().filter(|(i, _)| measured(*i).is_finite()).collect();
        let mut matrix = DMatrix::zeros(seen.len() + equations.len(), n);
        let mut rest = DVector::zeros(matrix.nrows());
        if !seen.is_empty() {
            let [by_y, by_u, by_p] = &mut self.jacobians;
            self.system.output_jacobians(at, by_y, by_u, by_p, &mut self.dwdt);
            self.system.outputs(at, &mut self.w);
            for (row, (i, noise)) in seen.iter().enumerate() {
                rest[row] = (measured(*i) - self.w[*i]) / noise;
            }
            let row_of = |i| seen.iter().position(|(seen, _)| *seen == i);
            fill(&mut matrix, &signature.output_jacobians[0], by_y, &self.sizes, row_of);
            for (row, (_, noise)) in seen.iter().enumerate() {
                matrix.row_mut(row).unscale_mut(*noise);
            }
        }
        if !equations.is_empty() {
            let still = vec![0.0; signature.n_u()];
            let (f, dfdt) = (&mut self.f, &mut self.dfdt);
            self.system.linearize(at, &still, f, &mut self.dfdy, dfdt);
            let row_of = |i| Some(seen.len() + equations.iter().position(|e| *e == i)?);
            fill(&mut matrix, &signature.jacobian, &self.dfdy, &self.sizes, row_of);
            let best = (0..seen.len()).map(|row| matrix.row(row).norm()).fold(1.0, f64::max);
            let weight = EQUATION_WEIGHT * best;
            for (k, i) in equations.iter().enumerate() {
                let row = seen.len() + k;
                let norm = matrix.row(row).norm();
                if norm > 0.0 {
                    matrix.row_mut(row).scale_mut(weight / norm);
                    rest[row] = -self.f[*i] * weight / norm;
                }
            }
        }
        let finite = matrix.iter().chain(rest.iter()).all(|value| value.is_finite());
        finite.then_some((matrix, rest))
    }
}

/// Writes the rows of a matrix that are wanted, columns times sizes.
fn fill(
    matrix: &mut DMatrix<f64>,
    pattern: &Pattern,
    values: &[f64],
    sizes: &[f64],
    row_of: impl Fn(usize) -> Option<usize>,
) {
    pattern.for_each(values, |row, column, value| {
        if let Some(row) = row_of(row) {
            matrix[(row, column)] = value * sizes[column];
        }
    });
}

impl Inverse {
    fn of(matrix: &DMatrix<f64>) -> Option<Self> {
        let n = matrix.ncols();
        let size: Vec<f64> = matrix.column_iter().map(|column| column.norm()).collect();
        let seen: Vec<usize> = (0..n).filter(|j| size[*j] > 0.0).collect();
        let mut pseudo = DMatrix::zeros(n, matrix.nrows());
        let mut determined = vec![false; n];
        if seen.is_empty() {
            return Some(Self { pseudo, determined });
        }
        let mut scaled = matrix.select_columns(&seen);
        for (column, j) in seen.iter().enumerate() {
            scaled.column_mut(column).unscale_mut(size[*j]);
        }
        let svd = scaled.svd(true, true);
        let cutoff = UNSEEN * svd.singular_values.max();
        let v_t = svd.v_t.as_ref()?;
        let kept: Vec<usize> =
            (0..svd.singular_values.len()).filter(|k| svd.singular_values[*k] > cutoff).collect();
        for (column, j) in seen.iter().enumerate() {
            let share: f64 = kept.iter().map(|k| v_t[(*k, column)].powi(2)).sum();
            determined[*j] = 1.0 - share <= TAKES_PART;
        }
        let of_seen = svd.pseudo_inverse(cutoff).ok()?;
        for (row, j) in seen.iter().enumerate() {
            pseudo.row_mut(*j).copy_from(&(of_seen.row(row) / size[*j]));
        }
        Some(Self { pseudo, determined })
    }
}
