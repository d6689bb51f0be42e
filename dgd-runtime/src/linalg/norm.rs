//! The norm of local errors: weighted by tolerances, mean square over blocks.

// Lengths are constants if storage has a fixed size, but only after inlining.
#![allow(clippy::inline_always)]

/// A value that a step has increased by more than this factor, and beyond its size, may consist of the step's error.
const MOST_GROWTH: f64 = 10.0;

/// Tolerances of a step.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Tolerances {
    pub(crate) rtol: f64,
    pub(crate) atol: f64,
}

impl Tolerances {
    /// Error weight: rtol |y| + atol · size.
    #[inline(always)]
    pub(crate) fn weight(self, y: f64, size: f64) -> f64 {
        self.rtol * y.abs() + self.atol * size
    }

    /// The value that scales the error of a step from `y` to `y_new`: the larger one, as far as it is trusted.
    #[inline(always)]
    pub(crate) fn judging(y: f64, y_new: f64, size: f64) -> f64 {
        y.abs().max(y_new.abs().min(Self::most(y, size)))
    }

    /// Up to where a value that was `y` is trusted after a step.
    #[inline(always)]
    pub(crate) fn most(y: f64, size: f64) -> f64 {
        MOST_GROWTH * y.abs().max(size)
    }

    /// Mean of (eᵢ / wᵢ)², the square of the weighted root-mean-square norm, with the larger of two values of each
    /// unknown in its weight, as far as it is trusted. Zero for empty slices.
    #[inline(always)]
    pub(crate) fn mean_square(self, e: &[f64], y: &[f64], y_new: &[f64], sizes: &[f64]) -> f64 {
        if e.is_empty() {
            return 0.0;
        }
        let n = e.len();
        let (y, y_new, sizes) = (&y[..n], &y_new[..n], &sizes[..n]);
        let mut sum = 0.0;
        for i in 0..n {
            let value = Self::judging(y[i], y_new[i], sizes[i]);
            let ratio = e[i] / self.weight(value, sizes[i]);
            sum += ratio * ratio;
        }
        sum / e.len() as f64
    }
}

/// The largest mean square over blocks of n numbers; NaN if one is NaN.
#[inline(always)]
pub(crate) fn largest_block(
    tolerances: Tolerances,
    n: usize,
    e: &[f64],
    y: &[f64],
    y_new: &[f64],
    sizes: &[f64],
) -> f64 {
    let mut largest = 0.0;
    for first in (0..e.len()).step_by(n) {
        let block = first..first + n;
        let [e, y, y_new] = [&e[block.clone()], &y[block.clone()], &y_new[block.clone()]];
        largest = larger(largest, tolerances.mean_square(e, y, y_new, &sizes[block]));
    }
    largest
}

/// The larger of two numbers; NaN if one is NaN.
#[inline(always)]
pub(crate) fn larger(a: f64, b: f64) -> f64 {
    if a >= b || a.is_nan() { a } else { b }
}
