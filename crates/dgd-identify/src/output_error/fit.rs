//! The result of a fit.

use dgd_runtime::Options;
use dgd_runtime::signature::Distribution;

use crate::error::TrialFailed;
use crate::minimise::trust_region::{Minimum, Termination};
use crate::noise::NoiseSource;
use crate::noise::loss::Loss;
use crate::output_error::stepping::FitStepping;
use crate::output_error::weighing::{
    WeightedSums, curvature_and_influence, effective_priors, information, misfits,
};
use crate::output_error::{OutputErrorProblem, Starts, least_noise};
use crate::recording::{OutputMisfit, OutputSums};
use crate::uncertainty::{CorrelatedPair, ParameterEstimate, Uncertainty, UndeterminedDirection};
use crate::variables::FitVariables;

/// Estimated parameters and start values, with their uncertainty.
#[derive(Debug, Clone)]
pub struct Fit {
    /// All parameters, SI.
    pub p: Vec<f64>,
    /// Start values that replace the model's, for each recording.
    pub starts: Vec<Starts>,
    /// The estimates: parameters, then the start values of each recording.
    pub estimates: Vec<ParameterEstimate>,
    /// Changes of the estimates that affect no output.
    pub undetermined: Vec<UndeterminedDirection>,
    /// σ of each output as weighted by the fit, SI; `None` if an output was not fitted. If samples have individual σ,
    /// the root of their mean square.
    pub noise: Vec<Option<f64>>,
    /// Loss function.
    pub loss: Loss,
    /// Σ ρ(e/σ), including priors: Σ (e/σ)² for squares. For outputs that contribute by their likelihood, the terms
    /// that depend on residuals.
    pub cost: f64,
    /// Samples that count, of all fitted outputs.
    pub samples: usize,
    /// Downweighted samples by output, those with less than half the weight under a loss other than squares.
    pub light_samples: Vec<usize>,
    /// Samples without sensitivities, which the search direction ignores.
    pub samples_without_sensitivity: usize,
    /// Samples and priors less estimates that are not at a bound.
    pub degrees_of_freedom: usize,
    /// −2 ln of the likelihood: Σ n ln(2πσ²) + Σ ρ(e/σ), with estimated σ at its minimum, √(Σ e²/n). Comparable between
    /// fits to the same samples with the same loss, whatever their noise.
    pub deviance: f64,
    /// Simulated against measured, by recording and output, including outputs that are not fitted.
    pub misfits: Vec<Vec<OutputMisfit>>,
    /// Accepted steps.
    pub iterations: usize,
    /// Simulations of all recordings.
    pub evaluations: usize,
    /// Trials that could not be simulated.
    pub failures: usize,
    /// The reason why the last of them could not.
    pub last_failure: Option<TrialFailed>,
    /// The steps of its simulations.
    pub stepping: FitStepping,
    /// Options of its simulations: tolerances are tighter than those of the problem if the search had stalled with
    /// these.
    pub options: Options,
    /// Why the fit ended.
    pub termination: Termination,
    /// Information criteria; `None` for a loss other than squares, whose value is not a likelihood, and with priors,
    /// which constrain parameters only partially.
    pub criteria: Option<Criteria>,
    /// Whether readings of some output have Student's distribution, so that squares do not measure the misfit.
    has_tails: bool,
    uncertainty: Uncertainty,
    slopes: Vec<f64>,
}

/// Criteria for comparing models fitted to the same samples: the lower the better.
///
/// With D the deviance, n samples, and k estimates that are not at a bound, including estimated noise levels:
///
/// Akaike, IEEE TAC 19 (1974) 716; Hurvich, Tsai, Biometrika 76 (1989) 297; Schwarz, Ann. Stat. 6 (1978) 461.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Criteria {
    /// D + 2 k.
    pub aic: f64,
    /// AIC corrected for small samples: D + 2 k n/(n − k − 1); `None` if n ≤ k + 1.
    pub aicc: Option<f64>,
    /// D + k ln n.
    pub bic: f64,
}

impl Criteria {
    fn new(deviance: f64, samples: usize, estimates: usize) -> Self {
        let (n, k) = (samples as f64, estimates as f64);
        Self {
            aic: deviance + 2.0 * k,
            aicc: (n > k + 1.0).then(|| deviance + 2.0 * k * n / (n - k - 1.0)),
            bic: deviance + k * n.ln(),
        }
    }
}

impl Fit {
    /// Options of its simulations, with the cancellation of these options.
    pub(crate) fn simulated(&self, options: &Options) -> Options {
        Options { watched: options.watched, ..self.options }
    }

    /// Scale of changes of an estimate, SI: its value for a parameter with `log`, otherwise the size of the quantity.
    /// Positive.
    pub(crate) fn size(&self, i: usize) -> f64 {
        self.slopes[i].abs()
    }

    /// Covariance of two estimates, SI; `None` if one of them is at a bound or not determined.
    pub fn covariance(&self, i: usize, j: usize) -> Option<f64> {
        Some(self.uncertainty.covariance(i, j)? * self.slopes[i] * self.slopes[j])
    }

    /// Covariance over the combinations that outputs determine, where single estimates may be undetermined; 0 at a
    /// bound.
    pub(crate) fn seen_covariance(&self, i: usize, j: usize) -> f64 {
        self.uncertainty.seen[(i, j)] * self.slopes[i] * self.slopes[j]
    }

    /// The weight of an error of an output, SI, under the loss: 1 for squares and for outputs that are not fitted.
    pub fn weight(&self, output: usize, e: f64) -> f64 {
        self.noise[output].map_or(1.0, |sigma| self.loss.evaluate(e / sigma).weight)
    }

    /// The rise of −2 ln of the likelihood that corresponds to a rise of Σ ρ along an estimate, as a factor; 1 for
    /// squares.
    ///
    /// Σ ρ rises by (θ − θ̂)²/(H⁻¹)ᵢᵢ, and the variance of θ̂ is (H⁻¹ G H⁻¹)ᵢᵢ.
    pub(crate) fn worth(&self, i: usize) -> f64 {
        self.uncertainty.worth[i]
    }

    /// Drops the standard errors: if the noise is unknown, so are these.
    pub fn forget_uncertainty(&mut self) {
        self.uncertainty.forget(&mut self.estimates);
    }

    /// Correlation of the errors of two estimates.
    pub fn correlation(&self, i: usize, j: usize) -> Option<f64> {
        let covariance = |i, j| self.uncertainty.covariance(i, j);
        Some(covariance(i, j)? / (covariance(i, i)? * covariance(j, j)?).sqrt())
    }

    /// Pairs of estimates whose errors have a correlation above `least`.
    pub fn correlated(&self, least: f64) -> Vec<CorrelatedPair> {
        let n = self.estimates.len();
        let pairs = (0..n).flat_map(|i| (i + 1..n).map(move |j| (i, j)));
        pairs
            .filter_map(|(first, second)| {
                let correlation = self.correlation(first, second)?;
                (correlation.abs() > least).then_some(CorrelatedPair { first, second, correlation })
            })
            .collect()
    }

    /// Reduced χ²: 1 if the model is true and the noise known; `None` without degrees of freedom, under a loss other
    /// than squares, and for readings with Student's distribution.
    pub fn reduced_chi_square(&self) -> Option<f64> {
        let is_squares = self.loss == Loss::Squares && !self.has_tails;
        let is_known = self.degrees_of_freedom > 0 && is_squares;
        is_known.then(|| self.cost / self.degrees_of_freedom as f64)
    }
}

/// Totals over several minimisations.
#[derive(Default)]
pub(crate) struct FitTotals {
    pub iterations: usize,
    /// Simulations before the search, which do not count towards its limit.
    pub beforehand: usize,
    pub evaluations: usize,
    pub failures: usize,
    pub last_failure: Option<TrialFailed>,
    pub termination: Option<Termination>,
}

impl FitTotals {
    /// Adds a minimisation, and returns its end point.
    pub(crate) fn add<T>(&mut self, minimum: Minimum<T, TrialFailed>) -> (Vec<f64>, T) {
        self.iterations += minimum.iterations;
        self.evaluations += minimum.evaluations;
        self.failures += minimum.failures;
        self.last_failure = minimum.last_failure.or_else(|| self.last_failure.take());
        self.termination = Some(minimum.termination);
        (minimum.x, minimum.at)
    }
}

/// The fit that ended at z.
pub(crate) fn finish(
    problem: &OutputErrorProblem<'_>,
    variables: &FitVariables,
    z: &[f64],
    at: &WeightedSums,
    sigma: &[Option<f64>],
    stepping: FitStepping,
    total: FitTotals,
) -> Fit {
    let signature = problem.system.signature();
    let bounds: Vec<_> =
        variables.all.iter().zip(z).map(|(variable, z)| variable.bound(*z)).collect();
    let is_fixed: Vec<bool> = bounds.iter().map(Option::is_some).collect();
    let cutoff = unseen(problem.options.rtol);
    let uncertainty = if problem.loss == Loss::Squares {
        Uncertainty::new(&information(problem, variables, z, at), &is_fixed, cutoff)
    } else {
        let (h, g) = curvature_and_influence(problem, variables, z, sigma, at);
        Uncertainty::new(&h, &is_fixed, cutoff).with_influence(&g)
    };
    let slopes: Vec<f64> =
        variables.all.iter().zip(z).map(|(variable, z)| variable.slope(*z)).collect();
    let estimates = (0..variables.len())
        .map(|i| ParameterEstimate {
            name: variables.name(signature, i),
            of: variables.all[i].of,
            recording: variables.all[i].recording,
            value: variables.all[i].value(z[i]),
            std: uncertainty.covariance(i, i).map(|variance| variance.sqrt() * slopes[i]),
            at_bound: bounds[i],
        })
        .collect();

    let fitted = || {
        let weighted_sums = at.sums.iter().flat_map(|of_recording| of_recording.iter().zip(sigma));
        weighted_sums.filter_map(|(sums, sigma)| Some((sums, (*sigma)?)))
    };
    let samples: usize = fitted().map(|(sums, _)| sums.samples).sum();
    let logarithms: f64 = fitted()
        .filter(|(sums, _)| sums.likelihood.is_none())
        .map(|(sums, sigma)| sums.samples as f64 * (std::f64::consts::TAU * sigma * sigma).ln())
        .sum();
    let light = |i: usize| {
        let robust = at.sums.iter().filter_map(|of_recording| of_recording[i].robust.as_ref());
        robust.map(|sums| sums.light).sum()
    };
    let free = is_fixed.iter().filter(|held| !**held).count();
    let deviance = logarithms + at.normal.cost + to_most_likely(problem, at, sigma);
    let has_tails = problem.noise.iter().any(|noise| {
        let Some(NoiseSource::Density(density)) = noise else { return false };
        matches!(density.distribution, Distribution::Student { .. })
    });
    let levels =
        problem.noise.iter().filter(|noise| **noise == Some(NoiseSource::Estimated)).count();
    let priors = effective_priors(problem, variables);
    let has_criteria = problem.loss == Loss::Squares && priors == 0;
    let criteria = has_criteria.then(|| Criteria::new(deviance, samples, free + levels));
    Fit {
        p: variables.parameters(problem.p, z),
        starts: (0..problem.recordings.len())
            .map(|r| variables.starts(r, &problem.recordings[r].start, z))
            .collect(),
        estimates,
        undetermined: uncertainty.undetermined.clone(),
        loss: problem.loss,
        cost: at.normal.cost - at.normal.logarithms,
        has_tails,
        samples,
        light_samples: (0..sigma.len()).map(light).collect(),
        samples_without_sensitivity: fitted().map(|(sums, _)| sums.without_sensitivity).sum(),
        degrees_of_freedom: (samples + priors).saturating_sub(free),
        deviance,
        criteria,
        misfits: misfits(&at.sums),
        iterations: total.iterations,
        evaluations: total.beforehand + total.evaluations,
        failures: total.failures,
        last_failure: total.last_failure,
        stepping,
        options: Options { watched: None, ..problem.options },
        termination: total.termination.unwrap_or(Termination::EvaluationLimit),
        noise: (0..sigma.len()).map(|i| noise_of(&at.sums, i).or(sigma[i])).collect(),
        uncertainty,
        slopes,
    }
}

/// The change of −2 ln of the likelihood when estimated noise is replaced by the maximum likelihood one, √(Σ e²/n): σ
/// of a fit is larger by its degrees of freedom. Zero for a loss other than squares, which is not a likelihood.
fn to_most_likely(
    problem: &OutputErrorProblem<'_>,
    at: &WeightedSums,
    sigma: &[Option<f64>],
) -> f64 {
    let least = least_noise(problem);
    let change = |i: usize| {
        let sums = at.sums.iter().map(|of_recording| &of_recording[i]);
        let (samples, squares) =
            sums.fold((0.0, 0.0), |(n, sum), one| (n + one.samples as f64, sum + one.squares));
        let (Some(sigma), true) = (sigma[i], samples > 0.0) else { return 0.0 };
        let likely = f64::sqrt(squares / samples).max(least[i]);
        let weights = 1.0 / (likely * likely) - 1.0 / (sigma * sigma);
        2.0 * samples * (likely / sigma).ln() + weights * squares
    };
    let is_estimated = |i: &usize| problem.noise[*i] == Some(NoiseSource::Estimated);
    let outputs = (0..sigma.len()).filter(is_estimated);
    if problem.loss == Loss::Squares { outputs.map(change).sum() } else { 0.0 }
}

/// The root of the mean variance of an output's readings, if they contribute by their likelihood.
fn noise_of(sums: &[Vec<OutputSums>], output: usize) -> Option<f64> {
    let of_output = || sums.iter().map(|of_recording| &of_recording[output]);
    let likely = of_output().filter_map(|sums| sums.likelihood.as_ref());
    let variances: Vec<f64> = likely.map(|likelihood| likelihood.variances).collect();
    let samples: usize = of_output().map(|sums| sums.samples).sum();
    let is_known = samples > 0 && !variances.is_empty();
    is_known.then(|| (variances.iter().sum::<f64>() / samples as f64).sqrt())
}

/// Eigenvalues of JᵀJ below this fraction of the largest count as zero: sensitivities are accurate to about ten times
/// the tolerance, and enter squared.
pub(crate) fn unseen(rtol: f64) -> f64 {
    (10.0 * rtol).powi(2).max(1e-13)
}
