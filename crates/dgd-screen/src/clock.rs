//! Estimates the time lag between two channels of the same quantity.
//!
//! ```text
//!   D(l) = mean of (Δ_w b at k + l − Δ_w a at k)²,   Δ_w x at k = x(k + w) − x(k)
//! ```
//!
//! is smallest if the shift is l. A parabola through the minimum and its neighbours gives the fraction of a sample.
//! Least squares of changes (the sum of squares minus twice the cross-correlation) is not biased by an offset. Changes
//! over w samples are large relative to the noise, and x is first averaged over w samples, which shifts both alike and
//! makes D smooth. The standard error is that of a jackknife that leaves out one twentieth of the record at a time.
//!
//! Source: Jacovitti, Scarano, Discrete time techniques for time delay estimation, IEEE Trans. Signal
//! Processing 41 (1993) 525–533 (average square difference function).

use crate::record::usual_spacing;
use crate::statistics::estimate::Estimate;

/// Largest shift tried, in samples.
const FARTHEST: usize = 120;
/// Number of parts of the record for the jackknife.
const PARTS: usize = 20;
/// Number of samples over which changes are taken.
const SPAN: usize = 16;
/// Maximum ratio of the minimum of D to its mean.
const CLEAR: f64 = 0.5;

/// The lag of `b` behind `a`, s; positive if `b` is late.
///
/// `None` if the recording does not change enough, or is too short. Samples that are not equally spaced are
/// interpolated.
///
/// # Panics
///
/// If the slices differ in length.
pub fn shift(times: &[f64], a: &[f64], b: &[f64]) -> Option<Estimate> {
    assert!(times.len() == a.len() && times.len() == b.len(), "values for each time");
    let spacing = usual_spacing(times)?;
    let (a, b) = (even(times, a, spacing)?, even(times, b, spacing)?);
    let farthest = FARTHEST.min(a.len() / 8);
    if farthest < 2 || a.len() < 4 * SPAN {
        return None;
    }
    let (a, b) = (changes(&a), changes(&b));
    let n = a.len();
    let lags = 2 * farthest + 1;
    // Sums of squares for each part and lag, over the samples that all lags have.
    let parts: Vec<Vec<(f64, usize)>> = (0..PARTS)
        .map(|part| {
            let inner = n.saturating_sub(2 * farthest);
            let (from, until) =
                (farthest + part * inner / PARTS, farthest + (part + 1) * inner / PARTS);
            (0..lags)
                .map(|lag| {
                    let other = &b[from + lag - farthest..until + lag - farthest];
                    let squares = a[from..until].iter().zip(other).map(|(a, b)| (b - a).powi(2));
                    squares.filter(|x| x.is_finite()).fold((0.0, 0), |(s, n), x| (s + x, n + 1))
                })
                .collect()
        })
        .collect();
    let without = |left_out: Option<usize>| -> Option<f64> {
        let kept = || parts.iter().enumerate().filter(|(part, _)| Some(*part) != left_out);
        let mean: Vec<f64> = (0..lags)
            .map(|lag| {
                let sum: f64 = kept().map(|(_, part)| part[lag].0).sum();
                let count: usize = kept().map(|(_, part)| part[lag].1).sum();
                sum / count as f64
            })
            .collect();
        least(&mean).map(|at| (at - farthest as f64) * spacing)
    };
    let value = without(None)?;
    let mut leaving = Vec::with_capacity(PARTS);
    for part in 0..PARTS {
        leaving.push(without(Some(part))?);
    }
    let m = PARTS as f64;
    let centre = leaving.iter().sum::<f64>() / m;
    let squares: f64 = leaving.iter().map(|x| (x - centre).powi(2)).sum();
    let std_error = ((m - 1.0) / m * squares).sqrt();
    Some(Estimate { value, std_error, dof: m - 1.0 })
}

/// Δ_w of means over w samples.
fn changes(x: &[f64]) -> Vec<f64> {
    let mean = |k: usize| x[k..k + SPAN].iter().sum::<f64>() / SPAN as f64;
    let means: Vec<f64> = (0..=x.len() - SPAN).map(mean).collect();
    (SPAN..means.len()).map(|k| means[k] - means[k - SPAN]).collect()
}

/// The interpolated position of a sequence's minimum; `None` at an end or if it is too shallow.
fn least(mean: &[f64]) -> Option<f64> {
    let average = mean.iter().sum::<f64>() / mean.len() as f64;
    let position = (0..mean.len()).min_by(|i, j| mean[*i].total_cmp(&mean[*j]))?;
    if position == 0
        || position + 1 == mean.len()
        || mean[position].is_nan()
        || mean[position] > CLEAR * average
    {
        return None;
    }
    let (before, here, after) = (mean[position - 1], mean[position], mean[position + 1]);
    let curvature = before - 2.0 * here + after;
    (curvature > 0.0).then(|| position as f64 + 0.5 * (before - after) / curvature)
}

/// Values at equal steps from the first time, interpolated where missing, but not across more than three missing ones.
fn even(times: &[f64], values: &[f64], spacing: f64) -> Option<Vec<f64>> {
    let (first, last) = (*times.first()?, *times.last()?);
    let n = ((last - first) / spacing).round() as usize + 1;
    // Gaps are not filled: a day without samples does not make a record longer.
    if n > 4 * times.len() {
        return None;
    }
    let valid: Vec<usize> = (0..times.len()).filter(|k| values[*k].is_finite()).collect();
    let mut next = 0;
    let value_at = |k: usize| {
        let t = first + k as f64 * spacing;
        while next < valid.len() && times[valid[next]] < t - 1e-9 * spacing {
            next += 1;
        }
        let Some(&right) = valid.get(next) else { return f64::NAN };
        if (times[right] - t).abs() <= 1e-6 * spacing || next == 0 {
            return if (times[right] - t).abs() <= 0.5 * spacing {
                values[right]
            } else {
                f64::NAN
            };
        }
        let left = valid[next - 1];
        let width = times[right] - times[left];
        if width > 4.0 * spacing {
            return f64::NAN;
        }
        let share = (t - times[left]) / width;
        values[left] + share * (values[right] - values[left])
    };
    Some((0..n).map(value_at).collect())
}
