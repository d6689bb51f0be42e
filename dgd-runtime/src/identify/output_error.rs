//! Fits by simulation error.
//!
//! Every recording is simulated from its start, with nothing corrected on the way; what the
//! simulated outputs differ from the measured ones by is made small in the weighted least-squares
//! sense, by [`minimise`] with the model's sensitivities.
//!
//! Samples without a measurement are left out. Where sensitivities are undefined
//! ([`UndefinedSensitivity`](crate::UndefinedSensitivity)) the samples stay in the cost, so that
//! no trial is accepted that fits them worse, and have no part in the search direction or the
//! covariance: leaving them out of the cost would reward parameters that lose sensitivities early.
//! [`Fit::samples_without_sensitivity`] counts them.
//!
//! The normal matrix has the shape of an arrow, one block shared by all recordings and one for
//! each. Recordings are summed in their order, whatever thread simulated them.

use crate::identify::error::{EstimateError, TrialFailed, TrialFailure};
use crate::identify::levenberg_marquardt::{
    Minimum, NormalEquations, StoppingRule, Termination, minimise,
};
use crate::identify::noise::{self, Noise};
use crate::identify::parallel::in_parallel;
use crate::identify::recording::{Derivatives, Misfit, Recording, Sums, outputs_of, sums};
use crate::identify::uncertainty::{Correlated, Estimate, Uncertainty, Undetermined};
use crate::identify::variables::{Variable, Variables};
use crate::observe::Observations;
use crate::problem::Options;
use crate::system::{Direction, System};

/// Most fits with re-estimated noise.
const MOST_ROUNDS: usize = 6;

/// Noise that changes by less than this part is stable: a weight enters the estimates in second
/// order only.
const STABLE: f64 = 0.01;

/// A promised reduction of Σ (e/σ)² below this, per degree of freedom, ends a fit: the estimates are
/// then within √1e-6 of their standard deviations from the minimum.
const NEGLIGIBLE_REDUCTION: f64 = 1e-6;

/// Start values by position of the unknown, SI.
pub type Starts = Vec<(usize, f64)>;

/// What is known of a parameter beforehand.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Prior {
    /// Position of the parameter.
    pub parameter: usize,
    /// Mean, SI.
    pub mean: f64,
    /// Standard deviation, SI.
    pub std: f64,
}

/// What to fit to what.
#[derive(Debug, Clone)]
pub struct OutputErrorProblem<'a, S> {
    /// The model; its directions are what can be free.
    pub system: &'a S,
    /// All parameters, SI: values of those that are not free, first guesses of the others.
    pub p: &'a [f64],
    /// Which of the directions are free.
    pub free: Vec<bool>,
    /// What was recorded.
    pub recordings: &'a [Recording],
    /// For each output of the model, its noise; `None` for one that is not to be fitted.
    pub noise: Vec<Option<Noise>>,
    /// What is known beforehand.
    pub priors: Vec<Prior>,
    /// How to integrate.
    pub options: Options,
    /// When to stop.
    pub stopping: StoppingRule,
    /// How many recordings are simulated at a time. Results do not depend on it.
    pub threads: usize,
}

impl<'a, S: System> OutputErrorProblem<'a, S> {
    /// A problem in which all directions are free and the noise of all outputs is estimated.
    pub fn new(system: &'a S, p: &'a [f64], recordings: &'a [Recording]) -> Self {
        let signature = system.signature();
        Self {
            system,
            p,
            free: vec![true; signature.directions.len()],
            recordings,
            noise: vec![Some(Noise::Estimated); signature.outputs.len()],
            priors: Vec::new(),
            options: Options::default(),
            stopping: StoppingRule::default(),
            threads: 1,
        }
    }
}

/// Estimated parameters and start values, and how well they are known.
#[derive(Debug, Clone)]
pub struct Fit {
    /// All parameters, SI.
    pub p: Vec<f64>,
    /// Start values that replace the model's, for each recording.
    pub starts: Vec<Starts>,
    /// What was estimated: parameters, then the start values of each recording.
    pub estimates: Vec<Estimate>,
    /// Changes of the estimates that no output sees.
    pub undetermined: Vec<Undetermined>,
    /// σ of each output as the fit weighted it, SI; `None` where an output was not fitted.
    pub noise: Vec<Option<f64>>,
    /// Σ (e/σ)², priors included.
    pub cost: f64,
    /// Samples that count, of all fitted outputs.
    pub samples: usize,
    /// Those of them that the search direction knows nothing of.
    pub samples_without_sensitivity: usize,
    /// Samples and priors less estimates that are not at a bound.
    pub degrees_of_freedom: usize,
    /// −2 ln of the likelihood: Σ n ln(2πσ²) + Σ (e/σ)². Comparable between fits to the same
    /// samples, whatever their noise.
    pub deviance: f64,
    /// Simulated against measured, by recording and output, those that are not fitted too.
    pub misfits: Vec<Vec<Misfit>>,
    /// Accepted steps.
    pub iterations: usize,
    /// Simulations of all recordings.
    pub evaluations: usize,
    /// Trials that could not be simulated.
    pub failures: usize,
    /// Why the last of them could not.
    pub last_failure: Option<TrialFailed>,
    /// Why the fit ended.
    pub termination: Termination,
    uncertainty: Uncertainty,
    slopes: Vec<f64>,
}

impl Fit {
    /// Covariance of two estimates, SI; `None` where one of them is at a bound or not determined.
    pub fn covariance(&self, i: usize, j: usize) -> Option<f64> {
        Some(self.uncertainty.covariance(i, j)? * self.slopes[i] * self.slopes[j])
    }

    /// Correlation of the errors of two estimates.
    pub fn correlation(&self, i: usize, j: usize) -> Option<f64> {
        let of = |i, j| self.uncertainty.covariance(i, j);
        Some(of(i, j)? / (of(i, i)? * of(j, j)?).sqrt())
    }

    /// Pairs of estimates whose errors are correlated by more than `least`.
    pub fn correlated(&self, least: f64) -> Vec<Correlated> {
        let n = self.estimates.len();
        let pairs = (0..n).flat_map(|i| (i + 1..n).map(move |j| (i, j)));
        pairs
            .filter_map(|(first, second)| {
                let correlation = self.correlation(first, second)?;
                (correlation.abs() > least).then_some(Correlated { first, second, correlation })
            })
            .collect()
    }

    /// Σ (e/σ)² per degree of freedom: 1 where the model is true and the noise known; `None` without
    /// degrees of freedom.
    pub fn reduced_chi_square(&self) -> Option<f64> {
        (self.degrees_of_freedom > 0).then(|| self.cost / self.degrees_of_freedom as f64)
    }
}

/// Estimates the free parameters and start values.
///
/// A parameter outside of its bounds starts at the nearer one. A minimum that was not reached is no
/// error: [`Fit::termination`] says so.
///
/// # Errors
///
/// [`EstimateError`]: nothing to estimate or to estimate from, or the first simulation fails.
///
/// # Panics
///
/// When lengths are not those of the model's signature.
pub fn fit<S: System + Clone + Send>(
    problem: &OutputErrorProblem<'_, S>,
) -> Result<Fit, EstimateError> {
    verify(problem)?;
    let (variables, mut z) =
        Variables::new(problem.system, problem.p, problem.recordings, &problem.free)?;
    let samples = samples(problem);
    let data = samples + problem.priors.len();
    if variables.len() == 0 {
        return Err(EstimateError::NothingFree);
    }
    if samples == 0 {
        return Err(EstimateError::NothingMeasured);
    }
    if data < variables.len() {
        return Err(EstimateError::TooFewSamples { samples, free: variables.len() });
    }

    let least = least_noise(problem);
    let mut sigma = first_noise(problem, &least);
    let bounds: Vec<(f64, f64)> = variables.all.iter().map(Variable::bounds).collect();
    let freedom = (data - variables.len()).max(1) as f64;
    let reduction = problem.stopping.reduction.max(NEGLIGIBLE_REDUCTION / freedom);
    let mut total = Total { evaluations: 1, ..Total::default() };
    let first = simulate_all(problem, &variables, &z).map_err(EstimateError::Start)?;
    let mut at = weigh(problem, &variables, &z, &sigma, first);
    for round in 1.. {
        let left = problem.stopping.evaluations.saturating_sub(total.evaluations);
        let rule = StoppingRule { reduction, evaluations: left, ..problem.stopping };
        let minimum = minimise(z, at, &bounds, &rule, |z| {
            let sums = simulate_all(problem, &variables, z)?;
            Ok(weigh(problem, &variables, z, &sigma, sums))
        });
        let termination = minimum.termination;
        (z, at) = total.add(minimum);
        let spread = (data as f64 / freedom).sqrt();
        let next = estimated_noise(problem, &at.sums, &sigma, &least, spread);
        let stable = next.iter().zip(&sigma).all(|(next, sigma)| match (next, sigma) {
            (Some(next), Some(sigma)) => (next / sigma - 1.0).abs() <= STABLE,
            _ => true,
        });
        if stable || round == MOST_ROUNDS || !termination.is_converged() {
            break;
        }
        sigma = next;
        at = weigh(problem, &variables, &z, &sigma, at.sums);
    }
    Ok(finish(problem, &variables, &z, &at, sigma, total))
}

/// The best of fits that start from several points, and which it was.
///
/// Each point gives values to some parameters, by position, SI; the others start as in `problem`.
/// The fit with the least [`Fit::deviance`] is the best, the first of equals.
///
/// # Errors
///
/// That of the first point, where no fit from any point succeeds.
///
/// # Panics
///
/// As [`fit`], and without points.
pub fn fit_from<S: System + Clone + Send>(
    problem: &OutputErrorProblem<'_, S>,
    points: &[Starts],
) -> Result<(usize, Fit), EstimateError> {
    assert!(!points.is_empty(), "a fit starts somewhere");
    let mut best: Option<(usize, Fit)> = None;
    let mut first_error = None;
    for (k, point) in points.iter().enumerate() {
        let mut p = problem.p.to_vec();
        for &(i, value) in point {
            p[i] = value;
        }
        match fit(&OutputErrorProblem { p: &p, ..problem.clone() }) {
            Ok(fit) => {
                if best.as_ref().is_none_or(|(_, best)| fit.deviance < best.deviance) {
                    best = Some((k, fit));
                }
            }
            Err(error) => {
                first_error.get_or_insert(error);
            }
        }
    }
    match (best, first_error) {
        (Some(best), _) => Ok(best),
        (None, Some(error)) => Err(error),
        (None, None) => unreachable!("every point gives a fit or an error"),
    }
}

/// Start values of each recording from its first `seconds`, at the parameters of the problem.
///
/// Those that are not free, and what the samples do not determine, stay as they are; so do all where
/// there are too few samples. For held-out
/// recordings: what was used here should not count in their errors ([`Recording::counts_from`]).
///
/// # Errors
///
/// As [`fit`].
pub fn fit_starts<S: System + Clone + Send>(
    problem: &OutputErrorProblem<'_, S>,
    seconds: f64,
) -> Result<Vec<Starts>, EstimateError> {
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
        let first = recording.times.first().copied().unwrap_or(0.0);
        let head = [recording.head(first + seconds)];
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

/// Simulated outputs, and how far they are from what was measured.
#[derive(Debug, Clone, PartialEq)]
pub struct Evaluation {
    /// Outputs at the sample times of each recording.
    pub observations: Vec<Observations>,
    /// Simulated against measured, by recording and output, those that are not fitted too.
    pub misfits: Vec<Vec<Misfit>>,
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
/// When lengths are not those of the model's signature, or `starts` is not one for each recording.
pub fn evaluate<S: System + Clone + Send>(
    problem: &OutputErrorProblem<'_, S>,
    p: &[f64],
    starts: &[Starts],
) -> Result<Evaluation, TrialFailed> {
    let OutputErrorProblem { system, recordings, options, threads, .. } = problem;
    assert_eq!(starts.len(), recordings.len(), "start values for each recording");
    let names = output_names(*system);
    let results = in_parallel(*system, recordings.len(), *threads, |system, r| {
        let recording = &recordings[r];
        outputs_of(system, recording, p, &starts[r], options, Derivatives::No)
            .map_err(TrialFailure::Simulation)
            .and_then(|observations| {
                let sums = sums(recording, &observations, &[], |i| names[i].clone())?;
                Ok((observations, sums))
            })
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
            if let Some(Noise::Known(sigma)) = noise {
                cost += sums.squares / (sigma * sigma);
            }
        }
    }
    Ok(Evaluation { observations, misfits: misfits(&sums), cost })
}

/// Sums of all recordings with their weights.
struct Weighted {
    normal: NormalEquations,
    sums: Vec<Vec<Sums>>,
}

impl AsRef<NormalEquations> for Weighted {
    fn as_ref(&self) -> &NormalEquations {
        &self.normal
    }
}

/// What several minimisations did together.
#[derive(Default)]
struct Total {
    iterations: usize,
    evaluations: usize,
    failures: usize,
    last_failure: Option<TrialFailed>,
    termination: Option<Termination>,
}

impl Total {
    fn add<T>(&mut self, minimum: Minimum<T, TrialFailed>) -> (Vec<f64>, T) {
        self.iterations += minimum.iterations;
        self.evaluations += minimum.evaluations;
        self.failures += minimum.failures;
        self.last_failure = minimum.last_failure.or_else(|| self.last_failure.take());
        self.termination = Some(minimum.termination);
        (minimum.x, minimum.at)
    }
}

fn verify<S: System>(problem: &OutputErrorProblem<'_, S>) -> Result<(), EstimateError> {
    let signature = problem.system.signature();
    assert_eq!(problem.p.len(), signature.parameters.len(), "number of parameters");
    assert_eq!(problem.free.len(), signature.directions.len(), "number of directions");
    assert_eq!(problem.noise.len(), signature.outputs.len(), "number of outputs");
    for recording in problem.recordings {
        assert_eq!(recording.measured.len(), signature.outputs.len(), "number of outputs");
        let lengths = recording.measured.iter().flatten().map(Vec::len);
        assert!(lengths.into_iter().all(|len| len == recording.times.len()), "number of samples");
    }
    for (output, noise) in signature.outputs.iter().zip(&problem.noise) {
        if let Some(Noise::Known(sigma)) = *noise
            && !(sigma > 0.0 && sigma.is_finite())
        {
            return Err(EstimateError::Noise { output: output.name.to_string(), sigma });
        }
    }
    Ok(())
}

/// Samples of fitted outputs that count.
fn samples<S: System>(problem: &OutputErrorProblem<'_, S>) -> usize {
    let outputs = || (0..problem.noise.len()).filter(|i| problem.noise[*i].is_some());
    let of_recording =
        |recording: &Recording| outputs().map(|i| recording.counted(i).count()).sum::<usize>();
    problem.recordings.iter().map(of_recording).sum()
}

fn least_noise<S: System>(problem: &OutputErrorProblem<'_, S>) -> Vec<f64> {
    let outputs = problem.system.signature().outputs.iter().enumerate();
    let rtol = problem.options.rtol;
    outputs
        .map(|(i, output)| noise::least(problem.recordings, i, rtol, output.unit.factor))
        .collect()
}

/// σ to begin with; `None` for what is not fitted.
fn first_noise<S: System>(problem: &OutputErrorProblem<'_, S>, least: &[f64]) -> Vec<Option<f64>> {
    let of = |(i, noise): (usize, &Option<Noise>)| match (*noise)? {
        Noise::Known(sigma) => Some(sigma),
        Noise::Estimated => {
            Some(noise::scatter(problem.recordings, i).unwrap_or(0.0).max(least[i]))
        }
    };
    problem.noise.iter().enumerate().map(of).collect()
}

/// σ from the residuals, where it is to be estimated.
fn estimated_noise<S: System>(
    problem: &OutputErrorProblem<'_, S>,
    sums: &[Vec<Sums>],
    sigma: &[Option<f64>],
    least: &[f64],
    spread: f64,
) -> Vec<Option<f64>> {
    let of = |(i, noise): (usize, &Option<Noise>)| match (*noise)? {
        Noise::Known(sigma) => Some(sigma),
        Noise::Estimated => {
            noise::of_residuals(sums, i, spread).map(|next| next.max(least[i])).or(sigma[i])
        }
    };
    problem.noise.iter().enumerate().map(of).collect()
}

/// Sums over the samples of all recordings at z.
fn simulate_all<S: System + Clone + Send>(
    problem: &OutputErrorProblem<'_, S>,
    variables: &Variables,
    z: &[f64],
) -> Result<Vec<Vec<Sums>>, TrialFailed> {
    let OutputErrorProblem { system, recordings, options, threads, .. } = problem;
    let p = variables.parameters(problem.p, z);
    let names = output_names(*system);
    let results = in_parallel(*system, recordings.len(), *threads, |system, r| {
        let recording = &recordings[r];
        let start = variables.starts(r, &recording.start, z);
        let observations = outputs_of(system, recording, &p, &start, options, Derivatives::Yes)
            .map_err(TrialFailure::Simulation)?;
        let columns = variables.columns(r, z);
        sums(recording, &observations, &columns, |i| names[i].clone())
    });
    let failed = |(recording, result): (usize, Result<Vec<Sums>, TrialFailure>)| {
        result.map_err(|reason| TrialFailed { recording, reason })
    };
    results.into_iter().enumerate().map(failed).collect()
}

/// Weighs and adds up: recordings in their order, outputs in theirs, then priors.
fn weigh<S: System>(
    problem: &OutputErrorProblem<'_, S>,
    variables: &Variables,
    z: &[f64],
    sigma: &[Option<f64>],
    sums: Vec<Vec<Sums>>,
) -> Weighted {
    let mut normal = NormalEquations::zeros(variables.len());
    let own = variables.n_shared + variables.n_start;
    for (r, of_recording) in sums.iter().enumerate() {
        for (sums, sigma) in of_recording.iter().zip(sigma) {
            let Some(sigma) = sigma else { continue };
            let weight = 1.0 / (sigma * sigma);
            normal.cost += weight * sums.squares;
            for i in 0..own {
                let row = variables.position(r, i);
                normal.gradient[row] += weight * sums.gradient[i];
                for j in 0..=i {
                    let column = variables.position(r, j);
                    normal.information[(row, column)] += weight * sums.information[i * own + j];
                }
            }
        }
    }
    for prior in &problem.priors {
        let of = Direction::Parameter(prior.parameter);
        let Some(i) = variables.all.iter().position(|variable| variable.of == of) else { continue };
        let variable = &variables.all[i];
        let (r, slope) =
            ((variable.value(z[i]) - prior.mean) / prior.std, variable.slope(z[i]) / prior.std);
        normal.cost += r * r;
        normal.gradient[i] += slope * r;
        normal.information[(i, i)] += slope * slope;
    }
    normal.information.fill_upper_triangle_with_lower_triangle();
    Weighted { normal, sums }
}

fn finish<S: System>(
    problem: &OutputErrorProblem<'_, S>,
    variables: &Variables,
    z: &[f64],
    at: &Weighted,
    sigma: Vec<Option<f64>>,
    total: Total,
) -> Fit {
    let signature = problem.system.signature();
    let bounds: Vec<_> =
        variables.all.iter().zip(z).map(|(variable, z)| variable.bound(*z)).collect();
    let held: Vec<bool> = bounds.iter().map(Option::is_some).collect();
    let uncertainty = Uncertainty::new(&at.normal.information, &held, unseen(problem.options.rtol));
    let slopes: Vec<f64> =
        variables.all.iter().zip(z).map(|(variable, z)| variable.slope(*z)).collect();
    let estimates = (0..variables.len())
        .map(|i| Estimate {
            name: variables.name(signature, i),
            of: variables.all[i].of,
            recording: variables.all[i].recording,
            value: variables.all[i].value(z[i]),
            std: uncertainty.covariance(i, i).map(|variance| variance.sqrt() * slopes[i]),
            at_bound: bounds[i],
        })
        .collect();

    let fitted = || {
        let all = at.sums.iter().flat_map(|of_recording| of_recording.iter().zip(&sigma));
        all.filter_map(|(sums, sigma)| Some((sums, (*sigma)?)))
    };
    let samples: usize = fitted().map(|(sums, _)| sums.samples).sum();
    let logarithms: f64 = fitted()
        .map(|(sums, sigma)| sums.samples as f64 * (std::f64::consts::TAU * sigma * sigma).ln())
        .sum();
    let free = held.iter().filter(|held| !**held).count();
    Fit {
        p: variables.parameters(problem.p, z),
        starts: (0..problem.recordings.len())
            .map(|r| variables.starts(r, &problem.recordings[r].start, z))
            .collect(),
        estimates,
        undetermined: uncertainty.undetermined.clone(),
        cost: at.normal.cost,
        samples,
        samples_without_sensitivity: fitted().map(|(sums, _)| sums.without_sensitivity).sum(),
        degrees_of_freedom: (samples + problem.priors.len()).saturating_sub(free),
        deviance: logarithms + at.normal.cost,
        misfits: misfits(&at.sums),
        iterations: total.iterations,
        evaluations: total.evaluations,
        failures: total.failures,
        last_failure: total.last_failure,
        termination: total.termination.unwrap_or(Termination::EvaluationLimit),
        noise: sigma,
        uncertainty,
        slopes,
    }
}

/// Eigenvalues of JᵀJ below this part of the largest are not told from zero: sensitivities are
/// known to some ten times the tolerance, and enter in squares.
fn unseen(rtol: f64) -> f64 {
    (10.0 * rtol).powi(2).max(1e-13)
}

fn misfits(sums: &[Vec<Sums>]) -> Vec<Vec<Misfit>> {
    let of = |sums: &Sums| Misfit { samples: sums.samples, squares: sums.squares };
    sums.iter().map(|of_recording| of_recording.iter().map(of).collect()).collect()
}

fn output_names<S: System>(system: &S) -> Vec<String> {
    system.signature().outputs.iter().map(|output| output.name.to_string()).collect()
}
