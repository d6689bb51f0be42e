//! Means of correlated samples, with standard errors.
//!
//! With B blocks of m neighbouring samples, the block means x̄ⱼ give
//!
//! ```text
//!   s² = Σ (x̄ⱼ − x̄)²/(B (B − 1))
//! ```
//!
//! for the variance of x̄. It grows with m until blocks are longer than the correlation time. The largest s² for m = 1,
//! 2, 4, … with B ≥ 16 is used, so that a drifting sensor gets a realistic error.
//!
//! Source: Flyvbjerg, Petersen, Error estimates on averages of correlated data, J. Chem. Phys. 91
//! (1989) 461–466.

use crate::statistics::distribution::normal_two_sided;

/// An estimated number.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Estimate {
    /// The number.
    pub value: f64,
    /// Its standard error.
    pub std_error: f64,
    /// Degrees of freedom of the standard error.
    pub dof: f64,
}

/// Minimum number of blocks for a variance.
const FEWEST_BLOCKS: usize = 16;

impl Estimate {
    /// Half the width of the 95 % interval.
    pub fn half_width(&self) -> f64 {
        // Student's t, to 1 % from 10 degrees of freedom on: the first terms of the Cornish–Fisher expansion.
        let z: f64 = 1.959_964;
        let t = z
            + (z.powi(3) + z) / (4.0 * self.dof)
            + (5.0 * z.powi(5) + 16.0 * z.powi(3) + 3.0 * z) / (96.0 * self.dof * self.dof);
        t * self.std_error
    }

    /// Probability of a value as far from zero by chance.
    pub fn p_value(&self) -> f64 {
        self.p_value_beyond(0.0)
    }

    /// The same if the true value may be up to `tolerance` from zero.
    pub fn p_value_beyond(&self, tolerance: f64) -> f64 {
        let excess = (self.value.abs() - tolerance).max(0.0);
        if excess == 0.0 {
            return 1.0;
        }
        if self.std_error == 0.0 {
            return 0.0;
        }
        // Wallace's normal deviate of a t, Ann. Math. Stat. 30 (1959) 1124, within 1 %.
        let (t, nu) = (excess / self.std_error, self.dof);
        let z = (8.0 * nu + 1.0) / (8.0 * nu + 3.0) * (nu * (t * t / nu).ln_1p()).sqrt();
        normal_two_sided(z)
    }
}

/// The mean of the values that are not NaN, which may be correlated; `None` with fewer than 16.
pub fn mean(values: &[f64]) -> Option<Estimate> {
    let mut blocks: Vec<f64> = values.iter().copied().filter(|value| value.is_finite()).collect();
    if blocks.len() < FEWEST_BLOCKS {
        return None;
    }
    let value = blocks.iter().sum::<f64>() / blocks.len() as f64;
    let (mut variance, mut dof) = (0.0, blocks.len() as f64 - 1.0);
    while blocks.len() >= FEWEST_BLOCKS {
        let n = blocks.len() as f64;
        let centre = blocks.iter().sum::<f64>() / n;
        let squares: f64 = blocks.iter().map(|x| (x - centre).powi(2)).sum();
        let here = squares / (n * (n - 1.0));
        if here > variance {
            (variance, dof) = (here, n - 1.0);
        }
        // A remaining single block at the end is left out.
        blocks = blocks.chunks_exact(2).map(|pair| f64::midpoint(pair[0], pair[1])).collect();
    }
    Some(Estimate { value, std_error: variance.sqrt(), dof })
}

/// Coefficients of a linear regression without an intercept, with standard errors that allow for
/// errors correlated over up to `lags` neighbours.
///
/// `columns` are the regressors. `None` if they are not independent, or with fewer than four samples for each.
///
/// Source: Newey, West, A simple, positive semi-definite, heteroskedasticity and autocorrelation
/// consistent covariance matrix, Econometrica 55 (1987) 703–708.
///
/// # Panics
///
/// If a column differs in length from `y`.
pub fn regression(columns: &[Vec<f64>], y: &[f64], lags: usize) -> Option<Regression> {
    let (n, k) = (y.len(), columns.len());
    assert!(columns.iter().all(|column| column.len() == n), "a regressor for each sample");
    if n < 4 * k.max(4) {
        return None;
    }
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let scale: Vec<f64> = columns.iter().map(|x| dot(x, x).sqrt()).collect();
    if scale.iter().any(|s| !(*s > 0.0 && s.is_finite())) {
        return None;
    }
    let gram: Vec<Vec<f64>> = (0..k)
        .map(|i| (0..k).map(|j| dot(&columns[i], &columns[j]) / (scale[i] * scale[j])).collect())
        .collect();
    let inverse = inverse(gram)?;
    let moment: Vec<f64> = (0..k).map(|i| dot(&columns[i], y) / scale[i]).collect();
    let product = |v: &[f64]| -> Vec<f64> { inverse.iter().map(|row| dot(row, v)).collect() };
    let scaled = product(&moment);
    let residuals: Vec<f64> = (0..n)
        .map(|t| y[t] - (0..k).map(|i| scaled[i] * columns[i][t] / scale[i]).sum::<f64>())
        .collect();
    let score = |t: usize, i: usize| residuals[t] * columns[i][t] / scale[i];
    // Σ_l w_l Σ_t s_t s_{t−l}ᵀ with w_l = 1 − l/(L + 1).
    let mut meat = vec![vec![0.0; k]; k];
    for lag in 0..=lags.min(n - 1) {
        let weight = 1.0 - lag as f64 / (lags as f64 + 1.0);
        for (i, j) in (0..k).flat_map(|i| (0..k).map(move |j| (i, j))) {
            let sum: f64 = (lag..n).map(|t| score(t, i) * score(t - lag, j)).sum();
            meat[i][j] += weight * sum;
            if lag > 0 {
                meat[j][i] += weight * sum;
            }
        }
    }
    let dof = (n as f64 / (1.0 + lags as f64) - k as f64).max(4.0);
    let coefficients = (0..k)
        .map(|i| {
            let half: Vec<f64> = meat.iter().map(|row| dot(row, &inverse[i])).collect();
            let variance = dot(&half, &inverse[i]).max(0.0) * n as f64 / (n - k) as f64;
            Estimate { value: scaled[i] / scale[i], std_error: variance.sqrt() / scale[i], dof }
        })
        .collect();
    Some(Regression { coefficients, residuals })
}

/// The result of a regression.
#[derive(Debug, Clone, PartialEq)]
pub struct Regression {
    /// Coefficient of each regressor.
    pub coefficients: Vec<Estimate>,
    /// Residuals of y.
    pub residuals: Vec<f64>,
}

/// The inverse of a matrix with a unit diagonal, by Gauss–Jordan elimination; `None` if a pivot is only rounding.
fn inverse(mut a: Vec<Vec<f64>>) -> Option<Vec<Vec<f64>>> {
    let k = a.len();
    let mut b: Vec<Vec<f64>> =
        (0..k).map(|i| (0..k).map(|j| f64::from(u8::from(i == j))).collect()).collect();
    for i in 0..k {
        let pivot = a[i][i];
        if pivot < 1e-9 {
            return None;
        }
        for j in 0..k {
            a[i][j] /= pivot;
            b[i][j] /= pivot;
        }
        for row in (0..k).filter(|row| *row != i) {
            let factor = a[row][i];
            for j in 0..k {
                let (up, vp) = (a[i][j], b[i][j]);
                a[row][j] -= factor * up;
                b[row][j] -= factor * vp;
            }
        }
    }
    Some(b)
}
