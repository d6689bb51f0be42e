//! The difference between Fisher's information and the Hessian, learnt from gradients during the search.
//!
//! If the model is not quite right, innovations do not have the predicted covariance, and the information is not the
//! curvature of the likelihood: scoring oscillates around the minimum. H = I + A has the curvature given by the
//! gradients g at the last two points,
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

use crate::minimise::trust_region::NormalEquations;

/// Gradients whose difference along the step is below this fraction of their lengths contain no information.
const NO_CURVATURE: f64 = 1e-8;

/// The current estimate of the Hessian.
pub(in crate::filter) struct Secant {
    /// A.
    rest: DMatrix<f64>,
    /// The last point, and its gradient.
    last: Option<(DVector<f64>, DVector<f64>)>,
}

impl Secant {
    pub(in crate::filter) fn new(n: usize) -> Self {
        Self { rest: DMatrix::zeros(n, n), last: None }
    }

    /// H at the next point of a search.
    pub(in crate::filter) fn hessian(&mut self, z: &[f64], at: &NormalEquations) -> DMatrix<f64> {
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

    fn curvature() -> DMatrix<f64> {
        DMatrix::from_row_slice(2, 2, &[4.0, 1.0, 1.0, 3.0])
    }

    /// H after evaluating a quadratic function at some points; its information is half of the curvature in one
    /// direction and twice the curvature in another.
    fn after(points: impl IntoIterator<Item = [f64; 2]>) -> DMatrix<f64> {
        let information = DMatrix::from_row_slice(2, 2, &[2.0, 0.0, 0.0, 6.0]);
        let mut secant = Secant::new(2);
        let mut hessian = information.clone();
        for z in points {
            let gradient = curvature() * DVector::from_column_slice(&z);
            let information = information.clone();
            let normal = NormalEquations { gradient, information, ..NormalEquations::zeros(2) };
            hessian = secant.hessian(&z, &normal);
        }
        hessian
    }

    #[test]
    fn the_last_step_gives_the_curvature_along_it() {
        let hessian = after([[0.0, 0.0], [0.3, 0.1], [0.2, -0.4], [0.25, -0.1]]);
        let step = DVector::from_column_slice(&[0.05, 0.3]);
        assert!((hessian * &step - curvature() * step).amax() < 1e-12);
    }

    /// Ge, Powell, The convergence of variable metric matrices in unconstrained optimization, Math. Program.
    /// 27 (1983) 123.
    #[test]
    fn steps_in_all_directions_lead_to_the_hessian() {
        let hessian =
            after((0..60).map(|k| [(2.0 * f64::from(k)).sin(), (3.0 * f64::from(k)).cos()]));
        assert!((&hessian - curvature()).amax() < 1e-9, "{hessian}");
    }
}
