//! Measures the evidence for an effect.
//!
//! Residuals are correlated in time, so resampling keeps blocks of them together.
//!
//! - p-value: the signs of blocks of the residuals without the effect are randomised, which preserves their size and
//!   correlation but destroys any relation to candidates. How often does the *best* of all candidates then gain as much
//!   (`resampled.rs`)?
//! - inclusion: blocks are drawn with replacement. How often does the structure with the smallest criterion have the
//!   effect?

mod cross_validation;
mod gates;

use rand_pcg::Pcg64;
use rand_pcg::rand_core::Rng;

use super::screen::{
    BLOCKS, MANY_RESAMPLES, PointTrial, RESAMPLES, gain, p_value, resampled_p_value,
};

/// The evidence for an effect.
#[derive(Debug, Clone, Copy)]
pub struct Evidence {
    /// Probability that the best of the library gains as much if nothing is missing.
    pub p_value: f64,
    /// Number of resamples behind the p-value.
    pub resamples: usize,
    /// Decrease of the Bayesian information criterion.
    pub bic_gain: f64,
    /// Fraction of resamples of the recordings in which the best structure has the effect.
    pub inclusion: f64,
}

/// Evidence for an effect of a structure.
#[derive(Debug, Clone, Copy)]
pub(crate) struct WeighedEvidence {
    pub evidence: Evidence,
    /// Fraction of resamples in which the best structure has the effect or one that the data cannot distinguish from
    /// it.
    pub with_alike: f64,
}

/// A structure in resampling.
pub(crate) struct ResampledContender {
    /// Whether it has the effect, and whether it has the effect or one that the data cannot distinguish from it.
    pub has: [bool; 2],
    /// The penalty for its parameters.
    pub penalty: f64,
    /// Σ ε² of each block.
    pub sums: [f64; BLOCKS],
}

/// Whether the best candidate gains more in the base model than in any of ten thousand resamples of its errors.
pub(crate) fn is_no_chance(trials: &[PointTrial], seed: u64) -> bool {
    let p_value = p_value_of_the_base(trials, seed, true);
    p_value.is_some_and(|p| p <= 1.0 / (1 + MANY_RESAMPLES) as f64)
}

/// Probability that, with nothing missing, the best candidate promises as much as it does in the base model; from more
/// resamples if few reach its gain. `None` if there is nothing to try.
pub(crate) fn p_value_of_the_base(trials: &[PointTrial], seed: u64, many: bool) -> Option<f64> {
    let mut random = Pcg64::new(u128::from(seed), 0);
    let p = (!trials.is_empty()).then(|| p_value(trials, gain(trials), &mut random))?;
    if !many || p > 1.0 / (1 + RESAMPLES) as f64 {
        return Some(p);
    }
    Some(resampled_p_value(trials, gain(trials), MANY_RESAMPLES, &mut random))
}

/// Fractions of resamples whose best structure has an effect, and whose best structure has it or one that the data
/// cannot distinguish from it. Sums are in units of the best structure's residual.
pub(crate) fn inclusion(
    contenders: &[ResampledContender],
    unit: f64,
    random: &mut Pcg64,
) -> [f64; 2] {
    let mut included = [0; 2];
    let mut counts = [0.0; BLOCKS];
    for _ in 0..RESAMPLES {
        counts.fill(0.0);
        for _ in 0..BLOCKS {
            counts[(random.next_u64() % BLOCKS as u64) as usize] += 1.0;
        }
        let criterion = |ResampledContender { penalty, sums, .. }: &ResampledContender| {
            penalty + sums.iter().zip(&counts).map(|(sum, count)| sum * count).sum::<f64>() / unit
        };
        let best = contenders.iter().min_by(|a, b| criterion(a).total_cmp(&criterion(b)));
        let has = best.map_or([false; 2], |best| best.has);
        for (included, has) in included.iter_mut().zip(has) {
            *included += usize::from(has);
        }
    }
    included.map(|included| included as f64 / RESAMPLES as f64)
}
