//! What the balances of a model leave over when all that they contain was measured.
//!
//! A balance ẏ = f(y, u) whose unknown y and whose right-hand side follow from readings alone has
//!
//! ```text
//!   I(t) = y(t) − y(0) − ∫₀ᵗ f dt
//! ```
//!
//! which is noise if readings and balance are right. Its mean slope is the drift. What would explain it
//! is tried one by one, in increments of means over blocks:
//!
//! ```text
//!   ΔI = (gain − 1) ∫ x dt       the share x of a channel in f reads by a factor
//!   ΔI = late Δx                 that channel is late
//!   ΔI = −late Δy                the reading of y is late
//!   ΔI = rate Δt                 something flows that is in no channel
//! ```
//!
//! Sources: Haukanes 2015, (3.9) and Fig. 3.11, where θ₁ q in place of q cures a level that runs away;
//! increments because ∫ noise dt
//! is a random walk, whose increments are independent.

use crate::estimate::{Estimate, regression};

/// A balance with everything in it, at common times.
#[derive(Debug, Clone)]
pub struct Balance<'a> {
    /// Times, s.
    pub times: &'a [f64],
    /// The unknown.
    pub unknown: &'a [f64],
    /// Its rate by the balance, in the unknown's unit per second.
    pub rate: &'a [f64],
    /// The share of each channel in the rate: the derivative of the rate to the channel, times the
    /// channel.
    pub shares: &'a [Vec<f64>],
}

/// What a balance leaves over.
#[derive(Debug, Clone, PartialEq)]
pub struct Imbalance {
    /// I at each time; NaN where something is not known, and counted on from the next time.
    pub trace: Vec<f64>,
    /// Its mean slope, in the unknown's unit per second.
    pub drift: Estimate,
    /// What explains it, each alone, the best first.
    pub explanations: Vec<Explanation>,
}

/// One cause that would explain an imbalance, alone.
#[derive(Debug, Clone, PartialEq)]
pub struct Explanation {
    /// Which.
    pub cause: Cause,
    /// Its size.
    pub size: Estimate,
    /// Share of the mean square of the imbalance that is left.
    pub left: f64,
}

/// Causes of an imbalance.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Cause {
    /// This share should be multiplied by 1 + size.
    Gain(usize),
    /// The channel of this share is late by size, s.
    Late(usize),
    /// The unknown's reading is late by size, s.
    UnknownLate,
    /// Size flows besides, in the unknown's unit per second.
    Flow,
}

/// Neighbouring increments whose errors may be correlated.
const LAGS: usize = 12;
/// Increments are those of means over blocks, so many of them as long as blocks are short.
const BLOCKS: usize = 512;
/// Samples of a block, at most: what is late is late by a few samples.
const LONGEST: usize = 32;
/// Fewest blocks.
const FEWEST: usize = 64;

/// What a balance leaves over; `None` for fewer than 64 known ones.
///
/// # Panics
///
/// When the slices differ in length.
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
    let mut candidates =
        vec![(Cause::Flow, summed(&steps, |k| balance.times[k] - balance.times[k - 1]))];
    for (share, x) in balance.shares.iter().enumerate() {
        candidates.push((Cause::Gain(share), summed(&steps, |k| area(x, k))));
        candidates.push((Cause::Late(share), summed(&steps, |k| x[k] - x[k - 1])));
    }
    let rate = balance.rate;
    candidates.push((Cause::UnknownLate, summed(&steps, |k| rate[k - 1] - rate[k])));

    let imbalance = increments(&trace, block);
    let whole = extent(&imbalance);
    let mut explanations: Vec<Explanation> = candidates
        .iter()
        .filter_map(|(cause, sums)| {
            let fit = regression(&[increments(sums, block)], &imbalance, LAGS)?;
            let left = extent(&fit.residuals) / whole;
            Some(Explanation { cause: *cause, size: fit.coefficients[0], left })
        })
        .collect();
    let drift = explanations.iter().find(|e| e.cause == Cause::Flow)?.size;
    explanations.sort_by(|a, b| a.left.total_cmp(&b.left));
    let mut at_times = vec![f64::NAN; n];
    for (k, sum) in steps.iter().zip(&trace) {
        at_times[*k] = *sum;
    }
    Some(Imbalance { trace: at_times, drift, explanations })
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

/// Increments of the means of neighbouring blocks, in which the noise of single readings is small.
fn increments(sums: &[f64], block: usize) -> Vec<f64> {
    let means: Vec<f64> =
        sums.chunks_exact(block).map(|c| c.iter().sum::<f64>() / block as f64).collect();
    means.windows(2).map(|pair| pair[1] - pair[0]).collect()
}

/// Mean square of the sums of increments: how far an imbalance goes.
fn extent(increments: &[f64]) -> f64 {
    let mut sum = 0.0;
    let squares = increments.iter().map(|x| {
        sum += x;
        sum * sum
    });
    squares.sum::<f64>() / increments.len().max(1) as f64
}
