//! Detects frozen readings, and readings that pile up at a limit.
//!
//! A working sensor repeats a reading with a probability p because of rounding. Among n readings a run of L equal ones
//! occurs by chance about n p^(L−1) times. A channel without noise (a set value, a calculated flow) repeats values as a
//! rule, so nothing is reported about it.
//!
//! A limit that clips readings piles them up at one value, which occurs much more often than the values next to it.
//! Readings that thin out towards their extremes have no such pile.
//!
//! Source: the length of the longest run, Erdős, Rényi, On a new law of large numbers, J. Analyse
//! Math. 23 (1970) 103–111. The pile is a sign test of the counts of two neighbouring levels.

use crate::record::{TimeStretch, extremes, runs};

/// A run of equal readings that is not due to chance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FrozenRun {
    /// The period.
    pub stretch: TimeStretch,
    /// First and last sample.
    pub samples: (usize, usize),
    /// The reading.
    pub value: f64,
    /// Expected number of such runs in the record.
    pub p_value: f64,
}

/// Readings that pile up at a limit.
#[derive(Debug, Clone, PartialEq)]
pub struct SaturatedReadings {
    /// The limit.
    pub limit: f64,
    /// Whether it is the upper one.
    pub is_upper: bool,
    /// Periods at the limit.
    pub stretches: Vec<TimeStretch>,
    /// Samples at the limit.
    pub samples: Vec<usize>,
    /// Upper bound of the probability of such a pile by chance.
    pub p_value: f64,
}

/// Runs expected fewer times than this are not due to chance.
const RARE: f64 = 1e-6;
/// Minimum number of readings of a run.
const FEWEST: usize = 10;
/// Number of neighbouring pairs among which repetitions are counted.
const BLOCK: usize = 64;
/// A block with more repetitions may itself be frozen.
const STILL: f64 = 0.9;
/// Fraction of changes of direction above which a channel is noisy; white noise has 2/3.
const LIVELY: f64 = 0.3;
/// Minimum ratio of a pile to the levels next to it.
const PILE: f64 = 3.0;
/// Minimum number of runs at a limit.
const FEWEST_RUNS: usize = 3;
/// Number of levels with which a pile is compared.
const NEIGHBOURS: usize = 5;

/// Statistics of a working channel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct ChannelLife {
    /// Probability that a reading repeats the previous one, in the block where that is most frequent.
    repeats: f64,
}

impl ChannelLife {
    /// Statistics of these values; `None` if the channel shows no noise of its own.
    pub(crate) fn estimate(values: &[f64]) -> Option<ChannelLife> {
        let mut shares = Vec::new();
        let (mut turns, mut moves) = (0usize, 0usize);
        for block in values.chunks(BLOCK) {
            let pairs: Vec<f64> = block
                .windows(2)
                .map(|pair| pair[1] - pair[0])
                .filter(|step| step.is_finite())
                .collect();
            if pairs.len() < BLOCK / 4 {
                continue;
            }
            let still = pairs.iter().filter(|step| **step == 0.0).count();
            let share = still as f64 / pairs.len() as f64;
            if share > STILL {
                continue;
            }
            shares.push(share);
            let steps: Vec<f64> = pairs.into_iter().filter(|step| *step != 0.0).collect();
            moves += steps.len().saturating_sub(1);
            turns += steps.windows(2).filter(|pair| pair[0] * pair[1] < 0.0).count();
        }
        shares.sort_unstable_by(f64::total_cmp);
        let repeats = *shares.get(shares.len() * 9 / 10)?;
        let is_lively = turns as f64 >= LIVELY * moves.max(1) as f64;
        (is_lively && repeats < STILL).then_some(ChannelLife { repeats })
    }

    /// Expected number of runs of this length among n readings.
    fn expected(self, n: usize, length: usize) -> f64 {
        // The probability of a repetition has a floor, however rare.
        n as f64 * self.repeats.max(0.05).powf(length as f64 - 1.0)
    }
}

/// Periods in which an otherwise working channel reads one value.
pub fn frozen(times: &[f64], values: &[f64]) -> Vec<FrozenRun> {
    let Some(life) = ChannelLife::estimate(values) else { return Vec::new() };
    let repeated = |k: usize| k > 0 && values[k] == values[k - 1];
    runs(values.len(), repeated)
        .into_iter()
        .filter_map(|(first, last)| {
            let (first, length) = (first - 1, last - first + 2);
            let p_value = life.expected(values.len(), length);
            (length >= FEWEST && p_value < RARE).then(|| FrozenRun {
                stretch: TimeStretch::from_samples(times, first, last),
                samples: (first, last),
                value: values[first],
                p_value,
            })
        })
        .collect()
}

/// Limits at which readings of an otherwise working channel pile up.
pub fn saturated(times: &[f64], values: &[f64]) -> Vec<SaturatedReadings> {
    let Some((low, high)) = extremes(values) else { return Vec::new() };
    if low == high || ChannelLife::estimate(values).is_none() {
        return Vec::new();
    }
    let mut sorted: Vec<f64> = values.iter().copied().filter(|value| value.is_finite()).collect();
    sorted.sort_unstable_by(f64::total_cmp);
    let upper = pile(sorted.iter().rev().copied());
    let lower = pile(sorted.iter().copied());
    [(upper, high, true), (lower, low, false)]
        .into_iter()
        .filter_map(|(p_value, limit, is_upper)| {
            let p_value = p_value.filter(|p| *p < RARE)?;
            let samples: Vec<usize> = (0..values.len()).filter(|k| values[*k] == limit).collect();
            let stretches: Vec<TimeStretch> = runs(values.len(), |k| values[k] == limit)
                .into_iter()
                .map(|(first, last)| TimeStretch::from_samples(times, first, last))
                .collect();
            // Noise takes readings to a limit and off it again; a single long run is a held value.
            if stretches.len() < FEWEST_RUNS {
                return None;
            }
            Some(SaturatedReadings { limit, is_upper, stretches, samples, p_value })
        })
        .collect()
}

/// If the first level of sorted values is a pile, the probability of such a pile by chance.
fn pile(sorted: impl Iterator<Item = f64>) -> Option<f64> {
    let mut counts: Vec<(f64, usize)> = Vec::new();
    for value in sorted {
        let is_new = counts.last().is_none_or(|(level, _)| *level != value);
        if is_new && counts.len() > NEIGHBOURS {
            break;
        }
        match counts.last_mut() {
            Some((_, count)) if !is_new => *count += 1,
            _ => counts.push((value, 1)),
        }
    }
    let (&(_, first), others) = counts.split_first()?;
    let next = others.iter().map(|(_, count)| *count).max()?;
    if first < FEWEST || (first as f64) < PILE * next as f64 {
        return None;
    }
    // Hoeffding: P(X ≥ c) ≤ exp(−(c − n/2)²·2/n) of n = c + c' throws of a coin.
    let n = (first + next) as f64;
    let excess = first as f64 - 0.5 * n;
    Some((-2.0 * excess * excess / n).exp())
}
