//! Determines the unknowns at each sample from the readings.
//!
//! ```text
//!   w_s(t, y, u, p) = measured          outputs without a parameter to be estimated
//!   f_a(t, y, u, p) = 0                 algebraic equations without one
//! ```
//!
//! are solved for y at each sample by Gauss–Newton, with outputs weighted by their noise, and equations weighted so
//! heavily that they hold (Golub, Van Loan, 4th ed., §6.2.3). Modes decide which equations are algebraic;
//! [`super::modes`] follows them, with unknowns that are carried along. An unknown that is neither determined nor
//! carried is NaN. Slopes of determined unknowns are those of [`super::slopes`].
//!
//! Equations with delayed unknowns need these at other samples: in that case, everything is solved once more with the
//! values known by then.

pub(super) mod delayed;
pub(super) mod filters;
pub(crate) mod gains;
pub(super) mod modes;
pub(super) mod slopes;

use dgd_runtime::for_identify::{choose_sides, select_states, unknown_sizes};
use dgd_runtime::model::Model;
use dgd_runtime::{EvaluationPoint, Inputs, LimitSide, Pattern, Problem, discrete_numbers, side};
use nalgebra::{DMatrix, DVector};

use crate::error::{EstimateError, TrialFailed};
use crate::recording::Recording;
use crate::regression::error::RegressionError;
use crate::regression::known::delayed::{BeforeRecord, DelayedColumns, cubic};
use crate::regression::known::modes::{CorrectedRun, is_reset, remembered};
use crate::regression::known::slopes::slopes;
use crate::variables::first_start;

/// Corrections below this fraction of an unknown's size end the iteration.
const CONVERGED: f64 = 1e-10;
const MOST_ITERATIONS: usize = 30;
/// Limit on the passes over all samples with delayed unknowns.
const MOST_PASSES: usize = 4;
/// Singular values below this fraction of the largest, with columns of length 1, count as zero.
const UNSEEN: f64 = 1e-8;
/// An unknown is part of an undetermined combination from this share of its square on.
const TAKES_PART: f64 = 1e-6;
/// Weight of an equation over that of the best output.
const EQUATION_WEIGHT: f64 = 1e4;
/// Default number of samples on either side of a window for slopes.
const SAMPLES_EACH_SIDE: f64 = 5.0;

/// Outputs and equations that determine the unknowns.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct SensorEquations {
    /// Outputs without estimated parameters, and their noise.
    pub outputs: Vec<(usize, f64)>,
    /// Equations without estimated parameters; only algebraic ones count.
    pub equations: Vec<usize>,
    /// Positions of the estimated parameters.
    pub free: Vec<usize>,
}

/// All samples of a recording.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct RecordingSamples {
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
    z_before: Vec<f64>,
    /// Whether readings determine an unknown; others are carried along, or unknown.
    given: Vec<bool>,
    /// Whether an event lies between the previous sample and this one.
    cuts: Vec<bool>,
    /// Whether the record contains all delayed values for a sample.
    has_past: Vec<bool>,
    is_steady: Vec<bool>,
    /// Samples from this one on cannot be reached by simulation, so their modes are unknown.
    pub lost_from: usize,
}

impl RecordingSamples {
    /// The point at which the rows of sample k are evaluated.
    pub(crate) fn point<'a>(&'a self, k: usize, p: &'a [f64]) -> EvaluationPoint<'a> {
        self.to_point(k, &self.u, &self.z, p)
    }

    /// The point just before the inputs take their values at sample k.
    pub(crate) fn point_before<'a>(&'a self, k: usize, p: &'a [f64]) -> EvaluationPoint<'a> {
        self.to_point(k, &self.u_before, &self.z_before, p)
    }

    fn to_point<'a>(
        &'a self,
        k: usize,
        u: &'a [f64],
        z: &'a [f64],
        p: &'a [f64],
    ) -> EvaluationPoint<'a> {
        let Self { n, n_u, n_z, .. } = *self;
        EvaluationPoint {
            t: self.times[k],
            y: &self.y[k * n..(k + 1) * n],
            u: &u[k * n_u..(k + 1) * n_u],
            p,
            z: &z[k * n_z..(k + 1) * n_z],
        }
    }

    /// Slopes of the unknowns at sample k.
    pub(crate) fn ydot(&self, k: usize) -> &[f64] {
        &self.ydot[k * self.n..(k + 1) * self.n]
    }

    /// Whether readings determine an unknown at sample k.
    pub(crate) fn is_given(&self, k: usize, unknown: usize) -> bool {
        self.given[k * self.n + unknown]
    }

    /// Whether an event lies between sample k and the previous one.
    pub(crate) fn is_cut(&self, k: usize) -> bool {
        self.cuts[k]
    }

    /// Whether the record contains all delayed values for sample k.
    pub(crate) fn has_past(&self, k: usize) -> bool {
        self.has_past[k]
    }

    /// Whether the samples with complete histories differ from another's.
    pub(crate) fn pasts_differ(&self, other: &Self) -> bool {
        self.has_past != other.has_past
    }

    /// Number of samples whose modes, or preceding events, differ from another's.
    pub(crate) fn modes_differ(&self, other: &Self) -> usize {
        let modes_at = |known: &Self, k: usize| known.z[k * self.n_z..(k + 1) * self.n_z].to_vec();
        let differs = |k: &usize| {
            modes_at(self, *k) != modes_at(other, *k) || self.cuts[*k] != other.cuts[*k]
        };
        (0..self.times.len()).filter(differs).count()
    }

    /// An unknown and its slope at any time; NaN if unknown.
    pub(crate) fn read_at(&self, unknown: usize, t: f64) -> [f64; 2] {
        let value_at = |values: &[f64], k: usize| values[k * self.n + unknown];
        let Some(k) = self.times.partition_point(|time| *time <= t).checked_sub(1) else {
            return [f64::NAN; 2];
        };
        if self.times[k] == t {
            let slope = value_at(&self.ydot, k);
            return [value_at(&self.y, k), if slope.is_finite() { slope } else { 0.0 }];
        }
        if k + 1 == self.times.len() {
            return [f64::NAN; 2];
        }
        let h = self.times[k + 1] - self.times[k];
        let ends = [value_at(&self.y, k), value_at(&self.y, k + 1)];
        let straight = (ends[1] - ends[0]) / h;
        let slopes = [k, k + 1].map(|k| value_at(&self.ydot, k));
        let slopes = slopes.map(|slope| if slope.is_finite() { slope } else { straight });
        cubic((t - self.times[k]) / h, h, ends, slopes)
    }

    /// Excludes samples at which an unknown moves faster than its limit, or at an unknown rate. They are still used as
    /// delayed values.
    pub(crate) fn keep_steady(&mut self, limits: &[(usize, f64)]) {
        for k in 0..self.times.len() {
            let slopes = &self.ydot[k * self.n..(k + 1) * self.n];
            // NaN does not count as steady.
            self.is_steady[k] = limits.iter().all(|(i, limit)| slopes[*i].abs() <= *limit);
        }
    }

    /// Whether a sample has rows, as far as these are known.
    pub(crate) fn counts(&self, k: usize) -> bool {
        k >= self.first && self.is_steady[k]
    }

    /// The lowest rate of an unknown, SI; infinity if it is known at no sample.
    pub(crate) fn slowest(&self, unknown: usize) -> f64 {
        let slopes = (self.first..self.times.len()).map(|k| self.ydot[k * self.n + unknown].abs());
        slopes.fold(f64::INFINITY, f64::min)
    }

    /// Determines the unknowns along the recording at a position.
    pub(crate) fn new(
        system: &dyn Model,
        p: &[f64],
        position: usize,
        recording: &Recording,
        sensors: &SensorEquations,
        half_width: Option<f64>,
    ) -> Result<Self, RegressionError> {
        let signature = system.signature();
        let (n, n_u, n_z) = (signature.unknowns.len(), signature.n_u(), signature.discrete.len());
        let problem =
            Problem { system: &system, p, inputs: &recording.inputs, start: &recording.start };
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
            z_before: vec![0.0; n_z * times.len()],
            given: vec![false; n * times.len()],
            cuts: vec![false; times.len()],
            has_past: vec![true; times.len()],
            is_steady: vec![true; times.len()],
            lost_from: times.len(),
            times,
        };
        known.write_inputs(&inputs);
        if n > 0 {
            known.reconstruct(system, p, position, recording, sensors)?;
            known.write_slopes(half_width);
            let reads_late = !signature.delayed_unknowns.is_empty();
            for _ in 1..if reads_late { MOST_PASSES } else { 1 } {
                let count = known.count();
                known.reconstruct(system, p, position, recording, sensors)?;
                known.write_slopes(half_width);
                if known.count() == count {
                    break;
                }
            }
            known.look_for_past(system, p);
        } else if n_z > 0 {
            for k in 0..known.times.len() {
                let z = discrete_numbers(&system, p, known.times[k]);
                known.z[k * n_z..(k + 1) * n_z].copy_from_slice(&z);
            }
            known.z_before.clone_from(&known.z);
        }
        Ok(known)
    }

    /// Finds the samples whose whole history is in the record.
    fn look_for_past(&mut self, system: &dyn Model, p: &[f64]) {
        let Some(mut delayed) = DelayedColumns::new(system) else { return };
        let mut u = vec![0.0; self.n_u];
        for k in 0..self.times.len() {
            let point = self.point(k, p);
            u.copy_from_slice(point.u);
            delayed.write(system, self, BeforeRecord::Unknown, point, &mut u);
            self.has_past[k] = delayed.earliest >= self.times[0];
        }
    }

    /// Number of known values.
    fn count(&self) -> usize {
        self.y.iter().filter(|y| !y.is_nan()).count()
    }

    fn write_inputs(&mut self, inputs: &Inputs) {
        if self.n_u == 0 {
            return;
        }
        let both = self.u.chunks_exact_mut(self.n_u).zip(self.u_before.chunks_exact_mut(self.n_u));
        for (k, (u, before)) in both.enumerate() {
            inputs.value(self.times[k], side(&self.times, k), u);
            inputs.value(self.times[k], LimitSide::Left, before);
        }
    }

    fn reconstruct(
        &mut self,
        system: &dyn Model,
        p: &[f64],
        position: usize,
        recording: &Recording,
        sensors: &SensorEquations,
    ) -> Result<(), RegressionError> {
        let Self { n, n_u, n_z, .. } = *self;
        let mut guess = first_start(system, p, recording).map_err(|reason| {
            let failed = TrialFailed { recording: position, reason };
            RegressionError::Variables(EstimateError::Start(failed))
        })?;
        let mut sizes = vec![0.0; n];
        unknown_sizes(&system, &guess, &mut sizes);
        let mut solver = SampleSolver::new(system, sensors, sizes);
        let mut delayed = DelayedColumns::new(system);
        let before = delayed.is_some().then(|| self.clone());
        self.y.fill(f64::NAN);
        let mut carrier =
            remembered(system).map(|_| CorrectedRun::new(system, p, recording, guess.clone()));
        let n_e = system.signature().discrete.transitions().count();
        let mut e = vec![0.0; n_e];
        for k in 0..self.times.len() {
            let t = self.times[k];
            let mut u = self.u[k * n_u..(k + 1) * n_u].to_vec();
            let measured = |i: usize| recording.measured[i].as_ref().map_or(f64::NAN, |w| w[k]);
            let mut z = Vec::new();
            if let Some(carrier) = &mut carrier {
                if k == 0 {
                    z = discrete_numbers(&system, p, t);
                    solver.solve(
                        EvaluationPoint { t, y: &[], u: &u, p, z: &z },
                        &measured,
                        &mut guess,
                    );
                    carrier.y.copy_from_slice(&guess);
                }
                let Some(now) = carrier.next(k) else {
                    self.lost_from = k;
                    break;
                };
                guess.copy_from_slice(&now.y);
                self.z_before[k * n_z..(k + 1) * n_z].copy_from_slice(&now.z_before);
                self.cuts[k] = now.is_cut;
                z = now.z;
            } else if n_z > 0 {
                z = discrete_numbers(&system, p, t);
                select_states(
                    &system,
                    EvaluationPoint { t, y: &guess, u: &u, p, z: &[] },
                    &mut z,
                    &mut e,
                );
                choose_sides(
                    &system,
                    EvaluationPoint { t, y: &guess, u: &u, p, z: &[] },
                    &mut e,
                    &mut z,
                );
                self.z_before[k * n_z..(k + 1) * n_z].copy_from_slice(&z);
            }
            self.z[k * n_z..(k + 1) * n_z].copy_from_slice(&z);
            if let (Some(delayed), Some(before)) = (&mut delayed, &before) {
                let point = before.point(k, p);
                delayed.write(system, before, BeforeRecord::Unknown, point, &mut u);
            }
            let solved =
                solver.solve(EvaluationPoint { t, y: &[], u: &u, p, z: &z }, &measured, &mut guess);
            let is_given = solved.unwrap_or_else(|| vec![false; n]);
            let mut is_known = is_given.clone();
            if let Some(carrier) = &mut carrier {
                // Estimated parameters decide whether the run reached the threshold in time.
                let point = EvaluationPoint { t, y: carrier.simulated(), u: &u, p, z: &z };
                self.cuts[k] |= k > 0 && is_reset(system, point, &is_given, &guess);
                carrier.keep(&sensors.free, &is_given, &guess, &mut is_known);
            }
            for (i, is_known) in is_known.iter().enumerate() {
                if *is_known {
                    self.y[k * n + i] = guess[i];
                }
            }
            self.given[k * n..(k + 1) * n].copy_from_slice(&is_given);
        }
        Ok(())
    }

    fn write_slopes(&mut self, half_width: Option<f64>) {
        let half_width = half_width.or_else(|| usual_step(&self.times)).unwrap_or(1.0);
        for i in 0..self.n {
            let of_readings = |k: usize| {
                if self.is_given(k, i) { self.y[k * self.n + i] } else { f64::NAN }
            };
            let y: Vec<f64> = (0..self.times.len()).map(of_readings).collect();
            let rates = slopes(&self.times, &self.cuts, &y, half_width);
            for (k, slope) in rates.into_iter().enumerate() {
                self.ydot[k * self.n + i] = slope;
            }
        }
    }
}

/// The width of a usual step, with a margin for rounding errors.
fn usual_step(times: &[f64]) -> Option<f64> {
    let mut steps: Vec<f64> =
        times.windows(2).map(|pair| pair[1] - pair[0]).filter(|step| *step > 0.0).collect();
    steps.sort_by(f64::total_cmp);
    steps.get(steps.len() / 2).map(|median| SAMPLES_EACH_SIDE * median * (1.0 + 1e-9))
}

/// Solves for y at one sample after another.
struct SampleSolver<'a> {
    system: &'a dyn Model,
    sensors: &'a SensorEquations,
    sizes: Vec<f64>,
    w: Vec<f64>,
    jacobians: [Vec<f64>; 3],
    dwdt: Vec<f64>,
    f: Vec<f64>,
    dfdt: Vec<f64>,
    dfdy: Vec<f64>,
    mass: Vec<f64>,
    /// The last matrix and its factorisation: linear sensors always have the same.
    last: Option<(DMatrix<f64>, PseudoInverse)>,
}

/// A matrix's pseudo-inverse, and the columns that it determines.
#[derive(Clone)]
struct PseudoInverse {
    pseudo: DMatrix<f64>,
    determined: Vec<bool>,
}

impl<'a> SampleSolver<'a> {
    fn new(system: &'a dyn Model, sensors: &'a SensorEquations, sizes: Vec<f64>) -> Self {
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
            mass: vec![0.0; n],
            last: None,
        }
    }

    /// Moves the guess to the solution, and returns the unknowns that it determines; `None` if there is none, and the
    /// guess then stays.
    fn solve(
        &mut self,
        at: EvaluationPoint<'_>,
        measured: &dyn Fn(usize) -> f64,
        guess: &mut [f64],
    ) -> Option<Vec<bool>> {
        let mut y = guess.to_vec();
        for _ in 0..MOST_ITERATIONS {
            let (matrix, rest) = self.linearized(EvaluationPoint { y: &y, ..at }, measured)?;
            if !self.last.as_ref().is_some_and(|(last, _)| *last == matrix) {
                let inverse = PseudoInverse::from_matrix(&matrix)?;
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

    /// Weighted rows over unknowns in their sizes, and their residuals.
    fn linearized(
        &mut self,
        at: EvaluationPoint<'_>,
        measured: &dyn Fn(usize) -> f64,
    ) -> Option<(DMatrix<f64>, DVector<f64>)> {
        let signature = self.system.signature();
        let n = signature.unknowns.len();
        let SensorEquations { outputs, equations, .. } = self.sensors;
        self.system.mass(at, &mut self.mass);
        let algebraic = |i: &usize| self.mass[*i] == 0.0;
        let mut equations: Vec<usize> = equations.iter().copied().filter(algebraic).collect();
        // Unknown delayed values only invalidate the rows that read them.
        let reads_unknown = at.u.iter().any(|u| u.is_nan());
        if !equations.is_empty() {
            let still = vec![0.0; signature.n_u()];
            let (f, dfdt) = (&mut self.f, &mut self.dfdt);
            self.system.linearize(at, &still, f, &mut self.dfdy, dfdt);
            if reads_unknown {
                equations.retain(|i| !self.f[*i].is_nan());
            }
        }
        let mut used: Vec<(usize, f64)> =
            outputs.iter().copied().filter(|(i, _)| measured(*i).is_finite()).collect();
        if reads_unknown {
            self.system.outputs(at, &mut self.w);
            used.retain(|(i, _)| !self.w[*i].is_nan());
        }
        let mut matrix = DMatrix::zeros(used.len() + equations.len(), n);
        let mut rest = DVector::zeros(matrix.nrows());
        if !used.is_empty() {
            let [by_y, by_u, by_p] = &mut self.jacobians;
            self.system.output_jacobians(at, by_y, by_u, by_p, &mut self.dwdt);
            self.system.outputs(at, &mut self.w);
            for (row, (i, noise)) in used.iter().enumerate() {
                rest[row] = (measured(*i) - self.w[*i]) / noise;
            }
            let row_of = |i| used.iter().position(|(unknown, _)| *unknown == i);
            fill(&mut matrix, &signature.output_jacobians[0], by_y, &self.sizes, row_of);
            for (row, (_, noise)) in used.iter().enumerate() {
                matrix.row_mut(row).unscale_mut(*noise);
            }
        }
        if !equations.is_empty() {
            let row_of = |i| Some(used.len() + equations.iter().position(|e| *e == i)?);
            fill(&mut matrix, &signature.jacobian, &self.dfdy, &self.sizes, row_of);
            let best = (0..used.len()).map(|row| matrix.row(row).norm()).fold(1.0, f64::max);
            let weight = EQUATION_WEIGHT * best;
            for (k, i) in equations.iter().enumerate() {
                let row = used.len() + k;
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

/// Writes the selected rows of a matrix, with columns times sizes.
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

impl PseudoInverse {
    fn from_matrix(matrix: &DMatrix<f64>) -> Option<Self> {
        let n = matrix.ncols();
        let size: Vec<f64> = matrix.column_iter().map(|column| column.norm()).collect();
        let used: Vec<usize> = (0..n).filter(|j| size[*j] > 0.0).collect();
        let mut pseudo = DMatrix::zeros(n, matrix.nrows());
        let mut determined = vec![false; n];
        if used.is_empty() {
            return Some(Self { pseudo, determined });
        }
        let mut scaled = matrix.select_columns(&used);
        for (column, j) in used.iter().enumerate() {
            scaled.column_mut(column).unscale_mut(size[*j]);
        }
        let svd = scaled.svd(true, true);
        let cutoff = UNSEEN * svd.singular_values.max();
        let v_t = svd.v_t.as_ref()?;
        let kept: Vec<usize> =
            (0..svd.singular_values.len()).filter(|k| svd.singular_values[*k] > cutoff).collect();
        for (column, j) in used.iter().enumerate() {
            let share: f64 = kept.iter().map(|k| v_t[(*k, column)].powi(2)).sum();
            determined[*j] = 1.0 - share <= TAKES_PART;
        }
        let of_seen = svd.pseudo_inverse(cutoff).ok()?;
        for (row, j) in used.iter().enumerate() {
            pseudo.row_mut(*j).copy_from(&(of_seen.row(row) / size[*j]));
        }
        Some(Self { pseudo, determined })
    }
}
