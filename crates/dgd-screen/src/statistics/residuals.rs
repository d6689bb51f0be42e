//! Autocorrelation of a model's residuals, and their correlation with its inputs.
//!
//! With N residuals e about zero, their autocorrelations ρ_l, and u an input minus its mean:
//!
//! ```text
//!   whiteness      Q   = N (N + 2) Σ_{l ≤ L} ρ_l²/n_l                   χ²_L    n_l: pairs l apart
//!   input          r_τ = Σ e(k) u(k−τ) / √(Σe² Σu²),   τ ≥ 0
//!                  var r_τ = Σ_l ρ_e(l) ρ_u(l) / N                      normal
//! ```
//!
//! Residuals come in runs, one for each recording, with NaN where there is none: nothing is correlated across runs, and
//! lags are counted in samples. A fit makes residuals orthogonal to its sensitivities, which lowers both statistics and
//! makes the tests milder, never stricter.
//!
//! Sources: Ljung & Box, On a measure of lack of fit in time series models, Biometrika 65 (1978)
//! 297–303; Ljung, System Identification, 2nd ed. (1999), §16.6, where var r_τ is P/N.

use crate::statistics::distribution::{chi_square_tail, normal_threshold, normal_two_sided};

/// Minimum number of residuals for a verdict.
const FEWEST: usize = 32;
/// Lags are at most one in this many residuals.
const LONGEST: usize = 4;
/// Maximum number of products for the autocorrelations of one variance.
const MOST_PRODUCTS: usize = 200_000_000;

/// The Ljung–Box test.
#[derive(Debug, Clone, PartialEq)]
pub struct Portmanteau {
    /// ρ_1, ρ_2, ….
    pub autocorrelation: Vec<f64>,
    /// Limit that |ρ_l| of white noise exceeds in one of twenty cases.
    pub limit: f64,
    /// Q.
    pub statistic: f64,
    /// Probability that white noise exceeds it.
    pub p_value: f64,
}

/// Tests whether residuals are white, by their autocorrelations up to a lag.
///
/// `None` with fewer than 32 residuals, or if all are zero. The number of lags is at most a quarter of that of the
/// residuals.
pub fn portmanteau(runs: &[&[f64]], lags: usize) -> Option<Portmanteau> {
    let (squares, n) = lagged(runs, 0);
    if n < FEWEST || squares == 0.0 {
        return None;
    }
    let lags = ljung_box(runs, lags.min(n / LONGEST));
    let autocorrelation = lags.iter().map(|lag| lag.rho).collect();
    let (statistic, tested) = lags.last().map_or((0.0, 0), |lag| (lag.statistic, lag.tested));
    let p_value = chi_square_tail(statistic, tested as f64);
    let limit = normal_threshold(0.05) / (n as f64).sqrt();
    Some(Portmanteau { autocorrelation, limit, statistic, p_value })
}

/// An autocorrelation, and the statistic of all up to it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LagStatistic {
    /// ρ_l.
    pub rho: f64,
    /// Q of the lags up to this one.
    pub statistic: f64,
    /// Number of these with pairs: the degrees of freedom of Q.
    pub tested: usize,
}

/// The lags 1 … `lags` of residuals that are not all zero.
pub fn ljung_box(runs: &[&[f64]], lags: usize) -> Vec<LagStatistic> {
    let (squares, n) = lagged(runs, 0);
    let n = n as f64;
    let (mut sum, mut tested) = (0.0, 0);
    let lag = |lag| {
        let (products, pairs) = lagged(runs, lag);
        let rho = products / squares;
        if pairs > 0 {
            tested += 1;
            sum += rho * rho / pairs as f64;
        }
        LagStatistic { rho, statistic: n * (n + 2.0) * sum, tested }
    };
    (1..=lags).map(lag).collect()
}

/// Correlation of residuals with an input.
#[derive(Debug, Clone, PartialEq)]
pub struct CrossCorrelation {
    /// r_0, r_1, …: residuals with the input that many samples earlier.
    pub correlation: Vec<f64>,
    /// Limit that |r_τ| of one lag exceeds in one of twenty cases if residuals do not depend on the input.
    pub limit: f64,
    /// The lag of the largest |r_τ|, in samples.
    pub lag: usize,
    /// Upper bound on the probability that the largest is as large by chance: Bonferroni's over the lags.
    pub p_value: f64,
}

/// Tests whether residuals are correlated with an input up to `lags` samples earlier.
///
/// Each run has residuals and the input at the same samples. The residuals may be coloured. If their colour would make
/// the limit narrower than for white ones, the latter is used. `None` as for [`portmanteau`], or if the input does not
/// change.
///
/// # Panics
///
/// If a run's residuals and inputs differ in number.
pub fn cross_correlation(runs: &[(&[f64], &[f64])], lags: usize) -> Option<CrossCorrelation> {
    let residuals: Vec<&[f64]> = runs.iter().map(|(e, _)| *e).collect();
    let (squares, n) = lagged(&residuals, 0);
    if n < FEWEST || squares == 0.0 {
        return None;
    }
    let inputs: Vec<Vec<f64>> = runs.iter().map(|(e, u)| centred(e, u)).collect();
    let inputs: Vec<&[f64]> = inputs.iter().map(Vec::as_slice).collect();
    let (power, _) = lagged(&inputs, 0);
    if power == 0.0 {
        return None;
    }
    let scale = (squares * power).sqrt();
    let correlation: Vec<f64> = (0..=lags.min(n / LONGEST))
        .map(|lag| {
            let pairs = residuals.iter().zip(&inputs);
            pairs.map(|(e, u)| product(&e[lag.min(e.len())..], u).0).sum::<f64>() / scale
        })
        .collect();
    // 1 + 2 Σ ρ_e(l) ρ_u(l)
    let widening = common_time(&residuals, &inputs, n).max(1.0);
    let std = (widening / n as f64).sqrt();
    let (lag, largest) = correlation
        .iter()
        .map(|r| r.abs())
        .enumerate()
        .fold((0, 0.0), |best, r| if r.1 > best.1 { r } else { best });
    let p_value = (normal_two_sided(largest / std) * correlation.len() as f64).min(1.0);
    Some(CrossCorrelation { correlation, limit: normal_threshold(0.05) * std, lag, p_value })
}

/// The input minus its mean over the samples that have a residual; NaN at the others.
fn centred(e: &[f64], u: &[f64]) -> Vec<f64> {
    assert_eq!(e.len(), u.len(), "an input for each residual");
    let counted = || e.iter().zip(u).filter(|(e, u)| e.is_finite() && u.is_finite());
    let mean = counted().map(|(_, u)| u).sum::<f64>() / counted().count().max(1) as f64;
    // A constant input differs from its mean only by rounding.
    let changes = counted().any(|(_, u)| (u - mean).abs() > 1e-9 * mean.abs());
    let value = |(e, u): (&f64, &f64)| {
        if !e.is_finite() {
            f64::NAN
        } else if changes {
            u - mean
        } else {
            0.0
        }
    };
    e.iter().zip(u).map(value).collect()
}

/// 1 + 2 Σ ρ_e(l) ρ_u(l), summed while two neighbouring ρ_e are positive together (Geyer, Statist.
/// Sci. 7 (1992) 473, §3.3): those of noise would otherwise add up.
fn common_time(residuals: &[&[f64]], inputs: &[&[f64]], n: usize) -> f64 {
    let (squares, power) = (lagged(residuals, 0).0, lagged(inputs, 0).0);
    let longest = (n / LONGEST).min(MOST_PRODUCTS / n);
    let mut time = 1.0;
    for lag in (1..longest).step_by(2) {
        let rho = [lag, lag + 1].map(|lag| lagged(residuals, lag).0 / squares);
        if rho[0] + rho[1] <= 0.0 {
            break;
        }
        let common = [lag, lag + 1].map(|lag| lagged(inputs, lag).0 / power);
        time += 2.0 * (rho[0] * common[0] + rho[1] * common[1]);
    }
    time
}

/// Σ eₖ eₖ₊ₗ over all runs, and the number of pairs.
fn lagged(runs: &[&[f64]], lag: usize) -> (f64, usize) {
    let covariance = |run: &&[f64]| product(&run[lag.min(run.len())..], run);
    runs.iter().map(covariance).fold((0.0, 0), |sum, one| (sum.0 + one.0, sum.1 + one.1))
}

/// Σ eₖ eₖ₊ₗ of one sequence, without values that are not finite.
pub fn lagged_product(e: &[f64], lag: usize) -> f64 {
    lagged(&[e], lag).0
}

/// Σ aₖ bₖ over the pairs that are finite, and their number.
fn product(a: &[f64], b: &[f64]) -> (f64, usize) {
    let products = a.iter().zip(b).map(|(a, b)| a * b).filter(|product| product.is_finite());
    products.fold((0.0, 0), |(sum, pairs), product| (sum + product, pairs + 1))
}
