//! What Fisher's information lacks of the Hessian, from gradients along the way.
//!
//! Where the model is not quite right, innovations are not what their covariance says, and the information
//! is not the curvature of the likelihood: scoring goes to and fro around the minimum. H = I + A has the
//! curvature that the gradients g at the last two points say,
//!
//! ```text
//!   M = I₊ + τ A,   s = z₊ − z,   y = g₊ − g,   τ = min(1, |sᵀ(y − I₊ s)| / |sᵀA s|)
//!   H = M − M s sᵀ M/sᵀM s + y yᵀ/yᵀs
//! ```
//!
//! Dennis, Martínez, Tapia, Convergence theory for the structured BFGS secant method, J. Optim. Theory Appl.
//! 61 (1989) 161; τ by Dennis, Gay, Welsch, An adaptive nonlinear least-squares algorithm, ACM TOMS 7 (1981)
//! 348.

use nalgebra::{DMatrix, DVector};

use crate::identify::levenberg_marquardt::NormalEquations;

/// Gradients whose difference is less along the step than this part of their lengths say nothing.
const NO_CURVATURE: f64 = 1e-8;

/// What is known of the Hessian.
pub(super) struct Secant {
    /// A.
    rest: DMatrix<f64>,
    /// The last point, and the gradient there.
    last: Option<(DVector<f64>, DVector<f64>)>,
}

impl Secant {
    pub(super) fn new(n: usize) -> Self {
        Self { rest: DMatrix::zeros(n, n), last: None }
    }

    /// H at the next point of a search.
    pub(super) fn hessian(&mut self, z: &[f64], at: &NormalEquations) -> DMatrix<f64> {
        let information = &at.information;
        let z = DVector::from_column_slice(z);
        let last = self.last.replace((z.clone(), at.gradient.clone()));
        if let Some((last, gradient)) = last {
            let (s, y) = (z - last, &at.gradient - gradient);
            let lacking = s.dot(&(&y - information * &s));
            let present = s.dot(&(&self.rest * &s));
            if present != 0.0 {
                self.rest *= (lacking / present).abs().min(1.0);
            }
            let of_step = (information + &self.rest) * &s;
            let (curvature, expected) = (y.dot(&s), of_step.dot(&s));
            if curvature > NO_CURVATURE * y.norm() * s.norm() && expected > 0.0 {
                self.rest.ger(1.0 / curvature, &y, &y, 1.0);
                self.rest.ger(-1.0 / expected, &of_step, &of_step, 1.0);
            }
        }
        let hessian = information + &self.rest;
        if hessian.clone().cholesky().is_some() {
            return hessian;
        }
        self.rest.fill(0.0);
        information.clone()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Of a quadratic function whose information is half of its curvature in one direction and twice in
    /// another, the steps of two points give the Hessian of the plane that they span.
    #[test]
    fn steps_give_the_curvature_along_them() {
        let curvature = DMatrix::from_row_slice(2, 2, &[4.0, 1.0, 1.0, 3.0]);
        let information = DMatrix::from_row_slice(2, 2, &[2.0, 0.0, 0.0, 6.0]);
        let mut secant = Secant::new(2);
        let mut hessian = information.clone();
        for z in [[0.0, 0.0], [0.3, 0.1], [0.2, -0.4], [0.25, -0.1]] {
            let gradient = &curvature * DVector::from_column_slice(&z);
            let information = information.clone();
            hessian = secant.hessian(&z, &NormalEquations { cost: 0.0, gradient, information });
        }
        let step = DVector::from_column_slice(&[0.05, 0.3]);
        assert!((&hessian * &step - &curvature * &step).amax() < 1e-12);
        assert!((&hessian - &curvature).amax() < 0.5, "{hessian}");
    }
}
