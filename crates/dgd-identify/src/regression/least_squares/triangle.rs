//! Rows of a linear regression, added one by one and stored as a triangle.
//!
//! ```text
//!   [Φ | z] = Q [R | ζ]        R, ζ: n + 1 columns, upper triangular
//!               [0 | ρ]
//!   ‖Φθ − z‖² = ‖Rθ − ζ‖² + ρ²
//! ```
//!
//! by Householder reflections of the triangle so far and the new rows. Memory does not grow with the number of rows,
//! and nothing is squared: the loss of accuracy is given by the condition number, not its square.
//!
//! Golub, Van Loan, Matrix Computations, 4th ed. (2013), §5.2.2, §6.5.3.

use nalgebra::{DMatrix, DVector};

/// Number of rows that are stored before they are reduced: enough for the triangle's own rows not to matter.
const KEPT: usize = 128;

/// The triangle of all rows so far.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct RowTriangle {
    /// Columns, the target's included.
    columns: usize,
    upper: DMatrix<f64>,
    /// Rows that are not in the triangle yet.
    rows: Vec<f64>,
}

impl RowTriangle {
    /// No rows, of n regressors and a target.
    pub(crate) fn new(n: usize) -> Self {
        Self { columns: n + 1, upper: DMatrix::zeros(n + 1, n + 1), rows: Vec::new() }
    }

    /// Adds a row: φ and z, both times `weight`.
    pub(crate) fn push(&mut self, phi: &[f64], z: f64, weight: f64) {
        debug_assert_eq!(phi.len() + 1, self.columns, "length of the regressors");
        self.rows.extend(phi.iter().map(|phi| weight * phi));
        self.rows.push(weight * z);
        if self.rows.len() >= KEPT * self.columns {
            self.reduce();
        }
    }

    /// Multiplies all rows so far by a factor.
    pub(crate) fn scale(&mut self, factor: f64) {
        self.upper *= factor;
        self.rows.iter_mut().for_each(|value| *value *= factor);
    }

    /// Reduces the rows into the triangle.
    pub(crate) fn reduce(&mut self) {
        let n = self.columns;
        for j in 0..n {
            let below: f64 = self.rows.chunks_exact(n).map(|row| row[j] * row[j]).sum();
            if below == 0.0 {
                continue;
            }
            // v = x ± ‖x‖ e, with the sign that avoids cancellation; H = 1 − 2 v vᵀ / vᵀv
            let above = self.upper[(j, j)];
            let length = above.hypot(below.sqrt());
            let diagonal = if above > 0.0 { -length } else { length };
            let head = above - diagonal;
            let half = 0.5 * (head * head + below);
            self.upper[(j, j)] = diagonal;
            for c in j + 1..n {
                let tail: f64 = self.rows.chunks_exact(n).map(|row| row[j] * row[c]).sum();
                let along = (head * self.upper[(j, c)] + tail) / half;
                self.upper[(j, c)] -= along * head;
                for row in self.rows.chunks_exact_mut(n) {
                    row[c] -= along * row[j];
                }
            }
        }
        self.rows.clear();
    }

    /// Sets ζ and ρ to zero: the information about the target has been used.
    pub(crate) fn forget_target(&mut self) {
        self.upper.column_mut(self.columns - 1).fill(0.0);
    }

    /// R, n × n. All rows must have been reduced.
    pub(crate) fn r(&self) -> DMatrix<f64> {
        debug_assert!(self.rows.is_empty(), "rows that are not in the triangle");
        let n = self.columns - 1;
        self.upper.view((0, 0), (n, n)).into_owned()
    }

    /// ζ, n numbers. All rows must have been reduced.
    pub(crate) fn zeta(&self) -> DVector<f64> {
        let n = self.columns - 1;
        self.upper.view((0, n), (n, 1)).column(0).into_owned()
    }

    /// ρ², the residual that no θ removes.
    pub(crate) fn remainder(&self) -> f64 {
        let n = self.columns - 1;
        self.upper[(n, n)].powi(2)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// More rows than are stored: R has the normal matrix of all rows, and ρ² is their residual.
    #[test]
    fn the_triangle_is_that_of_all_rows() {
        let mut triangle = RowTriangle::new(2);
        let (mut normal, mut right, mut squares) = (DMatrix::zeros(2, 2), DVector::zeros(2), 0.0);
        for k in 0..1000 {
            let x = f64::from(k) / 1000.0;
            let (phi, z, weight) = ([1.0, x], (3.0 * x).sin(), 1.0 + x);
            triangle.push(&phi, z, weight);
            let phi = DVector::from_row_slice(&phi) * weight;
            right += &phi * (z * weight);
            normal += &phi * phi.transpose();
            squares += (z * weight).powi(2);
        }
        triangle.reduce();
        let (r, zeta) = (triangle.r(), triangle.zeta());
        // Sums of 1000 terms of the order of 1.
        assert!((r.transpose() * &r - &normal).amax() < 1e-10);
        assert!((r.transpose() * &zeta - &right).amax() < 1e-10);
        let theta = normal.cholesky().expect("two columns").solve(&right);
        let left = squares - theta.dot(&right);
        assert!((triangle.remainder() - left).abs() < 1e-10, "{} {left}", triangle.remainder());
    }
}
