//! The numbers that a step advances: the unknowns, alone or with their sensitivities.

// Lengths are constants if storage has a fixed size, but only after inlining.
#![allow(clippy::inline_always)]

use crate::integrate::methods::tableaux::MAX_STAGES;
use crate::linalg::norm::Tolerances;
use crate::linalg::norm::larger;
use crate::solved::SolvableSystem;
use crate::system::{EvaluationPoint, Storage};

/// Numbers that obey ẋ = F(t, x, u): y, or y and S as one system.
pub(crate) trait CarriedState<S: SolvableSystem>: Clone {
    /// Whether S is among them.
    const HAS_SENSITIVITIES: bool;

    /// Zeros of a model's length.
    fn zeros(system: &S) -> Self;

    /// Takes over y and S.
    fn set(&mut self, y: &[f64], s: &[f64]);

    /// y.
    fn y(&self) -> &[f64];

    /// S, direction by direction; empty without sensitivities.
    fn s(&self) -> &[f64];

    /// y and S, mutable.
    fn parts_mut(&mut self) -> (&mut [f64], &mut [f64]);

    /// F at these numbers; `at.y` is not read.
    fn slopes(&self, system: &S, at: EvaluationPoint<'_>, out: &mut Self);

    /// x + h Σⱼ wⱼ kⱼ over the first J of the `k`.
    fn advanced<const J: usize>(
        &self,
        h: f64,
        weights: &[f64; MAX_STAGES],
        k: &[Self],
        out: &mut Self,
    );

    /// h Σⱼ wⱼ kⱼ over the first J of the `k`.
    fn weighted<const J: usize>(h: f64, weights: &[f64; MAX_STAGES], k: &[Self], out: &mut Self);

    /// Largest squared error in units of the tolerance, over the unknowns and each direction separately; `sizes` are
    /// those of these numbers. NaN if one is NaN. Overwrites the errors.
    fn error_norm(&mut self, tolerances: Tolerances, from: &Self, to: &Self, sizes: &Self) -> f64;

    /// Whether all numbers are finite.
    fn is_finite(&self) -> bool;
}

/// y alone.
pub(crate) struct UnknownsOnly<S: SolvableSystem> {
    pub(crate) y: S::Vector,
}

/// y and S.
pub(crate) struct WithSensitivities<S: SolvableSystem> {
    pub(crate) y: S::Vector,
    pub(crate) s: S::Sensitivity,
}

impl<S: SolvableSystem> Clone for UnknownsOnly<S> {
    fn clone(&self) -> Self {
        Self { y: self.y.clone() }
    }
}

impl<S: SolvableSystem> Clone for WithSensitivities<S> {
    fn clone(&self) -> Self {
        Self { y: self.y.clone(), s: self.s.clone() }
    }
}

impl<S: SolvableSystem> CarriedState<S> for UnknownsOnly<S> {
    const HAS_SENSITIVITIES: bool = false;

    fn zeros(system: &S) -> Self {
        Self { y: S::Vector::zeros(system.signature().unknowns.len()) }
    }

    fn set(&mut self, y: &[f64], _s: &[f64]) {
        self.y.as_mut().copy_from_slice(y);
    }

    #[inline(always)]
    fn y(&self) -> &[f64] {
        self.y.as_ref()
    }

    #[inline(always)]
    fn s(&self) -> &[f64] {
        &[]
    }

    #[inline(always)]
    fn parts_mut(&mut self) -> (&mut [f64], &mut [f64]) {
        (self.y.as_mut(), &mut [])
    }

    #[inline(always)]
    fn slopes(&self, system: &S, at: EvaluationPoint<'_>, out: &mut Self) {
        system.rhs(EvaluationPoint { y: self.y.as_ref(), ..at }, out.y.as_mut());
    }

    #[inline(always)]
    fn advanced<const J: usize>(
        &self,
        h: f64,
        weights: &[f64; MAX_STAGES],
        k: &[Self],
        out: &mut Self,
    ) {
        let k: [&[f64]; J] = std::array::from_fn(|j| k[j].y.as_ref());
        add_weighted(self.y.as_ref(), h, weights, k, out.y.as_mut());
    }

    #[inline(always)]
    fn weighted<const J: usize>(h: f64, weights: &[f64; MAX_STAGES], k: &[Self], out: &mut Self) {
        let k: [&[f64]; J] = std::array::from_fn(|j| k[j].y.as_ref());
        weighted_sum(h, weights, k, out.y.as_mut());
    }

    #[inline(always)]
    fn error_norm(&mut self, tolerances: Tolerances, from: &Self, to: &Self, sizes: &Self) -> f64 {
        tolerances.mean_square(self.y(), from.y(), to.y(), sizes.y())
    }

    #[inline(always)]
    fn is_finite(&self) -> bool {
        all_finite(self.y())
    }
}

impl<S: SolvableSystem> CarriedState<S> for WithSensitivities<S> {
    const HAS_SENSITIVITIES: bool = true;

    fn zeros(system: &S) -> Self {
        let signature = system.signature();
        let n = signature.unknowns.len();
        Self { y: S::Vector::zeros(n), s: S::Sensitivity::zeros(n * signature.directions.len()) }
    }

    fn set(&mut self, y: &[f64], s: &[f64]) {
        self.y.as_mut().copy_from_slice(y);
        self.s.as_mut().copy_from_slice(s);
    }

    #[inline(always)]
    fn y(&self) -> &[f64] {
        self.y.as_ref()
    }

    #[inline(always)]
    fn s(&self) -> &[f64] {
        self.s.as_ref()
    }

    #[inline(always)]
    fn parts_mut(&mut self) -> (&mut [f64], &mut [f64]) {
        (self.y.as_mut(), self.s.as_mut())
    }

    #[inline(always)]
    fn slopes(&self, system: &S, at: EvaluationPoint<'_>, out: &mut Self) {
        let point = EvaluationPoint { y: self.y.as_ref(), ..at };
        system.sensitivity_rhs(point, self.s.as_ref(), out.y.as_mut(), out.s.as_mut());
    }

    #[inline(always)]
    fn advanced<const J: usize>(
        &self,
        h: f64,
        weights: &[f64; MAX_STAGES],
        k: &[Self],
        out: &mut Self,
    ) {
        let y: [&[f64]; J] = std::array::from_fn(|j| k[j].y.as_ref());
        add_weighted(self.y.as_ref(), h, weights, y, out.y.as_mut());
        let s: [&[f64]; J] = std::array::from_fn(|j| k[j].s.as_ref());
        add_weighted(self.s.as_ref(), h, weights, s, out.s.as_mut());
    }

    #[inline(always)]
    fn weighted<const J: usize>(h: f64, weights: &[f64; MAX_STAGES], k: &[Self], out: &mut Self) {
        let y: [&[f64]; J] = std::array::from_fn(|j| k[j].y.as_ref());
        weighted_sum(h, weights, y, out.y.as_mut());
        let s: [&[f64]; J] = std::array::from_fn(|j| k[j].s.as_ref());
        weighted_sum(h, weights, s, out.s.as_mut());
    }

    #[inline(always)]
    fn error_norm(&mut self, tolerances: Tolerances, from: &Self, to: &Self, sizes: &Self) -> f64 {
        let mut largest = tolerances.mean_square(self.y(), from.y(), to.y(), sizes.y());
        square_ratios(self.s.as_mut(), tolerances, from.s(), to.s(), sizes.s());
        let n = self.y().len().max(1);
        for column in self.s().chunks_exact(n) {
            largest = larger(column.iter().sum::<f64>() / n as f64, largest);
        }
        largest
    }

    #[inline(always)]
    fn is_finite(&self) -> bool {
        all_finite(self.y()) && all_finite(self.s())
    }
}

/// x + h Σⱼ wⱼ kⱼ, each sum in the order of the kⱼ.
#[inline(always)]
fn add_weighted<const J: usize>(
    x: &[f64],
    h: f64,
    weights: &[f64; MAX_STAGES],
    k: [&[f64]; J],
    out: &mut [f64],
) {
    let n = x.len();
    let k = k.map(|k| &k[..n]);
    for (i, (out, x)) in out[..n].iter_mut().zip(x).enumerate() {
        let mut value = *x;
        for j in 0..J {
            value += h * weights[j] * k[j][i];
        }
        *out = value;
    }
}

/// h Σⱼ wⱼ kⱼ.
#[inline(always)]
fn weighted_sum<const J: usize>(
    h: f64,
    weights: &[f64; MAX_STAGES],
    k: [&[f64]; J],
    out: &mut [f64],
) {
    let n = out.len();
    let k = k.map(|k| &k[..n]);
    for (i, out) in out.iter_mut().enumerate() {
        let mut value = 0.0;
        for j in 0..J {
            value += h * weights[j] * k[j][i];
        }
        *out = value;
    }
}

/// Replaces eᵢ by (eᵢ / wᵢ)², in one loop that vectorises.
#[inline(always)]
fn square_ratios(
    errors: &mut [f64],
    tolerances: Tolerances,
    from: &[f64],
    to: &[f64],
    sizes: &[f64],
) {
    for (((error, from), to), size) in errors.iter_mut().zip(from).zip(to).zip(sizes) {
        let (from, to) = (from.abs(), to.abs());
        let ratio = *error / tolerances.weight(Tolerances::judging(from, to, *size), *size);
        *error = ratio * ratio;
    }
}

/// Whether all values are finite: products with zero then sum to zero, otherwise to NaN.
#[inline(always)]
fn all_finite(values: &[f64]) -> bool {
    values.iter().map(|value| 0.0 * value).sum::<f64>() == 0.0
}
