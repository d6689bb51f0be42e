//! Findings: what may be wrong, in numbers.

use crate::record::TimeStretch;
use crate::redundant::Kinship;
use crate::statistics::estimate::Estimate;

/// Severity of a finding.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Severity {
    /// It biases a fit.
    Fault,
    /// It is worth knowing.
    Remark,
}

/// Something wrong or notable.
#[derive(Debug, Clone, PartialEq)]
pub struct Finding {
    /// The channels concerned; empty for the times.
    pub channels: Vec<usize>,
    /// The periods concerned; empty for the whole record.
    pub stretches: Vec<TimeStretch>,
    /// The kind.
    pub fault: ChannelFault,
    /// Upper bound of the probability of it by chance; `None` if chance plays no part.
    pub p_value: Option<f64>,
    /// Its severity.
    pub weight: Severity,
}

/// What may be wrong with channels.
#[derive(Debug, Clone, PartialEq)]
pub enum ChannelFault {
    /// There is no value at all.
    Empty,
    /// All values are this one.
    Constant(f64),
    /// This many values are missing.
    Missing(usize),
    /// Times between which nothing was recorded.
    Gaps,
    /// This fraction of the samples is not at the typical interval.
    Uneven(f64),
    /// A run of equal readings.
    Frozen {
        /// The value.
        value: f64,
        /// Number of readings.
        samples: usize,
        /// Whether another channel of the same quantity changed meanwhile. Otherwise the value may have been set.
        is_shown: bool,
    },
    /// Readings pile up at a limit.
    Saturated {
        /// The limit.
        limit: f64,
        /// Whether it is the upper one.
        is_upper: bool,
        /// Number of readings there.
        samples: usize,
    },
    /// Pulses in several channels at once: an event rather than spikes.
    Pulses {
        /// Number of them.
        count: usize,
        /// The height of the largest, with its sign.
        largest: f64,
    },
    /// Isolated outliers.
    Spikes {
        /// Number of them.
        count: usize,
        /// The height of the largest, with its sign.
        largest: f64,
    },
    /// Readings are rounded to steps that hide the noise.
    Coarse {
        /// The step.
        step: f64,
    },
    /// Two channels declared to measure the same do not move together.
    Unlike,
    /// Two channels declared to measure the same move in opposite directions, with this correlation.
    Opposed(f64),
    /// The record does not show whether two channels declared to measure the same do: they are constant and too far
    /// apart, or have too few common samples.
    Untold,
    /// The second channel reads this much more than the first.
    Offset {
        /// Second − first.
        offset: Estimate,
        /// Why they are compared.
        kinship: Kinship,
    },
    /// The channel is the odd one of several, with this offset from the median of the others.
    Odd(Estimate),
    /// The slope of the second channel against the first, minus one.
    Gain(Estimate),
    /// Drift of the second channel relative to the first, per second.
    Drift(Estimate),
    /// The second channel's noise is this many times that of the first.
    Noisier(f64),
    /// The second channel lags by this, s.
    Lag(Estimate),
}
