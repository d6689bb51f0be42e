//! What may be wrong, in numbers.

use crate::record::Stretch;
use crate::redundant::Kinship;
use crate::statistics::estimate::Estimate;

/// Whether something is wrong.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Weight {
    /// It misleads a fit.
    Fault,
    /// It is good to know.
    Remark,
}

/// Something that is wrong or notable.
#[derive(Debug, Clone, PartialEq)]
pub struct Finding {
    /// The channels that it is about; none for the times.
    pub channels: Vec<usize>,
    /// When; empty where it is all of the record.
    pub stretches: Vec<Stretch>,
    /// What.
    pub fault: Fault,
    /// Bound of the probability that chance makes it; `None` where chance plays no part.
    pub p_value: Option<f64>,
    /// Whether it is a fault.
    pub weight: Weight,
}

/// What may be wrong with channels.
#[derive(Debug, Clone, PartialEq)]
pub enum Fault {
    /// There is no value at all.
    Empty,
    /// All values are this one.
    Constant(f64),
    /// So many values are missing.
    Missing(usize),
    /// Times between which nothing was recorded.
    Gaps,
    /// This share of the samples is not at the usual distance.
    Uneven(f64),
    /// So many readings of one value.
    Frozen {
        /// The value.
        value: f64,
        /// Number of readings.
        samples: usize,
        /// Whether another channel that measures the same went on meanwhile. Otherwise it may have been
        /// set.
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
    /// Pulses that several channels show at once: an event rather than spikes.
    Pulses {
        /// Number of them.
        count: usize,
        /// The height of the largest, with its sign.
        largest: f64,
    },
    /// Readings that stand alone.
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
    /// Two channels that are said to measure the same do not move together.
    Unlike,
    /// Two channels that are said to measure the same move in opposite directions, with this correlation.
    Opposed(f64),
    /// Whether two channels measure the same that are said to, the record does not tell: they rest, too
    /// far apart, or have too few samples in common.
    Untold,
    /// The second channel reads this much more than the first.
    Offset {
        /// Second − first.
        offset: Estimate,
        /// Why they are compared.
        kinship: Kinship,
    },
    /// The channel is the odd one of several; its offset from the middle one of the others.
    Odd(Estimate),
    /// The second channel's slope over the first, less one.
    Gain(Estimate),
    /// The second channel drifts from the first, per second.
    Drift(Estimate),
    /// The second channel's noise is this many times that of the first.
    Noisier(f64),
    /// The second channel is late by this, s.
    Late(Estimate),
}
