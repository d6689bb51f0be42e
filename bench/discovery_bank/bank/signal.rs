//! Inputs: how they are drawn, and their values between samples and in the past.

use super::random::Random;

/// A sampled signal with equal intervals, from time zero.
#[derive(Debug, Clone)]
pub(crate) struct Signal {
    interval: f64,
    is_linear: bool,
    values: Vec<f64>,
}

impl Signal {
    /// Keeps each value until the next sample, like an input that holds.
    pub(crate) fn held(interval: f64, values: &[f64]) -> Self {
        Signal { interval, is_linear: false, values: values.to_vec() }
    }

    /// Straight lines between samples, like an input that is `linear`.
    pub(crate) fn linear(interval: f64, values: &[f64]) -> Self {
        Signal { interval, is_linear: true, values: values.to_vec() }
    }

    /// The value at a time; before the first sample that sample's, after the last one the last.
    ///
    /// A held signal changes at its samples to within a thousand-millionth of an interval, so that times that
    /// are sums of steps do not fall on the wrong side.
    pub(crate) fn at(&self, t: f64) -> f64 {
        let x = (t / self.interval + 1e-9).max(0.0);
        let k = (x.floor() as usize).min(self.values.len() - 1);
        let a = self.values[k];
        if !self.is_linear {
            return a;
        }
        let b = self.values.get(k + 1).copied().unwrap_or(a);
        a + (b - a) * (x - k as f64).clamp(0.0, 1.0)
    }
}

/// So many samples of levels between two bounds, each for between so many samples.
pub(crate) fn steps(
    random: &mut Random,
    samples: usize,
    [low, high]: [f64; 2],
    [shortest, longest]: [usize; 2],
) -> Vec<f64> {
    let mut values = Vec::with_capacity(samples);
    while values.len() < samples {
        let level = four_digits(random.between(low, high));
        let length = random.whole(shortest, longest).min(samples - values.len());
        values.resize(values.len() + length, level);
    }
    values
}

/// The same with a straight line from each level to the next, over so many samples.
pub(crate) fn ramps(
    random: &mut Random,
    samples: usize,
    bounds: [f64; 2],
    lengths: [usize; 2],
    ramp: usize,
) -> Vec<f64> {
    smoothed(&steps(random, samples, bounds, lengths), ramp)
}

/// The mean of each sample and those before it.
fn smoothed(values: &[f64], over: usize) -> Vec<f64> {
    let mean = |k: usize| {
        let sum: f64 = (0..over).map(|back| values[k.saturating_sub(back)]).sum();
        four_digits(sum / over as f64)
    };
    (0..values.len()).map(mean).collect()
}

/// A sum of sine waves between two bounds, with periods in samples and random phases.
pub(crate) fn waves(
    random: &mut Random,
    samples: usize,
    [low, high]: [f64; 2],
    periods: &[f64],
) -> Vec<f64> {
    let phases: Vec<f64> = periods.iter().map(|_| random.between(0.0, 1.0)).collect();
    let value = |k: usize| {
        let waves = periods.iter().zip(&phases);
        let sum: f64 = waves
            .map(|(period, phase)| (std::f64::consts::TAU * (k as f64 / period + phase)).sin())
            .sum();
        let mean = sum / periods.len() as f64;
        four_digits(0.5 * (low + high) + 0.5 * (high - low) * mean)
    };
    (0..samples).map(value).collect()
}

/// To four significant digits, so that what is recorded is what acts.
pub(crate) fn four_digits(x: f64) -> f64 {
    format!("{x:.3e}").parse().unwrap_or(x)
}
