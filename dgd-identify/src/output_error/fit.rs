//! What a fit found.

use dgd_runtime::Options;
use dgd_runtime::signature::Distribution;

use crate::error::TrialFailed;
use crate::minimise::trust_region::{Minimum, Termination};
use crate::noise::Noise;
use crate::noise::loss::Loss;
use crate::output_error::stepping::Stepping;
use crate::output_error::weighing::{
    Weighted, curvature_and_influence, effective_priors, information, misfits,
};
use crate::output_error::{OutputErrorProblem, Starts, least_noise};
use crate::recording::{Misfit, Sums};
use crate::uncertainty::{Correlated, Estimate, Uncertainty, Undetermined};
use crate::variables::Variables;

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
    /// σ of each output as the fit weighted it, SI; `None` where an output was not fitted. Where samples have σ of
    /// their own, the root of their mean square.
    pub noise: Vec<Option<f64>>,
    /// What errors were taken by.
    pub loss: Loss,
    /// Σ ρ(e/σ), priors included: Σ (e/σ)² where the loss is squares. Of outputs that count by their likelihood what
    /// depends on residuals.
    pub cost: f64,
    /// Samples that count, of all fitted outputs.
    pub samples: usize,
    /// Those of them, by output, that weigh less than half under a loss that is not squares.
    pub light_samples: Vec<usize>,
    /// Those of them that the search direction knows nothing of.
    pub samples_without_sensitivity: usize,
    /// Samples and priors less estimates that are not at a bound.
    pub degrees_of_freedom: usize,
    /// −2 ln of the likelihood: Σ n ln(2πσ²) + Σ ρ(e/σ), with estimated σ where it is least, √(Σ e²/n). Comparable
    /// between fits to the same samples by the same loss, whatever their noise.
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
    /// How its simulations stepped.
    pub stepping: Stepping,
    /// With which options: tolerances are tighter than those of the problem where the search had stalled with them.
    pub options: Options,
    /// Why the fit ended.
    pub termination: Termination,
    /// Information criteria; `None` under a loss other than squares, whose value is not a likelihood, and with priors,
    /// which hold parameters only in part.
    pub criteria: Option<Criteria>,
    /// Whether readings of some output have Student's distribution, whose squares do not add up.
    has_tails: bool,
    uncertainty: Uncertainty,
    slopes: Vec<f64>,
}

/// What a model's fit is worth beside that of another model to the same samples: the less the better.
///
/// With D the deviance, n samples, and k estimates that are not at a bound, estimated levels of noise among them:
///
/// Akaike, IEEE TAC 19 (1974) 716; Hurvich, Tsai, Biometrika 76 (1989) 297; Schwarz, Ann. Stat. 6 (1978) 461.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Criteria {
    /// D + 2 k.
    pub aic: f64,
    /// The same, corrected for few samples: D + 2 k n/(n − k − 1); `None` where n ≤ k + 1.
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
    /// How its simulations were made, watched as with these options.
    pub(crate) fn simulated(&self, options: &Options) -> Options {
        Options { watched: options.watched, ..self.options }
    }

    /// What changes of an estimate are compared with, SI: of a parameter with `log` its value, of all others the
    /// size of what they stand for. Above zero.
    pub(crate) fn size(&self, i: usize) -> f64 {
        self.slopes[i].abs()
    }

    /// Covariance of two estimates, SI; `None` where one of them is at a bound or not determined.
    pub fn covariance(&self, i: usize, j: usize) -> Option<f64> {
        Some(self.uncertainty.covariance(i, j)? * self.slopes[i] * self.slopes[j])
    }

    /// The same over the combinations that outputs see, where single estimates may be undetermined; 0 for
    /// those at a bound.
    pub(crate) fn seen_covariance(&self, i: usize, j: usize) -> f64 {
        self.uncertainty.seen[(i, j)] * self.slopes[i] * self.slopes[j]
    }

    /// What an error of an output, SI, weighs under the loss: 1 for squares and for what is not fitted.
    pub fn weight(&self, output: usize, e: f64) -> f64 {
        self.noise[output].map_or(1.0, |sigma| self.loss.at(e / sigma).weight)
    }

    /// What a rise of Σ ρ along an estimate is worth as a rise of −2 ln of its likelihood; 1 for squares.
    ///
    /// Σ ρ rises by (θ − θ̂)²/(H⁻¹)ᵢᵢ, and θ̂ scatters by (H⁻¹ G H⁻¹)ᵢᵢ.
    pub(crate) fn worth(&self, i: usize) -> f64 {
        self.uncertainty.worth[i]
    }

    /// Says no more how sure the estimates are: where the noise is not known, neither is that.
    pub fn forget_uncertainty(&mut self) {
        self.uncertainty.forget(&mut self.estimates);
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
    /// degrees of freedom, under a loss that is not squares, and with readings of Student's distribution.
    pub fn reduced_chi_square(&self) -> Option<f64> {
        let is_squares = self.loss == Loss::Squares && !self.has_tails;
        let is_known = self.degrees_of_freedom > 0 && is_squares;
        is_known.then(|| self.cost / self.degrees_of_freedom as f64)
    }
}

/// What several minimisations did together.
#[derive(Default)]
pub(crate) struct Total {
    pub iterations: usize,
    /// Simulations before the search, which do not count towards its limit.
    pub beforehand: usize,
    pub evaluations: usize,
    pub failures: usize,
    pub last_failure: Option<TrialFailed>,
    pub termination: Option<Termination>,
}

impl Total {
    /// Counts it in, and hands on where it ended.
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
    variables: &Variables,
    z: &[f64],
    at: &Weighted,
    sigma: &[Option<f64>],
    stepping: Stepping,
    total: Total,
) -> Fit {
    let signature = problem.system.signature();
    let bounds: Vec<_> =
        variables.all.iter().zip(z).map(|(variable, z)| variable.bound(*z)).collect();
    let held: Vec<bool> = bounds.iter().map(Option::is_some).collect();
    let cutoff = unseen(problem.options.rtol);
    let uncertainty = if problem.loss == Loss::Squares {
        Uncertainty::new(&information(problem, variables, z, at), &held, cutoff)
    } else {
        let (h, g) = curvature_and_influence(problem, variables, z, sigma, at);
        Uncertainty::new(&h, &held, cutoff).with_influence(&g)
    };
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
        let all = at.sums.iter().flat_map(|of_recording| of_recording.iter().zip(sigma));
        all.filter_map(|(sums, sigma)| Some((sums, (*sigma)?)))
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
    let free = held.iter().filter(|held| !**held).count();
    let deviance = logarithms + at.normal.cost + to_most_likely(problem, at, sigma);
    let has_tails = problem.noise.iter().any(|noise| {
        let Some(Noise::Density(density)) = noise else { return false };
        matches!(density.distribution, Distribution::Student { .. })
    });
    let levels = problem.noise.iter().filter(|noise| **noise == Some(Noise::Estimated)).count();
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

/// What −2 ln of the likelihood changes by where estimated noise becomes the most likely one, √(Σ e²/n): σ of a fit is
/// larger by its degrees of freedom. Nothing under a loss other than squares, which is no likelihood.
fn to_most_likely(problem: &OutputErrorProblem<'_>, at: &Weighted, sigma: &[Option<f64>]) -> f64 {
    let least = least_noise(problem);
    let of = |i: usize| {
        let all = at.sums.iter().map(|of_recording| &of_recording[i]);
        let (samples, squares) =
            all.fold((0.0, 0.0), |(n, sum), one| (n + one.samples as f64, sum + one.squares));
        let (Some(sigma), true) = (sigma[i], samples > 0.0) else { return 0.0 };
        let likely = f64::sqrt(squares / samples).max(least[i]);
        let weights = 1.0 / (likely * likely) - 1.0 / (sigma * sigma);
        2.0 * samples * (likely / sigma).ln() + weights * squares
    };
    let is_estimated = |i: &usize| problem.noise[*i] == Some(Noise::Estimated);
    let outputs = (0..sigma.len()).filter(is_estimated);
    if problem.loss == Loss::Squares { outputs.map(of).sum() } else { 0.0 }
}

/// The root of the mean variance of an output's readings, where they count by their likelihood.
fn noise_of(sums: &[Vec<Sums>], output: usize) -> Option<f64> {
    let of_output = || sums.iter().map(|of_recording| &of_recording[output]);
    let likely = of_output().filter_map(|sums| sums.likelihood.as_ref());
    let variances: Vec<f64> = likely.map(|likelihood| likelihood.variances).collect();
    let samples: usize = of_output().map(|sums| sums.samples).sum();
    let is_known = samples > 0 && !variances.is_empty();
    is_known.then(|| (variances.iter().sum::<f64>() / samples as f64).sqrt())
}

/// Eigenvalues of JᵀJ below this part of the largest are not told from zero: sensitivities are
/// known to some ten times the tolerance, and enter in squares.
pub(crate) fn unseen(rtol: f64) -> f64 {
    (10.0 * rtol).powi(2).max(1e-13)
}
