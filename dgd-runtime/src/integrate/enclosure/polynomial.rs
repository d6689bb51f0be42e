//! Tubes of polynomials.

use super::interval::Interval;
use super::tube::Tube;
use crate::codegen::taylor::MOST_ORDER;

/// Coefficients of a polynomial in powers of its variable, from the zeroth.
pub(crate) type PolynomialCoefficients = [f64; MOST_ORDER + 1];

/// A polynomial, and the sum of the sizes of all terms that were added up to it, from which its rounding follows.
#[derive(Debug, Clone)]
pub(super) struct Polynomial {
    pub(super) coefficients: PolynomialCoefficients,
    pub(super) len: usize,
    pub(super) size: f64,
}

impl Polynomial {
    /// The polynomial that is zero.
    pub(super) const ZERO: Self = Self { coefficients: [0.0; MOST_ORDER + 1], len: 1, size: 0.0 };

    /// Takes the size from the coefficients.
    pub(super) fn measure(&mut self) {
        self.size = self.coefficients[..self.len].iter().map(|c| c.abs()).sum();
    }

    /// a + f b.
    pub(super) fn add_multiple(&mut self, a: &Self, f: f64, b: &Self) {
        self.len = a.len.max(b.len);
        for k in 0..self.len {
            let coefficient = |x: &Self| if k < x.len { x.coefficients[k] } else { 0.0 };
            self.coefficients[k] = coefficient(a) + f * coefficient(b);
        }
        self.size = a.size + f.abs() * b.size;
    }

    /// Its tube from a to b, which are between 0 and 1.
    pub(super) fn tube(&self, a: f64, b: f64) -> Tube {
        tube_with(&self.coefficients[..self.len], self.size, a, b)
    }
}

/// The polynomial with these coefficients from a to b.
///
/// Around the middle m, with q its Taylor coefficients there and r = (b − a)/2,
///
/// ```text
///   x ∈ q₀ ± Σ |q_k| r^k,    x' ∈ q₁ ± Σ k |q_k| r^(k−1), k > 1
/// ```
pub(crate) fn tube_of(coefficients: &[f64], a: f64, b: f64) -> Tube {
    tube_with(coefficients, 0.0, a, b)
}

/// The same where the coefficients are sums of terms of this size.
fn tube_with(coefficients: &[f64], terms: f64, a: f64, b: f64) -> Tube {
    let n = coefficients.len();
    if terms == 0.0 && coefficients[1..].iter().all(|c| *c == 0.0) {
        return Tube::still(Interval::point(coefficients[0]));
    }
    let middle = 0.5 * (a + b);
    let radius = (0.5 * (b - a)).next_up();
    let mut q = [0.0; MOST_ORDER + 1];
    q[..n].copy_from_slice(coefficients);
    for i in 0..n - 1 {
        for j in (i..n - 1).rev() {
            q[j] += middle * q[j + 1];
        }
    }
    let rounding = |largest: f64| 2.0 * n as f64 * f64::EPSILON * largest;
    let furthest = a.abs().max(b.abs());
    let (mut size, mut slope_size) = (0.0, 0.0_f64);
    for c in coefficients.iter().rev() {
        slope_size = slope_size * furthest + size;
        size = size * furthest + c.abs();
    }
    let (mut spread, mut slope_spread) = (0.0, 0.0);
    for (k, q) in q[..n].iter().enumerate().skip(1).rev() {
        spread = (spread + q.abs()) * radius;
        if k > 1 {
            slope_spread = (slope_spread + k as f64 * q.abs()) * radius;
        }
    }
    let value = |x: f64| coefficients.iter().rev().fold(0.0, |sum, c| sum * x + c);
    let error = rounding(size.max(terms));
    let slope_size = slope_size.max((n - 1) as f64 * terms);
    let slope = Interval::around(q[1], slope_spread + rounding(slope_size));
    Tube::moving(
        Interval::around(value(a), error),
        Interval::around(value(b), error),
        Interval::around(q[0], spread + error),
        slope * Interval::around(b - a, f64::EPSILON * furthest),
    )
}
