//! Sigma points: a few points with a given mean and covariance.
//!
//! ```text
//!   χ₀ = x,  χ_{±i} = x ± √(n + λ) L_i,   λ = α² (n + κ) − n
//!   mean:        W₀ = λ/(n + λ),              W_i = 1/(2 (n + λ))
//!   covariance:  W₀ᶜ = W₀ + 1 − α² + β,       W_i
//! ```
//!
//! Negative weights are refused: the resulting matrix need not be a covariance.

use nalgebra::{DMatrix, DVector};

use super::error::{FilterError, OptionOutOfRange};

/// The spread of sigma points.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SigmaSpread {
    /// α: distance from the mean.
    pub alpha: f64,
    /// β: depends on the fourth moment; 2 for normal distributions.
    pub beta: f64,
    /// κ.
    pub kappa: f64,
}

impl Default for SigmaSpread {
    /// α = 1, β = 2, κ = 0: no weight is negative, and solver errors are not amplified.
    fn default() -> Self {
        Self { alpha: 1.0, beta: 2.0, kappa: 0.0 }
    }
}

impl SigmaSpread {
    fn lambda(self, n: usize) -> f64 {
        self.alpha * self.alpha * (n as f64 + self.kappa) - n as f64
    }

    /// # Errors
    ///
    /// [`FilterError::Option`] if weights of the covariance would be negative.
    pub(super) fn verify(self, n: usize) -> Result<(), FilterError> {
        let spread = n as f64 + self.lambda(n);
        let wrong = |of: &str, value, expected| {
            Err(FilterError::Option(OptionOutOfRange { of: of.to_owned(), value, expected }))
        };
        if !(spread > 0.0 && spread.is_finite()) {
            return wrong("α² (n + κ) of the sigma points", spread, "a positive number");
        }
        let weight = self.weights(n).1;
        if weight.is_nan() || weight < 0.0 {
            let subject = "the weight of the middle sigma point in the covariance";
            return wrong(subject, weight, "zero or above: use a larger α or β");
        }
        Ok(())
    }

    /// Weights of the middle point in the mean and in the covariance, and weight of each other point.
    fn weights(self, n: usize) -> (f64, f64, f64) {
        let lambda = self.lambda(n);
        let spread = n as f64 + lambda;
        let middle = lambda / spread;
        (middle, middle + 1.0 - self.alpha * self.alpha + self.beta, 0.5 / spread)
    }

    /// The points as columns, the middle one first.
    pub(super) fn points(self, x: &[f64], root: &DMatrix<f64>) -> DMatrix<f64> {
        let n = x.len();
        let far = (n as f64 + self.lambda(n)).sqrt();
        DMatrix::from_fn(n, 2 * n + 1, |row, column| match column {
            0 => x[row],
            i if i <= n => x[row] + far * root[(row, i - 1)],
            i => x[row] - far * root[(row, i - n - 1)],
        })
    }

    /// Mean of points, and their deviations from it, weighted so that D Dᵀ is the covariance; n is the number of
    /// variables for which the points were drawn.
    pub(super) fn moments(self, points: &DMatrix<f64>, n: usize) -> (DVector<f64>, DMatrix<f64>) {
        let (of_mean, of_covariance, other) = self.weights(n);
        let mut mean = points.column(0) * of_mean;
        for column in points.column_iter().skip(1) {
            mean += column * other;
        }
        let mut deviations = points.clone();
        for (i, mut column) in deviations.column_iter_mut().enumerate() {
            column -= &mean;
            column *= if i == 0 { of_covariance.sqrt() } else { other.sqrt() };
        }
        (mean, deviations)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_have_the_moments_that_they_were_drawn_for() {
        let x = [1.0, -2.0, 0.5];
        let root = DMatrix::from_row_slice(3, 3, &[2.0, 0.0, 0.0, 0.3, 1.0, 0.0, -1.0, 0.2, 0.1]);
        for spread in [SigmaSpread::default(), SigmaSpread { alpha: 0.8, beta: 2.0, kappa: 1.0 }] {
            spread.verify(3).expect("no weight is below zero");
            let (mean, deviations) = spread.moments(&spread.points(&x, &root), 3);
            assert!((mean - DVector::from_column_slice(&x)).amax() < 1e-14);
            assert!(
                (&deviations * deviations.transpose() - &root * root.transpose()).amax() < 1e-13
            );
        }
        assert!(SigmaSpread { alpha: 1e-3, beta: 2.0, kappa: 0.0 }.verify(3).is_err());
    }

    /// E x² of a normal deviate is m² + σ²: sigma points include the curvature that a linearisation misses.
    #[test]
    fn the_mean_of_a_square_is_exact() {
        let spread = SigmaSpread::default();
        let points = spread.points(&[3.0], &DMatrix::from_element(1, 1, 0.5));
        let squares = points.map(|x| x * x);
        let (mean, _) = spread.moments(&squares, 1);
        assert!((mean[0] - 9.25).abs() < 1e-14);
    }
}
