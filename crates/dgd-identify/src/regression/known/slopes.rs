//! Slopes of sampled signals.
//!
//! ```text
//!   y(t) ≈ a + b (t − t_k) + c (t − t_k)²     least squares over |t − t_k| ≤ half_width
//!   ẏ(t_k) = b
//! ```
//!
//! With equal steps h, m samples on either side and white noise σ, the standard deviation of b is σ √3 / (h √(m (m + 1)
//! (2m + 1))), and its bias is half_width²/10 times the third derivative.
//!
//! Times need not be regular, and samples may be missing. A window ends where two samples have the same time, as inputs
//! jump there, and before a sample that follows an event: there slopes jump, or even values.
//!
//! Savitzky, Golay, Analytical Chemistry 36 (1964) 1627; for irregular times local regression,
//! Cleveland, J. Am. Stat. Assoc. 74 (1979) 829, without weights.

use std::ops::Range;

/// Minimum number of samples in a window: one more than the parabola has coefficients.
const LEAST_SAMPLES: usize = 4;

/// Slopes at all times; NaN where `y` is, and where a window has too few samples.
pub(crate) fn slopes(times: &[f64], cuts: &[bool], y: &[f64], half_width: f64) -> Vec<f64> {
    let mut rates = vec![f64::NAN; times.len()];
    for stretch in stretches(times, cuts) {
        let mut window = stretch.start..stretch.start;
        for k in stretch.clone() {
            let t = times[k];
            while window.end < stretch.end && times[window.end] <= t + half_width {
                window.end += 1;
            }
            while times[window.start] < t - half_width {
                window.start += 1;
            }
            if y[k].is_finite() {
                rates[k] = slope(&times[window.clone()], &y[window.clone()], t, half_width);
            }
        }
    }
    rates
}

/// Stretches with distinct times and without events.
fn stretches(times: &[f64], cuts: &[bool]) -> Vec<Range<usize>> {
    let mut stretches = Vec::new();
    let mut first = 0;
    for k in 1..=times.len() {
        if k == times.len() || times[k] == times[k - 1] || cuts[k] {
            stretches.push(first..k);
            first = k;
        }
    }
    stretches
}

/// b of one window.
fn slope(times: &[f64], y: &[f64], t: f64, half_width: f64) -> f64 {
    // Orthogonal polynomials of the window's own samples: 1, s − s̄, and a parabola.
    let samples = || {
        let scaled = times.iter().map(|time| (time - t) / half_width);
        scaled.zip(y).filter(|(_, y)| y.is_finite())
    };
    let n = samples().count();
    if n < LEAST_SAMPLES {
        return f64::NAN;
    }
    let mean = samples().map(|(s, _)| s).sum::<f64>() / n as f64;
    let (mut s2, mut s3) = (0.0, 0.0);
    for (s, _) in samples() {
        let x = s - mean;
        s2 += x * x;
        s3 += x * x * x;
    }
    // q(x) = x² − (s3/s2) x − s2/n
    let (tilt, level) = (s3 / s2, s2 / n as f64);
    let (mut along_x, mut along_q, mut q2) = (0.0, 0.0, 0.0);
    for (s, y) in samples() {
        let x = s - mean;
        let q = (x - tilt) * x - level;
        along_x += x * y;
        along_q += q * y;
        q2 += q * q;
    }
    // Slope at s = 0, where x = −s̄.
    (along_x / s2 + along_q / q2 * (-2.0 * mean - tilt)) / half_width
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parabolas_on_irregular_stamps_have_exact_slopes() {
        let times: Vec<f64> = (0..60)
            .map(f64::from)
            .map(|k| k + 0.3 * (1.7 * k).sin())
            .filter(|t| *t != 9.0)
            .collect();
        let parabola = |t: f64| 2.0 - 0.5 * t + 0.01 * t * t;
        let mut y: Vec<f64> = times.iter().map(|t| parabola(*t)).collect();
        y[20] = f64::NAN;
        let found = slopes(&times, &vec![false; times.len()], &y, 4.0);
        assert!(found[20].is_nan());
        for (k, (t, slope)) in times.iter().zip(&found).enumerate().filter(|(k, _)| *k != 20) {
            assert!((slope - (-0.5 + 0.02 * t)).abs() < 1e-12, "{k}: {slope}");
        }
    }

    #[test]
    fn noise_is_damped_as_the_formula_says() {
        // One sample is off by 1 at a time: the sum of squared weights is the variance of the slope.
        let times: Vec<f64> = (0..21).map(|k| 0.5 * f64::from(k)).collect();
        let variance: f64 = (0..21)
            .map(|k| {
                let mut y = vec![0.0; 21];
                y[k] = 1.0;
                slopes(&times, &[false; 21], &y, 2.5)[10].powi(2)
            })
            .sum();
        let expected = 3.0 / (0.25 * 5.0 * 6.0 * 11.0);
        assert!((variance / expected - 1.0).abs() < 1e-12, "{variance} {expected}");
    }

    #[test]
    fn a_kink_at_two_samples_of_one_time_is_not_smoothed() {
        let times = [0.0, 1.0, 2.0, 3.0, 4.0, 4.0, 5.0, 6.0, 7.0, 8.0];
        let y = [0.0, 1.0, 2.0, 3.0, 4.0, 4.0, 3.0, 2.0, 1.0, 0.0];
        let found = slopes(&times, &[false; 10], &y, 3.0);
        for (k, slope) in found.iter().enumerate() {
            let expected = if k < 5 { 1.0 } else { -1.0 };
            assert!((slope - expected).abs() < 1e-12, "{k}: {slope}");
        }
    }
}
