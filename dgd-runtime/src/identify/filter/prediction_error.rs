//! Parameters, start values and levels of noise by the likelihood of the innovations.
//!
//! ```text
//!   minimise  −2 ln L = Σ ln det S + εᵀ S⁻¹ ε      over θ, x(0) of each recording, rates of dβ, σ
//! ```
//!
//! ε and S are those of an extended Kalman filter with known start values. Without process noise nothing is
//! corrected, S is σ², and this is the fit by simulation error.
//!
//! The minimum is found by Fisher's scoring within bounds ([`minimise`]): with primes for derivatives,
//!
//! ```text
//!   gradient:     Σ ½ tr(S⁻¹S′) + ε′ᵀ S⁻¹ ε − ½ εᵀ S⁻¹ S′ S⁻¹ ε
//!   information:  Σ ε′ᵀ S⁻¹ ε′ + ½ tr(S⁻¹ S′ S⁻¹ S′)
//! ```
//!
//! ε′ and S′ are central differences; the filters that they need run side by side, so that no innovation is
//! kept. The inverse of the information is the covariance of the estimates.
//!
//! Ljung, System Identification, 2nd ed. (1999), ch. 7; Kristensen, Madsen, Jørgensen, Parameter estimation in
//! stochastic grey-box models, Automatica 40 (2004) 225; the information is that of Goodrich and Caines, IEEE
//! TAC 24 (1979) 403.

use nalgebra::{DMatrix, DVector};

use super::estimator::{Filter, Innovated, Row};
use super::problem::{Estimator, FilterProblem, Sample, Tuning, Walk, usual_tuning};
use crate::identify::error::{EstimateError, TrialFailed, TrialFailure};
use crate::identify::filter::FilterError;
use crate::identify::levenberg_marquardt::{NormalEquations, StoppingRule, Termination, minimise};
use crate::identify::noise;
use crate::identify::output_error::{Prior, Starts};
use crate::identify::parallel::in_parallel;
use crate::identify::recording::Recording;
use crate::identify::uncertainty::{Estimate, Uncertainty, Undetermined};
use crate::identify::variables::{Bound, Variable, Variables};
use crate::problem::Options;
use crate::signal::Side;
use crate::system::{Signature, Storage, System};

/// Steps of the differences: in scaled parameters and start values, and in logarithms of levels.
const STEP: f64 = 1e-3;
const LEVEL_STEP: f64 = 1e-2;
/// A rate is searched for down to this part of the usual one, and up to as many times it.
const LEAST_RATE: f64 = 1e-4;
const MOST_RATE: f64 = 1e4;
/// A noise is searched for up to so many times what is left of neighbouring samples.
const MOST_NOISE: f64 = 1e3;
/// Eigenvalues of the information below this part of the largest are not told from zero: differences are
/// known to some thousandth, and enter in squares.
const UNSEEN: f64 = 1e-9;

/// Where a level of noise comes from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Level {
    /// This, SI.
    Known(f64),
    /// It is estimated.
    Estimated,
}

/// What to estimate from what.
#[derive(Debug, Clone)]
pub struct PredictionErrorProblem<'a, S> {
    /// The model. Its directions are what can be free, and have the start values of all differential
    /// unknowns among them.
    pub system: &'a S,
    /// All parameters, SI: values of those that are not free, first guesses of the others.
    pub p: &'a [f64],
    /// Which of the directions are free.
    pub free: Vec<bool>,
    /// What was recorded. Of two rows with one time the second counts.
    pub recordings: &'a [Recording],
    /// For each differential unknown, how far it strays by itself in a second, SI/√s.
    pub rates: Vec<Level>,
    /// For each output, the standard deviation of its noise, SI; `None` for one that is not used.
    pub noise: Vec<Option<Level>>,
    /// What is known beforehand.
    pub priors: Vec<Prior>,
    /// How to integrate. Differences need a tight tolerance.
    pub options: Options,
    /// When to stop.
    pub stopping: StoppingRule,
    /// How many recordings are filtered at a time. Results do not depend on it.
    pub threads: usize,
}

impl<'a, S: System> PredictionErrorProblem<'a, S> {
    /// A problem in which all directions, the process noise of all states and the noise of all outputs are
    /// estimated.
    pub fn new(system: &'a S, p: &'a [f64], recordings: &'a [Recording]) -> Self {
        let signature = system.signature();
        let unknowns = &signature.unknowns;
        let states = (0..unknowns.len()).filter(|i| unknowns.is_differential(*i)).count();
        Self {
            system,
            p,
            free: vec![true; signature.directions.len()],
            recordings,
            rates: vec![Level::Estimated; states],
            noise: vec![Some(Level::Estimated); signature.outputs.len()],
            priors: Vec::new(),
            options: Options { rtol: 1e-8, atol: 1e-8, ..Options::default() },
            stopping: StoppingRule { reduction: 1e-11, ..StoppingRule::default() },
            threads: 1,
        }
    }
}

/// A level of noise.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LevelEstimate {
    /// Its value, SI.
    pub value: f64,
    /// Standard deviation of its logarithm; `None` where it was given, is at a bound, or not determined.
    pub log_std: Option<f64>,
    /// The bound that was reached: at the lower one the data asks for none.
    pub at_bound: Option<Bound>,
}

/// What was estimated.
#[derive(Debug, Clone)]
pub struct PredictionError {
    /// All parameters, SI.
    pub p: Vec<f64>,
    /// Start values that replace the model's, for each recording.
    pub starts: Vec<Starts>,
    /// What was estimated: parameters, then the start values of each recording.
    pub estimates: Vec<Estimate>,
    /// Changes of the estimates that the innovations do not see. Positions from `estimates.len()` on are
    /// levels of noise, rates first.
    pub undetermined: Vec<Undetermined>,
    /// How far each differential unknown strays by itself in a second, SI/√s.
    pub rates: Vec<LevelEstimate>,
    /// Standard deviation of each output's noise, SI.
    pub noise: Vec<Option<LevelEstimate>>,
    /// −2 ln of the likelihood.
    pub deviance: f64,
    /// Samples that count, of all outputs in use.
    pub samples: usize,
    /// Accepted steps.
    pub iterations: usize,
    /// Evaluations with derivatives.
    pub evaluations: usize,
    /// Why it ended.
    pub termination: Termination,
    uncertainty: Uncertainty,
    slopes: Vec<f64>,
}

impl PredictionError {
    /// Covariance of two estimates, SI; `None` where one of them is at a bound or not determined.
    pub fn covariance(&self, i: usize, j: usize) -> Option<f64> {
        Some(self.uncertainty.covariance(i, j)? * self.slopes[i] * self.slopes[j])
    }
}

/// Estimates parameters, start values and levels of noise by the innovations of an extended Kalman filter.
///
/// # Errors
///
/// [`EstimateError`]: nothing to estimate or to estimate from, the model cannot be filtered, or not where the
/// search begins.
///
/// # Panics
///
/// When lengths are not those of the model's signature.
pub fn prediction_error<S: System + Clone + Send>(
    problem: &PredictionErrorProblem<'_, S>,
) -> Result<PredictionError, EstimateError> {
    let signature = problem.system.signature();
    assert_eq!(problem.p.len(), signature.parameters.len(), "number of parameters");
    assert_eq!(problem.free.len(), signature.directions.len(), "number of directions");
    assert_eq!(problem.noise.len(), signature.outputs.len(), "number of outputs");
    let search = Search::new(problem)?;
    let mut z = search.first.clone();
    if z.is_empty() {
        return Err(EstimateError::NothingFree);
    }
    let samples = samples(problem);
    if samples == 0 {
        return Err(EstimateError::NothingMeasured);
    }
    if samples < z.len() {
        return Err(EstimateError::TooFewSamples { samples, free: z.len() });
    }
    let bounds = search.bounds();
    for (z, (low, high)) in z.iter_mut().zip(&bounds) {
        *z = z.clamp(*low, *high);
    }
    let evaluate = |z: &[f64]| search.evaluate(problem.system, problem.threads, z);
    let first = evaluate(&z).map_err(Failed::at_start)?;
    let minimum = minimise(z, first, &bounds, &problem.stopping, evaluate);
    Ok(PredictionError {
        samples,
        iterations: minimum.iterations,
        evaluations: minimum.evaluations + 1,
        termination: minimum.termination,
        ..search.finish(&minimum.x, &minimum.at, signature)
    })
}

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

/// Samples of outputs in use that count.
fn samples<S: System>(problem: &PredictionErrorProblem<'_, S>) -> usize {
    let outputs = || (0..problem.noise.len()).filter(|i| problem.noise[*i].is_some());
    let of_recording =
        |recording: &Recording| outputs().map(|i| recording.counted(i).count()).sum::<usize>();
    problem.recordings.iter().map(of_recording).sum()
}

/// A level as a variable: ln(level / unit).
struct Sought {
    unit: f64,
    bounds: (f64, f64),
}

/// Why a trial failed.
enum Failed {
    Trial(TrialFailed),
    /// Before any trial: the model cannot be filtered.
    Model(FilterError),
}

/// The variables of the search: parameters and start values, rates, noise.
///
/// It knows no system, so that threads can share it.
struct Search<'p> {
    p: &'p [f64],
    recordings: &'p [Recording],
    /// Levels that are given.
    known_rates: &'p [Level],
    known_noise: &'p [Option<Level>],
    priors: &'p [Prior],
    n_directions: usize,
    options: Options,
    variables: Variables,
    first: Vec<f64>,
    /// For each state and each output in use, the level where it is sought.
    rates: Vec<Option<Sought>>,
    noise: Vec<Option<Sought>>,
    /// σ that ln det S is relative to, so that it does not fall below zero.
    least: Vec<f64>,
}

impl<'p> Search<'p> {
    fn new<S: System>(problem: &'p PredictionErrorProblem<'_, S>) -> Result<Self, EstimateError> {
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

    fn bounds(&self) -> Vec<(f64, f64)> {
        let of_levels = self.rates.iter().chain(&self.noise).flatten().map(|sought| sought.bounds);
        self.variables.all.iter().map(Variable::bounds).chain(of_levels).collect()
    }

    /// Rates and noise at z.
    fn tuning(&self, z: &[f64]) -> Tuning {
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
    fn evaluate<S: System + Clone + Send>(
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

    /// What one recording adds.
    fn of_recording<S: System>(
        &self,
        system: &S,
        r: usize,
        z: &[f64],
        bounds: &[(f64, f64)],
    ) -> Result<NormalEquations, Failed> {
        let recording = &self.recordings[r];
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
        let starts: Vec<Starts> =
            points.iter().map(|z| self.variables.starts(r, &recording.start, z)).collect();
        let ps: Vec<Vec<f64>> =
            points.iter().map(|z| self.variables.parameters(self.p, z)).collect();
        let mut filters: Vec<Filter<'_, S>> = Vec::with_capacity(points.len());
        let mut sum = NormalEquations::zeros(z.len());
        let mut measured = vec![f64::NAN; self.noise.len()];
        for (k, &t) in recording.times.iter().enumerate() {
            // The second of two rows with one time counts.
            if recording.times.get(k + 1) == Some(&t) {
                continue;
            }
            for (measured, samples) in measured.iter_mut().zip(&recording.measured) {
                let counts = t >= recording.counts_from;
                *measured = samples.as_ref().filter(|_| counts).map_or(f64::NAN, |s| s[k]);
            }
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

    /// What was found at z.
    fn finish(&self, z: &[f64], at: &NormalEquations, signature: &Signature) -> PredictionError {
        let bounds = self.bounds();
        let reached: Vec<Option<Bound>> = z
            .iter()
            .zip(&bounds)
            .map(|(z, (low, high))| match z {
                z if z <= low => Some(Bound::Lower),
                z if z >= high => Some(Bound::Upper),
                _ => None,
            })
            .collect();
        let held: Vec<bool> = reached.iter().map(Option::is_some).collect();
        let uncertainty = Uncertainty::new(&at.information, &held, UNSEEN);
        let std = |i: usize| uncertainty.covariance(i, i).map(f64::sqrt);
        let all = &self.variables.all;
        let slopes: Vec<f64> = all.iter().zip(z).map(|(variable, z)| variable.slope(*z)).collect();
        let estimates = (0..all.len())
            .map(|i| Estimate {
                name: self.variables.name(signature, i),
                of: all[i].of,
                recording: all[i].recording,
                value: all[i].value(z[i]),
                std: std(i).map(|std| std * slopes[i].abs()),
                at_bound: reached[i],
            })
            .collect();
        let tuning = self.tuning(z);
        let mut position = all.len();
        let mut level = |value: f64, sought: bool| {
            let i = position;
            position += usize::from(sought);
            let (log_std, at_bound) = if sought { (std(i), reached[i]) } else { (None, None) };
            LevelEstimate { value, log_std, at_bound }
        };
        let rates = tuning.states.iter().zip(&self.rates);
        let rates = rates.map(|(walk, sought)| level(walk.rate, sought.is_some())).collect();
        let noise = tuning.noise.iter().zip(&self.noise);
        let noise = noise.map(|(sigma, sought)| sigma.map(|sigma| level(sigma, sought.is_some())));
        let noise = noise.collect();
        // The constant: ln 2π of each sample, and what ln det S is relative to.
        let outputs = (0..self.least.len()).filter(|i| self.known_noise[*i].is_some());
        let constant: f64 = outputs
            .map(|i| {
                let count = self.recordings.iter().map(|r| r.counted(i).count()).sum::<usize>();
                count as f64 * (std::f64::consts::TAU * self.least[i] * self.least[i]).ln()
            })
            .sum();
        PredictionError {
            p: self.variables.parameters(self.p, z),
            starts: (0..self.recordings.len())
                .map(|r| self.variables.starts(r, &self.recordings[r].start, z))
                .collect(),
            estimates,
            undetermined: uncertainty.undetermined.clone(),
            rates,
            noise,
            deviance: at.cost + constant,
            samples: 0,
            iterations: 0,
            evaluations: 0,
            termination: Termination::EvaluationLimit,
            uncertainty,
            slopes,
        }
    }
}

impl Failed {
    /// Where the search begins it ends it.
    fn at_start(self) -> EstimateError {
        match self {
            Failed::Trial(failed) => EstimateError::Start(failed),
            Failed::Model(FilterError::Free(error)) => error,
            Failed::Model(error) => EstimateError::NotFiltered(Box::new(error)),
        }
    }

    fn of(error: FilterError, recording: usize) -> Self {
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
