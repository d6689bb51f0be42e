//! The imbalance of a model's balances whose terms were all measured.
//!
//! A balance ẏ = f(y, u) whose unknown y and right-hand side follow from readings alone has the imbalance
//!
//! ```text
//!   I(t) = y(t) − y(0) − ∫₀ᵗ f dt
//! ```
//!
//! which is noise if readings and balance are right. Its mean slope is the drift. Possible explanations are tried one
//! by one, in increments of block means:
//!
//! ```text
//!   I(t) = size ∫ x dt              the share x of a channel in f should be 1 + size times as large
//!   I(t) = ∫ x(t + size) − x(t) dt  that channel is late
//!   I(t) = y(t) − y(t + size)       the reading of y is late
//!   I(t) = size t                   something flows that is in no channel
//! ```
//!
//! Sources: Haukanes 2015, (3.9) and Fig. 3.11, where θ₁ q in place of q cures a level that runs away; increments,
//! because ∫ noise dt is a random walk, whose increments are independent.

use crate::statistics::estimate::{Estimate, regression};

/// A balance with all its terms, at common times.
#[derive(Debug, Clone)]
pub struct Balance<'a> {
    /// Times, s.
    pub times: &'a [f64],
    /// The unknown.
    pub unknown: &'a [f64],
    /// Its rate by the balance, in the unknown's unit per second.
    pub rate: &'a [f64],
    /// The share of each channel in the rate: the derivative of the rate with respect to the channel, times the
    /// channel.
    pub shares: &'a [Vec<f64>],
}

/// The imbalance of a balance.
#[derive(Debug, Clone, PartialEq)]
pub struct Imbalance {
    /// I at each time; NaN where a term is missing, continued at the next time.
    pub trace: Vec<f64>,
    /// Its mean slope, in the unknown's unit per second.
    pub drift: Estimate,
    /// Single explanations, the best first: that with the smallest remaining sum of squared increments.
    pub explanations: Vec<Explanation>,
}

/// A single cause that would explain an imbalance.
#[derive(Debug, Clone, PartialEq)]
pub struct Explanation {
    /// The cause.
    pub cause: ImbalanceCause,
    /// Its size.
    pub size: Estimate,
    /// Fraction of the mean square of the imbalance that remains.
    pub left: f64,
}

/// Causes of an imbalance.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ImbalanceCause {
    /// This share should be multiplied by 1 + size.
    Gain(usize),
    /// The channel of this share lags by size, s.
    Lag(usize),
    /// The unknown's reading lags by size, s.
    UnknownLag,
    /// There is an additional flow of size, in the unknown's unit per second.
    Flow,
}

/// Number of neighbouring increments whose errors may be correlated.
const LAGS: usize = 12;
/// Number of blocks, as long as blocks are short. Increments are those of block means.
const BLOCKS: usize = 512;
/// Maximum number of samples of a block: typical lags are a few samples.
const LONGEST: usize = 32;
/// Largest delay tried, in samples.
const FARTHEST: usize = 120;
/// Minimum number of blocks.
const FEWEST: usize = 64;

/// The imbalance of a balance; `None` with fewer than 64 blocks of known values.
///
/// # Panics
///
/// If the slices differ in length.
pub fn imbalance(balance: &Balance<'_>) -> Option<Imbalance> {
    let n = balance.times.len();
    assert!(
        balance.unknown.len() == n
            && balance.rate.len() == n
            && balance.shares.iter().all(|share| share.len() == n),
        "values for each time"
    );
    let known = |k: usize| balance.unknown[k].is_finite() && balance.rate[k].is_finite();
    let steps: Vec<usize> = (1..n).filter(|k| known(*k) && known(k - 1)).collect();
    let block = (steps.len() / BLOCKS).clamp(1, LONGEST);
    if steps.len() < FEWEST * block {
        return None;
    }
    let area = |x: &[f64], k: usize| {
        f64::midpoint(x[k], x[k - 1]) * (balance.times[k] - balance.times[k - 1])
    };
    let trace =
        summed(&steps, |k| balance.unknown[k] - balance.unknown[k - 1] - area(balance.rate, k));
    let times: Vec<f64> = steps.iter().map(|k| balance.times[*k]).collect();
    let clock = summed(&steps, |k| balance.times[k] - balance.times[k - 1]);
    let sums: Vec<Vec<f64>> =
        balance.shares.iter().map(|x| summed(&steps, |k| area(x, k))).collect();
    let unknown: Vec<f64> = steps.iter().map(|k| -balance.unknown[*k]).collect();

    let left = RemainingImbalance { imbalance: increments(&trace, block), times, block };
    let mut explanations: Vec<(f64, Explanation)> = Vec::new();
    explanations.extend(left.by_factor(ImbalanceCause::Flow, &clock));
    for (share, sums) in sums.iter().enumerate() {
        explanations.extend(left.by_factor(ImbalanceCause::Gain(share), sums));
        explanations.extend(left.by_delay(ImbalanceCause::Lag(share), sums));
    }
    explanations.extend(left.by_delay(ImbalanceCause::UnknownLag, &unknown));
    let is_flow = |(_, e): &&(f64, Explanation)| e.cause == ImbalanceCause::Flow;
    let drift = explanations.iter().find(is_flow)?.1.size;
    explanations.sort_by(|a, b| a.0.total_cmp(&b.0));
    let explanations = explanations.into_iter().map(|(_, explanation)| explanation).collect();
    let mut at_times = vec![f64::NAN; n];
    for (k, sum) in steps.iter().zip(&trace) {
        at_times[*k] = *sum;
    }
    Some(Imbalance { trace: at_times, drift, explanations })
}

/// The imbalance to explain.
struct RemainingImbalance {
    /// Increments of block means.
    imbalance: Vec<f64>,
    /// Times of the samples, s.
    times: Vec<f64>,
    /// Samples of a block.
    block: usize,
}

impl RemainingImbalance {
    /// The explanation by a multiple of `sums`, with the remaining fraction of the sum of squares.
    fn by_factor(&self, cause: ImbalanceCause, sums: &[f64]) -> Option<(f64, Explanation)> {
        let fit = regression(&[increments(sums, self.block)], &self.imbalance, LAGS)?;
        Some(explanation(cause, fit.coefficients[0], &self.imbalance, &fit.residuals))
    }

    /// The explanation by S(t + τ) − S(t), where S is `sums`, with the best τ: from a grid of samples, then a
    /// Gauss–Newton step.
    fn by_delay(&self, cause: ImbalanceCause, sums: &[f64]) -> Option<(f64, Explanation)> {
        let n = self.times.len();
        let spacing = (self.times[n - 1] - self.times[0]) / (n - 1) as f64;
        let farthest = i32::try_from(FARTHEST.min(n / 8)).unwrap_or(i32::MAX);
        // Blocks that stay within the record for all delays.
        let margin = FARTHEST.min(n / 8) / self.block + 2;
        let inner = margin..self.imbalance.len().saturating_sub(margin);
        if inner.len() < FEWEST {
            return None;
        }
        let residuals = |tau: f64| -> Vec<f64> {
            let ahead = interpolated(&self.times, sums, tau);
            let moved: Vec<f64> = ahead.iter().zip(sums).map(|(ahead, now)| ahead - now).collect();
            let moved = &increments(&moved, self.block)[inner.clone()];
            self.imbalance[inner.clone()]
                .iter()
                .zip(moved)
                .map(|(left, moved)| left - moved)
                .collect()
        };
        let squares = |r: &[f64]| r.iter().map(|r| r * r).sum::<f64>();
        let best = (-farthest..=farthest)
            .map(|lag| f64::from(lag) * spacing)
            .map(|tau| (squares(&residuals(tau)), tau))
            .min_by(|a, b| a.0.total_cmp(&b.0))?
            .1;
        // ∂/∂τ of S(t + τ), over two samples.
        let (before, behind) = (residuals(best - spacing), residuals(best + spacing));
        let slope: Vec<f64> =
            before.iter().zip(&behind).map(|(a, b)| (a - b) / (2.0 * spacing)).collect();
        let fit = regression(&[slope], &residuals(best), LAGS)?;
        let step = fit.coefficients[0];
        let size = Estimate { value: best + step.value.clamp(-spacing, spacing), ..step };
        let rest = residuals(size.value);
        Some(explanation(cause, size, &self.imbalance[inner], &rest))
    }
}

/// An explanation that leaves `rest` of `whole`, with the share of the sum of squares.
fn explanation(
    cause: ImbalanceCause,
    size: Estimate,
    whole: &[f64],
    rest: &[f64],
) -> (f64, Explanation) {
    let squares = |r: &[f64]| r.iter().map(|r| r * r).sum::<f64>();
    let left = extent(rest) / extent(whole);
    (squares(rest) / squares(whole), Explanation { cause, size, left })
}

/// Values at t + τ by linear interpolation, constant beyond the ends.
fn interpolated(times: &[f64], values: &[f64], tau: f64) -> Vec<f64> {
    let mut right = 0;
    let value = |t: &f64| {
        let t = t + tau;
        while right < times.len() && times[right] < t {
            right += 1;
        }
        if right == 0 || right == times.len() {
            return values[right.min(times.len() - 1)];
        }
        let share = (t - times[right - 1]) / (times[right] - times[right - 1]);
        values[right - 1] + share * (values[right] - values[right - 1])
    };
    times.iter().map(value).collect()
}

/// Sums of increments from the first of these steps on.
fn summed(steps: &[usize], increment: impl Fn(usize) -> f64) -> Vec<f64> {
    let mut sum = 0.0;
    let add = |k: &usize| {
        sum += increment(*k);
        sum
    };
    steps.iter().map(add).collect()
}

/// Increments of the means of neighbouring blocks, which reduce the noise of single readings.
fn increments(sums: &[f64], block: usize) -> Vec<f64> {
    let means: Vec<f64> =
        sums.chunks_exact(block).map(|c| c.iter().sum::<f64>() / block as f64).collect();
    means.windows(2).map(|pair| pair[1] - pair[0]).collect()
}

/// Mean square of the cumulated increments: the extent of an imbalance.
fn extent(increments: &[f64]) -> f64 {
    let mut sum = 0.0;
    let squares = increments.iter().map(|x| {
        sum += x;
        sum * sum
    });
    squares.sum::<f64>() / increments.len().max(1) as f64
}
