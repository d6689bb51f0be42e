//! The likelihood of innovations and its derivatives.

use nalgebra::{DMatrix, DVector};

use super::error::FilterError;
use super::estimator::{Filter, Innovated, Row};
use super::prediction_error::{Level, PredictionErrorProblem};
use super::problem::{Estimator, FilterProblem, Sample, Tuning, Walk, usual_tuning};
use crate::identify::error::{EstimateError, TrialFailed, TrialFailure};
use crate::identify::levenberg_marquardt::NormalEquations;
use crate::identify::noise;
use crate::identify::output_error::{Prior, Starts};
use crate::identify::parallel::in_parallel;
use crate::identify::recording::Recording;
use crate::identify::variables::{Variable, Variables};
use crate::problem::Options;
use crate::signal::Side;
use crate::system::{Storage, System};

/// Steps of the differences: in scaled parameters and start values, and in logarithms of levels.
const STEP: f64 = 1e-3;
const LEVEL_STEP: f64 = 1e-2;
/// A rate is searched for down to this part of the usual one, and up to as many times it.
const LEAST_RATE: f64 = 1e-4;
const MOST_RATE: f64 = 1e4;
/// A noise is searched for up to so many times what is left of neighbouring samples.
const MOST_NOISE: f64 = 1e3;
/// Usual rates, from the start of the first recording.
fn usual<S: System>(problem: &PredictionErrorProblem<'_, S>) -> Result<Tuning, EstimateError> {
    let Some(recording) = problem.recordings.first() else {
        return Err(EstimateError::NothingMeasured);
    };
    let Some(&t) = recording.times.first() else {
        return Err(EstimateError::NothingMeasured);
    };
    let mut u = S::Inputs::zeros(recording.inputs.len());
    recording.inputs.value(t, Side::Right, u.as_mut());
    let filter = FilterProblem {
        start: recording.start.clone(),
        options: problem.options,
        ..FilterProblem::new(problem.system, problem.p)
    };
    let sample = Sample { t, u: u.as_ref(), measured: &[] };
    usual_tuning(&filter, sample).map_err(not_filtered)
}

/// A level as a variable: ln(level / unit).
pub(super) struct Sought {
    unit: f64,
    bounds: (f64, f64),
}

/// Why a trial failed.
pub(super) enum Failed {
    Trial(TrialFailed),
    /// Before any trial: the model cannot be filtered.
    Model(FilterError),
}

/// The variables of the search: parameters and start values, rates, noise.
///
/// It knows no system, so that threads can share it.
pub(super) struct Search<'p> {
    pub(super) p: &'p [f64],
    pub(super) recordings: &'p [Recording],
    /// Levels that are given.
    pub(super) known_rates: &'p [Level],
    pub(super) known_noise: &'p [Option<Level>],
    pub(super) priors: &'p [Prior],
    pub(super) n_directions: usize,
    pub(super) options: Options,
    pub(super) variables: Variables,
    pub(super) first: Vec<f64>,
    /// For each state and each output in use, the level where it is sought.
    pub(super) rates: Vec<Option<Sought>>,
    pub(super) noise: Vec<Option<Sought>>,
    /// σ that ln det S is relative to, so that it does not fall below zero.
    pub(super) least: Vec<f64>,
}

impl<'p> Search<'p> {
    pub(super) fn new<S: System>(
        problem: &'p PredictionErrorProblem<'_, S>,
    ) -> Result<Self, EstimateError> {
        let PredictionErrorProblem { system, p, free, recordings, .. } = problem;
        let (variables, mut first) = Variables::new(*system, p, recordings, free)?;
        let usual = usual(problem)?;
        assert_eq!(problem.rates.len(), usual.states.len(), "number of states");
        let mut rates = Vec::with_capacity(problem.rates.len());
        for (level, walk) in problem.rates.iter().zip(&usual.states) {
            rates.push(match level {
                Level::Known(_) => None,
                Level::Estimated => {
                    first.push(0.0);
                    Some(Sought { unit: walk.rate, bounds: (LEAST_RATE.ln(), MOST_RATE.ln()) })
                }
            });
        }
        let (mut noise, mut least) = (Vec::new(), Vec::new());
        for (i, level) in problem.noise.iter().enumerate() {
            let output = &system.signature().outputs[i];
            let lowest =
                noise::least(recordings, i, problem.options.rtol.max(1e-6), output.unit.factor);
            least.push(match level {
                Some(Level::Known(sigma)) => *sigma,
                Some(Level::Estimated) | None => lowest,
            });
            noise.push(match level {
                Some(Level::Estimated) => {
                    let unit = noise::scatter(recordings, i).unwrap_or(lowest).max(lowest);
                    first.push(0.0);
                    Some(Sought { unit, bounds: ((lowest / unit).ln(), MOST_NOISE.ln()) })
                }
                Some(Level::Known(sigma)) if !(*sigma > 0.0 && sigma.is_finite()) => {
                    let output = output.name.to_string();
                    return Err(EstimateError::Noise { output, sigma: *sigma });
                }
                Some(Level::Known(_)) | None => None,
            });
        }
        Ok(Self {
            p,
            recordings,
            known_rates: &problem.rates,
            known_noise: &problem.noise,
            priors: &problem.priors,
            n_directions: free.len(),
            options: problem.options,
            variables,
            first,
            rates,
            noise,
            least,
        })
    }

    pub(super) fn bounds(&self) -> Vec<(f64, f64)> {
        let of_levels = self.rates.iter().chain(&self.noise).flatten().map(|sought| sought.bounds);
        self.variables.all.iter().map(Variable::bounds).chain(of_levels).collect()
    }

    /// Rates and noise at z.
    pub(super) fn tuning(&self, z: &[f64]) -> Tuning {
        let mut levels = z[self.variables.len()..].iter();
        let mut level = |sought: &Option<Sought>, known: Level| match (sought, known) {
            (Some(sought), _) => sought.unit * levels.next().copied().unwrap_or(0.0).exp(),
            (None, Level::Known(value)) => value,
            (None, Level::Estimated) => 0.0,
        };
        let rates = self.rates.iter().zip(self.known_rates);
        let states = rates.map(|(sought, known)| Walk { start: 0.0, rate: level(sought, *known) });
        let states = states.collect();
        let noise = self.noise.iter().zip(self.known_noise);
        let noise = noise.map(|(sought, known)| known.map(|known| level(sought, known))).collect();
        Tuning { states, parameters: Vec::new(), noise }
    }

    /// −2 ln L less a constant, and its derivatives.
    pub(super) fn evaluate<S: System + Clone + Send>(
        &self,
        system: &S,
        threads: usize,
        z: &[f64],
    ) -> Result<NormalEquations, Failed> {
        let bounds = self.bounds();
        let of = in_parallel(system, self.recordings.len(), threads, |system, r| {
            self.of_recording(system, r, z, &bounds)
        });
        let mut sum = NormalEquations::zeros(z.len());
        for of_recording in of {
            let of_recording = of_recording?;
            sum.cost += of_recording.cost;
            sum.gradient += of_recording.gradient;
            sum.information += of_recording.information;
        }
        self.add_priors(&mut sum, z);
        Ok(sum)
    }

    /// ((p − mean) / std)² of parameters that are free.
    fn add_priors(&self, sum: &mut NormalEquations, z: &[f64]) {
        for Prior { parameter, mean, std } in self.priors {
            let Some(i) = self.variables.parameter(*parameter) else { continue };
            let variable = &self.variables.all[i];
            let (e, slope) = ((variable.value(z[i]) - mean) / std, variable.slope(z[i]) / std);
            sum.cost += e * e;
            sum.gradient[i] += e * slope;
            sum.information[(i, i)] += slope * slope;
        }
    }

    /// z, and two points for each variable that concerns the recording; the variables, each with the distance
    /// of its points.
    fn points(
        &self,
        r: usize,
        z: &[f64],
        bounds: &[(f64, f64)],
    ) -> (Vec<Vec<f64>>, Vec<(usize, f64)>) {
        // Start values of other recordings are no business of this one.
        let own = |j: usize| match self.variables.all.get(j) {
            Some(variable) => variable.recording.is_none_or(|of| of == r),
            None => true,
        };
        let mut points = vec![z.to_vec()];
        let mut differences = Vec::new();
        for j in (0..z.len()).filter(|j| own(*j)) {
            let step =
                if j < self.variables.len() { STEP * z[j].abs().max(1.0) } else { LEVEL_STEP };
            let (low, high) = bounds[j];
            let (below, above) = ((z[j] - step).max(low), (z[j] + step).min(high));
            for value in [below, above] {
                let mut point = z.to_vec();
                point[j] = value;
                points.push(point);
            }
            differences.push((j, above - below));
        }
        (points, differences)
    }

    /// What one recording adds.
    fn of_recording<S: System>(
        &self,
        system: &S,
        r: usize,
        z: &[f64],
        bounds: &[(f64, f64)],
    ) -> Result<NormalEquations, Failed> {
        let recording = &self.recordings[r];
        let (points, differences) = self.points(r, z, bounds);
        let starts: Vec<Starts> =
            points.iter().map(|z| self.variables.starts(r, &recording.start, z)).collect();
        let ps: Vec<Vec<f64>> =
            points.iter().map(|z| self.variables.parameters(self.p, z)).collect();
        let mut filters: Vec<Filter<'_, S>> = Vec::with_capacity(points.len());
        let mut sum = NormalEquations::zeros(z.len());
        for (k, measured) in counting_rows(recording) {
            let t = recording.times[k];
            let failed = |error| Failed::of(error, r);
            if filters.is_empty() {
                for ((z, p), start) in points.iter().zip(&ps).zip(&starts) {
                    let problem = FilterProblem {
                        system,
                        p,
                        free: vec![false; self.n_directions],
                        start: start.clone(),
                        estimator: Estimator::ExtendedKalman,
                        gate: None,
                        options: self.options,
                    };
                    let (inputs, row) = (&recording.inputs, (t, measured.as_slice()));
                    let begun = Filter::begin_recorded(&problem, &self.tuning(z), inputs, row);
                    let (filter, row) = begun.map_err(failed)?;
                    verify(&row, r)?;
                    filters.push(filter);
                }
            } else {
                for filter in &mut filters {
                    let row = filter.advance(&recording.inputs, t, &measured).map_err(failed)?;
                    verify(&row, r)?;
                }
            }
            self.add(&mut sum, &filters, &differences);
        }
        let n = z.len();
        for i in 0..n {
            for j in 0..i {
                sum.information[(j, i)] = sum.information[(i, j)];
            }
        }
        Ok(sum)
    }

    /// Adds a row.
    fn add<S: System>(
        &self,
        sum: &mut NormalEquations,
        filters: &[Filter<'_, S>],
        differences: &[(usize, f64)],
    ) {
        let Innovated { outputs, epsilon, root } = filters[0].innovated();
        let m = outputs.len();
        if m == 0 {
            return;
        }
        let whiten = |matrix: &DMatrix<f64>| {
            root.solve_lower_triangular(matrix).unwrap_or_else(|| matrix * f64::NAN)
        };
        let epsilon_white =
            whiten(&DMatrix::from_column_slice(m, 1, epsilon)).column(0).clone_owned();
        for (i, output) in outputs.iter().enumerate() {
            sum.cost += 2.0 * (root[(i, i)] / self.least[*output]).ln();
        }
        sum.cost += epsilon_white.norm_squared();
        // ε′ and S′, whitened from both sides.
        let mut slopes: Vec<(usize, DVector<f64>, DMatrix<f64>)> = Vec::new();
        for (k, (j, width)) in differences.iter().enumerate() {
            let below = filters[1 + 2 * k].innovated();
            let above = filters[2 + 2 * k].innovated();
            let de = (0..m).map(|i| (above.epsilon[i] - below.epsilon[i]) / width);
            let de = DMatrix::from_iterator(m, 1, de);
            let square = |of: &Innovated| &of.root * of.root.transpose();
            let ds = (square(above) - square(below)) / *width;
            let half = whiten(&ds).transpose();
            slopes.push((*j, whiten(&de).column(0).clone_owned(), whiten(&half)));
        }
        for (a, (i, de, ds)) in slopes.iter().enumerate() {
            let quadratic = epsilon_white.dot(&(ds * &epsilon_white));
            sum.gradient[*i] += 0.5 * ds.trace() + de.dot(&epsilon_white) - 0.5 * quadratic;
            for (j, de_j, ds_j) in &slopes[..=a] {
                sum.information[(*i, *j)] += de.dot(de_j) + 0.5 * ds.dot(ds_j);
            }
        }
    }
}

/// Positions of the rows of a recording, the second of two with one time, each with its samples; NaN for one
/// that does not count.
pub(super) fn counting_rows(recording: &Recording) -> impl Iterator<Item = (usize, Vec<f64>)> + '_ {
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

impl Failed {
    /// Where the search begins it ends it.
    pub(super) fn at_start(self) -> EstimateError {
        match self {
            Failed::Trial(failed) => EstimateError::Start(failed),
            Failed::Model(FilterError::Free(error)) => error,
            Failed::Model(error) => EstimateError::NotFiltered(Box::new(error)),
        }
    }

    pub(super) fn of(error: FilterError, recording: usize) -> Self {
        match error {
            FilterError::Start(error) => {
                let reason = TrialFailure::Simulation(error);
                Failed::Trial(TrialFailed { recording, reason })
            }
            FilterError::Stuck { failure: reason, .. } => {
                Failed::Trial(TrialFailed { recording, reason })
            }
            error => Failed::Model(error),
        }
    }
}

/// A row in which the model could not be evaluated spoils the likelihood.
fn verify(row: &Row, recording: usize) -> Result<(), Failed> {
    match &row.failure {
        None => Ok(()),
        Some(reason) => Err(Failed::Trial(TrialFailed { recording, reason: reason.clone() })),
    }
}

/// A model that cannot be filtered, as an error of estimation.
fn not_filtered(error: FilterError) -> EstimateError {
    Failed::of(error, 0).at_start()
}
