//! The number of equal steps in each segment of the inputs.

use crate::signal::{Inputs, LimitSide};

/// Steps of a run: equal within each segment, and never longer than a fraction of the sample interval.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct StepGrid {
    per_sample: u32,
    /// One over the longest step.
    rate: f64,
}

/// Segments that exceed a whole number of steps by less than this fraction of a step get no extra step.
const ROUNDING: f64 = 1e-9;

impl StepGrid {
    /// `per_sample` steps in each sample interval.
    pub(crate) fn new(interval: f64, per_sample: u32) -> Self {
        Self { per_sample, rate: f64::from(per_sample) / interval }
    }

    /// Steps in a sample interval.
    pub(crate) fn per_sample(self) -> u32 {
        self.per_sample
    }

    /// Steps in a segment of this length.
    #[inline]
    pub(crate) fn steps(self, length: f64) -> usize {
        // Rounds up without `ceil`, a library call on processors that lack the instruction; via a signed integer, for
        // which there is a conversion instruction.
        (length * self.rate - ROUNDING) as i64 as usize + 1
    }
}

/// The mean distance of the requested times or of the points at which inputs change, whichever is shorter.
pub(crate) fn sample_interval(inputs: &Inputs, times: &[f64]) -> f64 {
    let (Some(from), Some(until)) = (times.first(), times.last()) else {
        return f64::INFINITY;
    };
    (until - from) / (times.len() - 1).max(segments(inputs, *from, *until)).max(1) as f64
}

/// Number of input segments in a run.
pub(crate) fn segments(inputs: &Inputs, from: f64, until: f64) -> usize {
    inputs.segment_at(until, LimitSide::Left) + 1 - inputs.segment_at(from, LimitSide::Right)
}
