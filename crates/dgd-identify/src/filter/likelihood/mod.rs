//! The likelihood of innovations and its derivatives.

pub(super) mod levels;
pub(super) mod prediction_error;
pub(super) mod profile;
pub(super) mod secant;
pub(super) mod side_by_side;

use dgd_runtime::model::Model;
use dgd_runtime::parallel::in_parallel_by_model;
use dgd_runtime::{LimitSide, Options};
use nalgebra::{DMatrix, DVector};

use super::error::FilterError;
use super::estimator::RowInnovations;
use super::problem::{FilterProblem, FilterSample, FilterTuning, RandomWalk, usual_tuning};
use crate::error::{EstimateError, TrialFailed, TrialFailure, WrongLength};
use crate::minimise::trust_region::NormalEquations;
use crate::noise;
use crate::output_error::prior::Prior;
use crate::recording::Recording;
use crate::variables::{FitVariable, FitVariables};
use levels::FreeNoiseLevel;
use prediction_error::{NoiseLevelSource, PredictionErrorProblem};
use side_by_side::{FilterParameters, RecordingCursor, filter_side_by_side};

/// Step sizes of differences: in scaled parameters and start values, and in variables of levels.
const STEP: f64 = 1e-3;
const LEVEL_STEP: f64 = 1e-2;
/// Upper bound of a rate, as a multiple of the default.
const MOST_RATE: f64 = 1e4;
/// This fraction of the default rate is practically zero.
const SMALL_RATE: f64 = 1e-4;
/// Upper bound of a noise, as a multiple of the difference between neighbouring samples.
const MOST_NOISE: f64 = 1e3;

/// Default rates, from the start of the first recording.
fn usual(problem: &PredictionErrorProblem<'_>) -> Result<FilterTuning, EstimateError> {
    let Some(recording) = problem.recordings.first() else {
        return Err(EstimateError::NothingMeasured);
    };
    let Some(&t) = recording.times.first() else {
        return Err(EstimateError::NothingMeasured);
    };
    let mut u = vec![0.0; recording.inputs.len()];
    recording.inputs.value(t, LimitSide::Right, u.as_mut());
    let filter = FilterProblem {
        start: recording.start.clone(),
        options: problem.options,
        ..FilterProblem::new(problem.system, problem.p)
    };
    let sample = FilterSample { t, u: u.as_ref(), measured: &[] };
    usual_tuning(&filter, sample).map_err(not_filtered)
}

/// The reason why a trial failed.
pub(in crate::filter) enum LikelihoodFailure {
    Trial(TrialFailed),
    /// Before any trial: the model cannot be filtered.
    Model(FilterError),
}

/// The variables of the search: parameters and start values, rates, noise.
///
/// It does not contain the system, so that threads can share it.
pub(in crate::filter) struct LikelihoodSearch<'p> {
    pub(in crate::filter) p: &'p [f64],
    pub(in crate::filter) recordings: &'p [Recording],
    /// Given levels.
    pub(in crate::filter) known_rates: &'p [NoiseLevelSource],
    pub(in crate::filter) known_noise: &'p [Option<NoiseLevelSource>],
    pub(in crate::filter) priors: &'p [Prior],
    pub(in crate::filter) options: Options,
    pub(in crate::filter) variables: FitVariables,
    pub(in crate::filter) first: Vec<f64>,
    /// For each state and each used output, its level if it is estimated.
    pub(in crate::filter) rates: Vec<Option<FreeNoiseLevel>>,
    pub(in crate::filter) noise: Vec<Option<FreeNoiseLevel>>,
    /// Reference σ for ln det S, so that it is not negative.
    pub(in crate::filter) least: Vec<f64>,
}

impl<'p> LikelihoodSearch<'p> {
    pub(in crate::filter) fn new(
        problem: &'p PredictionErrorProblem<'_>,
    ) -> Result<Self, EstimateError> {
        let PredictionErrorProblem { system, p, free, recordings, .. } = problem;
        let (variables, first) = FitVariables::new(*system, p, recordings, free)?;
        let usual = usual(problem)?;
        WrongLength::verify("rates of states", problem.rates.len(), usual.states.len())?;
        let mut rates = Vec::with_capacity(problem.rates.len());
        for (level, walk) in problem.rates.iter().zip(&usual.states) {
            rates.push(match level {
                NoiseLevelSource::Known(_) | NoiseLevelSource::Parameter(_) => None,
                NoiseLevelSource::Estimated => {
                    Some(FreeNoiseLevel::rate(walk.rate, MOST_RATE * walk.rate))
                }
            });
        }
        let (mut noise, mut least) = (Vec::new(), Vec::new());
        for (i, level) in problem.noise.iter().enumerate() {
            let output = &system.signature().outputs[i];
            let lowest =
                noise::least(recordings, i, problem.options.rtol.max(1e-6), output.unit.factor);
            least.push(match level {
                Some(NoiseLevelSource::Known(sigma)) => *sigma,
                Some(NoiseLevelSource::Estimated | NoiseLevelSource::Parameter(_)) | None => lowest,
            });
            noise.push(match level {
                Some(NoiseLevelSource::Estimated) => {
                    let scatter = noise::scatter(recordings, i).unwrap_or(lowest).max(lowest);
                    Some(FreeNoiseLevel::noise(scatter, lowest, MOST_NOISE * scatter))
                }
                Some(NoiseLevelSource::Known(sigma)) if !(*sigma > 0.0 && sigma.is_finite()) => {
                    let output = output.name.to_string();
                    return Err(EstimateError::Noise { output, sigma: *sigma });
                }
                Some(NoiseLevelSource::Known(_) | NoiseLevelSource::Parameter(_)) | None => None,
            });
        }
        let mut search = Self {
            p,
            recordings,
            known_rates: &problem.rates,
            known_noise: &problem.noise,
            priors: &problem.priors,
            options: problem.options,
            variables,
            first,
            rates,
            noise,
            least,
        };
        search.tell_from_none(*system, problem.threads);
        let first: Vec<f64> = search.levels().map(FreeNoiseLevel::first).collect();
        search.first.extend(first);
        Ok(search)
    }

    /// Estimated levels: rates, then noise.
    fn levels(&self) -> impl Iterator<Item = &FreeNoiseLevel> {
        self.rates.iter().chain(&self.noise).flatten()
    }

    /// Limit on a step in each variable.
    pub(in crate::filter) fn reach(&self) -> Vec<f64> {
        let of_levels = self.levels().map(FreeNoiseLevel::reach);
        self.variables.all.iter().map(FitVariable::reach).chain(of_levels).collect()
    }

    pub(in crate::filter) fn bounds(&self) -> Vec<(f64, f64)> {
        let of_levels = self.levels().map(FreeNoiseLevel::bounds);
        self.variables.all.iter().map(FitVariable::bounds).chain(of_levels).collect()
    }

    /// Sets the unit of each rate to the one that differs from zero by one standard deviation at the start of the
    /// search:
    ///
    /// ```text
    ///   unit⁴ = 1/I,   I = Σ ½ tr(S⁻¹ S′ S⁻¹ S′),   S′ = ∂S/∂(rate²) without process noise
    /// ```
    fn tell_from_none(&mut self, system: &dyn Model, threads: usize) {
        let n_rates = self.rates.iter().flatten().count();
        if n_rates == 0 {
            return;
        }
        for sought in self.rates.iter_mut().flatten() {
            sought.unit *= SMALL_RATE;
        }
        let mut none = self.first.clone();
        none.resize(none.len() + n_rates, 0.0);
        none.extend(self.noise.iter().flatten().map(FreeNoiseLevel::first));
        let mut points = vec![none.clone()];
        let small = self.rates.iter().flatten().map(|sought| sought.variable(sought.unit));
        for (i, small) in small.enumerate() {
            let mut point = none.clone();
            point[self.variables.len() + i] = small;
            points.push(point);
        }
        let of_recordings = self.of_recordings(system, threads, |system, r, threads| {
            let mut sums = vec![0.0; n_rates];
            self.filter(system, r, &points, threads, |row| {
                for (sum, with) in sums.iter_mut().zip(&row[1..]) {
                    let difference = with.covariance() - row[0].covariance();
                    *sum += 0.5 * row[0].whiten_both(&difference).norm_squared();
                }
            })
            .map(|()| sums)
        });
        // If the model needs corrections, a small rate has to suffice.
        let Ok(of_recordings) = of_recordings.into_iter().collect::<Result<Vec<_>, _>>() else {
            return;
        };
        for (i, sought) in self.rates.iter_mut().flatten().enumerate() {
            let information: f64 = of_recordings.iter().map(|sums| sums[i]).sum();
            let usual = sought.unit / SMALL_RATE;
            let unit = sought.unit / information.sqrt().sqrt();
            // A state that affects no output has no observable process noise.
            sought.unit = if unit.is_finite() { unit.min(MOST_RATE * usual) } else { usual };
        }
    }

    /// Rates and noise at z.
    pub(in crate::filter) fn tuning(&self, z: &[f64]) -> FilterTuning {
        let p = self.variables.parameters(self.p, z);
        let mut levels = z[self.variables.len()..].iter();
        let mut level =
            |sought: &Option<FreeNoiseLevel>, known: NoiseLevelSource| match (sought, known) {
                (Some(sought), _) => sought.level(levels.next().copied().unwrap_or(0.0)),
                (None, NoiseLevelSource::Known(value)) => value,
                (None, NoiseLevelSource::Parameter(i)) => p[i],
                (None, NoiseLevelSource::Estimated) => 0.0,
            };
        let rates = self.rates.iter().zip(self.known_rates);
        let states =
            rates.map(|(sought, known)| RandomWalk { start: 0.0, rate: level(sought, *known) });
        let states = states.collect();
        let noise = self.noise.iter().zip(self.known_noise);
        let noise = noise.map(|(sought, known)| known.map(|known| level(sought, known))).collect();
        FilterTuning { states, parameters: Vec::new(), noise }
    }

    /// −2 ln L less a constant; with its derivatives if it is below `least`, otherwise with zeros because no step
    /// starts there.
    pub(in crate::filter) fn better(
        &self,
        system: &dyn Model,
        threads: usize,
        z: &[f64],
        least: f64,
    ) -> Result<NormalEquations, LikelihoodFailure> {
        let bounds = self.bounds();
        if least.is_finite() {
            let value = self.sum(system, threads, z, |_| DifferencePoints::none(z))?;
            if value.cost >= least || value.cost.is_nan() {
                return Ok(value);
            }
        }
        self.sum(system, threads, z, |r| self.differences(r, z, &bounds))
    }

    /// The sum over all recordings, with the derivatives from the `differences` of each.
    fn sum(
        &self,
        system: &dyn Model,
        threads: usize,
        z: &[f64],
        differences: impl Fn(usize) -> DifferencePoints + Sync,
    ) -> Result<NormalEquations, LikelihoodFailure> {
        let contributions = self.of_recordings(system, threads, |system, r, threads| {
            let DifferencePoints { points, weights } = differences(r);
            let mut sum = NormalEquations::zeros(z.len());
            self.filter(system, r, &points, threads, |row| self.add(&mut sum, row, &weights))?;
            Ok(sum)
        });
        let mut sum = NormalEquations::zeros(z.len());
        for of_recording in contributions {
            let of_recording = of_recording?;
            sum.cost += of_recording.cost;
            sum.gradient += of_recording.gradient;
            sum.information += of_recording.information;
        }
        for i in 0..z.len() {
            for j in 0..i {
                sum.information[(j, i)] = sum.information[(i, j)];
            }
        }
        self.add_priors(&mut sum, z);
        Ok(sum)
    }

    /// Results for all recordings. If these are fewer than the threads, they are processed one by one, and the filters
    /// of each share the threads.
    fn of_recordings<T: Send>(
        &self,
        system: &dyn Model,
        threads: usize,
        work: impl Fn(&dyn Model, usize, usize) -> T + Sync,
    ) -> Vec<T> {
        let count = self.recordings.len();
        let (outside, inside) = if count < threads { (1, threads) } else { (threads, 1) };
        in_parallel_by_model(system, count, outside, |system, r| work(system, r, inside))
    }

    /// Passes the innovations of filters with the numbers of `points` to `take`, row by row of a recording.
    fn filter(
        &self,
        system: &dyn Model,
        r: usize,
        points: &[Vec<f64>],
        threads: usize,
        take: impl FnMut(&[&RowInnovations]),
    ) -> Result<(), LikelihoodFailure> {
        let recording = &self.recordings[r];
        let numbers = |z: &Vec<f64>| FilterParameters {
            p: self.variables.parameters(self.p, z),
            start: self.variables.starts(r, &recording.start, z),
            tuning: self.tuning(z),
        };
        let filters: Vec<FilterParameters> = points.iter().map(numbers).collect();
        let along = RecordingCursor { recording, position: r, options: self.options };
        filter_side_by_side(system, along, &filters, threads, take)
    }

    /// Adds the priors of free parameters.
    fn add_priors(&self, sum: &mut NormalEquations, z: &[f64]) {
        let p = self.variables.parameters(self.p, z);
        for term in self.priors.iter().filter_map(|prior| prior.term(&self.variables, &p, z)) {
            sum.cost += term.cost + term.logarithm;
            term.add_gradient(&mut sum.gradient);
            term.add_curvature(&mut sum.information);
        }
    }

    /// Differences with respect to the variables that affect a recording.
    fn differences(&self, r: usize, z: &[f64], bounds: &[(f64, f64)]) -> DifferencePoints {
        // Start values of other recordings do not affect this one.
        let is_relevant = |j: usize| match self.variables.all.get(j) {
            Some(variable) => variable.recording.is_none_or(|of| of == r),
            None => true,
        };
        let mut differences = DifferencePoints::none(z);
        for j in (0..z.len()).filter(|j| is_relevant(*j)) {
            let h = if j < self.variables.len() { STEP * z[j].abs().max(1.0) } else { LEVEL_STEP };
            let (low, high) = bounds[j];
            differences.push(j, h, low, high);
        }
        differences
    }

    /// Adds a row.
    fn add(
        &self,
        sum: &mut NormalEquations,
        row: &[&RowInnovations],
        weights: &[(usize, Vec<(usize, f64)>)],
    ) {
        let RowInnovations { outputs, epsilon, root } = row[0];
        let m = outputs.len();
        if m == 0 {
            return;
        }
        let mut white = DVector::from_column_slice(epsilon);
        row[0].whiten(&mut white);
        for (i, output) in outputs.iter().enumerate() {
            sum.cost += 2.0 * (root[(i, i)] / self.least[*output]).ln();
        }
        sum.cost += white.norm_squared();
        // ε′ and S′, whitened from both sides.
        let mut slopes: Vec<(usize, DVector<f64>, DMatrix<f64>)> =
            Vec::with_capacity(weights.len());
        for (j, weights) in weights {
            let (mut de, mut ds) = (DVector::zeros(m), DMatrix::zeros(m, m));
            for &(point, weight) in weights {
                for (de, epsilon) in de.iter_mut().zip(&row[point].epsilon) {
                    *de += weight * epsilon;
                }
                let root = &row[point].root;
                ds.gemm(weight, root, &root.transpose(), 1.0);
            }
            row[0].whiten(&mut de);
            slopes.push((*j, de, row[0].whiten_both(&ds)));
        }
        for (a, (i, de, ds)) in slopes.iter().enumerate() {
            let quadratic = white.dot(&(ds * &white));
            sum.gradient[*i] += 0.5 * ds.trace() + de.dot(&white) - 0.5 * quadratic;
            for (j, de_j, ds_j) in &slopes[..=a] {
                sum.information[(*i, *j)] += de.dot(de_j) + 0.5 * ds.dot(ds_j);
            }
        }
    }
}

/// Points around z, and the derivatives as weighted sums over these points.
struct DifferencePoints {
    /// z, then others.
    points: Vec<Vec<f64>>,
    /// Variables, each with the points and weights of its derivative.
    weights: Vec<(usize, Vec<(usize, f64)>)>,
}

impl DifferencePoints {
    /// No derivatives.
    fn none(z: &[f64]) -> Self {
        Self { points: vec![z.to_vec()], weights: Vec::new() }
    }

    /// Differences of second order with step h: central ones, or one-sided ones next to a bound.
    ///
    /// ```text
    ///   f′ = (f(z + h) − f(z − h))/2h      f′ = (−3 f(z) + 4 f(z + h) − f(z + 2h))/2h
    /// ```
    fn push(&mut self, j: usize, h: f64, low: f64, high: f64) {
        let (z, first) = (self.points[0][j], self.points.len());
        let fits = |z: f64| low <= z && z <= high;
        let side = if fits(z + 2.0 * h) { h } else { -h };
        let (values, weights) = if fits(z - h) && fits(z + h) {
            ([z - h, z + h], vec![(first, -0.5 / h), (first + 1, 0.5 / h)])
        } else if fits(z + 2.0 * side) {
            let weights = vec![(0, -1.5 / side), (first, 2.0 / side), (first + 1, -0.5 / side)];
            ([z + side, z + 2.0 * side], weights)
        } else {
            // Bounds leave hardly any room.
            let (below, above) = ((z - h).max(low), (z + h).min(high));
            let width = above - below;
            ([below, above], vec![(first, -1.0 / width), (first + 1, 1.0 / width)])
        };
        for value in values {
            let mut point = self.points[0].clone();
            point[j] = value;
            self.points.push(point);
        }
        self.weights.push((j, weights));
    }
}

impl RowInnovations {
    /// S.
    fn covariance(&self) -> DMatrix<f64> {
        &self.root * self.root.transpose()
    }

    /// S^{-½} v.
    fn whiten(&self, v: &mut DVector<f64>) {
        if !self.root.solve_lower_triangular_mut(v) {
            v.fill(f64::NAN);
        }
    }

    /// S^{-½} M S^{-½ᵀ} of a symmetric M.
    fn whiten_both(&self, m: &DMatrix<f64>) -> DMatrix<f64> {
        let mut half = m.clone();
        let mut solved = self.root.solve_lower_triangular_mut(&mut half);
        half.transpose_mut();
        solved = solved && self.root.solve_lower_triangular_mut(&mut half);
        if !solved {
            half.fill(f64::NAN);
        }
        half
    }
}

/// Positions of the rows of a recording, only the second of two with the same time, each with its samples; NaN for
/// samples that do not count.
pub(in crate::filter) fn counting_rows(
    recording: &Recording,
) -> impl Iterator<Item = (usize, Vec<f64>)> + '_ {
    let times = &recording.times;
    let last = move |k: &usize| times.get(k + 1) != Some(&times[*k]);
    (0..times.len()).filter(last).map(move |k| {
        let counts = times[k] >= recording.counts_from;
        let sample = |samples: &Option<Vec<f64>>| {
            samples.as_ref().filter(|_| counts).map_or(f64::NAN, |samples| samples[k])
        };
        (k, recording.measured.iter().map(sample).collect())
    })
}

impl LikelihoodFailure {
    /// The error if the starting point of the search fails.
    pub(in crate::filter) fn at_start(self) -> EstimateError {
        match self {
            LikelihoodFailure::Trial(failed) => EstimateError::Start(failed),
            LikelihoodFailure::Model(FilterError::Free(error)) => error,
            LikelihoodFailure::Model(error) => EstimateError::NotFiltered(Box::new(error)),
        }
    }

    pub(in crate::filter) fn from_error(error: FilterError, recording: usize) -> Self {
        match error {
            FilterError::Start(error) => {
                let reason = TrialFailure::Simulation(error);
                LikelihoodFailure::Trial(TrialFailed { recording, reason })
            }
            FilterError::Stuck { failure: reason, .. } => {
                LikelihoodFailure::Trial(TrialFailed { recording, reason })
            }
            error => LikelihoodFailure::Model(error),
        }
    }
}

/// A model that cannot be filtered, as an error of estimation.
fn not_filtered(error: FilterError) -> EstimateError {
    LikelihoodFailure::from_error(error, 0).at_start()
}
