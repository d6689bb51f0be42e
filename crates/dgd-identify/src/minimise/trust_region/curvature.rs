//! The difference between JᵀJ and the Hessian for large residuals, learnt from gradients during the search.
//!
//! The Hessian of ½ Σ r² is JᵀJ + Σ r ∇²r. The second part is small if residuals are; otherwise it is learnt from
//! accepted steps s, as the symmetric matrix closest to the last one, in the metric of the Hessian, that is consistent
//! with the change of the gradients g:
//!
//! ```text
//!   y = g₊ − g − J₊ᵀJ₊ s,   v = g₊ − g,   τ = min(1, |sᵀy| / |sᵀS s|),   u = y − τ S s
//!   S₊ = τ S + (u vᵀ + v uᵀ)/(vᵀs) − (sᵀu) v vᵀ/(vᵀs)²
//! ```
//!
//! Steps use JᵀJ or JᵀJ + S, whichever predicted the last one better.
//!
//! Dennis, Gay, Welsch, An adaptive nonlinear least-squares algorithm, ACM TOMS 7 (1981) 348, §3 and §4.

use nalgebra::{DMatrix, DVector};

use super::problem::NormalEquations;

/// Gradients whose difference along the step is below this fraction of their lengths contain no information.
const NO_CURVATURE: f64 = 1e-8;

/// The other model is better if it predicted a step better by this factor.
const CLEARLY: f64 = 1.5;

/// The current estimate of the second part, and whether steps use it.
pub(super) struct Curvature {
    rest: DMatrix<f64>,
    is_known: bool,
    is_used: bool,
}

impl Curvature {
    pub(super) fn new(n: usize) -> Self {
        Self { rest: DMatrix::zeros(n, n), is_known: false, is_used: false }
    }

    /// Whether steps use it.
    pub(super) fn is_used(&self) -> bool {
        self.is_used
    }

    /// The Hessian for steps.
    pub(super) fn hessian(&self, normal: &NormalEquations) -> DMatrix<f64> {
        if self.is_used { &normal.information + &self.rest } else { normal.information.clone() }
    }

    /// Whether the unused model predicted the change of a sum clearly better than the used one.
    pub(super) fn other_is_better(
        &self,
        normal: &NormalEquations,
        step: &DVector<f64>,
        reduction: f64,
    ) -> bool {
        if !self.is_known {
            return false;
        }
        let first = normal.promised(step, &normal.information);
        let second = first - step.dot(&(&self.rest * step));
        let (used, other) = if self.is_used { (second, first) } else { (first, second) };
        CLEARLY * (reduction - other).abs() < (reduction - used).abs()
    }

    /// Makes steps use the other model from now on.
    pub(super) fn switch(&mut self) {
        self.is_used = !self.is_used;
    }

    /// Learns from an accepted step. If residuals lack derivatives, gradients are not those of the sum.
    pub(super) fn learn(
        &mut self,
        step: &DVector<f64>,
        before: &NormalEquations,
        after: &NormalEquations,
    ) {
        if !(before.is_whole && after.is_whole) {
            return;
        }
        let v = &after.gradient - &before.gradient;
        let y = &v - &after.information * step;
        let along = v.dot(step);
        // False for NaN.
        let says_something = along > NO_CURVATURE * v.norm() * step.norm();
        if !says_something {
            return;
        }
        let present = step.dot(&(&self.rest * step));
        if present != 0.0 {
            self.rest *= (step.dot(&y) / present).abs().min(1.0);
        }
        let u = y - &self.rest * step;
        self.rest.ger(1.0 / along, &u, &v, 1.0);
        self.rest.ger(1.0 / along, &v, &u, 1.0);
        self.rest.ger(-step.dot(&u) / along.powi(2), &v, &v, 1.0);
        self.is_known = self.rest.iter().all(|value| value.is_finite());
        if !self.is_known {
            self.rest.fill(0.0);
            self.is_used = false;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn equations_at(gradient: &DVector<f64>, information: &DMatrix<f64>) -> NormalEquations {
        NormalEquations {
            gradient: gradient.clone(),
            information: information.clone(),
            ..NormalEquations::zeros(gradient.len())
        }
    }

    /// After steps in all directions on a quadratic function, the last one is reproduced exactly: (JᵀJ + S) s is the
    /// change of the gradient. S is symmetric and contains only observed curvature.
    #[test]
    fn the_last_step_gives_the_curvature_along_it() {
        let hessian = DMatrix::from_row_slice(2, 2, &[4.0, 1.0, 1.0, 3.0]);
        let information = DMatrix::from_row_slice(2, 2, &[2.0, 0.0, 0.0, 6.0]);
        let mut curvature = Curvature::new(2);
        let mut z = DVector::from_column_slice(&[0.0, 0.0]);
        for step in [[0.3, 0.1], [-0.1, -0.5], [0.05, 0.3]] {
            let step = DVector::from_column_slice(&step);
            let before = equations_at(&(&hessian * &z), &information);
            z += &step;
            let after = equations_at(&(&hessian * &z), &information);
            curvature.learn(&step, &before, &after);
            curvature.is_used = true;
            let known = curvature.hessian(&after);
            assert!((&known * &step - &hessian * &step).amax() < 1e-12, "{known}");
            assert!((&known - known.transpose()).amax() < 1e-12, "{known}");
        }
    }

    #[test]
    fn a_gradient_that_misses_residuals_teaches_nothing() {
        let information = DMatrix::from_row_slice(1, 1, &[1.0]);
        let [first, second] =
            [1.0, 4.0].map(|g| equations_at(&DVector::from_element(1, g), &information));
        let mut curvature = Curvature::new(1);
        let step = DVector::from_element(1, 1.0);
        curvature.learn(&step, &first, &NormalEquations { is_whole: false, ..second.clone() });
        assert!(!curvature.is_known);
        curvature.learn(&step, &first, &second);
        // The gradient rose by 3, of which JᵀJ explains 1.
        assert_eq!(curvature.rest[(0, 0)], 2.0);
        // A step by −1 from there: JᵀJ predicts 2 · 4 − 1 = 7, and with S 2 · 4 − 3 = 5.
        let back = DVector::from_element(1, -1.0);
        assert!(curvature.other_is_better(&second, &back, 5.2));
        assert!(!curvature.other_is_better(&second, &back, 6.8));
    }
}
