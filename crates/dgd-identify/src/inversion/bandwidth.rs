//! The maximum likelihood width of the window.
//!
//! As d is free, y less the contribution of g is an integral of d, observed with noise:
//!
//! ```text
//!   Y' = c d,   ⟨(d(t + h) − d(t))²⟩ = q h,   Y + noise = y − ∫ g dt          of a differential equation
//!               ⟨(d(t + h) − d(t))²⟩ = q h,   d + noise = −g/c                 of an algebraic one
//! ```
//!
//! q maximises the likelihood of the innovations of a Kalman filter. The corresponding smoother passes a frequency ω by
//! 1/(1 + (ω τ)⁴), τ⁴ = r Δ/(c² q), or by 1/(1 + (ω τ)²), τ² = r Δ/q, with r the variance of a reading and Δ the time
//! between two. The window is chosen to halve the frequency that the smoother halves, ω = 1/τ.
//!
//! Source for the smoother's frequencies: Harvey, Forecasting, Structural Time Series Models and the Kalman Filter
//! (1989), §8.2.

use super::samples::{EquationSample, EquationSamples};

/// ω h at which ∫ φ cos ω s ds falls to half of ∫ φ ds.
const HALVED: f64 = 3.2;
/// Decades of √q that are searched around the size at which a step of d is just visible.
const DECADES: i32 = 8;
/// Size of the last step, in decades.
const LAST_STEP: f64 = 0.05;
/// Diffuse initial variances, relative to that of a reading.
const DIFFUSE: f64 = 1e8;
/// Lower and upper limit of the width: in samples, and as a fraction of the recording.
const LEAST_SAMPLES: f64 = 3.0;
const MOST_PART: f64 = 0.25;

/// Half the width, s.
pub(super) fn most_likely(samples: &EquationSamples) -> f64 {
    let known = &samples.known;
    let spacing = samples.spacing();
    let duration = known[known.len() - 1].t - known[0].t;
    let sums_up = samples.sums_up();
    let usual = |of: &dyn Fn(&EquationSample) -> f64| {
        let mut variances: Vec<f64> = known.iter().map(of).collect();
        variances.sort_by(f64::total_cmp);
        variances[variances.len() / 2]
    };
    let c = usual(&|own| own.c.abs());
    // Variance of a reading of the integral of d, or of d itself, in units of d.
    let reading = if sums_up {
        usual(&|own| own.variance(1.0, 0.0)) / (c * c)
    } else {
        usual(&|own| own.variance(0.0, 1.0 / own.c))
    };
    let (least, most) = (LEAST_SAMPLES * spacing, MOST_PART * duration);
    if !(reading > 0.0 && spacing > 0.0) {
        return least.min(most);
    }
    // The step of d that is visible after one interval.
    let shows = if sums_up { reading / spacing.powi(3) } else { reading / spacing };
    let likelihood = |decades: f64| log_likelihood(samples, shows * 100_f64.powf(decades), reading);
    let (mut best, mut value) = (0.0, f64::NEG_INFINITY);
    for decade in -DECADES..=2 {
        let log_likelihood_here = likelihood(f64::from(decade));
        if log_likelihood_here > value {
            (best, value) = (f64::from(decade), log_likelihood_here);
        }
    }
    let mut step = 0.5;
    while step > LAST_STEP {
        for side in [best - step, best + step] {
            let log_likelihood_here = likelihood(side);
            if log_likelihood_here > value {
                (best, value) = (side, log_likelihood_here);
            }
        }
        step *= 0.5;
    }
    let q = shows * 100_f64.powf(best);
    let tau =
        if sums_up { (reading * spacing / q).powf(0.25) } else { (reading * spacing / q).sqrt() };
    (HALVED * tau).max(least).min(most.max(least))
}

/// The log-likelihood of the readings, with d a random walk of this intensity.
fn log_likelihood(samples: &EquationSamples, q: f64, reading: f64) -> f64 {
    let known = &samples.known;
    // Y in units of d times s, and d.
    let span = (known[known.len() - 1].t - known[0].t).max(samples.spacing());
    let mut z = [0.0; 2];
    let start = |own: &EquationSample| {
        let sum = DIFFUSE * reading;
        let d = DIFFUSE * reading / (if own.is_differential { span * span } else { 1.0 });
        [[sum, 0.0], [0.0, d]]
    };
    let mut p = start(&known[0]);
    let mut integral = 0.0;
    let mut total = 0.0;
    for (k, own) in known.iter().enumerate() {
        if k > 0 {
            let before = &known[k - 1];
            let h = own.t - before.t;
            if own.goes_on {
                let rate = |own: &EquationSample| own.g / own.c;
                let c = 0.5 * (1.0 / before.c + 1.0 / own.c);
                integral += c * (own.y - before.y) - 0.5 * h * (rate(before) + rate(own));
                let noise = before.variance(0.0, h / before.c);
                z[0] += h * z[1];
                let [[a, b], [_, d]] = p;
                let cubic = q * h * h * h / 3.0;
                let square = q * h * h / 2.0;
                p = [
                    [a + 2.0 * h * b + h * h * d + cubic + noise, b + h * d + square],
                    [b + h * d + square, d + q * h],
                ];
            } else {
                (z, integral) = ([0.0, z[1]], 0.0);
                p = start(own);
            }
        }
        // The reading is of the integral, or of d itself.
        let (seen, value, r) = if own.is_differential {
            (0, integral, own.variance(1.0 / own.c, 0.0))
        } else {
            (1, -own.g / own.c, own.variance(0.0, 1.0 / own.c))
        };
        let s = p[seen][seen] + r;
        let innovation = value - z[seen];
        if !(s > 0.0 && s.is_finite()) {
            continue;
        }
        total -= 0.5 * (innovation * innovation / s + s.ln());
        let gain = [p[0][seen] / s, p[1][seen] / s];
        let row = p[seen];
        for (i, gain) in gain.iter().enumerate() {
            z[i] += gain * innovation;
            for (j, row) in row.iter().enumerate() {
                p[i][j] -= gain * row;
            }
        }
    }
    total
}
