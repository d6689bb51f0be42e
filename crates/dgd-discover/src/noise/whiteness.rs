//! Tests whether residuals are white noise.
//!
//! With e = r/σ, N valid samples in order and m degrees of freedom absorbed by a fit, three kinds of
//! statistic have known distributions when e is white and normal:
//!
//! ```text
//!   mean square    Σe²                                      χ²_{N−m}   misfit of any form
//!   block means    Σ over B blocks of (Σ_block e)²/n_block   χ²_B       slow misfit
//!   correlation    N(N+2) Σ_{l≤L} ρ_l²/(N−l)                 χ²_L       oscillation, colour
//! ```
//!
//! B = 1, 2, 4, … up to N/8 and L = 1, 5, 25. The first two are widened by the uncertainty of σ, which would otherwise
//! look like misfit for large N. Block means are a cumulated periodogram of the lowest frequencies in the Haar basis: a
//! drift that is invisible in each sample, and lost in a periodogram summed over all frequencies, stands out in blocks
//! of its length.
//!
//! A fit can only reduce Σe² and the block means of noise, so m = 0 makes the test milder, never stricter. All p-values
//! are of upper tails, and [`Whiteness::p_value`] uses Bonferroni's correction: the smallest times their number.
//!
//! Sources: Ljung & Box, On a measure of lack of fit in time series models, Biometrika 65 (1978) 297–303; Bartlett's
//! cumulated periodogram, which the block means replace, in Madsen, Time Series Analysis (2008), §6.6.

use dgd_screen::distribution::chi_square_tail;
use dgd_screen::noise::SensorNoise;
use dgd_screen::residuals::{LagStatistic, lagged_product, ljung_box};

/// The statistic of a check.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CheckKind {
    /// The mean square.
    MeanSquare,
    /// The means of this many blocks of equal length.
    BlockMeans(usize),
    /// The autocorrelations up to this lag, in samples.
    Correlation(usize),
}

/// One statistic of residuals.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WhitenessCheck {
    /// Its kind.
    pub kind: CheckKind,
    /// The statistic.
    pub statistic: f64,
    /// Degrees of freedom of its χ² distribution.
    pub degrees_of_freedom: f64,
    /// Probability that white noise exceeds it.
    pub p_value: f64,
}

/// The result of the tests for white noise.
#[derive(Debug, Clone, PartialEq)]
pub struct Whiteness {
    /// All checks.
    pub checks: Vec<WhitenessCheck>,
    /// The check with the smallest p-value; if several are zero, the one with the largest statistic per degree of
    /// freedom.
    pub worst: WhitenessCheck,
    /// Upper bound on the probability that white noise looks as bad in any of them.
    pub p_value: f64,
    /// Mean square relative to the noise's variance.
    pub mean_square: f64,
}

/// Lags up to which autocorrelations are summed.
const LAGS: [usize; 3] = [1, 5, 25];
/// Minimum number of samples of a block.
const SHORTEST_BLOCK: usize = 8;
/// Minimum number of samples for the tests of an output in a recording; with fewer, only the size is tested.
pub const FEWEST: usize = 32;

/// Tests whether the residuals of one output are white noise with this standard deviation.
///
/// `absorbed` is the number of degrees of freedom absorbed by a fit to these residuals, 0 if in doubt. Samples that are
/// not finite are left out, and the rest form a sequence: white noise stays white. `None` if fewer than 32 samples are
/// left or the noise is not positive.
pub fn whiteness(residuals: &[f64], noise: &SensorNoise, absorbed: usize) -> Option<Whiteness> {
    let usable = noise.std > 0.0 && noise.std.is_finite();
    let e: Vec<f64> = residuals.iter().filter(|r| r.is_finite()).map(|r| r / noise.std).collect();
    if !usable || e.len() < FEWEST.max(absorbed + 1) {
        return None;
    }
    let n = e.len() as f64;
    let sum_of_squares: f64 = e.iter().map(|e| e * e).sum();

    let mut checks = vec![mean_square(sum_of_squares, n - absorbed as f64, noise.relative_error)];
    let mut blocks = 1;
    while blocks * SHORTEST_BLOCK <= e.len() {
        checks.push(block_means(&e, blocks, noise.relative_error));
        blocks *= 2;
    }
    if sum_of_squares > 0.0 {
        let lags = ljung_box(&[&e], LAGS[LAGS.len() - 1]);
        checks.extend(LAGS.map(|lag| {
            let LagStatistic { statistic, tested, .. } = lags[lag - 1];
            check(CheckKind::Correlation(lag), statistic, tested as f64)
        }));
    }

    let excess = |check: &WhitenessCheck| check.statistic / check.degrees_of_freedom;
    let worst = checks.iter().copied().min_by(|a, b| {
        a.p_value.total_cmp(&b.p_value).then_with(|| excess(b).total_cmp(&excess(a)))
    })?;
    let p_value = (worst.p_value * checks.len() as f64).min(1.0);
    Some(Whiteness { checks, worst, p_value, mean_square: sum_of_squares / n })
}

/// Tests whether a few residuals, in any order, are as small as white noise; `None` without samples.
pub(crate) fn size(residuals: &[f64], noise: &SensorNoise) -> Option<WhitenessCheck> {
    let e = residuals.iter().filter(|r| r.is_finite()).map(|r| r / noise.std);
    let (sum, n) = e.fold((0.0, 0), |(sum, n), e| (sum + e * e, n + 1));
    (n > 0).then(|| mean_square(sum, f64::from(n), noise.relative_error))
}

/// Number of samples of a block whose mean square is compared with that of others.
const BLOCK_OF_SQUARES: usize = 128;

/// Probability that stationary errors of unit standard deviation have block mean squares that differ as much.
///
/// With n samples in each of B blocks, Σ (Σ_block e² − n m)²/(2n m²), where m is the overall mean square, is χ²_{B−1}
/// for normal errors.
pub(crate) fn steadiness(errors: &[f64]) -> f64 {
    let e: Vec<f64> = errors.iter().copied().filter(|e| e.is_finite()).collect();
    let blocks = e.chunks_exact(BLOCK_OF_SQUARES);
    let sums: Vec<f64> = blocks.map(|block| block.iter().map(|e| e * e).sum()).collect();
    let number = sums.len() as f64;
    if number < 2.0 {
        return 1.0;
    }
    let mean = sums.iter().sum::<f64>() / number;
    // 2 n m² = 2 (n m)²/n
    let variance = 2.0 * mean * mean / BLOCK_OF_SQUARES as f64;
    let statistic = sums.iter().map(|sum| (sum - mean).powi(2)).sum::<f64>() / variance;
    chi_square_tail(statistic, number - 1.0)
}

fn check(kind: CheckKind, statistic: f64, degrees_of_freedom: f64) -> WhitenessCheck {
    let p_value = chi_square_tail(statistic, degrees_of_freedom);
    WhitenessCheck { kind, statistic, degrees_of_freedom, p_value }
}

/// The check of Σe², including the uncertainty of σ.
///
/// Σe²/σ̂² has a variance of 2ν + (2sν)², from χ²_ν and from ν/σ̂². Scaling the distance from ν by the root of the
/// ratio of 2ν to this variance makes it χ²_ν again, to second order.
fn mean_square(sum_of_squares: f64, dof: f64, relative_error: f64) -> WhitenessCheck {
    let widening = (1.0 + 2.0 * dof * relative_error * relative_error).sqrt();
    check(CheckKind::MeanSquare, dof + (sum_of_squares - dof) / widening, dof)
}

/// The check of Σ (Σ_block e)²/n_block; the uncertainty of σ is treated as in [`mean_square`].
fn block_means(e: &[f64], blocks: usize, relative_error: f64) -> WhitenessCheck {
    let bound = |block: usize| block * e.len() / blocks;
    let sum: f64 = (0..blocks)
        .map(|block| {
            let block = &e[bound(block)..bound(block + 1)];
            let sum: f64 = block.iter().sum();
            sum * sum / block.len() as f64
        })
        .sum();
    let dof = blocks as f64;
    let widening = (1.0 + 2.0 * dof * relative_error * relative_error).sqrt();
    check(CheckKind::BlockMeans(blocks), dof + (sum - dof) / widening, dof)
}

/// The number of equivalent independent samples: N/(1 + 2Σρ_l).
///
/// Autocorrelations ρ about zero are summed while the sum of two neighbouring ones is positive (Geyer, Practical Markov
/// chain Monte Carlo, Statist. Sci. 7 (1992) 473–483, §3.3); those of noise would otherwise add up. Between 1 and N,
/// with residuals that are not finite left out; 0 if none are left.
pub fn effective_sample_size(residuals: &[f64]) -> f64 {
    let r: Vec<f64> = residuals.iter().copied().filter(|r| r.is_finite()).collect();
    let n = r.len() as f64;
    let sum_of_squares = lagged_product(&r, 0);
    if sum_of_squares == 0.0 {
        return n;
    }
    let mut time = 1.0;
    for lag in (1..r.len().saturating_sub(1)).step_by(2) {
        let pair = (lagged_product(&r, lag) + lagged_product(&r, lag + 1)) / sum_of_squares;
        if pair <= 0.0 {
            break;
        }
        time += 2.0 * pair;
    }
    (n / time).clamp(1.0, n.max(1.0))
}
