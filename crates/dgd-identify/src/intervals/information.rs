//! The samples that determine each estimate: the sources of its information.
//!
//! ```text
//!   s⊥ = J C eᵢ / Cᵢᵢ        rows of J: ∂w/∂θ/σ at each sample; C: covariance of the estimates
//!   Σ s⊥² = 1/Cᵢᵢ            over samples and priors
//! ```
//!
//! s⊥ is the sensitivity to θᵢ without the component that changes of the others could mimic (in J = QR with θᵢ last,
//! its last row). Its squares are contributions to the information behind the standard deviation, and can be added up
//! by recording, output, or kind of sample.
//!
//! The effect of more samples of one kind, of which there are n among N:
//!
//! ```text
//!   C′ = (I + C H)⁻¹ C,   H = N/n Σ_kind s sᵀ/σ²        s: ∂w/∂θ
//! ```
//!
//! is the covariance with N additional samples, all of that kind. Above √½, the result of repeating the same
//! recordings, a kind is not worth measuring; the kind with the smallest value is the best test.
//!
//! Source of the latter: Fedorov, Theory of Optimal Experiments (1972) §2, a design point's gain.

use dgd_runtime::Direction;
use dgd_runtime::parallel::in_parallel_by_model;
use nalgebra::{DMatrix, DVector};

use crate::error::{EstimateError, TrialFailed};
use crate::output_error::OutputErrorProblem;
use crate::output_error::fit::Fit;
use crate::recording::outputs_with_sensitivities;

/// The sources of the information about an estimate. All shares, including that of the prior, add up to 1.
#[derive(Debug, Clone, PartialEq)]
pub struct Information {
    /// Position among the estimates.
    pub estimate: usize,
    /// Shares of the recordings.
    pub recordings: Vec<f64>,
    /// Shares of the outputs.
    pub outputs: Vec<f64>,
    /// Shares of the kinds of samples.
    pub kinds: Vec<f64>,
    /// For each kind, the relative standard deviation after doubling the number of samples by that kind; `None` for a
    /// kind without samples.
    pub again: Vec<Option<f64>>,
    /// The relative standard deviation after repeating all recordings: √½ without priors.
    pub all_again: f64,
    /// The most informative sample: recording, output and position.
    pub best: Option<(usize, usize, usize)>,
}

/// Information about each estimate that is determined and not at a bound.
///
/// `kinds` has the kind of each sample of each recording, out of `n_kinds`.
///
/// # Errors
///
/// If the problem cannot be simulated at the estimates of the fit.
///
/// # Panics
///
/// If the fit does not belong to the problem, or `kinds` does not match its recordings.
pub fn information(
    problem: &OutputErrorProblem<'_>,
    fit: &Fit,
    kinds: &[Vec<usize>],
    n_kinds: usize,
) -> Result<Vec<Information>, EstimateError> {
    assert_eq!(kinds.len(), problem.recordings.len(), "kinds for each recording");
    let options = fit.simulated(&problem.options);
    let directions = &problem.system.signature().directions;
    let n = fit.estimates.len();
    let determined: Vec<usize> = (0..n).filter(|i| fit.covariance(*i, *i).is_some()).collect();
    let position = |of: Direction| directions.iter().position(|direction| *direction == of);
    let columns: Vec<Option<usize>> = fit.estimates.iter().map(|e| position(e.of)).collect();
    let empty = |estimate: &usize| Information {
        estimate: *estimate,
        recordings: vec![0.0; problem.recordings.len()],
        outputs: vec![0.0; fit.noise.len()],
        kinds: vec![0.0; n_kinds],
        again: vec![None; n_kinds],
        all_again: 1.0,
        best: None,
    };

    let recordings =
        in_parallel_by_model(problem.system, kinds.len(), problem.threads, |system, r| {
            let recording = &problem.recordings[r];
            let observations =
                outputs_with_sensitivities(system, recording, &fit.p, &fit.starts[r], &options)?;
            let mut results: Vec<(Information, f64)> =
                determined.iter().map(|i| (empty(i), 0.0)).collect();
            let mut sums = vec![OfKind::zeros(n); n_kinds];
            for (output, sigma) in fit.noise.iter().enumerate() {
                let Some(sigma) = sigma else { continue };
                for (k, _) in recording.counted(output) {
                    let slope = |j: usize| -> f64 {
                        let is_relevant = fit.estimates[j].recording.is_none_or(|of| of == r);
                        let column = columns[j].filter(|_| is_relevant);
                        column.map_or(0.0, |c| observations.dw(k)[c * observations.n_w + output])
                    };
                    let slopes: Vec<f64> = (0..n).map(slope).collect();
                    if slopes.iter().any(|slope| !slope.is_finite()) {
                        continue;
                    }
                    sums[kinds[r][k]].add(&slopes, *sigma);
                    for (place, i) in determined.iter().enumerate() {
                        let (found, most) = &mut results[place];
                        let along = slopes.iter().enumerate();
                        let sum: f64 =
                            along.map(|(j, slope)| fit.seen_covariance(*i, j) * slope).sum();
                        let part = (sum / sigma).powi(2);
                        found.recordings[r] += part;
                        found.outputs[output] += part;
                        found.kinds[kinds[r][k]] += part;
                        if part > *most {
                            (*most, found.best) = (part, Some((r, output, k)));
                        }
                    }
                }
            }
            Ok((results, sums))
        });

    let mut results: Vec<(Information, f64)> = determined.iter().map(|i| (empty(i), 0.0)).collect();
    let mut sums = vec![OfKind::zeros(n); n_kinds];
    for (recording, result) in recordings.into_iter().enumerate() {
        let (found, of_recording): (Vec<(Information, f64)>, Vec<OfKind>) =
            result.map_err(|reason| EstimateError::Start(TrialFailed { recording, reason }))?;
        for (sum, more) in sums.iter_mut().zip(of_recording) {
            sum.samples += more.samples;
            sum.information += more.information;
        }
        for ((sum, most), (one, of_one)) in results.iter_mut().zip(found) {
            add(&mut sum.recordings, &one.recordings);
            add(&mut sum.outputs, &one.outputs);
            add(&mut sum.kinds, &one.kinds);
            if of_one > *most {
                (*most, sum.best) = (of_one, one.best);
            }
        }
    }
    for (found, _) in &mut results {
        let i = found.estimate;
        // Σ (J C eᵢ)² + Σ_priors (wᵀC eᵢ/s)² = Cᵢᵢ
        let whole = fit.covariance(i, i).unwrap_or(f64::NAN);
        let parts = [&mut found.recordings, &mut found.outputs, &mut found.kinds];
        parts.into_iter().flatten().for_each(|part| *part /= whole);
    }
    let size = DVector::from_fn(n, |i, _| {
        let variance = fit.seen_covariance(i, i);
        if variance > 0.0 { variance.sqrt() } else { 1.0 }
    });
    let covariance = DMatrix::from_fn(n, n, |i, j| fit.seen_covariance(i, j) / (size[i] * size[j]));
    // Relative standard deviations with a multiple of the samples of a kind.
    let with = |more: &OfKind, times: f64| -> Option<Vec<f64>> {
        let h = DMatrix::from_fn(n, n, |i, j| times * size[i] * size[j] * more.information[(i, j)]);
        let after = (DMatrix::identity(n, n) + &covariance * h).lu().solve(&covariance)?;
        let ratio = |i: usize| (after[(i, i)] / covariance[(i, i)]).max(0.0).sqrt();
        Some((0..n).map(ratio).collect())
    };
    let whole = sums.iter().fold(OfKind::zeros(n), |mut whole, sum| {
        whole.samples += sum.samples;
        whole.information += &sum.information;
        whole
    });
    let of_whole = with(&whole, 1.0);
    let of_kinds: Vec<Option<Vec<f64>>> = sums
        .iter()
        .map(|sum| match sum.samples {
            0 => None,
            samples => with(sum, whole.samples as f64 / samples as f64),
        })
        .collect();
    for (found, _) in &mut results {
        let i = found.estimate;
        found.all_again = of_whole.as_ref().map_or(1.0, |ratios| ratios[i]);
        found.again = of_kinds.iter().map(|ratios| ratios.as_ref().map(|all| all[i])).collect();
    }
    Ok(results.into_iter().map(|(found, _)| found).collect())
}

/// The information in the samples of a kind.
#[derive(Debug, Clone)]
struct OfKind {
    samples: usize,
    /// Σ s sᵀ/σ² for all estimates, 1/SI².
    information: DMatrix<f64>,
}

impl OfKind {
    fn zeros(n: usize) -> Self {
        Self { samples: 0, information: DMatrix::zeros(n, n) }
    }

    fn add(&mut self, slopes: &[f64], sigma: f64) {
        self.samples += 1;
        for (j, b) in slopes.iter().enumerate() {
            for (i, a) in slopes.iter().enumerate() {
                self.information[(i, j)] += a * b / (sigma * sigma);
            }
        }
    }
}

fn add(sums: &mut [f64], more: &[f64]) {
    for (sum, more) in sums.iter_mut().zip(more) {
        *sum += more;
    }
}
