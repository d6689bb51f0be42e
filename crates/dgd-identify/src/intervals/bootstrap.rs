//! Residual bootstrap: the scatter of estimates under resampled residuals.
//!
//! ```text
//!   y* = w(t; θ̂) + e*        e*: blocks of e √(N/ν), of random beginnings and lengths
//!   θ* = fit of y*, from θ̂    standard deviation and quantiles of many θ*
//! ```
//!
//! Blocks preserve the autocorrelation of the residuals, and they are the same for all outputs of a recording, so that
//! cross-correlations between outputs are preserved as well. Their lengths are geometric (the stationary bootstrap)
//! with a mean that minimises the error of the variance of a mean. e is the residual less its mean in each recording,
//! with the weights of the loss, scaled for the ν = N − n degrees of freedom of a fit of n variables. Priors are drawn
//! around the estimate. Weights are those of the fit.
//!
//! Sources: Politis, Romano, The stationary bootstrap, J. Am. Stat. Assoc. 89 (1994) 1303; Politis,
//! White, Automatic block-length selection for the dependent bootstrap, Econometric Reviews 23 (2004)
//! 53, with the correction of Patton, Politis, White, ibid. 28 (2009) 372.

use std::sync::atomic::{AtomicUsize, Ordering};

use dgd_runtime::model::Model;
use dgd_runtime::parallel::in_parallel_by_model;
use dgd_runtime::signature::PriorDensity;

use crate::error::{EstimateError, TrialFailed};
use crate::intervals::around::FitNeighbourhood;
use crate::journal::Digest;
use crate::minimise::trust_region::Termination;
use crate::output_error::OutputErrorProblem;
use crate::output_error::fit::Fit;
use crate::output_error::weighing::effective_priors;
use crate::progress::{Progress, Total};
use crate::random::Uniform;
use crate::recording::{DerivativeUse, Recording, outputs_of};

/// Limit on the simulations of a refit, which starts near its minimum.
const MOST_EVALUATIONS: usize = 40;

/// Estimates from resampled data sets.
#[derive(Debug, Clone, PartialEq)]
pub struct Bootstrap {
    /// All estimates of each refit that reached a minimum, SI, in the order of the fit's.
    pub replicates: Vec<Vec<f64>>,
    /// Number of refits that did not.
    pub failures: usize,
    /// Number of refits that were not started or not completed because of cancellation.
    pub left_out: usize,
    /// Mean length of the blocks in each recording, in rows.
    pub block_lengths: Vec<f64>,
}

impl Bootstrap {
    /// Standard deviation of an estimate, SI; `None` with fewer than two refits.
    pub fn std(&self, estimate: usize) -> Option<f64> {
        let n = self.replicates.len() as f64;
        if n < 2.0 {
            return None;
        }
        let values = || self.replicates.iter().map(|replicate| replicate[estimate]);
        let mean = values().sum::<f64>() / n;
        Some((values().map(|value| (value - mean).powi(2)).sum::<f64>() / (n - 1.0)).sqrt())
    }

    /// The interval of an estimate with this probability, SI, from its [`percentiles`]; `None` if there are too few
    /// refits.
    pub fn interval(&self, estimate: usize, probability: f64) -> Option<(f64, f64)> {
        let values = self.replicates.iter().map(|replicate| replicate[estimate]);
        percentiles(values.collect(), probability)
    }
}

/// The interval that contains this share of the values; `None` if fewer than one value lies beyond each end.
///
/// Of n sorted values, the k-th is the quantile k/(n + 1); between them it is linear.
pub fn percentiles(mut values: Vec<f64>, probability: f64) -> Option<(f64, f64)> {
    values.sort_by(f64::total_cmp);
    let n = values.len();
    let below = 0.5 * (1.0 - probability) * (n as f64 + 1.0);
    if below < 1.0 {
        return None;
    }
    let quantile = |place: f64| {
        let k = (place.floor() as usize).clamp(1, n - 1);
        values[k - 1] + (place - k as f64) * (values[k] - values[k - 1])
    };
    Some((quantile(below), quantile(n as f64 + 1.0 - below)))
}

/// Refits a fit's problem to resampled data sets, in the threads of the problem.
///
/// `random` returns a generator of uniform 64-bit numbers for each replicate, by its number, so that results do not
/// depend on threads. If cancelled, returns the complete refits.
///
/// # Errors
///
/// As [`fit`](crate::fit); or the problem cannot be simulated at the estimates of the fit.
///
/// # Panics
///
/// If the fit does not belong to the problem.
pub fn bootstrap<G: FnMut() -> u64>(
    problem: &OutputErrorProblem<'_>,
    fit: &Fit,
    replicates: usize,
    random: impl Fn(usize) -> G + Sync,
) -> Result<Bootstrap, EstimateError> {
    let around = FitNeighbourhood::new(problem, fit, MOST_EVALUATIONS)?;
    let data = fit.samples + effective_priors(problem, &around.variables);
    let spread = (data as f64 / fit.degrees_of_freedom.max(1) as f64).sqrt();
    let unwatched = around.problem(problem.system).unwatched();
    let mut sources = Vec::with_capacity(problem.recordings.len());
    for (r, recording) in problem.recordings.iter().enumerate() {
        let options = &unwatched.options;
        let starts = &fit.starts[r];
        let simulated =
            outputs_of(problem.system, recording, &fit.p, starts, options, DerivativeUse::No)
                .map_err(|reason| EstimateError::Start(TrialFailed { recording: r, reason }))?;
        let of_output = |i: usize| {
            let sigma = fit.noise[i]?;
            let weight = |e: f64| problem.loss.evaluate(e / sigma).weight;
            let samples: Vec<(usize, f64)> = recording.counted(i).collect();
            ResampledOutput::new(
                recording.times.len(),
                &samples,
                |k| simulated.w(k)[i],
                weight,
                spread,
            )
        };
        sources.push(ResampleSource::new(recording, (0..fit.noise.len()).map(of_output).collect()));
    }

    let done = AtomicUsize::new(0);
    // `None` if no minimum was reached.
    let refit = |system: &dyn Model, k: usize| -> Result<Option<Vec<f64>>, IncompleteRefit> {
        if around.watch.is_stopped() {
            return Err(IncompleteRefit);
        }
        let mut uniform = Uniform(random(k));
        let recordings: Vec<Recording> =
            sources.iter().map(|source| source.resampled(&mut uniform)).collect();
        let mut resampled = around.problem(system);
        resampled.recordings = &recordings;
        for prior in &mut resampled.priors {
            let Some((_, std)) = prior.as_normal() else { continue };
            let mean = prior.value(&fit.p) + std * uniform.normal();
            prior.density = PriorDensity::Normal { mean, std };
        }
        match around.minimum(&resampled, around.z.clone(), &around.bounds) {
            Ok(minimum) if minimum.termination.is_converged() => {
                let variables = around.variables.all.iter().zip(&minimum.x);
                Ok(Some(variables.map(|(variable, z)| variable.value(*z)).collect()))
            }
            Ok(minimum) if minimum.termination == Termination::Stopped => Err(IncompleteRefit),
            // A cancelled refit fails as well.
            Ok(_) | Err(_) if around.watch.is_stopped() => Err(IncompleteRefit),
            Ok(_) | Err(_) => Ok(None),
        }
    };
    let refits = in_parallel_by_model(problem.system, replicates, problem.threads, |system, k| {
        let drawn = |digest: Digest| {
            let mut numbers = random(k);
            digest.debug(&("refit", numbers(), numbers()))
        };
        let refit = around.kept(drawn, || refit(system, k));
        if refit.is_ok() {
            let done = done.fetch_add(1, Ordering::Relaxed) + 1;
            let total = Total::Exactly(replicates);
            around.watch.advanced(Progress { what: "resampled data sets", done, of: total });
        }
        refit
    });
    let mut bootstrap = Bootstrap {
        replicates: Vec::with_capacity(replicates),
        failures: 0,
        left_out: 0,
        block_lengths: sources.iter().map(|source| source.block_length).collect(),
    };
    for refit in refits {
        match refit {
            Ok(Some(estimates)) => bootstrap.replicates.push(estimates),
            Ok(None) => bootstrap.failures += 1,
            Err(IncompleteRefit) => bootstrap.left_out += 1,
        }
    }
    Ok(bootstrap)
}

/// A refit that was not completed.
struct IncompleteRefit;

/// The source of resampled data for one recording.
struct ResampleSource<'a> {
    recording: &'a Recording,
    channels: Vec<Option<ResampledOutput>>,
    /// Mean length of a block, in rows.
    block_length: f64,
}

/// One output of one recording.
struct ResampledOutput {
    /// Positions of the samples that count.
    positions: Vec<usize>,
    /// Simulated values of the fit at these samples, SI.
    simulated: Vec<f64>,
    /// Residuals, less their mean and scaled, SI.
    residuals: Vec<f64>,
    /// For each position of the recording, the next residual, cyclic; `None` in a gap.
    nearest: Vec<Option<usize>>,
    /// Usual number of rows from one sample to the next.
    spacing: usize,
}

/// A gap is a distance between samples of more than this multiple of the usual one.
const GAP: usize = 2;

impl ResampledOutput {
    /// `None` without samples.
    fn new(
        len: usize,
        samples: &[(usize, f64)],
        simulated: impl Fn(usize) -> f64,
        weight: impl Fn(f64) -> f64,
        spread: f64,
    ) -> Option<Self> {
        if samples.is_empty() {
            return None;
        }
        let positions: Vec<usize> = samples.iter().map(|(k, _)| *k).collect();
        let simulated: Vec<f64> = positions.iter().map(|k| simulated(*k)).collect();
        let errors = || samples.iter().zip(&simulated).map(|((_, y), w)| y - w);
        let weights = errors().map(&weight).sum::<f64>();
        let weighted = errors().map(|e| weight(e) * e).sum::<f64>();
        let mean = if weights > 0.0 { weighted / weights } else { 0.0 };
        let residuals = errors().map(|e| (e - mean) * spread).collect();
        let n = positions.len();
        // Rows from each sample to the previous one, cyclic.
        let mut steps: Vec<usize> = positions.windows(2).map(|pair| pair[1] - pair[0]).collect();
        steps.insert(0, positions[0] + len - positions[n - 1]);
        let spacing = {
            let mut sorted = steps.clone();
            sorted.sort_unstable();
            sorted[n / 2]
        };
        let nearest = (0..len).map(|k| {
            let next = positions.partition_point(|p| *p < k) % n;
            (positions[next] == k || steps[next] <= GAP * spacing).then_some(next)
        });
        Some(Self { nearest: nearest.collect(), positions, simulated, residuals, spacing })
    }

    /// For each sample, the position of its residual: that of the row from which the recording's blocks are drawn, or,
    /// if that lies in a gap, of a block of the channel's own.
    fn drawn<G: FnMut() -> u64>(&self, from: &[usize], uniform: &mut Uniform<G>) -> Vec<usize> {
        let n = self.residuals.len();
        let mut block: Option<(usize, usize)> = None;
        let drawn = self.positions.iter().map(|k| {
            if let Some(residual) = self.nearest[from[*k]] {
                block = None;
                return residual;
            }
            let residual = match block {
                Some((before, residual))
                    if from[*k] == (from[before] + k - before) % from.len() =>
                {
                    (residual + 1) % n
                }
                Some(_) | None => uniform.below(n),
            };
            block = Some((*k, residual));
            residual
        });
        drawn.collect()
    }

    /// The mean length of its blocks, in rows.
    fn block_length(&self) -> f64 {
        block_length(&self.residuals) * self.spacing as f64
    }
}

impl<'a> ResampleSource<'a> {
    fn new(recording: &'a Recording, channels: Vec<Option<ResampledOutput>>) -> Self {
        let block_length =
            channels.iter().flatten().map(ResampledOutput::block_length).fold(1.0, f64::max);
        Self { recording, channels, block_length }
    }

    /// The recording with simulated values and resampled residuals.
    fn resampled<G: FnMut() -> u64>(&self, uniform: &mut Uniform<G>) -> Recording {
        let n = self.recording.times.len();
        let mut recording = self.recording.clone();
        // For each position, the position of its residuals.
        let mut from: Vec<usize> = Vec::with_capacity(n);
        for _ in 0..n {
            let next = match from.last() {
                Some(before) if uniform.next() > 1.0 / self.block_length => (before + 1) % n,
                Some(_) | None => uniform.below(n),
            };
            from.push(next);
        }
        for (channel, measured) in self.channels.iter().zip(&mut recording.measured) {
            let (Some(channel), Some(measured)) = (channel, measured) else { continue };
            let drawn = channel.drawn(&from, uniform);
            for ((k, simulated), drawn) in
                channel.positions.iter().zip(&channel.simulated).zip(drawn)
            {
                measured[*k] = simulated + channel.residuals[drawn];
            }
        }
        recording
    }
}

/// The mean length of blocks for the stationary bootstrap of a sequence, in samples.
///
/// ```text
///   b = (2G²/D N)^⅓,   G = Σ λ(k/M)|k| R(k),   D = 2 (Σ λ(k/M) R(k))²       k = −M … M
/// ```
///
/// λ is flat up to a half and falls to zero at 1; M is twice the lag after which K autocorrelations in a row are within
/// 2√(log₁₀N/N). At least 1 and at most 3√N or N/3.
fn block_length(e: &[f64]) -> f64 {
    let n = e.len();
    let count = n as f64;
    let power: f64 = e.iter().map(|e| e * e).sum();
    if n < 16 || power == 0.0 {
        return 1.0;
    }
    let rho = |lag: usize| e.iter().zip(&e[lag..]).map(|(a, b)| a * b).sum::<f64>() / power;
    let in_a_row = (count.log10().sqrt().ceil() as usize).max(5);
    let most = (count.sqrt().ceil() as usize + in_a_row).min(n - 1);
    let small = 2.0 * (count.log10() / count).sqrt();
    let mut rhos = Vec::new();
    let (mut last, mut quiet) = (0, 0);
    while rhos.len() < most && quiet < in_a_row {
        rhos.push(rho(rhos.len() + 1));
        if rhos[rhos.len() - 1].abs() < small {
            quiet += 1;
        } else {
            (last, quiet) = (rhos.len(), 0);
        }
    }
    let m = (2 * last.max(1)).min(most);
    let (mut g, mut d) = (0.0, 1.0);
    for k in 1..=m {
        let rho = rhos.get(k - 1).copied().unwrap_or_else(|| rho(k));
        let window = (2.0 * (1.0 - k as f64 / m as f64)).min(1.0);
        g += 2.0 * window * k as f64 * rho;
        d += 2.0 * window * rho;
    }
    let length = if d > 0.0 { (g * g / (d * d) * count).cbrt() } else { f64::INFINITY };
    length.clamp(1.0, (3.0 * count.sqrt()).min(count / 3.0).max(1.0))
}
