//! Size of residuals relative to the noise that the model declares, whatever noise the fit used.
//!
//! ```text
//!   squares        times² = Σ z²/n',  n' = n ν/N        P(χ²_n' > Σ z²)
//!   other losses   times  = median |z| / 0.6745         P ≤ exp(−n D(1/2 ‖ p)),  p = P(|z| > 2 · 0.6745)
//! ```
//!
//! z is a residual over the declared σ; ν/N the share of degrees of freedom left by the estimates. If σ is a formula,
//! its parameters are among the estimates, and n' is n. With a robust loss the median of |z| is used, because outliers
//! that the loss sets aside should not count against the fit: by Chernoff's bound, the probability that half of n
//! residuals exceed twice the median of the noise by chance is at most P.
//!
//! Source of the bound: Chernoff, Ann. Math. Statist. 23 (1952) 493–507.

use dgd_identify::{Loss, OutputErrorEvaluation, Recording};
use dgd_runtime::Signature;
use dgd_screen::distribution::{chi_square_tail, normal_two_sided};

use super::standard::NoiseStandard;
use crate::result::fit::ExcessEntry;

/// The median of |z| for a standard normal z.
const NORMAL_MEDIAN: f64 = 0.674_489_750_196_081_7;

/// Size of the residuals of an output relative to its declared noise.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct ResidualExcess {
    /// Ratio of their sizes.
    pub times: f64,
    /// Probability of such residuals under the declared noise; for losses other than squares, a bound for residuals
    /// twice as large.
    pub p_value: f64,
}

impl ResidualExcess {
    /// The excess of each fitted output that declares its noise.
    pub(crate) fn all(
        signature: &Signature,
        recordings: &[Recording],
        evaluation: &OutputErrorEvaluation,
        standard: NoiseStandard<'_>,
    ) -> Vec<Option<ResidualExcess>> {
        let excess_of = |i: usize| {
            let sigma = standard.fit.noise[i]?;
            let changes = standard.changes(i);
            let over = if changes { 1.0 } else { sigma / signature.outputs[i].noise? };
            let mut sizes = Vec::new();
            for (recording, observations) in recordings.iter().zip(&evaluation.observations) {
                for (k, t) in recording.times.iter().enumerate() {
                    let standardised = standard.standardise(recording, i, k, observations.w(k));
                    let z =
                        standardised.map_or(f64::NAN, |standardised| standardised.residual * over);
                    if z.is_finite() && *t >= recording.counts_from {
                        sizes.push(z.abs());
                    }
                }
            }
            let fit = standard.fit;
            let share = if changes { 1.0 } else { share(fit.degrees_of_freedom, fit.samples) };
            ResidualExcess::measure(sizes, share, fit.loss)
        };
        (0..signature.outputs.len()).map(excess_of).collect()
    }

    fn measure(mut sizes: Vec<f64>, share: f64, loss: Loss) -> Option<ResidualExcess> {
        let freedom = sizes.len() as f64 * share;
        if freedom <= 0.0 {
            return None;
        }
        if loss == Loss::Squares {
            let squares: f64 = sizes.iter().map(|z| z * z).sum();
            let (times, p_value) = ((squares / freedom).sqrt(), chi_square_tail(squares, freedom));
            return Some(ResidualExcess { times, p_value });
        }
        sizes.sort_unstable_by(f64::total_cmp);
        let times = sizes[sizes.len() / 2] / NORMAL_MEDIAN;
        let p = normal_two_sided(2.0 * NORMAL_MEDIAN);
        let divergence = 0.5 * (0.25 / (p * (1.0 - p))).ln();
        Some(ResidualExcess { times, p_value: (-(sizes.len() as f64) * divergence).exp() })
    }

    /// For programs.
    pub(crate) fn entry(self) -> ExcessEntry {
        ExcessEntry { times: self.times, p_value: self.p_value }
    }
}

/// The remaining share of degrees of freedom; priors count as samples.
fn share(freedom: usize, samples: usize) -> f64 {
    (freedom as f64 / samples.max(1) as f64).min(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn residuals_are_so_many_times_their_noise_and_outliers_are_not_asked_by_a_robust_loss() {
        let mut sizes = vec![0.0; 40];
        for (k, size) in sizes.iter_mut().enumerate() {
            *size = if k % 2 == 0 { 3.0 } else { 1.0 };
        }
        let excess = ResidualExcess::measure(sizes.clone(), 0.5, Loss::Squares).expect("samples");
        // 20 · (9 + 1) over 20.
        assert!(
            (excess.times - 10_f64.sqrt()).abs() < 1e-12 && excess.p_value < 1e-6,
            "{excess:?}"
        );
        let excess = ResidualExcess::measure(vec![0.67449; 41], 1.0, Loss::Huber).expect("samples");
        assert!((excess.times - 1.0).abs() < 1e-5, "{excess:?}");
        // 20 of 41 are outliers.
        let mut spoilt = vec![0.67449; 21];
        spoilt.extend([100.0; 20]);
        let excess = ResidualExcess::measure(spoilt, 1.0, Loss::Tukey).expect("samples");
        assert!((excess.times - 1.0).abs() < 1e-5 && excess.p_value < 1e-4, "{excess:?}");
        assert_eq!(ResidualExcess::measure(sizes, 0.0, Loss::Squares), None);
    }
}
