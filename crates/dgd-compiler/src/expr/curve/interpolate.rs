//! Interpolates points by piecewise polynomials.

use super::Curve;
use crate::syntax::ast::{TableExtrapolation, TableInterpolation};

/// The curve through at least two points with ascending abscissae. Of two points at one abscissa the first ends the
/// piece before the step, and the second begins the next.
///
/// Between points the curve has its shape, separately on each side of a step. Beyond its ends it holds their values or
/// continues with their slopes. It also continues where its table refuses extrapolation, because steps evaluate it
/// there before they are cut.
pub fn through(
    shape: TableInterpolation,
    beyond: TableExtrapolation,
    x: &[f64],
    y: &[f64],
) -> Curve {
    let (mut knots, mut pieces) = (Vec::with_capacity(x.len()), Vec::with_capacity(x.len() + 1));
    let (mut begin, mut last) = (0, [0.0; 2]);
    for section in x.chunk_by(|a, b| a != b) {
        let end = begin + section.len();
        let (inner, slopes) = between(shape, section, &y[begin..end]);
        if pieces.is_empty() {
            pieces.push([y[begin], slopes[0], 0.0, 0.0]);
        }
        pieces.extend(inner);
        // The knot of a step is already there.
        knots.extend(&section[usize::from(begin > 0)..]);
        (begin, last) = (end, [y[end - 1], slopes[1]]);
    }
    pieces.push([last[0], last[1], 0.0, 0.0]);
    if beyond == TableExtrapolation::Hold {
        let n = pieces.len() - 1;
        (pieces[0][1], pieces[n][1]) = (0.0, 0.0);
    }
    Curve { knots: knots.into(), pieces: pieces.into() }
}

/// The pieces between points without a step, and the slopes at the first and the last.
fn between(shape: TableInterpolation, x: &[f64], y: &[f64]) -> (Vec<[f64; 4]>, [f64; 2]) {
    let n = x.len();
    if n == 1 {
        return (Vec::new(), [0.0; 2]);
    }
    let slopes = match shape {
        TableInterpolation::Linear => Vec::new(),
        TableInterpolation::Pchip => monotone_slopes(x, y),
        TableInterpolation::Natural | TableInterpolation::Cubic => natural_slopes(x, y),
    };
    let pieces = (0..n - 1).map(|k| {
        let (h, delta) = (x[k + 1] - x[k], secant(x, y, k));
        match slopes.get(k..k + 2) {
            Some(&[left, right]) => hermite(y[k], h, delta, left, right),
            _ => [y[k], delta, 0.0, 0.0],
        }
    });
    let slope = |k: usize, of_secant: usize| {
        slopes.get(k).copied().unwrap_or_else(|| secant(x, y, of_secant))
    };
    (pieces.collect(), [slope(0, 0), slope(n - 1, n - 2)])
}

/// The broken line that is k at the k-th of these abscissae, and continues beyond them so that it reaches the next
/// whole number at a distance of `width`.
pub fn position(at: &[f64], width: f64) -> Curve {
    let slope = 1.0 / width;
    let mut pieces = vec![[0.0, slope, 0.0, 0.0]];
    for (k, pair) in at.windows(2).enumerate() {
        pieces.push([k as f64, 1.0 / (pair[1] - pair[0]), 0.0, 0.0]);
    }
    pieces.push([at.len() as f64 - 1.0, slope, 0.0, 0.0]);
    Curve { knots: at.to_vec().into(), pieces: pieces.into() }
}

fn secant(x: &[f64], y: &[f64], k: usize) -> f64 {
    (y[k + 1] - y[k]) / (x[k + 1] - x[k])
}

/// The cubic of an interval with this secant and these slopes at its ends.
fn hermite(y: f64, h: f64, delta: f64, left: f64, right: f64) -> [f64; 4] {
    let c2 = (3.0 * delta - 2.0 * left - right) / h;
    let c3 = (left + right - 2.0 * delta) / (h * h);
    [y, left, c2, c3]
}

/// Slopes that preserve monotonicity between points.
///
/// # Source
///
/// Fritsch and Butland, A method for constructing local monotone piecewise cubic interpolants, SIAM J. Sci. Stat.
/// Comput. 5 (1984) 300–304, equation 5; at the ends the formula of three points of Moler, Numerical Computing with
/// MATLAB (2004), §3.6.
fn monotone_slopes(x: &[f64], y: &[f64]) -> Vec<f64> {
    let n = x.len();
    let delta: Vec<f64> = (0..n - 1).map(|k| secant(x, y, k)).collect();
    if n == 2 {
        return vec![delta[0]; 2];
    }
    let h: Vec<f64> = x.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let mut slopes = vec![0.0; n];
    for k in 1..n - 1 {
        let (before, behind) = (delta[k - 1], delta[k]);
        if before * behind > 0.0 {
            let (w1, w2) = (2.0 * h[k] + h[k - 1], h[k] + 2.0 * h[k - 1]);
            slopes[k] = (w1 + w2) / (w1 / before + w2 / behind);
        }
    }
    slopes[0] = end_slope(h[0], h[1], delta[0], delta[1]);
    slopes[n - 1] = end_slope(h[n - 2], h[n - 3], delta[n - 2], delta[n - 3]);
    slopes
}

/// The slope at an end of the parabola through three points, limited to preserve monotonicity.
fn end_slope(h: f64, next: f64, delta: f64, behind: f64) -> f64 {
    let slope = ((2.0 * h + next) * delta - h * behind) / (h + next);
    if slope * delta <= 0.0 {
        0.0
    } else if delta * behind <= 0.0 && slope.abs() > 3.0 * delta.abs() {
        3.0 * delta
    } else {
        slope
    }
}

/// Slopes that make the curvature continuous, and zero at both ends.
///
/// ```text
///   2 s₀ + s₁ = 3 δ₀,   s_{k−1}/h_{k−1} + 2 (1/h_{k−1} + 1/h_k) s_k + s_{k+1}/h_k = 3 (δ_{k−1}/h_{k−1} + δ_k/h_k)
/// ```
///
/// # Source
///
/// De Boor, A Practical Guide to Splines (1978), chapter IV.
fn natural_slopes(x: &[f64], y: &[f64]) -> Vec<f64> {
    let n = x.len();
    let delta: Vec<f64> = (0..n - 1).map(|k| secant(x, y, k)).collect();
    let inverse: Vec<f64> = x.windows(2).map(|pair| 1.0 / (pair[1] - pair[0])).collect();
    // The tridiagonal system, eliminated on the fly: it is diagonally dominant.
    let (mut diagonal, mut right) = (vec![0.0; n], vec![0.0; n]);
    for k in 0..n {
        let before = k.checked_sub(1).map(|k| (inverse[k], delta[k]));
        let behind = inverse.get(k).map(|inverse| (*inverse, delta[k]));
        for (inverse, delta) in before.into_iter().chain(behind) {
            diagonal[k] += 2.0 * inverse;
            right[k] += 3.0 * inverse * delta;
        }
        if let Some((inverse, _)) = before {
            let factor = inverse / diagonal[k - 1];
            diagonal[k] -= factor * inverse;
            right[k] -= factor * right[k - 1];
        }
    }
    let mut slopes = right;
    for k in (0..n).rev() {
        if let Some(inverse) = inverse.get(k) {
            slopes[k] -= inverse * slopes[k + 1];
        }
        slopes[k] /= diagonal[k];
    }
    slopes
}

#[cfg(test)]
mod tests;
