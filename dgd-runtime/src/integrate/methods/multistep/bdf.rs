//! One step of variable-order backward differentiation, for the unknowns alone or with their sensitivities.
//!
//! With the backward differences ∇ʲ of values at equal spacing h, the formula of order k is
//!
//! ```text
//!   M Σⱼ ∇ʲy⁺/j = h f(t + h, y⁺),     j = 1 … k
//! ```
//!
//! and with the extrapolated polynomial through earlier values, y° = y + Σⱼ ∇ʲy, and γ_k = Σⱼ 1/j,
//!
//! ```text
//!   0 = f(t + h, y⁺) − M (y⁺ − Ȳ) γ_k/h,   Ȳ = y° − Σⱼ γⱼ ∇ʲy / γ_k
//!   d = y⁺ − y° = ∇ᵏ⁺¹y⁺,   local error ≈ d/(k + 1)
//! ```
//!
//! The polynomial through the values is also the dense output; when h changes, differences are recomputed from it.
//! Order and step size change after k + 1 equal steps at the earliest ([`super::order`]), which keeps that stable.
//!
//! J and the factorisation of M γ_k/h − J are kept for as long as Newton's method converges with them.
//!
//! # Source
//!
//! Shampine and Reichelt, The MATLAB ODE suite, SIAM Journal on Scientific Computing 18 (1997) 1–22,
//! with their κ = 0.

use crate::integrate::controller::{ControlLaw, Controller};
use crate::integrate::drive::InputCursor;
use crate::integrate::enclosure::PolynomialCoefficients;
use crate::integrate::methods::family::{
    EndEquations, ErrorScale, FamilyMemory, FamilyNeeds, FamilyTraits, JudgedStep, MethodFamily,
};
use crate::integrate::methods::stepper::{SensitivityWorkspace, StepFailure, StepTrial, Stepper};
use crate::integrate::methods::tableaux::MAX_STAGES;
use crate::solution::Statistics;
use crate::solved::SolvableSystem;
use crate::system::Storage;

/// The highest order.
pub(in crate::integrate) const MAX_ORDER: usize = 5;

/// γ_k; index 0 is not an order.
const GAMMA: [f64; MAX_ORDER + 1] = [0.0, 1.0, 3.0 / 2.0, 11.0 / 6.0, 25.0 / 12.0, 137.0 / 60.0];
/// Maximum number of Newton iterations before J is recomputed.
const MOST_ITERATIONS: i32 = 4;

/// Ratio of the local error of order k to ∇ᵏ⁺¹.
pub(in crate::integrate) fn error_constant(order: usize) -> f64 {
    1.0 / (order + 1) as f64
}

/// Stored data other than the differences ∇ʲy in `k[j]`, `v[j]`.
#[derive(Debug, Clone, Copy, Default)]
pub(in crate::integrate) struct BdfHistory {
    /// k.
    pub(in crate::integrate) order: usize,
    /// Spacing of the values.
    h: f64,
    /// Steps since h or the order was changed.
    pub(in crate::integrate) equal_steps: usize,
    /// Steps since the solution began.
    pub(in crate::integrate) steps: usize,
    /// Whether it began where an earlier one was abandoned.
    pub(in crate::integrate) is_resumed: bool,
    /// γ_k/h of the factorisation; zero if there is none.
    factorised: f64,
    has_jacobian: bool,
    /// Rejections since the last accepted step.
    pub(in crate::integrate) rejections: usize,
}

impl BdfHistory {
    /// The history at the start of a solution, whose slope is known.
    pub(in crate::integrate) fn beginning(h: f64, is_resumed: bool) -> Self {
        Self { order: 1, h, is_resumed, ..Self::default() }
    }

    /// Whether only the slope at the start of the solution is remembered.
    pub(super) fn is_at_beginning(&self) -> bool {
        self.order == 1 && self.equal_steps == 0
    }

    /// Continues with another order.
    pub(in crate::integrate) fn change_order(&mut self, order: usize) {
        self.order = order;
        self.equal_steps = 0;
    }

    /// The value at `offset` from the start of the last tried step, whose d is given.
    ///
    /// With p_i = Πₘ (θ − 1 + m)/(m + 1), m < i, and q_j = Σ p_i, 1 ≤ i ≤ j, it is
    /// y⁺ + Σ p_i ∇ⁱy⁺ = y + Σⱼ (1 + q_j) ∇ʲy + (1 + q_k) d.
    pub(in crate::integrate) fn interpolate<V: Storage>(
        &self,
        offset: f64,
        y: &[f64],
        k: &[V; MAX_STAGES],
        d: &[f64],
        out: &mut [f64],
    ) {
        let theta = offset / self.h;
        out.copy_from_slice(y);
        let (mut p, mut sum) = (1.0, 1.0);
        for (m, k) in k[1..=self.order].iter().enumerate() {
            p *= (theta - 1.0 + m as f64) / (m + 1) as f64;
            sum += p;
            for (out, k) in out.iter_mut().zip(k.as_ref()) {
                *out += sum * k;
            }
        }
        for (out, d) in out.iter_mut().zip(d) {
            *out += sum * d;
        }
    }

    /// The same for the i-th number, as coefficients in powers of the fraction of a step of size h. Returns their
    /// number.
    fn polynomial<V: Storage>(
        &self,
        i: usize,
        h: f64,
        y: f64,
        k: &[V; MAX_STAGES],
        d: f64,
        out: &mut PolynomialCoefficients,
    ) -> usize {
        let len = self.order + 1;
        let stretch = h / self.h;
        let (mut p, mut sum) = ([0.0; MAX_ORDER + 1], [0.0; MAX_ORDER + 1]);
        (p[0], sum[0]) = (1.0, 1.0);
        out[..len].fill(0.0);
        out[0] = y;
        for (m, k) in k[1..=self.order].iter().enumerate() {
            // p ← p (θ − 1 + m)/(m + 1)
            let (at_zero, slope) = ((m as f64 - 1.0) / (m + 1) as f64, stretch / (m + 1) as f64);
            for power in (0..len).rev() {
                let lower = if power > 0 { p[power - 1] } else { 0.0 };
                p[power] = at_zero * p[power] + slope * lower;
            }
            for (sum, p) in sum.iter_mut().zip(&p) {
                *sum += p;
            }
            for (out, sum) in out[..len].iter_mut().zip(&sum) {
                *out += sum * k.as_ref()[i];
            }
        }
        for (out, sum) in out[..len].iter_mut().zip(&sum) {
            *out += sum * d;
        }
        len
    }
}

/// Backward differentiation up to a maximum order.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Bdf {
    pub(crate) most_order: usize,
}

impl MethodFamily for Bdf {
    const TRAITS: FamilyTraits = FamilyTraits {
        needs: FamilyNeeds::Nothing,
        remembers: FamilyMemory::Differences,
        solves: EndEquations::Nonlinear,
    };
    const LAW: ControlLaw = ControlLaw::Piecewise;

    fn estimate_order(self, _rtol: f64) -> u32 {
        1
    }

    #[inline]
    fn attempt<S: SolvableSystem>(
        self,
        stepper: &mut Stepper<S>,
        trial: StepTrial<'_, S>,
        drive: &mut InputCursor<S>,
        directions: Option<&mut SensitivityWorkspace<S>>,
        statistics: &mut Statistics,
    ) -> Result<(), StepFailure> {
        stepper.attempt_bdf(trial, drive, directions, statistics)
    }

    #[inline]
    fn advance<S: SolvableSystem>(
        self,
        stepper: &mut Stepper<S>,
        _h: f64,
        _mass: &S::Vector,
        directions: Option<&mut SensitivityWorkspace<S>>,
    ) {
        if stepper.is_cut {
            // Values are no longer equidistant.
            stepper.restart();
        } else {
            stepper.advance_differences(directions);
        }
    }

    fn adapt_to_acceptance<S: SolvableSystem>(
        self,
        stepper: &mut Stepper<S>,
        judged: JudgedStep,
        scale: &ErrorScale<'_, S>,
        controller: &mut Controller,
    ) {
        stepper.choose_order(judged, scale, self.most_order, controller);
    }

    fn adapt_to_rejection<S: SolvableSystem>(
        self,
        stepper: &mut Stepper<S>,
        judged: JudgedStep,
        controller: &mut Controller,
    ) -> bool {
        let had_memory = !stepper.history.is_at_beginning();
        stepper.shrink_or_forget(judged, controller);
        !had_memory && !judged.error.is_finite()
    }

    #[inline]
    fn interpolate<S: SolvableSystem>(
        self,
        stepper: &Stepper<S>,
        theta: f64,
        y: &[f64],
        out: &mut [f64],
    ) {
        let Stepper { history, h, k, stage, .. } = stepper;
        history.interpolate(theta * h, y, k, stage.as_ref(), out);
    }

    fn polynomial<S: SolvableSystem>(
        self,
        stepper: &Stepper<S>,
        i: usize,
        y: f64,
        out: &mut PolynomialCoefficients,
    ) -> usize {
        let Stepper { history, h, k, stage, .. } = stepper;
        history.polynomial(i, *h, y, k, stage.as_ref()[i], out)
    }

    #[inline]
    fn interpolate_sensitivities<S: SolvableSystem>(
        self,
        stepper: &Stepper<S>,
        theta: f64,
        directions: &SensitivityWorkspace<S>,
        out: &mut [f64],
    ) {
        let SensitivityWorkspace { s, v, stage, .. } = directions;
        stepper.history.interpolate(theta * stepper.h, s.as_ref(), v, stage.as_ref(), out);
    }
}

impl<S: SolvableSystem> Stepper<S> {
    /// Tries a step.
    fn attempt_bdf(
        &mut self,
        trial: StepTrial<'_, S>,
        drive: &mut InputCursor<S>,
        mut directions: Option<&mut SensitivityWorkspace<S>>,
        statistics: &mut Statistics,
    ) -> Result<(), StepFailure> {
        let StepTrial { base, y, h, .. } = trial;
        let y = y.as_ref();
        let order = self.history.order;
        let t = base.t + h;
        if h != self.history.h {
            let matrix = change_of_step(order, h / self.history.h);
            change_differences(&matrix, order, &mut self.k);
            if let Some(d) = &mut directions {
                change_differences(&matrix, order, &mut d.v);
            }
            self.history.h = h;
            self.history.equal_steps = 0;
        }

        let c = GAMMA[order] / h;
        let mut is_new = !self.history.has_jacobian;
        loop {
            predict(order, y, &mut self.k, self.stage.as_mut(), self.y_new.as_mut());
            if is_new {
                self.history.has_jacobian = false;
                self.renew_jacobian(&trial, drive, t, statistics)?;
                self.history.has_jacobian = true;
            }
            if is_new || self.history.factorised != c {
                self.history.factorised = 0.0;
                self.factorise_iteration(&trial, c, statistics)?;
                self.history.factorised = c;
            }
            match self.solve_unknowns(&trial, drive, t, c, MOST_ITERATIONS, statistics) {
                Ok(()) => break,
                Err(failed) if is_new => return Err(failed),
                Err(_) => is_new = true,
            }
        }
        take_correction(order, &self.k[0], &self.y_new, &mut self.stage, &mut self.error);

        if let Some(d) = directions {
            predict(order, d.s.as_ref(), &mut d.v, d.stage.as_mut(), d.s_new.as_mut());
            self.solve_sensitivities(&trial, drive, t, c, d, statistics)?;
            take_correction(order, &d.v[0], &d.s_new, &mut d.stage, &mut d.error);
        }
        Ok(())
    }

    /// Updates the differences to the end of the last tried step.
    fn advance_differences(&mut self, directions: Option<&mut SensitivityWorkspace<S>>) {
        let order = self.history.order;
        advance(order, &self.stage, &mut self.k);
        if let Some(d) = directions {
            advance(order, &d.stage, &mut d.v);
        }
        self.history.equal_steps += 1;
        self.history.steps += 1;
        self.history.rejections = 0;
    }
}

/// `k[0]` and `y_new` ← y°, `known` ← Ȳ.
fn predict<V: Storage>(
    order: usize,
    y: &[f64],
    k: &mut [V; MAX_STAGES],
    known: &mut [f64],
    y_new: &mut [f64],
) {
    y_new.copy_from_slice(y);
    known.fill(0.0);
    for (j, k) in k.iter().enumerate().take(order + 1).skip(1) {
        let weight = GAMMA[j] / GAMMA[order];
        for ((y_new, known), k) in y_new.iter_mut().zip(known.iter_mut()).zip(k.as_ref()) {
            *y_new += k;
            *known += weight * k;
        }
    }
    for (known, y_new) in known.iter_mut().zip(y_new.iter()) {
        *known = y_new - *known;
    }
    k[0].as_mut().copy_from_slice(y_new);
}

/// `correction` ← d and `error` ← the local error in it.
fn take_correction<V: Storage>(
    order: usize,
    predicted: &V,
    y_new: &V,
    correction: &mut V,
    error: &mut V,
) {
    let constant = error_constant(order);
    let values = y_new.as_ref().iter().zip(predicted.as_ref());
    for ((d, e), (y_new, predicted)) in
        correction.as_mut().iter_mut().zip(error.as_mut()).zip(values)
    {
        *d = y_new - predicted;
        *e = constant * *d;
    }
}

/// ∇ᵏ⁺²y⁺ = d − ∇ᵏ⁺¹y,  ∇ᵏ⁺¹y⁺ = d,  ∇ʲy⁺ = ∇ʲy + ∇ʲ⁺¹y⁺.
fn advance<V: Storage>(order: usize, d: &V, k: &mut [V; MAX_STAGES]) {
    let (lower, upper) = k.split_at_mut(order + 2);
    let (next, beyond) = (lower[order + 1].as_mut(), upper[0].as_mut());
    for ((beyond, next), d) in beyond.iter_mut().zip(next).zip(d.as_ref()) {
        *beyond = d - *next;
        *next = *d;
    }
    for j in (1..=order).rev() {
        let (lower, upper) = k.split_at_mut(j + 1);
        for (k, next) in lower[j].as_mut().iter_mut().zip(upper[0].as_ref()) {
            *k += next;
        }
    }
}

/// Matrix that converts differences at spacing h to those at spacing ratio · h of the same polynomial; rows and columns
/// 1 … k are used.
///
/// R(ρ) U with R(ρ)ᵢⱼ = Πₗ (l − 1 − ρ j)/l, 1 ≤ l ≤ i, and U = R(1).
fn change_of_step(order: usize, ratio: f64) -> [[f64; MAX_ORDER + 1]; MAX_ORDER + 1] {
    let table = |ratio: f64| {
        let mut r = [[0.0; MAX_ORDER + 1]; MAX_ORDER + 1];
        for j in 1..=order {
            let mut product = 1.0;
            for (i, row) in r.iter_mut().enumerate().take(order + 1).skip(1) {
                product *= ((i - 1) as f64 - ratio * j as f64) / i as f64;
                row[j] = product;
            }
        }
        r
    };
    let (r, u) = (table(ratio), table(1.0));
    let mut product = [[0.0; MAX_ORDER + 1]; MAX_ORDER + 1];
    for i in 1..=order {
        for j in 1..=order {
            product[i][j] = (1..=order).map(|l| r[i][l] * u[l][j]).sum();
        }
    }
    product
}

/// ∇ʲ ← Σᵢ ∇ⁱ matrixᵢⱼ.
fn change_differences<V: Storage>(
    matrix: &[[f64; MAX_ORDER + 1]; MAX_ORDER + 1],
    order: usize,
    k: &mut [V; MAX_STAGES],
) {
    let len = k[0].as_ref().len();
    for position in 0..len {
        let mut before = [0.0; MAX_ORDER + 1];
        for (before, k) in before.iter_mut().zip(k.iter()).take(order + 1).skip(1) {
            *before = k.as_ref()[position];
        }
        for (j, k) in k.iter_mut().enumerate().take(order + 1).skip(1) {
            k.as_mut()[position] = (1..=order).map(|i| before[i] * matrix[i][j]).sum();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn differences_change_with_the_step_as_those_of_a_polynomial() {
        // t^q for q up to the order, at spacings of 1 and 0.7 back from t = 2.
        let order = MAX_ORDER;
        for degree in 1..=5 {
            let value = |k: usize, h: f64| (2.0 - h * k as f64).powi(degree);
            let differences = |h: f64| {
                let mut table: Vec<f64> = (0..=order).map(|k| value(k, h)).collect();
                let mut k: [Vec<f64>; MAX_STAGES] = std::array::from_fn(|_| vec![0.0]);
                for k in &mut k[1..=order] {
                    table = table.windows(2).map(|pair| pair[0] - pair[1]).collect();
                    k[0] = table[0];
                }
                k
            };
            let (mut k, expected) = (differences(1.0), differences(0.7));
            change_differences(&change_of_step(order, 0.7), order, &mut k);
            for j in 1..=order {
                // Sums of 2⁵ values of up to 3⁵.
                assert!((k[j][0] - expected[j][0]).abs() < 1e-11, "{degree} {j}");
            }
        }
    }
}
