//! The requested times, eight at a time.

#![allow(clippy::inline_always)]

use super::lanes::{LANES, Lanes};

/// The requested times, padded so that eight can be read from each of them on.
pub(super) struct PaddedTimes<'a> {
    pub(super) asked: &'a [f64],
    padded: Vec<f64>,
    /// Length of the interval from the first to the last.
    pub(super) span: f64,
    /// Times per second, on average.
    rate: f64,
}

impl<'a> PaddedTimes<'a> {
    pub(super) fn new(asked: &'a [f64]) -> Self {
        // Times that are never reached.
        let padding = [f64::INFINITY; LANES];
        let span = asked.last().zip(asked.first()).map_or(0.0, |(last, first)| last - first);
        let rate = if span > 0.0 { (asked.len() - 1) as f64 / span } else { 0.0 };
        Self { asked, padded: [asked, &padding].concat(), span, rate }
    }

    /// The requested times, then padding that is never reached.
    #[inline(always)]
    pub(super) fn all(&self) -> &[f64] {
        &self.padded
    }

    /// Number of values stored for each quantity.
    #[inline(always)]
    pub(super) fn stride(&self) -> usize {
        self.padded.len()
    }

    /// The number of times from `first` on that are before `t`.
    #[inline(always)]
    pub(super) fn count_before(&self, first: usize, t: f64) -> usize {
        // Exact if they are equidistant.
        let guess = first + ((t - self.padded[first]) * self.rate) as u32 as usize;
        for k in [guess, guess + 1] {
            if k > first && k < self.padded.len() && self.padded[k - 1] < t && self.padded[k] >= t {
                return k - first;
            }
        }
        self.padded[first..].partition_point(|asked| *asked < t)
    }

    /// Eight times from `first` on.
    #[inline(always)]
    pub(super) fn eight(&self, first: usize) -> Lanes {
        eight(&self.padded, first)
    }
}

/// Eight numbers from `first` on.
#[inline(always)]
pub(super) fn eight(values: &[f64], first: usize) -> Lanes {
    let mut eight = Lanes::ZERO;
    eight.0.copy_from_slice(&values[first..first + LANES]);
    eight
}
