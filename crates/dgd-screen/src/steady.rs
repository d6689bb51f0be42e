//! Finds steady periods and transients.
//!
//! The slope of each channel is that of a line through its samples within a window of time w. A
//! channel rests where the change over a window, w times the slope, is at most
//!
//! ```text
//!   ε = max(4 σ √(12/n), r/200)
//! ```
//!
//! with σ its noise, n the samples of a window and r its range: four standard deviations of a slope caused by noise, or
//! half a per cent of its range. The recording is at rest where all channels are. It moves where a channel changes by
//! more than 4ε in a window.
//!
//! Source: Haukanes 2015, §3.4, |dq/dt| ≤ ε, and Fig. 3.20 for transients. Noise of a slope over n
//! equally spaced samples: Var(slope) w² = 12 σ²/n.

use crate::record::{ScreenedRecord, TimeStretch, extremes, runs};
use crate::statistics::estimate::{Estimate, mean};

/// The criterion for a channel at rest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RestCriterion {
    /// Position of the channel in the record.
    pub channel: usize,
    /// Largest change over a window, in the channel's unit.
    pub change: f64,
}

/// A period in which all channels are at rest.
#[derive(Debug, Clone, PartialEq)]
pub struct SteadyPeriod {
    /// The period.
    pub stretch: TimeStretch,
    /// First and last sample.
    pub samples: (usize, usize),
    /// The mean of each channel; `None` with fewer than 16 values.
    pub means: Vec<Option<Estimate>>,
}

/// A period in which something changes.
#[derive(Debug, Clone, PartialEq)]
pub struct TransientPeriod {
    /// The period.
    pub stretch: TimeStretch,
    /// The channels that change: position, value before and after.
    pub changes: Vec<(usize, f64, f64)>,
}

/// Steady periods and transients of a record.
#[derive(Debug, Clone, PartialEq)]
pub struct Motion {
    /// Length of the windows, s.
    pub window: f64,
    /// The channels that move at all, with their criteria for rest.
    pub rests: Vec<RestCriterion>,
    /// Steady periods.
    pub steady: Vec<SteadyPeriod>,
    /// Transients.
    pub transients: Vec<TransientPeriod>,
}

/// Fraction of the range below which a change is negligible.
const SMALL: f64 = 1.0 / 200.0;
/// Number of standard deviations of a slope caused by noise.
const CLEAR: f64 = 4.0;
/// Multiple of ε above which something moves.
const MOVING: f64 = 4.0;

/// Finds steady periods and transients. `noise` has the standard deviation of each channel; `limits` sets the largest
/// slope of a channel at rest, per second.
///
/// # Panics
///
/// If the length of `noise` differs from the number of channels.
pub fn motion(
    record: &ScreenedRecord<'_>,
    noise: &[Option<f64>],
    window: f64,
    limits: &[(usize, f64)],
) -> Motion {
    assert_eq!(noise.len(), record.channels.len(), "a noise for each channel");
    let times = record.times;
    let mut rests = Vec::new();
    let n = times.len();
    let (mut at_rest, mut moving) = (vec![n > 0; n], vec![false; n]);
    for (channel, values) in record.channels.iter().map(|channel| channel.values).enumerate() {
        let Some((low, high)) = extremes(values) else { continue };
        if low == high {
            continue;
        }
        let changes = changes(times, values, window);
        let set = limits.iter().find(|(limited, _)| *limited == channel);
        let per_window = changes.iter().map(|(_, n)| *n).max().unwrap_or(0);
        let by_noise = noise[channel]
            .map_or(0.0, |std| CLEAR * std * (12.0 / per_window.max(1) as f64).sqrt());
        let change = set.map_or(by_noise.max(SMALL * (high - low)), |(_, rate)| rate * window);
        for (k, (value, _)) in changes.iter().enumerate() {
            at_rest[k] &= value.abs() <= change;
            moving[k] |= value.abs() > MOVING * change;
        }
        rests.push(RestCriterion { channel, change });
    }
    // A channel without values for a while does not count, and one with a short interruption is at rest.
    let steady = joined(times, runs(n, |k| at_rest[k]), 0.25 * window)
        .into_iter()
        .filter(|(first, last)| times[*last] - times[*first] >= window)
        .map(|(first, last)| SteadyPeriod {
            stretch: TimeStretch::from_samples(times, first, last),
            samples: (first, last),
            means: record.channels.iter().map(|c| mean(&c.values[first..=last])).collect(),
        })
        .collect();
    let transients = joined(times, runs(n, |k| moving[k]), 0.5 * window)
        .into_iter()
        .map(|(first, last)| {
            let side = |values: &[f64], k: usize, forwards: bool| {
                near(times, values, k, 0.5 * window, forwards)
            };
            let moved = rests.iter().filter_map(|rest| {
                let values = record.channels[rest.channel].values;
                let (before, after) = (side(values, first, false)?, side(values, last, true)?);
                ((after - before).abs() > MOVING * rest.change).then_some((
                    rest.channel,
                    before,
                    after,
                ))
            });
            let changes = moved.collect();
            TransientPeriod { stretch: TimeStretch::from_samples(times, first, last), changes }
        })
        .collect();
    Motion { window, rests, steady, transients }
}

/// Joins runs that are less than `gap` apart.
fn joined(times: &[f64], runs: Vec<(usize, usize)>, gap: f64) -> Vec<(usize, usize)> {
    let mut joined: Vec<(usize, usize)> = Vec::new();
    for (first, last) in runs {
        match joined.last_mut() {
            Some((_, before)) if times[first] - times[*before] <= gap => *before = last,
            _ => joined.push((first, last)),
        }
    }
    joined
}

/// Mean of the values within `reach` before or after a sample.
fn near(times: &[f64], values: &[f64], k: usize, reach: f64, forwards: bool) -> Option<f64> {
    let (mut sum, mut count) = (0.0, 0.0);
    let mut start = k;
    while (times[start] - times[k]).abs() <= reach {
        if values[start].is_finite() {
            sum += values[start];
            count += 1.0;
        }
        if (forwards && start + 1 == times.len()) || (!forwards && start == 0) {
            break;
        }
        start = if forwards { start + 1 } else { start - 1 };
    }
    (count > 0.0).then(|| sum / count)
}

/// For each sample, the change over a window around it from the slope of a line, and the number of samples used.
fn changes(times: &[f64], values: &[f64], window: f64) -> Vec<(f64, usize)> {
    let n = times.len();
    let mut changes = vec![(0.0, 0); n];
    // Sums over the window, with times and values relative to the current ones, to reduce cancellation.
    let (mut first, mut end) = (0, 0);
    let origin = values.iter().copied().find(|value| value.is_finite()).unwrap_or(0.0);
    let mut sums = TrendSums::default();
    for k in 0..n {
        while end < n && times[end] <= times[k] + 0.5 * window {
            sums.add(times[end], values[end] - origin, 1.0);
            end += 1;
        }
        while times[first] < times[k] - 0.5 * window {
            sums.add(times[first], values[first] - origin, -1.0);
            first += 1;
        }
        if k % 1024 == 0 {
            sums = TrendSums { base: times[k], ..TrendSums::default() };
            (first..end).for_each(|i| sums.add(times[i], values[i] - origin, 1.0));
        }
        changes[k] = (sums.slope() * window, sums.count as usize);
    }
    changes
}

/// Sums for a regression on time.
#[derive(Default)]
struct TrendSums {
    base: f64,
    count: f64,
    t: f64,
    tt: f64,
    x: f64,
    tx: f64,
}

impl TrendSums {
    fn add(&mut self, t: f64, x: f64, sign: f64) {
        if x.is_finite() {
            let t = t - self.base;
            self.count += sign;
            self.t += sign * t;
            self.tt += sign * t * t;
            self.x += sign * x;
            self.tx += sign * t * x;
        }
    }

    fn slope(&self) -> f64 {
        let spread = self.tt - self.t * self.t / self.count;
        if self.count < 3.0 || spread <= 0.0 {
            return 0.0;
        }
        (self.tx - self.t * self.x / self.count) / spread
    }
}
