//! Structures with estimated parameters, and their misfit.

use std::fmt;
use std::sync::OnceLock;

use dgd_identify::journal::{Journaled, kept};
use dgd_identify::keep_by_fields;
use dgd_identify::{
    EstimateError, Fit, NoiseCorrelation, NoiseSource, OutputErrorEvaluation, OutputErrorProblem,
    ParameterEstimate, Recording, Starts, StoppingRule, TrialFailed, counts_from, evaluate, fit,
};
use dgd_runtime::signature::Parameter;
use dgd_runtime::{IntegrateError, Observations, Signature, System};

use super::data::{SearchData, SearchEnd};
use super::moments::{MovingMoments, cross, relocate_onsets, with_found_starts};
use super::patience::{cannot_begin, is_cut_short, too_many_steps};
use super::residuals::{runs_away, whitened_square};
use super::start_point::StartPoint;
use crate::library::{CarriedValues, ModelStructure, StructureError};
use dgd_screen::noise::SensorNoise;

/// A fitted structure with its simulations of the data.
#[derive(Debug, Clone)]
pub(crate) struct FittedStructure {
    pub structure: ModelStructure,
    /// Parameters and start values.
    pub values: CarriedValues,
    /// All parameters, SI.
    pub p: Vec<f64>,
    pub estimates: Vec<ParameterEstimate>,
    /// Positions among these of parameters that were moved from sample to sample rather than fitted.
    pub moments: Vec<usize>,
    /// Whether the fit converged.
    pub is_converged: bool,
    /// Whether it ended early because a simulation took too many steps.
    pub is_cut_short: bool,
    /// Σ ε² of the training recordings and the number of samples, with the latest noise estimate.
    pub error: (f64, usize),
    /// Outputs at the samples of each training recording.
    pub train: Vec<Observations>,
    /// Those of each validation recording; `None` if they were not simulated or cannot be.
    pub valid: Option<Vec<Observations>>,
    /// Two effects, the second of which only cancels the first; computed on demand.
    pub cancelling: OnceLock<Option<[usize; 2]>>,
    /// Expected mean squares of its validation errors, relative to the noise, computed on demand.
    pub foreseen: OnceLock<Option<Vec<f64>>>,
}

/// The result of a fit, which takes long to compute.
struct StoredFit {
    p: Vec<f64>,
    starts: Vec<Starts>,
    estimates: Vec<ParameterEstimate>,
    moments: Vec<usize>,
    is_converged: bool,
    is_cut_short: bool,
}

/// Why a structure has no fit.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum NoFit {
    /// It is not a valid model.
    Invalid(StructureError),
    /// Its effect does not give a valid model.
    NotApplied(StructureError),
    /// No fit could begin.
    Failed(FitFailure),
    /// The fitted model could not be simulated again.
    NotEvaluated(TrialFailed),
    /// No recording could be begun.
    NotSimulated(Option<IntegrateError>),
    /// The search ended before.
    NotTried(SearchEnd),
    /// The base model was not fitted.
    NeverFitted,
}

/// Why the first fit of a structure failed, as the journal keeps it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum FitFailure {
    /// Its first simulation takes too many steps.
    TooManySteps,
    /// The estimator failed, with its message.
    Estimate(String),
}

impl NoFit {
    /// Whether its simulations take too many steps.
    pub(crate) fn is_too_long(&self) -> bool {
        matches!(self, NoFit::Failed(FitFailure::TooManySteps))
    }
}

impl fmt::Display for NoFit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            NoFit::Invalid(error) => error.fmt(f),
            NoFit::NotApplied(error) => write!(f, "cannot be applied: {error}"),
            NoFit::Failed(FitFailure::TooManySteps) => {
                write!(f, "cannot be fitted: {}", too_many_steps())
            }
            NoFit::Failed(FitFailure::Estimate(reason)) => {
                write!(f, "cannot be fitted: {reason}")
            }
            NoFit::NotEvaluated(error) => error.fmt(f),
            NoFit::NotSimulated(Some(error)) => write!(f, "cannot be simulated: {error}"),
            NoFit::NotSimulated(None) => f.write_str("cannot be simulated"),
            NoFit::NotTried(end) => end.fmt(f),
            NoFit::NeverFitted => f.write_str("it was never fitted"),
        }
    }
}

/// Difference of criteria that is "very strong" evidence (Kass & Raftery, J. Am. Stat. Assoc. 90 (1995) 773).
pub(crate) const VERY_STRONG: f64 = 10.0;

/// Distance from a bound, in standard deviations, below which an estimate counts as at the bound.
const AS_GOOD_AS_AT: f64 = 0.1;

impl FittedStructure {
    /// Whether a parameter is at a bound, or so near one that the recordings cannot distinguish the two, like the rate
    /// of a limit that is never reached.
    pub(crate) fn is_at_bound(&self, estimate: &ParameterEstimate) -> bool {
        let parameters = &self.structure.system.signature().parameters;
        let declared = parameters.iter().find(|declared| *declared.name == *estimate.name);
        let distance = declared.map_or(f64::INFINITY, |Parameter { lower, upper, .. }| {
            (estimate.value - lower).min(upper - estimate.value)
        });
        estimate.at_bound.is_some() || estimate.std.is_some_and(|s| distance < AS_GOOD_AS_AT * s)
    }

    /// Fits a structure from several points, and keeps the best; the first on a tie.
    pub(crate) fn new(
        structure: ModelStructure,
        from: &CarriedValues,
        points: &[StartPoint],
        data: &SearchData<'_>,
        evaluations: usize,
    ) -> Result<FittedStructure, NoFit> {
        let key = data.keeping.key(&("fit", &structure.id), |digest| {
            digest
                .debug(from)
                .debug(&points)
                .debug(&data.noise)
                .debug(&data.options_for(&structure.system))
                .debug(&evaluations)
                .debug(&data.own_weights)
        });
        let ended = kept(data.keeping.journal, key, || {
            StoredFit::new(&structure, from, points, data, evaluations)
        })
        .map_err(NoFit::Failed)?;
        let StoredFit { p, starts, estimates, moments, is_converged, is_cut_short } = ended;
        let values = CarriedValues::collect(&structure.system, &p, &starts);
        let recordings = with_starts(data.train, from, &structure);
        let problem = problem(&structure, &p, &recordings, data, evaluations);
        let OutputErrorEvaluation { observations: train, .. } =
            evaluate(&problem, &p, &starts).map_err(NoFit::NotEvaluated)?;
        let (error, valid) = ((0.0, 0), None);
        let (cancelling, foreseen) = (OnceLock::new(), OnceLock::new());
        let mut fitted = FittedStructure {
            structure,
            values,
            p,
            estimates,
            moments,
            is_converged,
            is_cut_short,
            error,
            train,
            valid,
            cancelling,
            foreseen,
        };
        fitted.weigh(data);
        Ok(fitted)
    }

    /// The same structure, fitted again from where this fit ended.
    pub(crate) fn continued(
        &self,
        data: &SearchData<'_>,
        evaluations: usize,
    ) -> Result<FittedStructure, NoFit> {
        let points = [StartPoint::default()];
        FittedStructure::new(self.structure.clone(), &self.values, &points, data, evaluations)
    }

    /// Recomputes the misfit with the current noise.
    pub(crate) fn weigh(&mut self, data: &SearchData<'_>) {
        self.error = whitened_square(data.train, &self.residuals(data), &data.noise);
        self.foreseen = OnceLock::new();
    }

    /// Times from which the validation recordings count.
    pub(crate) fn counts_from(&self, data: &SearchData<'_>, evaluations: usize) -> Vec<f64> {
        let problem = problem(&self.structure, &self.p, data.valid, data, evaluations);
        let key = data.keeping.key(&("counts from", &self.structure.id), |digest| {
            let options = data.options_for(&self.structure.system);
            digest.debug(&self.p).debug(&data.noise).debug(&options).debug(&evaluations)
        });
        let correlations: Vec<NoiseCorrelation> = data
            .noise
            .iter()
            .map(|noise| noise.as_ref().map_or(NoiseCorrelation::NONE, correlation))
            .collect();
        kept(data.keeping.journal, key, || counts_from(&problem, &correlations))
    }

    /// Mean square of the residuals of the training recordings relative to the noise.
    pub(crate) fn mean_square(&self) -> f64 {
        let (sum, n) = self.error;
        sum / n as f64
    }

    /// Σ ε² + k ln N of the training recordings, the Bayesian information criterion.
    pub(crate) fn criterion(&self) -> f64 {
        let (sum, n) = self.error;
        sum + self.free() as f64 * (n as f64).ln()
    }

    /// Number of free parameters and start values.
    pub(crate) fn free(&self) -> usize {
        self.estimates.len()
    }

    /// Measured minus simulated, for each recording and output; NaN where nothing was measured.
    pub(crate) fn residuals(&self, data: &SearchData<'_>) -> Vec<Vec<Vec<f64>>> {
        residuals(data.train, &self.train)
    }

    /// Whether its simulation diverges from a training recording, so that neither a linearisation around it nor a fit
    /// that begins there can locate what is missing.
    pub(crate) fn runs_away(&self, data: &SearchData<'_>) -> bool {
        let residuals = self.residuals(data);
        let mut both = data.train.iter().zip(&residuals);
        both.any(|(recording, outputs)| {
            let mut pairs = recording.measured.iter().zip(outputs);
            pairs.any(|(read, left)| read.as_ref().is_some_and(|read| runs_away(read, left)))
        })
    }

    /// Measured minus simulated in validation recordings, including the samples from which start values are estimated.
    pub(crate) fn all_held_out_residuals(
        &self,
        data: &SearchData<'_>,
    ) -> Option<Vec<Vec<Vec<f64>>>> {
        Some(residuals(data.valid, self.valid.as_ref()?))
    }

    /// [`Self::all_held_out_residuals`], with NaN at the samples from which start values are estimated.
    pub(crate) fn held_out_residuals(&self, data: &SearchData<'_>) -> Option<Vec<Vec<Vec<f64>>>> {
        let mut residuals = self.all_held_out_residuals(data)?;
        for ((recording, from), outputs) in
            data.valid.iter().zip(&data.counts_from).zip(&mut residuals)
        {
            let skipped = recording.times.partition_point(|t| t < from);
            for values in outputs {
                values[..skipped].fill(f64::NAN);
            }
        }
        Some(residuals)
    }
}

impl StoredFit {
    /// Fits a structure from several points, and keeps the best; the first on a tie.
    fn new(
        structure: &ModelStructure,
        from: &CarriedValues,
        points: &[StartPoint],
        data: &SearchData<'_>,
        evaluations: usize,
    ) -> Result<StoredFit, FitFailure> {
        let system = &structure.system;
        let signature = system.signature();
        let of_the_file = CarriedValues::default();
        let begun = |from: &CarriedValues| with_starts(data.train, from, structure);
        let [on, afresh] = [false, true].map(|is_afresh| {
            let from = if is_afresh { &of_the_file } else { from };
            let is_wanted = points.iter().any(|point| point.is_afresh == is_afresh);
            (from, if is_wanted { begun(from) } else { Vec::new() })
        });
        let mut best: Option<(Fit, MovingMoments)> = None;
        let mut failure = None;
        for point in points {
            let (from, recordings) = if point.is_afresh { &afresh } else { &on };
            let parameters_at = |values: &[(String, f64)]| {
                let mut combined = (*from).clone();
                combined.p.extend(values.iter().cloned());
                let mut p = combined.parameters(system);
                clip(&mut p, signature);
                p
            };
            let (suggested, nothing) =
                (parameters_at(&point.values), parameters_at(&point.at_nothing));
            let attempt = |p: &[f64]| {
                let problem = problem(structure, p, recordings, data, evaluations);
                fitted(&problem, &nothing, &point.held, structure, data.own_weights)
            };
            let mut result = attempt(&suggested);
            for share in MOVED {
                let between = |(a, b): (&f64, &f64)| a + share * (b - a);
                let moved: Vec<f64> = nothing.iter().zip(&suggested).map(between).collect();
                if !matches!(result, Err(EstimateError::Start(_))) || nothing == suggested {
                    break;
                }
                result = attempt(&moved);
            }
            match result {
                Ok(result) if best.as_ref().is_none_or(|(best, _)| result.0.cost < best.cost) => {
                    best = Some(result);
                }
                Ok(_) => {}
                Err(error) => {
                    failure.get_or_insert(if cannot_begin(&error) {
                        FitFailure::TooManySteps
                    } else {
                        FitFailure::Estimate(error.to_string())
                    });
                }
            }
        }
        let Some((fit, moments)) = best else {
            return Err(failure.unwrap_or_else(|| FitFailure::Estimate(String::new())));
        };
        let estimates = moments.estimates(system, &fit);
        let (is_converged, is_cut_short) = (fit.termination.is_converged(), is_cut_short(&fit));
        let moments = moments.parameters;
        let (p, starts) = (fit.p, fit.starts);
        Ok(StoredFit { p, starts, estimates, moments, is_converged, is_cut_short })
    }
}

keep_by_fields!(StoredFit { p, starts, estimates, moments, is_converged, is_cut_short });

impl Journaled for FitFailure {
    fn write(&self, bytes: &mut Vec<u8>) {
        let reason = match self {
            FitFailure::TooManySteps => None,
            FitFailure::Estimate(reason) => Some(reason.clone()),
        };
        reason.write(bytes);
    }

    fn read(bytes: &mut &[u8]) -> Option<Self> {
        let reason: Option<String> = Journaled::read(bytes)?;
        Some(reason.map_or(FitFailure::TooManySteps, FitFailure::Estimate))
    }
}

/// Shares of the way from no effect to a suggested start that cannot be simulated, at which a fit begins instead.
const MOVED: [f64; 3] = [0.3, 0.1, 0.0];

/// Maximum number of rounds in which moments are moved and the rest is refitted.
const MOST_ROUNDS: usize = 4;

/// Factor by which the simulations of a fit may be exceeded until a step is accepted: before that, the fit does
/// not characterise the structure.
const UNTIL_A_STEP: usize = 4;

/// Mean square relative to the noise up to which other onsets are tried after a fit: a larger misfit has another cause.
const NEAR: f64 = 10.0;

fn is_near(problem: &OutputErrorProblem<'_>, cost: f64) -> bool {
    let measured = problem.recordings.iter().flat_map(|recording| recording.measured.iter());
    let samples = measured.flatten().flatten().filter(|value| value.is_finite()).count();
    cost < NEAR * samples as f64
}

/// A fit from the better of two points, with the moments at which readings jump moved sample by sample. Some parameters
/// are held at first.
fn fitted(
    problem: &OutputErrorProblem<'_>,
    other: &[f64],
    held_at_first: &[String],
    structure: &ModelStructure,
    own_weights: bool,
) -> Result<(Fit, MovingMoments), EstimateError> {
    let mut p = problem.p.to_vec();
    let starts: Vec<Starts> = problem.recordings.iter().map(|r| r.start.clone()).collect();
    let moments = MovingMoments::jumping(problem, &structure.onsets, &mut p, &starts);
    if other != problem.p {
        let mut other = other.to_vec();
        for &moment in &moments.parameters {
            other[moment] = p[moment];
        }
        let cost = |p: &[f64]| evaluate(problem, p, &starts).map_or(f64::INFINITY, |e| e.cost);
        if cost(&other) < cost(&p) {
            p = other;
        }
    }
    let free = moments.held(problem);
    let mut recordings = problem.recordings.to_vec();
    if !held_at_first.is_empty() {
        let signature = problem.system.signature();
        let is_free = |(j, free): (usize, &bool)| {
            *free && !held_at_first.iter().any(|held| *held == signature.direction_name(j))
        };
        let free = free.iter().enumerate().map(is_free).collect();
        let evaluations = problem.stopping.evaluations / 2;
        let stopping = StoppingRule { evaluations, ..problem.stopping };
        let adapted = fit(&OutputErrorProblem { p: &p, free, stopping, ..problem.clone() })?;
        recordings = with_found_starts(&recordings, &adapted.starts);
        p = adapted.p;
    }
    let fit_rest = |p: &[f64], recordings: &[Recording]| {
        fit(&OutputErrorProblem { p, recordings, free: free.clone(), ..problem.clone() })
    };
    let mut best = fit_rest(&p, &recordings)?;
    for _ in 0..MOST_ROUNDS {
        let mut p = best.p.clone();
        // A fit that has not converged yet does not show whether to move the moment.
        let mut is_moved = false;
        if best.termination.is_converged() {
            let starts = &best.starts;
            is_moved = moments.settle(problem, &mut p, starts).map_err(EstimateError::Start)?;
            is_moved |=
                cross(problem, &structure.delays, &mut p, starts).map_err(EstimateError::Start)?;
        }
        if !is_moved && is_near(problem, best.cost) {
            let starts = &best.starts;
            is_moved = best.termination.is_converged()
                && relocate_onsets(problem, &structure.onsets, &moments, &mut p, starts)
                    .map_err(EstimateError::Start)?;
        }
        if !is_moved {
            break;
        }
        let recordings = with_found_starts(problem.recordings, &best.starts);
        best = fit_rest(&p, &recordings)?;
    }
    if own_weights && best.termination.is_converged() {
        let recordings = with_found_starts(problem.recordings, &best.starts);
        let estimated = |noise: &Option<NoiseSource>| noise.map(|_| NoiseSource::Estimated);
        let noise = problem.noise.iter().map(estimated).collect();
        let recordings = recordings.as_slice();
        best = fit(&OutputErrorProblem { p: &best.p, recordings, noise, free, ..problem.clone() })?;
    }
    Ok((best, moments))
}

fn residuals(recordings: &[Recording], observations: &[Observations]) -> Vec<Vec<Vec<f64>>> {
    let of_recording = |(recording, observations): (&Recording, &Observations)| {
        let of_output = |(output, measured): (usize, &Option<Vec<f64>>)| match measured {
            None => vec![f64::NAN; recording.times.len()],
            Some(measured) => {
                let samples = measured.iter().enumerate();
                samples.map(|(k, measured)| measured - observations.w(k)[output]).collect()
            }
        };
        recording.measured.iter().enumerate().map(of_output).collect()
    };
    recordings.iter().zip(observations).map(of_recording).collect()
}

fn correlation(noise: &SensorNoise) -> NoiseCorrelation {
    noise.colour.map_or(NoiseCorrelation::NONE, |colour| NoiseCorrelation {
        share: (colour.std / noise.total()).powi(2),
        memory: colour.memory,
    })
}

/// Σ (e/σ)² of the training recordings with some values, without a fit; infinite if they cannot be simulated.
pub(crate) fn cost_at(
    structure: &ModelStructure,
    values: &CarriedValues,
    data: &SearchData<'_>,
) -> f64 {
    let system = &structure.system;
    let mut p = values.parameters(system);
    clip(&mut p, system.signature());
    let recordings = with_starts(data.train, values, structure);
    let starts: Vec<Starts> = recordings.iter().map(|one| one.start.clone()).collect();
    let problem = problem(structure, &p, &recordings, data, 1);
    evaluate(&problem, &p, &starts).map_or(f64::INFINITY, |found| found.cost)
}

pub(super) fn problem<'a>(
    structure: &'a ModelStructure,
    p: &'a [f64],
    recordings: &'a [Recording],
    data: &SearchData<'_>,
    evaluations: usize,
) -> OutputErrorProblem<'a> {
    let known = |noise: &Option<SensorNoise>| noise.map(|noise| NoiseSource::Known(noise.total()));
    let noise = data.noise.iter().map(known).collect();
    let until_a_step = UNTIL_A_STEP * evaluations;
    let stopping = StoppingRule { evaluations, until_a_step, ..StoppingRule::default() };
    let options = data.options_for(&structure.system);
    let problem = OutputErrorProblem::new(structure.system.as_model(), p, recordings);
    OutputErrorProblem { noise, stopping, options, threads: 1, ..problem }
}

/// The recordings with these start values as initial guesses.
pub(crate) fn with_starts(
    recordings: &[Recording],
    values: &CarriedValues,
    structure: &ModelStructure,
) -> Vec<Recording> {
    let recordings = recordings.iter().enumerate();
    recordings
        .map(|(r, recording)| {
            let mut recording = recording.clone();
            for (unknown, value) in values.starts(&structure.system, r) {
                recording.start.retain(|(other, _)| *other != unknown);
                recording.start.push((unknown, value));
            }
            recording
        })
        .collect()
}

/// Clamps parameters to their bounds.
fn clip(p: &mut [f64], signature: &Signature) {
    for (value, parameter) in p.iter_mut().zip(signature.parameters.iter()) {
        *value = value.clamp(parameter.lower, parameter.upper);
    }
}
