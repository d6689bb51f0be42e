//! One step of an explicit Runge–Kutta method in each lane.

#![allow(clippy::inline_always)]

use super::dense::DensePolynomials;
use super::lanes::{LANES, LaneStorage, Lanes};
use super::stage::{LaneInputs, LaneTrial};
use crate::integrate::tableaux::MAX_STAGES;
use crate::integrate::tableaux::RungeKuttaTableau;
use crate::solved::SolvableSystem;
use crate::system::Storage;

/// Work space.
pub(super) struct ExplicitLanes<S: SolvableSystem> {
    stage: <S::Vector as Storage>::Lanes,
    k: [<S::Vector as Storage>::Lanes; MAX_STAGES],
    error: <S::Vector as Storage>::Lanes,
    /// Whether k₁ must be evaluated in a lane: its solution begins, or its inputs have changed.
    pub(super) is_fresh: [bool; LANES],
}

impl<S: SolvableSystem> ExplicitLanes<S> {
    pub(super) fn new(n: usize) -> Self {
        let zeros = || <S::Vector as Storage>::Lanes::zeros(n);
        Self {
            stage: zeros(),
            k: std::array::from_fn(|_| zeros()),
            error: zeros(),
            is_fresh: [true; LANES],
        }
    }

    /// Tries a step; returns y⁺.
    ///
    /// ```text
    ///   Yᵢ = y + h Σⱼ aᵢⱼ kⱼ,  kᵢ = f(t + cᵢ h, Yᵢ),  y⁺ = Y_s,  local error ≈ h Σ eᵢ kᵢ
    /// ```
    #[inline(always)]
    pub(super) fn attempt(
        &mut self,
        tableau: &RungeKuttaTableau,
        trial: &LaneTrial<'_, S>,
        inputs: &mut LaneInputs<S>,
        y_new: &mut [Lanes],
    ) {
        let Self { stage, k, error, is_fresh } = self;
        let (y, h) = (trial.y, trial.h);
        let last = tableau.stages() - 1;
        if is_fresh.contains(&true) {
            // An evaluation at the end of the previous step would repeat its result bit for bit.
            let f = stage.lanes_mut();
            trial.rhs(0.0, y, inputs, f);
            for (k, f) in k[0].lanes_mut().iter_mut().zip(f) {
                *k = k.choose(*f, *is_fresh);
            }
            *is_fresh = [false; LANES];
        }
        for i in 1..=last {
            let (earlier, rest) = k.split_at_mut(i);
            let stage = if i == last { &mut *y_new } else { stage.lanes_mut() };
            extrapolate(y, h, earlier, &tableau.a[i], stage);
            trial.rhs(tableau.c[i], stage, inputs, rest[0].lanes_mut());
        }
        let error = error.lanes_mut();
        error.fill(Lanes::ZERO);
        for (weight, k) in tableau.error.iter().zip(&*k) {
            for (error, k) in error.iter_mut().zip(k.lanes()) {
                *error = *error + *weight * *h * *k;
            }
        }
    }

    /// The local error of the last tried step.
    #[inline(always)]
    pub(super) fn error(&self) -> &[Lanes] {
        self.error.lanes()
    }

    /// Keeps the slope at the end of the last tried step in lanes that accept it.
    #[inline(always)]
    pub(super) fn advance(&mut self, tableau: &RungeKuttaTableau, accepted: [bool; LANES]) {
        let (first, rest) = self.k.split_at_mut(1);
        let last = rest[tableau.stages() - 2].lanes();
        for (first, last) in first[0].lanes_mut().iter_mut().zip(last) {
            *first = first.choose(*last, accepted);
        }
    }

    /// Writes the dense output of the last tried step: cₗ = h Σⱼ dⱼₗ kⱼ.
    #[inline(always)]
    pub(super) fn write_dense(
        &self,
        tableau: &RungeKuttaTableau,
        h: Lanes,
        out: &mut DensePolynomials<S>,
    ) {
        for (l, c) in out.c.iter_mut().enumerate() {
            for (i, c) in c.lanes_mut().iter_mut().enumerate() {
                let mut sum = Lanes::ZERO;
                for (weights, k) in tableau.dense.iter().zip(&self.k) {
                    sum = sum + weights[l] * k.lanes()[i];
                }
                *c = h * sum;
            }
        }
    }
}

/// `out` ← y + Σ (h wⱼ) kⱼ.
#[inline(always)]
fn extrapolate<V: LaneStorage>(
    y: &[Lanes],
    h: &Lanes,
    k: &[V],
    weights: &[f64; MAX_STAGES],
    out: &mut [Lanes],
) {
    match k.len() {
        1 => extrapolate_all::<1, V>(y, h, k, weights, out),
        2 => extrapolate_all::<2, V>(y, h, k, weights, out),
        3 => extrapolate_all::<3, V>(y, h, k, weights, out),
        4 => extrapolate_all::<4, V>(y, h, k, weights, out),
        5 => extrapolate_all::<5, V>(y, h, k, weights, out),
        6 => extrapolate_all::<6, V>(y, h, k, weights, out),
        _ => extrapolate_all::<7, V>(y, h, k, weights, out),
    }
}

#[inline(always)]
fn extrapolate_all<const J: usize, V: LaneStorage>(
    y: &[Lanes],
    h: &Lanes,
    k: &[V],
    weights: &[f64; MAX_STAGES],
    out: &mut [Lanes],
) {
    let n = y.len();
    let mut slopes: [&[Lanes]; J] = [&[]; J];
    for (lanes, k) in slopes.iter_mut().zip(k) {
        *lanes = &k.lanes()[..n];
    }
    let mut scaled = [Lanes::ZERO; J];
    for (scaled, weight) in scaled.iter_mut().zip(weights) {
        *scaled = *weight * *h;
    }
    for (i, out) in out[..n].iter_mut().enumerate() {
        let mut value = y[i];
        for j in 0..J {
            value = value + scaled[j] * slopes[j][i];
        }
        *out = value;
    }
}
