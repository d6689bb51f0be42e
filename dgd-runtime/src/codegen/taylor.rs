//! Arithmetic of Taylor series, with which generated models and the interpreter compute coefficients.
//!
//! A series is a(τ) = Σₖ aₖ τᵏ with τ = (t − t₀)/h. All functions here give the coefficient of order k ≥ 1 of a result
//! from those of its operands. Sums run from the middle outwards, so that the terms that are computed last are added
//! last.
//!
//! # Source
//!
//! Griewank and Walther, Evaluating Derivatives, 2nd ed. (2008), tables 13.1 and 13.2.

// These functions are inlined into loops in which the order is a constant.
#![allow(clippy::inline_always)]

use std::fmt;

/// The highest order.
pub const MOST_ORDER: usize = 31;

/// Coefficients of a series, of orders from 0 on.
pub type SeriesTerms = [f64; MOST_ORDER + 1];

/// The number of series that a model stores while it computes those of its solutions.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct KeptSeries {
    /// For [`System::taylor`](crate::System::taylor).
    pub unknowns: usize,
    /// For [`System::sensitivity_taylor`](crate::System::sensitivity_taylor).
    pub sensitivities: usize,
    /// Whether the series depend on the branch of an `if`, `abs` or `sign`, which a solution may leave within a step.
    pub has_branches: bool,
}

/// Why a model has no Taylor series.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NoTaylorSeries {
    /// The model has algebraic unknowns, always or in some modes.
    Algebraic,
    /// The model has delayed unknowns.
    Delays,
    /// The model has arrays of unknowns.
    Arrays,
    /// The derivatives of a function in the equations never close: each needs a new function.
    Functions,
    /// The model was not made by the compiler.
    NotCompiled,
}

impl fmt::Display for NoTaylorSeries {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Algebraic => "unknowns are algebraic, always or in some modes",
            Self::Delays => "unknowns are read late",
            Self::Arrays => "unknowns are arrays",
            Self::Functions => "a function in the equations, `lgamma`, has ever new derivatives",
            Self::NotCompiled => "the compiler has not made any",
        })
    }
}

/// The coefficient at k, which is below the number of terms; the remainder avoids a bounds check.
#[inline(always)]
fn coefficient(a: &SeriesTerms, k: usize) -> f64 {
    a[k % (MOST_ORDER + 1)]
}

/// Stores the coefficient of order k.
#[inline(always)]
pub fn keep(a: &mut SeriesTerms, k: usize, value: f64) {
    a[k % (MOST_ORDER + 1)] = value;
}

/// Σⱼ aⱼ b₍ₖ₋ⱼ₎, j = 1 … k − 1.
#[inline(always)]
fn inner(a: &SeriesTerms, b: &SeriesTerms, k: usize) -> f64 {
    // Low orders without a loop, whose overhead would exceed the cost of the sum.
    match k {
        1 => return 0.0,
        2 => return a[1] * b[1],
        3 => return a[1] * b[2] + a[2] * b[1],
        _ => {}
    }
    let mut sum =
        if k.is_multiple_of(2) { coefficient(a, k / 2) * coefficient(b, k / 2) } else { 0.0 };
    for j in (1..k.div_ceil(2)).rev() {
        sum +=
            coefficient(a, j) * coefficient(b, k - j) + coefficient(a, k - j) * coefficient(b, j);
    }
    sum
}

/// Σⱼ aⱼ a₍ₖ₋ⱼ₎, j = 1 … k − 1.
#[inline(always)]
fn inner_square(a: &SeriesTerms, k: usize) -> f64 {
    match k {
        1 => return 0.0,
        2 => return a[1] * a[1],
        3 => return 2.0 * (a[1] * a[2]),
        _ => {}
    }
    let mut half = 0.0;
    for j in (1..k.div_ceil(2)).rev() {
        half += coefficient(a, j) * coefficient(a, k - j);
    }
    let middle =
        if k.is_multiple_of(2) { coefficient(a, k / 2) * coefficient(a, k / 2) } else { 0.0 };
    middle + 2.0 * half
}

/// Σⱼ j aⱼ b₍ₖ₋ⱼ₎, j = 1 … k − 1.
#[inline(always)]
fn inner_weighted(a: &SeriesTerms, b: &SeriesTerms, k: usize) -> f64 {
    let mut sum = 0.0;
    for j in 1..k {
        sum += j as f64 * coefficient(a, j) * coefficient(b, k - j);
    }
    sum
}

/// a b: Σⱼ aⱼ b₍ₖ₋ⱼ₎, j = 0 … k.
#[inline(always)]
pub fn multiply(a: &SeriesTerms, b: &SeriesTerms, k: usize) -> f64 {
    inner(a, b, k) + (a[0] * coefficient(b, k) + coefficient(a, k) * b[0])
}

/// a².
#[inline(always)]
pub fn square(a: &SeriesTerms, k: usize) -> f64 {
    inner_square(a, k) + 2.0 * a[0] * coefficient(a, k)
}

/// a b for a straight line a.
#[inline(always)]
pub fn multiply_line(a: &SeriesTerms, b: &SeriesTerms, k: usize) -> f64 {
    a[1] * coefficient(b, k - 1) + a[0] * coefficient(b, k)
}

/// v = a/b: (aₖ − Σⱼ bⱼ v₍ₖ₋ⱼ₎)/b₀, j = 1 … k.
#[inline(always)]
pub fn divide(a_k: f64, b: &SeriesTerms, v: &SeriesTerms, reciprocal: f64, k: usize) -> f64 {
    (a_k - inner(b, v, k) - coefficient(b, k) * v[0]) * reciprocal
}

/// v̇ = d ẋ: Σⱼ j xⱼ d₍ₖ₋ⱼ₎/k, j = 1 … k.
#[inline(always)]
pub fn chain(x: &SeriesTerms, d: &SeriesTerms, k: usize) -> f64 {
    inner_weighted(x, d, k) / k as f64 + coefficient(x, k) * d[0]
}

/// v = √a, with 1/(2 v₀).
#[inline(always)]
pub fn root(a_k: f64, v: &SeriesTerms, half_reciprocal: f64, k: usize) -> f64 {
    (a_k - inner_square(v, k)) * half_reciprocal
}

/// v = log a, with 1/a₀.
#[inline(always)]
pub fn log(a: &SeriesTerms, v: &SeriesTerms, reciprocal: f64, k: usize) -> f64 {
    (coefficient(a, k) - inner_weighted(v, a, k) / k as f64) * reciprocal
}

/// v = a^r, with 1/a₀. If a starts at zero, coefficients of v below order r are zero.
#[inline]
pub fn power(a: &SeriesTerms, v: &SeriesTerms, exponent: f64, reciprocal: f64, k: usize) -> f64 {
    let order = k as f64;
    if a[0] == 0.0 && order < exponent {
        return 0.0;
    }
    let mut sum = 0.0;
    for j in 1..=k {
        sum += (j as f64 * (exponent + 1.0) - order) * coefficient(a, j) * coefficient(v, k - j);
    }
    sum / order * reciprocal
}

/// |a|: aₖ with the sign of the first non-zero coefficient.
#[inline(always)]
pub fn magnitude(a: &SeriesTerms, k: usize) -> f64 {
    let first = a.iter().take(k + 1).find(|a| **a != 0.0);
    match first {
        Some(first) if *first < 0.0 => -coefficient(a, k),
        _ => coefficient(a, k),
    }
}

/// The coefficient of order k of a straight line with this slope.
#[inline(always)]
pub fn line(slope: f64, k: usize) -> f64 {
    if k == 1 { slope } else { 0.0 }
}

/// Adds c s to g.
#[inline(always)]
pub fn add_scaled<const N: usize>(g: &mut [f64; N], c: f64, s: &[f64; N]) {
    for (g, s) in g.iter_mut().zip(s) {
        *g += c * s;
    }
}

/// Adds the coefficient of order k of a s to g, for each of the series in s: its coefficient of order k is in row k ·
/// `rows` + `row`. Each result is the same as from [`multiply`].
#[inline(always)]
pub fn add_product<const N: usize>(
    g: &mut [f64; N],
    a: &SeriesTerms,
    s: &[[f64; N]],
    rows: usize,
    row: usize,
    k: usize,
) {
    let s_term = |order: usize| &s[order * rows + row];
    let mut sum = [0.0; N];
    if k.is_multiple_of(2) {
        let (a, s) = (coefficient(a, k / 2), s_term(k / 2));
        for (sum, s) in sum.iter_mut().zip(s) {
            *sum = a * s;
        }
    }
    for j in (1..k.div_ceil(2)).rev() {
        let (a_j, a_rest, s_j, s_rest) =
            (coefficient(a, j), coefficient(a, k - j), s_term(j), s_term(k - j));
        for ((sum, s_j), s_rest) in sum.iter_mut().zip(s_j).zip(s_rest) {
            *sum += a_j * s_rest + a_rest * s_j;
        }
    }
    let (a_0, a_k, s_0, s_k) = (a[0], coefficient(a, k), s_term(0), s_term(k));
    for (((g, sum), s_0), s_k) in g.iter_mut().zip(sum).zip(s_0).zip(s_k) {
        *g += sum + (a_0 * s_k + a_k * s_0);
    }
}

/// Coefficients of order k of unknowns or sensitivities: those of order k − 1 of their slopes, times h/k.
#[inline(always)]
pub fn advance<const N: usize>(slopes: &[f64; N], per: f64) -> [f64; N] {
    slopes.map(|slope| per * slope)
}

/// Splits series into rows of N numbers.
#[inline(always)]
pub fn rows<const N: usize>(numbers: &mut [f64]) -> &mut [[f64; N]] {
    numbers.as_chunks_mut().0
}

/// The first N stored series.
///
/// # Panics
///
/// If there are fewer than N.
#[inline(always)]
pub fn kept<const N: usize>(series: &mut [SeriesTerms]) -> &mut [SeriesTerms; N] {
    let len = series.len();
    match series.first_chunk_mut() {
        Some(series) => series,
        None => panic!("expected {N} series, found {len}"),
    }
}
