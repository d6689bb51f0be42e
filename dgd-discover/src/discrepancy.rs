//! When the misfit stands out from the noise.
//!
//! The average of m samples of white noise has a standard deviation of σ/√m. A stretch of time is
//! marked where such an average exceeds c σ/√m, with c from
//!
//! ```text
//!   P(|z| > c) = α/(number of averages taken),   α = 10⁻³
//! ```
//!
//! Bonferroni's bound over all samples and lengths: a record of noise has a window in one case in a
//! thousand at most. Short lengths find short misfits of several σ, long ones find faint and lasting
//! ones.

use crate::windows::{Window, gather};
use dgd_screen::distribution::normal_threshold;

/// Lengths of the moving averages, s.
pub const AVERAGING_LENGTHS: [f64; 4] = [10.0, 30.0, 100.0, 300.0];

/// How often a record of noise may have a window.
const FALSE_ALARMS: f64 = 1e-3;

/// Windows in which the residuals of one output stand out from white noise of standard deviation
/// `noise`, in order of time.
///
/// Each average above its threshold marks the inner half of its length, so that averages on the
/// flank of a misfit do not widen it. Lengths are taken in ascending order, and what a shorter one
/// has marked is left out of the longer ones, which would smear it. A length below the spacing of
/// samples is one sample. Samples that are not finite are skipped. There are no windows where `noise`
/// is not positive.
///
/// # Panics
///
/// When the slices differ in length.
pub fn discrepancy_windows(
    times: &[f64],
    residuals: &[f64],
    noise: f64,
    lengths: &[f64],
) -> Vec<Window> {
    assert_eq!(times.len(), residuals.len(), "a residual for each time");
    let valid: Vec<usize> = (0..times.len()).filter(|k| residuals[*k].is_finite()).collect();
    if valid.is_empty() || lengths.is_empty() || !(noise > 0.0 && noise.is_finite()) {
        return Vec::new();
    }
    let mut lengths = lengths.to_vec();
    lengths.sort_unstable_by(f64::total_cmp);
    let threshold = normal_threshold(FALSE_ALARMS / (valid.len() * lengths.len()) as f64);

    let mut marked: Vec<Option<f64>> = vec![None; times.len()];
    for length in &lengths {
        let left: Vec<usize> = valid.iter().copied().filter(|k| marked[*k].is_none()).collect();
        for (centre, sigma) in standing_out(times, residuals, noise, &left, *length, threshold) {
            let within = |i: &&usize| (times[**i] - times[left[centre]]).abs() <= 0.25 * length;
            let before = left[..centre].iter().rev().take_while(within);
            for &k in before.chain(left[centre..].iter().take_while(within)) {
                if marked[k].is_none_or(|earlier| sigma.abs() > earlier.abs()) {
                    marked[k] = Some(sigma);
                }
            }
        }
    }
    // Pieces closer than the shortest average can tell apart are one.
    gather(times, residuals, &marked, lengths[0])
}

/// Averages over `length` around each of the samples `left` that exceed the threshold: position in
/// `left`, and average over its standard deviation.
fn standing_out(
    times: &[f64],
    residuals: &[f64],
    noise: f64,
    left: &[usize],
    length: f64,
    threshold: f64,
) -> Vec<(usize, f64)> {
    let mut sums = vec![0.0];
    for &k in left {
        sums.push(sums[sums.len() - 1] + residuals[k]);
    }
    let (mut first, mut end) = (0, 0);
    let mut found = Vec::new();
    for (centre, &k) in left.iter().enumerate() {
        while first < centre && times[left[first]] < times[k] - 0.5 * length {
            first += 1;
        }
        end = end.max(centre + 1);
        while end < left.len() && times[left[end]] <= times[k] + 0.5 * length {
            end += 1;
        }
        let m = (end - first) as f64;
        let sigma = (sums[end] - sums[first]) / (m.sqrt() * noise);
        if sigma.abs() > threshold {
            found.push((centre, sigma));
        }
    }
    found
}
