//! Means over a window, without derivatives of measured values.
//!
//! With weights φ(s) = (1 − (s/h)²)² for |s| < h around a sample, and t_k the samples of the window,
//!
//! ```text
//!   d̂ = ∫ φ (m ẏ − g)/c dt / ∫ φ dt
//!     ≈ Σ ½ (φ_k/c_k + φ_{k+1}/c_{k+1}) (y_{k+1} − y_k) − Σ ½ h_k (φ_k g_k/c_k + φ_{k+1} g_{k+1}/c_{k+1})   over   Σ ½ h_k (φ_k + φ_{k+1})
//! ```
//!
//! so d̂ is the mean of d with these weights, whatever the shape of d, up to the trapezoidal rule; at an end of the
//! recording half of the window remains. It is linear in the readings, and its variance is Σ (∂d̂/∂w)² σ² over all
//! readings of all sensors, each taken as white, summed once over all their contributions.

use super::samples::{EquationSample, EquationSamples};

/// Minimum number of samples in a window.
const LEAST_SAMPLES: usize = 4;
/// The fraction of a whole window's weight that has to be known.
const LEAST_WEIGHT: f64 = 0.4;
/// ∫ (1 − x²)² dx from −1 to 1.
const WEIGHT: f64 = 16.0 / 15.0;

/// Values over time, and their standard deviations.
#[derive(Debug, Clone, PartialEq)]
pub struct SignalTrace {
    /// Values, SI; NaN if unknown.
    pub value: Vec<f64>,
    /// Standard deviations due to the sensors' noise.
    pub std: Vec<f64>,
}

impl SignalTrace {
    fn unknown(n: usize) -> Self {
        SignalTrace { value: vec![f64::NAN; n], std: vec![f64::NAN; n] }
    }
}

/// The contribution of an interval between two samples, with weights at its ends.
fn interval(from: &EquationSample, to: &EquationSample, weights: [f64; 2]) -> f64 {
    let [a, b] = [weights[0] / from.c, weights[1] / to.c];
    let step = to.t - from.t;
    0.5 * (a + b) * (to.y - from.y) - 0.5 * step * (a * from.g + b * to.g)
}

/// d̂ at all samples.
pub(super) fn means(samples: &EquationSamples, half_width: f64) -> SignalTrace {
    let known = &samples.known;
    let mut trace = SignalTrace::unknown(samples.times.len());
    let (mut first, mut end) = (0, 0);
    let mut weights: Vec<f64> = Vec::new();
    for sample in known {
        while known[first].t <= sample.t - half_width {
            first += 1;
        }
        while end < known.len() && known[end].t < sample.t + half_width {
            end += 1;
        }
        let window = &known[first..end];
        if window.len() < LEAST_SAMPLES {
            continue;
        }
        weights.clear();
        weights.extend(window.iter().map(|own| {
            let x = (own.t - sample.t) / half_width;
            (1.0 - x * x).powi(2)
        }));
        let joined = |k: usize| {
            let gap = window[k + 1].t - window[k].t;
            window[k + 1].goes_on && gap <= half_width
        };
        let (mut sum, mut weight) = (0.0, 0.0);
        for k in (0..window.len() - 1).filter(|k| joined(*k)) {
            sum += interval(&window[k], &window[k + 1], [weights[k], weights[k + 1]]);
            weight += 0.5 * (window[k + 1].t - window[k].t) * (weights[k] + weights[k + 1]);
        }
        if weight < LEAST_WEIGHT * WEIGHT * half_width {
            continue;
        }
        let mut variance = 0.0;
        for (k, own) in window.iter().enumerate() {
            let before = (k > 0 && joined(k - 1)).then(|| k - 1);
            let after = (k + 1 < window.len() && joined(k)).then(|| k + 1);
            let scaled = |j: usize| weights[j] / window[j].c;
            let by_y = before.map_or(0.0, |j| 0.5 * (scaled(j) + scaled(k)))
                - after.map_or(0.0, |j| 0.5 * (scaled(k) + scaled(j)));
            let step = before.map_or(0.0, |j| own.t - window[j].t)
                + after.map_or(0.0, |j| window[j].t - own.t);
            variance += own.variance(by_y, -0.5 * step * scaled(k));
        }
        trace.value[sample.at] = sum / weight;
        trace.std[sample.at] = variance.sqrt() / weight;
    }
    trace
}

/// ∫ d dt, and the time that it excludes.
pub(super) fn integral(samples: &EquationSamples) -> (SignalTrace, f64) {
    let known = &samples.known;
    let mut trace = SignalTrace::unknown(samples.times.len());
    let (mut sum, mut inside, mut left_out) = (0.0, 0.0, 0.0);
    let spacing = samples.spacing();
    // Weights of the last sample so far: on y and on g.
    let mut last = [0.0; 2];
    for (k, own) in known.iter().enumerate() {
        if k > 0 {
            let before = &known[k - 1];
            let step = own.t - before.t;
            if own.goes_on && step <= MOST_GAP * spacing {
                sum += interval(before, own, [1.0, 1.0]);
                let mean = 0.5 * (1.0 / before.c + 1.0 / own.c);
                inside += before.variance(last[0] - mean, last[1] - 0.5 * step / before.c);
                last = [mean, -0.5 * step / own.c];
            } else {
                inside += before.variance(last[0], last[1]);
                last = [0.0; 2];
                left_out += step;
            }
        }
        trace.value[own.at] = sum;
        trace.std[own.at] = (inside + own.variance(last[0], last[1])).sqrt();
    }
    (trace, left_out)
}

/// Length limit of gaps that are bridged, in usual intervals.
const MOST_GAP: f64 = 20.0;

impl EquationSample {
    /// The variance due to the readings of a quantity with these weights on y and on g.
    pub(super) fn variance(&self, by_y: f64, by_g: f64) -> f64 {
        let errors = self.y_errors.iter().zip(&self.g_errors);
        errors.map(|(y, g)| (by_y * y + by_g * g).powi(2)).sum()
    }
}
