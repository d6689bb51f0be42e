//! Fits by simulation error.
//!
//! Every recording is simulated from its start, without corrections on the way; the errors of the simulated outputs are
//! minimised in the weighted least-squares sense, by [`minimise`] with the model's sensitivities.
//!
//! Samples without a measurement are left out. Samples whose sensitivities are undefined
//! ([`UndefinedSensitivity`](dgd_runtime::UndefinedSensitivity)) remain in the cost, so that no trial is accepted that
//! fits them worse, but have no part in the search direction or the covariance: leaving them out of the cost would
//! favour parameters that lose sensitivities early. [`Fit::samples_without_sensitivity`] counts them.
//!
//! The normal matrix has an arrow structure, with one block shared by all recordings and one for each. Recordings are
//! summed in order, whichever threads simulated them.

pub(crate) mod beginning;
pub(crate) mod fit;
pub(crate) mod linearised;
pub(crate) mod multi_start;
pub(crate) mod prior;
mod readings;
pub(crate) mod stepping;
pub(crate) mod weighing;

use dgd_runtime::model::Model;
use dgd_runtime::parallel::in_parallel_by_model;
use dgd_runtime::signature::Distribution;
use dgd_runtime::{Direction, Observations, Options};

use crate::error::{EstimateError, TrialFailed, WrongLength, WrongReading, verify_lengths};
use crate::journal::{Digest, JournalScope, kept_success};
use crate::minimise::trust_region::{StoppingRule, Termination, VariableRegion, minimise_watched};
use crate::noise::density::SampleWeighting;
use crate::noise::loss::{self, Loss};
use crate::noise::{self, NoiseSource};
use crate::output_error::fit::{Fit, FitTotals, finish, unseen};
use crate::output_error::prior::Prior;
use crate::output_error::stepping::SteppingAccuracy;
use crate::output_error::weighing::{
    WeightedSums, effective_priors, misfits, output_names, simulate_all, weigh,
};
use crate::progress::{Monitor, NoMonitor, Progress, Total};
use crate::recording::{
    DerivativeUse, OutputMisfit, OutputSums, Recording, SumsOf, outputs_of, sums,
};
use crate::variables::{FitVariable, FitVariables};

/// Limit on fits with re-estimated noise.
const MOST_ROUNDS: usize = 10;

/// Noise that changes by less than this fraction is stable. It depends on the estimates to second order, so a round or
/// two suffice, and a fit that starts at the end of another one ends there.
const STABLE: f64 = 1e-6;

/// Default of [`OutputErrorProblem::negligible_reduction`].
pub(crate) const NEGLIGIBLE_REDUCTION: f64 = 1e-6;

/// Negligible reduction if no step helps: a hundredth of a standard deviation is not reported as a stall.
const NEAR_ENOUGH: f64 = 1e-4;

/// Negligible reduction if the cost is exact: 1e-9 of a standard deviation.
const EXACT_REDUCTION: f64 = 1e-18;

/// A few units in the last place.
const ROUNDING: f64 = 4.0 * f64::EPSILON;

/// Start values by position of the unknown, SI.
pub type Starts = Vec<(usize, f64)>;

/// A fit problem.
#[derive(Debug, Clone)]
pub struct OutputErrorProblem<'a> {
    /// The model; its directions are the possible free quantities.
    pub system: &'a dyn Model,
    /// All parameters, SI: values of fixed ones, first guesses of free ones.
    pub p: &'a [f64],
    /// Which of the directions are free.
    pub free: Vec<bool>,
    /// The recordings.
    pub recordings: &'a [Recording],
    /// For each output of the model, its noise; `None` if it is not fitted.
    pub noise: Vec<Option<NoiseSource>>,
    /// The priors.
    pub priors: Vec<Prior>,
    /// Loss function.
    pub loss: Loss,
    /// Integrator options.
    pub options: Options,
    /// The stopping rule.
    pub stopping: StoppingRule,
    /// A predicted reduction of Σ (e/σ)² below this fraction of its mean per degree of freedom also ends a fit: the
    /// distance from the minimum is then at most its root in standard deviations of the estimates, based on the current
    /// residuals.
    pub negligible_reduction: f64,
    /// Number of recordings simulated in parallel. Results do not depend on it.
    pub threads: usize,
    /// Progress and cancellation.
    pub watch: &'a dyn Monitor,
    /// A journal for simulations of fits, profiles and refits, and a digest of the model.
    pub keeping: JournalScope<'a>,
}

impl<'a> OutputErrorProblem<'a> {
    /// The problem without cancellation, for simulations that the result of a cancelled fit needs.
    #[must_use]
    pub fn unwatched(&self) -> Self {
        let options = Options { watched: None, ..self.options };
        OutputErrorProblem { options, ..self.clone() }
    }

    /// The problem with the final tolerances of its fit.
    #[must_use]
    pub fn as_fitted(&self, fit: &Fit) -> Self {
        let Options { rtol, atol, .. } = fit.options;
        OutputErrorProblem { options: Options { rtol, atol, ..self.options }, ..self.clone() }
    }

    /// A problem in which all directions are free and the noise of all outputs is estimated.
    pub fn new(system: &'a dyn Model, p: &'a [f64], recordings: &'a [Recording]) -> Self {
        let signature = system.signature();
        Self {
            system,
            p,
            free: vec![true; signature.directions.len()],
            recordings,
            noise: vec![Some(NoiseSource::Estimated); signature.outputs.len()],
            priors: Vec::new(),
            loss: Loss::default(),
            options: Options::default(),
            stopping: StoppingRule::default(),
            negligible_reduction: NEGLIGIBLE_REDUCTION,
            threads: 1,
            watch: &NoMonitor,
            keeping: JournalScope::NOTHING,
        }
    }
}

/// Estimates the free parameters and start values.
///
/// A parameter outside of its bounds starts at the nearer one. A minimum that was not reached is not an error:
/// [`Fit::termination`] reports it. A cancelled fit returns the best result so far, weighted with the current noise.
///
/// # Errors
///
/// [`EstimateError`]: nothing to estimate or to estimate from, or the first simulation fails.
pub fn fit(problem: &OutputErrorProblem<'_>) -> Result<Fit, EstimateError> {
    verify(problem)?;
    let (variables, mut z) =
        FitVariables::new(problem.system, problem.p, problem.recordings, &problem.free)?;
    let samples = samples(problem);
    let data = samples + effective_priors(problem, &variables);
    if variables.len() == 0 {
        return Err(EstimateError::NothingFree);
    }
    if samples == 0 {
        return Err(EstimateError::NothingMeasured);
    }
    if data < variables.len() {
        return Err(EstimateError::TooFewSamples { samples, free: variables.len() });
    }

    let digest_of_problem = problem.keeping.digest(|digest| {
        digest
            .debug(&"simulations of a fit")
            .debug(&problem.p)
            .debug(&problem.free)
            .debug(&problem.recordings)
    });
    let mut total = FitTotals::default();
    let problem = &readings::with_tolerance(problem, &variables, &z, &mut total);
    z = readings::closer(problem, &variables, z, data, digest_of_problem, &mut total)?;
    let mut accuracy = SteppingAccuracy::first(problem, &variables, &z)?;
    let mut last: Option<(SteppingAccuracy, EstimationEnd)> = None;
    let (accuracy, EstimationEnd { z, at, sigma }) = loop {
        let stepped = OutputErrorProblem { options: accuracy.applied(), ..problem.clone() };
        let ended = match estimate_by_loss(
            &stepped,
            &variables,
            z.clone(),
            data,
            digest_of_problem,
            &mut total,
        ) {
            Ok(ended) => ended,
            // The less accurate result is kept.
            Err(error) => break last.ok_or(error)?,
        };
        let next = accuracy.next(&problem.unwatched(), &variables, &ended.z, total.termination)?;
        let Some(next) = next else { break (accuracy, ended) };
        z.clone_from(&ended.z);
        last = Some((std::mem::replace(&mut accuracy, next), ended));
    };
    let stepped = OutputErrorProblem { options: accuracy.applied(), ..problem.clone() };
    Ok(finish(&stepped, &variables, &z, &at, &sigma, accuracy.stepping, total))
}

/// The end of an estimation.
struct EstimationEnd {
    z: Vec<f64>,
    at: WeightedSums,
    sigma: Vec<Option<f64>>,
}

/// Estimates with given steps from z on, via Huber's loss if that of the problem ignores remote outliers.
fn estimate_by_loss(
    problem: &OutputErrorProblem<'_>,
    variables: &FitVariables,
    z: Vec<f64>,
    data: usize,
    of: Option<Digest>,
    total: &mut FitTotals,
) -> Result<EstimationEnd, EstimateError> {
    if !problem.loss.is_redescending() {
        return estimate(problem, variables, z, data, of, total);
    }
    let convex = OutputErrorProblem { loss: Loss::Huber, ..problem.clone() };
    let ended = estimate(&convex, variables, z, data, of, total)?;
    if total.termination == Some(Termination::Flat) {
        return Ok(ended);
    }
    let EstimationEnd { z, sigma, .. } = ended;
    let noise = sigma.iter().map(|sigma| sigma.map(NoiseSource::Known)).collect();
    let known = OutputErrorProblem { noise, ..problem.clone() };
    // If the search was cancelled, this one ends before its second simulation.
    estimate(&known, variables, z, data, of, total)
}

/// Estimates with given steps and σ from z on. Simulations are stored under digests that begin with `debug`.
fn estimate(
    problem: &OutputErrorProblem<'_>,
    variables: &FitVariables,
    mut z: Vec<f64>,
    data: usize,
    of: Option<Digest>,
    total: &mut FitTotals,
) -> Result<EstimationEnd, EstimateError> {
    let is_squares = problem.loss == Loss::Squares;
    let patient = problem.unwatched();
    // Before the first simulation nothing can be in the journal.
    let is_first = total.beforehand + total.evaluations == 0;
    let beginning = if is_first { problem } else { &patient };
    let of_problem = |problem: &OutputErrorProblem<'_>, z: &[f64], sigma: &[Option<f64>]| {
        let simulated = || simulate_all(problem, variables, z, sigma);
        let Some(of) = of else { return simulated() };
        let key = of.debug(&problem.options).debug(&z);
        // Sums of squares do not depend on σ.
        let key = if is_squares { key } else { key.debug(&(problem.loss, sigma)) };
        kept_success(problem.keeping.journal, key.value(), simulated)
    };
    let simulated = |z: &[f64], sigma: &[Option<f64>]| of_problem(problem, z, sigma);
    let least = least_noise(problem);
    let mut sigma = if is_squares {
        first_noise(problem, &least)
    } else {
        noise_of_medians(beginning, variables, &z, &least, 1.0).map_err(EstimateError::Start)?
    };
    let bounds: Vec<(f64, f64)> = variables.all.iter().map(FitVariable::bounds).collect();
    let reach = variables.reach();
    let freedom = (data - variables.len()).max(1) as f64;
    // Without unknowns nothing is integrated, and the cost is exact up to rounding error.
    let is_exact = problem.system.signature().unknowns.is_empty();
    let reduction = if is_exact {
        EXACT_REDUCTION
    } else {
        problem.stopping.reduction.max(problem.negligible_reduction / freedom)
    };
    total.evaluations += 1;
    let first = of_problem(beginning, &z, &sigma).map_err(EstimateError::Start)?;
    let mut weighted = weigh(problem, variables, &z, &sigma, first);
    for round in 1.. {
        let left = problem.stopping.evaluations.saturating_sub(total.evaluations);
        let flat = unseen(problem.options.rtol).max(problem.stopping.flat);
        let until_a_step = match total.iterations {
            0 => problem.stopping.until_a_step.saturating_sub(total.evaluations),
            _ => 0,
        };
        let accuracy = if is_exact { rounding(problem, &sigma) } else { NEAR_ENOUGH / freedom };
        let rule = StoppingRule {
            reduction,
            evaluations: left,
            until_a_step,
            flat,
            accuracy: problem.stopping.accuracy.max(accuracy),
            ..problem.stopping
        };
        let region = VariableRegion { bounds: &bounds, reach: &reach, leading: variables.n_shared };
        let mut done = total.evaluations;
        let minimum = minimise_watched(z, weighted, region, &rule, problem.watch, |z| {
            let sums = simulated(z, &sigma);
            done += 1;
            let limit = Total::AtMost(problem.stopping.evaluations);
            problem.watch.advanced(Progress { what: "simulations", done, of: limit });
            Ok(weigh(problem, variables, z, &sigma, sums?))
        });
        let termination = minimum.termination;
        (z, weighted) = total.add(minimum);
        // An estimate at a bound uses no degree of freedom.
        let left = data.saturating_sub(variables.unheld(&z)).max(1);
        let spread = (data as f64 / left as f64).sqrt();
        let next = if is_squares {
            estimated_noise(problem, &weighted.sums, &sigma, &least, spread)
        } else {
            noise_of_medians(&patient, variables, &z, &least, spread)
                .map_err(EstimateError::Start)?
        };
        let stable = next.iter().zip(&sigma).all(|(next, sigma)| match (next, sigma) {
            (Some(next), Some(sigma)) => (next / sigma - 1.0).abs() <= STABLE,
            _ => true,
        });
        if stable || round == MOST_ROUNDS || !termination.is_converged() {
            break;
        }
        sigma = next;
        let sums = if is_squares {
            weighted.sums
        } else {
            total.evaluations += 1;
            of_problem(&patient, &z, &sigma).map_err(EstimateError::Start)?
        };
        weighted = weigh(problem, variables, &z, &sigma, sums);
    }
    Ok(EstimationEnd { z, at: weighted, sigma })
}

/// Start values of each recording from its samples before a time, at the parameters of the problem.
///
/// Those that are not free, or not determined by the samples, stay as they are; so do all if there are too few samples.
/// This is for validation recordings: the samples used here should not count in their errors
/// ([`Recording::counts_from`]), and [`counts_from`](super::counts_from) gives their number.
///
/// # Errors
///
/// As [`fit`].
pub fn fit_starts(
    problem: &OutputErrorProblem<'_>,
    before: &[f64],
) -> Result<Vec<Starts>, EstimateError> {
    WrongLength::verify("times of recordings", before.len(), problem.recordings.len())?;
    let directions = problem.system.signature().directions.iter();
    let free: Vec<bool> = directions
        .zip(&problem.free)
        .map(|(direction, free)| *free && matches!(direction, Direction::Start(_)))
        .collect();
    if !free.contains(&true) {
        return Ok(problem.recordings.iter().map(|recording| recording.start.clone()).collect());
    }
    let mut starts = Vec::with_capacity(problem.recordings.len());
    for (r, recording) in problem.recordings.iter().enumerate() {
        let head = [recording.head(before[r])];
        let of_head =
            OutputErrorProblem { recordings: &head, free: free.clone(), ..problem.clone() };
        match fit(&of_head) {
            Ok(fit) => starts.extend(fit.starts),
            Err(EstimateError::NothingMeasured | EstimateError::TooFewSamples { .. }) => {
                starts.push(recording.start.clone());
            }
            Err(EstimateError::Start(failed)) => {
                return Err(EstimateError::Start(TrialFailed { recording: r, ..failed }));
            }
            Err(error) => return Err(error),
        }
    }
    Ok(starts)
}

/// Simulated outputs, and their errors.
#[derive(Debug, Clone, PartialEq)]
pub struct OutputErrorEvaluation {
    /// Outputs at the sample times of each recording.
    pub observations: Vec<Observations>,
    /// Simulated against measured, by recording and output, including outputs that are not fitted.
    pub misfits: Vec<Vec<OutputMisfit>>,
    /// Σ (e/σ)² over outputs whose noise is known, without priors.
    pub cost: f64,
}

/// Simulates all recordings with given parameters and start values.
///
/// # Errors
///
/// [`TrialFailed`]: the first recording that cannot be simulated.
///
/// # Panics
///
/// If lengths do not match the model's signature, or `starts` does not have one element for each recording.
pub fn evaluate(
    problem: &OutputErrorProblem<'_>,
    p: &[f64],
    starts: &[Starts],
) -> Result<OutputErrorEvaluation, TrialFailed> {
    let OutputErrorProblem { system, recordings, options, threads, .. } = problem;
    assert_eq!(starts.len(), recordings.len(), "start values for each recording");
    let names = output_names(*system);
    let results = in_parallel_by_model(*system, recordings.len(), *threads, |system, r| {
        let recording = &recordings[r];
        outputs_of(system, recording, p, &starts[r], options, DerivativeUse::No).and_then(
            |observations| {
                let counting = vec![SampleWeighting::Squares; names.len()];
                let sums_of = SumsOf { columns: &[], counting: &counting };
                let sums = sums(recording, &observations, sums_of, |i| names[i].clone())?;
                Ok((observations, sums))
            },
        )
    });
    let (mut observations, mut sums) = (Vec::new(), Vec::new());
    for (recording, result) in results.into_iter().enumerate() {
        let (of_recording, sums_of) = result.map_err(|reason| TrialFailed { recording, reason })?;
        observations.push(of_recording);
        sums.push(sums_of);
    }
    let mut cost = 0.0;
    for of_recording in &sums {
        for (sums, noise) in of_recording.iter().zip(&problem.noise) {
            if let Some(NoiseSource::Known(sigma)) = noise {
                cost += sums.squares / (sigma * sigma);
            }
        }
    }
    Ok(OutputErrorEvaluation { observations, misfits: misfits(&sums), cost })
}

fn verify(problem: &OutputErrorProblem<'_>) -> Result<(), EstimateError> {
    let signature = problem.system.signature();
    let OutputErrorProblem { p, free, recordings, noise, .. } = problem;
    verify_lengths(signature, p, free, recordings, noise.len())?;
    for (output, noise) in signature.outputs.iter().zip(&problem.noise) {
        if let Some(NoiseSource::Known(sigma)) = *noise
            && !(sigma > 0.0 && sigma.is_finite())
        {
            return Err(EstimateError::Noise { output: output.name.to_string(), sigma });
        }
    }
    verify_readings(problem)
}

/// Checks readings against the noise of their outputs.
fn verify_readings(problem: &OutputErrorProblem<'_>) -> Result<(), EstimateError> {
    let outputs = problem.system.signature().outputs.iter().zip(&problem.noise).enumerate();
    let used = outputs.filter_map(|(i, (output, noise))| Some((i, &output.name, (*noise)?)));
    for (i, output, noise) in used {
        let is_log = match noise {
            NoiseSource::Known(_) | NoiseSource::Estimated => continue,
            NoiseSource::Recorded => false,
            NoiseSource::Density(density) | NoiseSource::Stabilised(density, _) => {
                density.distribution == Distribution::LogNormal
            }
        };
        if problem.loss != Loss::Squares {
            return Err(EstimateError::LossOfDensity { output: output.to_string() });
        }
        for (r, recording) in problem.recordings.iter().enumerate() {
            let deviation = |k: usize| recording.deviations_of(i).map_or(f64::NAN, |all| all[k]);
            let wrong = |(k, measured): (usize, f64)| match noise {
                NoiseSource::Recorded if !(deviation(k) > 0.0 && deviation(k).is_finite()) => {
                    Some((k, WrongReading::Deviation(deviation(k))))
                }
                _ if is_log && measured <= 0.0 => Some((k, WrongReading::NotPositive(measured))),
                _ => None,
            };
            if let Some((k, wrong)) = recording.counted(i).find_map(wrong) {
                let (output, t) = (output.to_string(), recording.times[k]);
                return Err(EstimateError::Reading { output, recording: r, t, wrong });
            }
        }
    }
    Ok(())
}

/// Samples of fitted outputs that count.
fn samples(problem: &OutputErrorProblem<'_>) -> usize {
    let outputs = || (0..problem.noise.len()).filter(|i| problem.noise[*i].is_some());
    let of_recording =
        |recording: &Recording| outputs().map(|i| recording.counted(i).count()).sum::<usize>();
    problem.recordings.iter().map(of_recording).sum()
}

/// Relative accuracy of a sum of squares whose errors are exact up to rounding: the rounding error of a reading
/// relative to errors of the size σ.
fn rounding(problem: &OutputErrorProblem<'_>, sigma: &[Option<f64>]) -> f64 {
    let of_output = |(i, sigma): (usize, &Option<f64>)| {
        let readings = problem.recordings.iter().flat_map(|recording| recording.counted(i));
        let (n, squares) = readings.fold((0.0, 0.0), |(n, sum), (_, y)| (n + 1.0, sum + y * y));
        sigma.filter(|_| n > 0.0).map(|sigma| f64::sqrt(squares / n) / sigma)
    };
    let largest = sigma.iter().enumerate().filter_map(of_output).fold(1.0, f64::max);
    ROUNDING * largest
}

/// The smallest significant noise of each output.
pub(crate) fn least_noise(problem: &OutputErrorProblem<'_>) -> Vec<f64> {
    let outputs = problem.system.signature().outputs.iter().enumerate();
    let rtol = problem.options.rtol;
    outputs
        .map(|(i, output)| noise::least(problem.recordings, i, rtol, output.unit.factor))
        .collect()
}

/// Initial σ; `None` for outputs that are not fitted.
fn first_noise(problem: &OutputErrorProblem<'_>, least: &[f64]) -> Vec<Option<f64>> {
    let first_sigma = |(i, noise): (usize, &Option<NoiseSource>)| match (*noise)? {
        NoiseSource::Known(sigma) => Some(sigma),
        // Likelihood contributions include σ in the sums.
        NoiseSource::Density(_) | NoiseSource::Recorded | NoiseSource::Stabilised(..) => Some(1.0),
        NoiseSource::Estimated => {
            Some(noise::scatter(problem.recordings, i).unwrap_or(0.0).max(least[i]))
        }
    };
    problem.noise.iter().enumerate().map(first_sigma).collect()
}

/// σ from the median absolute error, if it is to be estimated: robust to outliers.
fn noise_of_medians(
    problem: &OutputErrorProblem<'_>,
    variables: &FitVariables,
    z: &[f64],
    least: &[f64],
    spread: f64,
) -> Result<Vec<Option<f64>>, TrialFailed> {
    let is_estimated = |noise: &Option<NoiseSource>| *noise == Some(NoiseSource::Estimated);
    let observations = if problem.noise.iter().any(is_estimated) {
        let p = variables.parameters(problem.p, z);
        let recordings = problem.recordings.iter().enumerate();
        let starts: Vec<Starts> =
            recordings.map(|(r, recording)| variables.starts(r, &recording.start, z)).collect();
        evaluate(problem, &p, &starts)?.observations
    } else {
        Vec::new()
    };
    let sigma_of = |(i, noise): (usize, &Option<NoiseSource>)| match (*noise)? {
        NoiseSource::Known(sigma) => Some(sigma),
        // Likelihood contributions include σ in the sums.
        NoiseSource::Density(_) | NoiseSource::Recorded | NoiseSource::Stabilised(..) => Some(1.0),
        NoiseSource::Estimated => {
            let recordings = problem.recordings.iter().zip(&observations);
            let sizes = recordings.flat_map(|(recording, simulated)| {
                recording.counted(i).map(move |(k, measured)| (simulated.w(k)[i] - measured).abs())
            });
            Some(loss::scale(sizes.collect()).unwrap_or(0.0) * spread)
                .map(|sigma| sigma.max(least[i]))
        }
    };
    Ok(problem.noise.iter().enumerate().map(sigma_of).collect())
}

/// σ from the residuals, if it is to be estimated.
fn estimated_noise(
    problem: &OutputErrorProblem<'_>,
    sums: &[Vec<OutputSums>],
    sigma: &[Option<f64>],
    least: &[f64],
    spread: f64,
) -> Vec<Option<f64>> {
    let sigma_of = |(i, noise): (usize, &Option<NoiseSource>)| match (*noise)? {
        NoiseSource::Known(sigma) => Some(sigma),
        // Likelihood contributions include σ in the sums.
        NoiseSource::Density(_) | NoiseSource::Recorded | NoiseSource::Stabilised(..) => Some(1.0),
        NoiseSource::Estimated => {
            noise::of_residuals(sums, i, spread).map(|next| next.max(least[i])).or(sigma[i])
        }
    };
    problem.noise.iter().enumerate().map(sigma_of).collect()
}
