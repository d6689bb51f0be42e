//! Estimates parameters, start values and noise levels by the likelihood of the innovations.
//!
//! ```text
//!   minimise  −2 ln L = Σ ln det S + εᵀ S⁻¹ ε      over θ, x(0) of each recording, rates of dβ, σ
//! ```
//!
//! ε and S are those of an extended Kalman filter with known start values. Without process noise there are no
//! corrections, S is σ², and this is the fit by simulation error.
//!
//! The minimum is found by Fisher scoring within bounds ([`minimise`]), with the estimate of the Hessian by
//! [`super::secant`] in addition to the information: with primes for derivatives,
//!
//! ```text
//!   gradient:     Σ ½ tr(S⁻¹S′) + ε′ᵀ S⁻¹ ε − ½ εᵀ S⁻¹ S′ S⁻¹ ε
//!   information:  Σ ε′ᵀ S⁻¹ ε′ + ½ tr(S⁻¹ S′ S⁻¹ S′)
//! ```
//!
//! ε′ and S′ are central differences; the required filters run side by side, so that no innovations are stored. The
//! inverse of the information is the covariance of the estimates.
//!
//! Ljung, System Identification, 2nd ed. (1999), ch. 7; Kristensen, Madsen, Jørgensen, Parameter estimation in
//! stochastic grey-box models, Automatica 40 (2004) 225; the information is that of Goodrich and Caines, IEEE
//! TAC 24 (1979) 403.

use dgd_runtime::model::Model;
use dgd_runtime::{Options, Signature};
use nalgebra::DMatrix;

use super::levels::FreeNoiseLevel;
use super::secant::Secant;
use super::{LikelihoodFailure, LikelihoodSearch, counting_rows};
use crate::error::{EstimateError, verify_lengths};
use crate::filter::estimator::{RunningFilter, TrackedRow};
use crate::filter::problem::{FilterProblem, FilterTuning, RandomWalk, states_of};
use crate::minimise::trust_region::{
    Minimum, NormalEquations, StoppingRule, Termination, VariableRegion, minimise_watched,
};
use crate::output_error::prior::Prior;
use crate::output_error::{NEGLIGIBLE_REDUCTION, Starts};
use crate::progress::{Monitor, NoMonitor, Progress, Total};
use crate::recording::Recording;
use crate::uncertainty::{ParameterEstimate, Uncertainty, UndeterminedDirection};
use crate::variables::BoundReached;

/// Eigenvalues of the information below this fraction of the largest count as zero: differences are accurate to about a
/// thousandth, and enter squared.
const UNSEEN: f64 = 1e-9;

/// Accuracy of a deviance whose derivatives are differences: its 95 % threshold is 3.8.
const KNOWN: f64 = 1e-4;

/// The source of a noise level.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum NoiseLevelSource {
    /// A known value, SI.
    Known(f64),
    /// An estimate.
    Estimated,
    /// The parameter at this position.
    Parameter(usize),
}

/// A problem of prediction error estimation.
#[derive(Debug, Clone)]
pub struct PredictionErrorProblem<'a> {
    /// The model. Its directions are the possible free quantities, and include the start values of all unknowns that
    /// are differential in some mode.
    pub system: &'a dyn Model,
    /// All parameters, SI: values of fixed ones, first guesses of free ones.
    pub p: &'a [f64],
    /// Which of the directions are free.
    pub free: Vec<bool>,
    /// The recordings. Of two rows with the same time the second counts.
    pub recordings: &'a [Recording],
    /// For each unknown that is differential in some mode, its process noise, SI/√s.
    pub rates: Vec<NoiseLevelSource>,
    /// For each output, the standard deviation of its noise, SI; `None` if it is not used.
    pub noise: Vec<Option<NoiseLevelSource>>,
    /// The priors.
    pub priors: Vec<Prior>,
    /// Integrator options. Differences need a tight tolerance.
    pub options: Options,
    /// The stopping rule.
    pub stopping: StoppingRule,
    /// Number of recordings filtered in parallel. Results do not depend on it.
    pub threads: usize,
    /// Progress and cancellation.
    pub watch: &'a dyn Monitor,
}

impl<'a> PredictionErrorProblem<'a> {
    /// A problem in which all directions, the process noise of all states and the noise of all outputs are
    /// estimated.
    pub fn new(system: &'a dyn Model, p: &'a [f64], recordings: &'a [Recording]) -> Self {
        let signature = system.signature();
        let states = states_of(system).len();
        Self {
            system,
            p,
            free: vec![true; signature.directions.len()],
            recordings,
            rates: vec![NoiseLevelSource::Estimated; states],
            noise: vec![Some(NoiseLevelSource::Estimated); signature.outputs.len()],
            priors: Vec::new(),
            options: Options { rtol: 1e-8, atol: 1e-8, ..Options::default() },
            stopping: StoppingRule { reduction: 1e-11, ..StoppingRule::default() },
            threads: 1,
            watch: &NoMonitor,
        }
    }

    /// The problem without cancellation, for filters that the result of a cancelled search needs.
    #[must_use]
    pub fn unwatched(&self) -> Self {
        let options = Options { watched: None, ..self.options };
        PredictionErrorProblem { options, ..self.clone() }
    }
}

/// An estimated noise level.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LevelEstimate {
    /// Its value, SI.
    pub value: f64,
    /// Standard deviation of its logarithm; `None` if it was given, is at a bound, or is not determined.
    pub log_std: Option<f64>,
    /// The bound that was reached; the lower one means that the data shows no noise.
    pub at_bound: Option<BoundReached>,
}

/// The result of a prediction error estimation.
#[derive(Debug, Clone)]
pub struct PredictionError {
    /// All parameters, SI.
    pub p: Vec<f64>,
    /// Start values that replace the model's, for each recording.
    pub starts: Vec<Starts>,
    /// The estimates: parameters, then the start values of each recording.
    pub estimates: Vec<ParameterEstimate>,
    /// Changes of the estimates that do not affect the innovations. Positions from `estimates.len()` on are noise
    /// levels, rates first.
    pub undetermined: Vec<UndeterminedDirection>,
    /// Process noise of each unknown that is differential in some mode, SI/√s.
    pub rates: Vec<LevelEstimate>,
    /// Standard deviation of each output's noise, SI.
    pub noise: Vec<Option<LevelEstimate>>,
    /// −2 ln of the likelihood.
    pub deviance: f64,
    /// Samples that count, of all used outputs.
    pub samples: usize,
    /// Accepted steps.
    pub iterations: usize,
    /// Points at which the likelihood was evaluated.
    pub evaluations: usize,
    /// Why it ended.
    pub termination: Termination,
    uncertainty: Uncertainty,
    slopes: Vec<f64>,
    /// The variables of the search.
    pub(in crate::filter) z: Vec<f64>,
}

impl PredictionError {
    /// Covariance of two estimates, SI; `None` if one of them is at a bound or not determined.
    pub fn covariance(&self, i: usize, j: usize) -> Option<f64> {
        Some(self.uncertainty.covariance(i, j)? * self.slopes[i] * self.slopes[j])
    }

    /// Drops the standard errors: if the noise is unknown, so are these.
    pub fn forget_uncertainty(&mut self) {
        self.uncertainty.forget(&mut self.estimates);
        let levels = self.rates.iter_mut().chain(self.noise.iter_mut().flatten());
        levels.for_each(|level| level.log_std = None);
    }
}

/// Estimates parameters, start values and noise levels by the innovations of an extended Kalman filter.
///
/// If it is cancelled, the result is the best so far ([`PredictionError::termination`]).
///
/// # Errors
///
/// [`EstimateError`]: nothing to estimate or to estimate from, or the model cannot be filtered, in general or at the
/// starting point.
pub fn prediction_error(
    problem: &PredictionErrorProblem<'_>,
) -> Result<PredictionError, EstimateError> {
    let signature = problem.system.signature();
    let PredictionErrorProblem { p, free, recordings, noise, .. } = problem;
    verify_lengths(signature, p, free, recordings, noise.len())?;
    let search = LikelihoodSearch::new(problem)?;
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
    let minimum = minimised(&search, problem, z, &bounds, &problem.stopping, |done| {
        let limit = Total::AtMost(problem.stopping.evaluations + 1);
        problem.watch.advanced(Progress { what: "evaluations", done, of: limit });
    });
    let minimum = minimum.map_err(LikelihoodFailure::at_start)?;
    Ok(PredictionError {
        samples,
        iterations: minimum.iterations,
        evaluations: minimum.evaluations + 1,
        termination: minimum.termination,
        ..search.finish(&minimum.x, &minimum.at, signature)
    })
}

/// The minimum of −2 ln L within bounds, starting from `z`; `told` receives the number of evaluations.
///
/// # Errors
///
/// If the model cannot be filtered at `z`.
pub(in crate::filter) fn minimised(
    search: &LikelihoodSearch<'_>,
    problem: &PredictionErrorProblem<'_>,
    z: Vec<f64>,
    bounds: &[(f64, f64)],
    stopping: &StoppingRule,
    told: impl Fn(usize),
) -> Result<Minimum<EvaluatedLikelihood, LikelihoodFailure>, LikelihoodFailure> {
    let (mut done, mut least) = (0, f64::INFINITY);
    let mut secant = Secant::new(z.len());
    let mut evaluate = |z: &[f64]| {
        let evaluated = search.better(problem.system, problem.threads, z, least);
        done += 1;
        told(done);
        let mut normal = evaluated?;
        let mut information = normal.information.clone();
        if normal.cost < least {
            least = normal.cost;
            let hessian = secant.hessian(z, &normal);
            information = std::mem::replace(&mut normal.information, hessian);
        }
        Ok(EvaluatedLikelihood { normal, information })
    };
    let first = evaluate(&z)?;
    // Costs during the search are lower than the first.
    let reduction = stopping.reduction.max(NEGLIGIBLE_REDUCTION / first.normal.cost);
    let accuracy = stopping.accuracy.max(KNOWN / first.normal.cost);
    let rule = StoppingRule { reduction, accuracy, ..*stopping };
    let reach = search.reach();
    let region = VariableRegion { bounds, reach: &reach, leading: search.variables.n_shared };
    Ok(minimise_watched(z, first, region, &rule, problem.watch, evaluate))
}

/// The likelihood at a point, with its Hessian in place of the information.
pub(in crate::filter) struct EvaluatedLikelihood {
    normal: NormalEquations,
    information: DMatrix<f64>,
}

impl EvaluatedLikelihood {
    /// −2 ln L less a constant.
    pub(in crate::filter) fn cost(&self) -> f64 {
        self.normal.cost
    }
}

impl AsRef<NormalEquations> for EvaluatedLikelihood {
    fn as_ref(&self) -> &NormalEquations {
        &self.normal
    }
}

/// The filter of an estimate along recordings: a row for each sample, except for the first of two with the same time.
///
/// `starts` are start values for each recording of the problem, such as [`PredictionError::starts`].
///
/// # Errors
///
/// [`EstimateError`] if the model cannot be filtered with these numbers.
///
/// # Panics
///
/// If lengths do not match the model's signature, or there are not as many starts as recordings.
pub fn predictions(
    problem: &PredictionErrorProblem<'_>,
    found: &PredictionError,
    starts: &[Starts],
) -> Result<Vec<Vec<TrackedRow>>, EstimateError> {
    assert_eq!(starts.len(), problem.recordings.len(), "starts of all recordings");
    let walk = |rate: &LevelEstimate| RandomWalk { start: 0.0, rate: rate.value };
    let tuning = FilterTuning {
        states: found.rates.iter().map(walk).collect(),
        parameters: Vec::new(),
        noise: found.noise.iter().map(|noise| noise.map(|noise| noise.value)).collect(),
    };
    let along = |(r, (recording, start)): (usize, (&Recording, &Starts))| {
        let failed = |error| LikelihoodFailure::from_error(error, r).at_start();
        let filter = FilterProblem {
            free: vec![false; problem.free.len()],
            start: start.clone(),
            options: problem.options,
            ..FilterProblem::new(problem.system, &found.p)
        };
        let mut rows: Vec<TrackedRow> = Vec::with_capacity(recording.times.len());
        let mut under_way = None;
        for (k, measured) in counting_rows(recording) {
            let (t, inputs) = (recording.times[k], &recording.inputs);
            let row = match &mut under_way {
                None => {
                    let begun =
                        RunningFilter::begin_recorded(&filter, &tuning, inputs, t, &measured);
                    let (begun, row) = begun.map_err(failed)?;
                    under_way = Some(begun);
                    row
                }
                Some(filter) => filter.advance(inputs, t, &measured).map_err(failed)?,
            };
            rows.push(row);
        }
        Ok(rows)
    };
    problem.recordings.iter().zip(starts).enumerate().map(along).collect()
}

/// Samples of used outputs that count.
fn samples(problem: &PredictionErrorProblem<'_>) -> usize {
    let outputs = (0..problem.noise.len()).filter(|i| problem.noise[*i].is_some());
    outputs.map(|i| samples_of(problem.recordings, i)).sum()
}

/// Samples of an output that count.
fn samples_of(recordings: &[Recording], output: usize) -> usize {
    let of_recording = |recording: &Recording| {
        counting_rows(recording).filter(|(_, measured)| measured[output].is_finite()).count()
    };
    recordings.iter().map(of_recording).sum()
}

impl LikelihoodSearch<'_> {
    /// The result at z.
    fn finish(
        &self,
        z: &[f64],
        at: &EvaluatedLikelihood,
        signature: &Signature,
    ) -> PredictionError {
        let bounds = self.bounds();
        let reached: Vec<Option<BoundReached>> = z
            .iter()
            .zip(&bounds)
            .map(|(z, (low, high))| match z {
                z if z <= low => Some(BoundReached::Lower),
                z if z >= high => Some(BoundReached::Upper),
                _ => None,
            })
            .collect();
        let is_fixed: Vec<bool> = reached.iter().map(Option::is_some).collect();
        let uncertainty = Uncertainty::new(&at.information, &is_fixed, UNSEEN);
        let std = |i: usize| uncertainty.covariance(i, i).map(f64::sqrt);
        let variables = &self.variables.all;
        let slopes: Vec<f64> =
            variables.iter().zip(z).map(|(variable, z)| variable.slope(*z)).collect();
        let estimates = (0..variables.len())
            .map(|i| ParameterEstimate {
                name: self.variables.name(signature, i),
                of: variables[i].of,
                recording: variables[i].recording,
                value: variables[i].value(z[i]),
                std: std(i).map(|std| std * slopes[i].abs()),
                at_bound: reached[i],
            })
            .collect();
        let tuning = self.tuning(z);
        let mut position = variables.len();
        let mut level = |value: f64, sought: &Option<FreeNoiseLevel>| {
            let Some(sought) = sought else {
                return LevelEstimate { value, log_std: None, at_bound: None };
            };
            let i = position;
            position += 1;
            let log_std = std(i).map(|std| std * sought.log_slope(z[i]));
            LevelEstimate { value, log_std, at_bound: reached[i] }
        };
        let rates = tuning.states.iter().zip(&self.rates);
        let rates = rates.map(|(walk, sought)| level(walk.rate, sought)).collect();
        let noise = tuning.noise.iter().zip(&self.noise);
        let noise = noise.map(|(sigma, sought)| sigma.map(|sigma| level(sigma, sought)));
        let noise = noise.collect();
        // The constant: ln 2π of each sample, and the reference of ln det S.
        let outputs = (0..self.least.len()).filter(|i| self.known_noise[*i].is_some());
        let constant: f64 = outputs
            .map(|i| {
                let count = samples_of(self.recordings, i);
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
            deviance: at.normal.cost + constant,
            samples: 0,
            iterations: 0,
            evaluations: 0,
            termination: Termination::EvaluationLimit,
            uncertainty,
            slopes,
            z: z.to_vec(),
        }
    }
}
