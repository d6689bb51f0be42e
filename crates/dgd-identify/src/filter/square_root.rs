//! Covariances as triangular factors, P = L Lᵀ: symmetric and non-negative, whatever the rounding errors.
//!
//! ```text
//!   prediction:   [Φ L   Q½] Θ = [L⁻   0]                      Θ orthogonal
//!   correction:   ⎡R½  H L⁻⎤ Θ = ⎡S½   0 ⎤     S = H P⁻ Hᵀ + R,   K = K̄ S^{-½}
//!                 ⎣0     L⁻⎦     ⎣K̄    L⁺⎦     x⁺ = x⁻ + K̄ S^{-½} ε
//! ```
//!
//! Kailath, Sayed, Hassibi, Linear Estimation (2000), §12.3.

use nalgebra::{DMatrix, DVector, SymmetricEigen};

/// Number of terms in the series of a short interval: with 2 ‖A‖ h ≤ ½ the remainder is below rounding error,
/// 0.5¹³/13!.
const TERMS: usize = 13;

/// The lower triangular L with L Lᵀ = M Mᵀ and a non-negative diagonal.
pub(super) fn triangular(m: &DMatrix<f64>) -> DMatrix<f64> {
    let n = m.nrows();
    let r = m.transpose().qr().r();
    let mut l = DMatrix::zeros(n, n);
    for k in 0..r.nrows().min(n) {
        let sign = if r[(k, k)] < 0.0 { -1.0 } else { 1.0 };
        for i in k..n {
            l[(i, k)] = sign * r[(k, i)];
        }
    }
    l
}

/// A matrix of two side by side.
pub(super) fn beside(left: &DMatrix<f64>, right: &DMatrix<f64>) -> DMatrix<f64> {
    let mut both = DMatrix::zeros(left.nrows(), left.ncols() + right.ncols());
    both.columns_mut(0, left.ncols()).copy_from(left);
    both.columns_mut(left.ncols(), right.ncols()).copy_from(right);
    both
}

/// The result of a correction.
pub(super) struct CorrectedEstimate {
    /// L⁺.
    pub root: DMatrix<f64>,
    /// K ε.
    pub step: DVector<f64>,
    /// S^{-½} ε: white and of unit variance if the filter is right.
    pub whitened: DVector<f64>,
    /// ln det S.
    pub log_det: f64,
    /// S½.
    pub innovation_root: DMatrix<f64>,
}

/// Corrects by innovations ε of outputs with noise σ. `of_outputs` and `of_variables` are roots of H P Hᵀ and of P with
/// the same columns: H L and L, or the deviations of sigma points.
pub(super) fn correct(
    sigma: &[f64],
    of_outputs: &DMatrix<f64>,
    of_variables: &DMatrix<f64>,
    innovation: &[f64],
) -> CorrectedEstimate {
    let (m, n) = (sigma.len(), of_variables.nrows());
    let columns = of_variables.ncols();
    let mut array = DMatrix::zeros(m + n, m + columns);
    for (i, sigma) in sigma.iter().enumerate() {
        array[(i, i)] = *sigma;
    }
    array.view_mut((0, m), (m, columns)).copy_from(of_outputs);
    array.view_mut((m, m), (n, columns)).copy_from(of_variables);
    let l = triangular(&array);

    let mut whitened = DVector::from_column_slice(innovation);
    let mut log_det = 0.0;
    for i in 0..m {
        let sum: f64 = (0..i).map(|j| l[(i, j)] * whitened[j]).sum();
        whitened[i] = (whitened[i] - sum) / l[(i, i)];
        log_det += 2.0 * l[(i, i)].ln();
    }
    let gain = l.view((m, 0), (n, m));
    CorrectedEstimate {
        step: gain * &whitened,
        root: l.view((m, m), (n, n)).into(),
        whitened,
        log_det,
        innovation_root: l.view((0, 0), (m, m)).into(),
    }
}

/// Covariance due to white noise of the densities `q` after `dt`, Q = ∫₀^dt e^{As} diag(q) e^{Aᵀs} ds, as a root; `a`
/// has a row for each of the first variables, the others are constant.
///
/// ```text
///   Q(h) = Σ D_k h^{k+1}/(k+1)!,   D₀ = diag(q),  D_{k+1} = A D_k + D_k Aᵀ
///   Q(2h) = Q(h) + Φ(h) Q(h) Φ(h)ᵀ,   Φ(2h) = Φ(h)²
/// ```
///
/// Doubling adds only non-negative terms, so stiff models are harmless. `None` on overflow.
pub(super) fn integrated_noise(a: &DMatrix<f64>, q: &[f64], dt: f64) -> Option<DMatrix<f64>> {
    let n = q.len();
    let mut whole = DMatrix::zeros(n, n);
    whole.view_mut((0, 0), a.shape()).copy_from(a);
    let norm = whole.column_iter().map(|column| column.lp_norm(1)).fold(0.0, f64::max);
    let rows = whole.row_iter().map(|row| row.lp_norm(1)).fold(0.0, f64::max);
    let norm = norm.max(rows);
    if !norm.is_finite() {
        return None;
    }
    let doublings = (4.0 * norm * dt).max(1.0).log2().ceil();
    let h = dt / doublings.exp2();

    whole *= h;
    let scaled = whole;
    let mut term = DMatrix::from_diagonal(&DVector::from_fn(n, |i, _| q[i] * h));
    let mut noise = term.clone();
    let (mut half, mut next) = (DMatrix::zeros(n, n), DMatrix::zeros(n, n));
    for k in 1..TERMS {
        // Terms are symmetric: D Aᵀ = (A D)ᵀ.
        half.gemm(1.0 / (k + 1) as f64, &scaled, &term, 0.0);
        half.transpose_to(&mut next);
        next += &half;
        std::mem::swap(&mut term, &mut next);
        noise += &term;
        if term.amax() <= f64::EPSILON * noise.amax() {
            break;
        }
    }
    let mut phi = if doublings > 0.0 { exponential(&scaled) } else { DMatrix::identity(n, n) };
    for _ in 0..doublings as usize {
        noise = &noise + &phi * &noise * phi.transpose();
        phi = &phi * &phi;
    }
    root(&noise)
}

/// eᴬ of a small A, by its series.
fn exponential(a: &DMatrix<f64>) -> DMatrix<f64> {
    let n = a.nrows();
    let (mut sum, mut power) = (DMatrix::identity(n, n), DMatrix::identity(n, n));
    for k in 1..TERMS {
        power = &power * a / k as f64;
        sum += &power;
    }
    sum
}

/// B with B Bᵀ = P, which may be singular; `None` if P is not finite.
fn root(p: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    if p.iter().any(|value| !value.is_finite()) {
        return None;
    }
    let symmetric = (p + p.transpose()) * 0.5;
    let SymmetricEigen { mut eigenvectors, eigenvalues } =
        SymmetricEigen::try_new(symmetric, f64::EPSILON, 1000)?;
    for (mut column, value) in eigenvectors.column_iter_mut().zip(eigenvalues.iter()) {
        column *= value.max(0.0).sqrt();
    }
    Some(eigenvectors)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_factor_has_the_product_and_a_diagonal_above_zero() {
        let m = DMatrix::from_row_slice(2, 3, &[1.0, -2.0, 0.5, 3.0, 0.0, -1.0]);
        let l = triangular(&m);
        assert!((&l * l.transpose() - &m * m.transpose()).amax() < 1e-14);
        assert!(l[(0, 0)] > 0.0 && l[(1, 1)] > 0.0 && l[(0, 1)] == 0.0);
        // More rows than columns: the rank is that of M.
        let thin = DMatrix::from_row_slice(2, 1, &[1.0, 2.0]);
        let l = triangular(&thin);
        assert!((&l * l.transpose() - &thin * thin.transpose()).amax() < 1e-15);
    }

    /// dx = −a x dt + dβ: Q = q (1 − e^{−2 a dt})/(2a), also for large a dt; a second state integrates the first, with
    /// a = 0: q dt, q dt²/2, q dt³/3.
    #[test]
    fn white_noise_is_integrated_as_in_closed_form() {
        for (a, dt) in [(0.3, 2.0), (5.0e4, 10.0), (-0.2, 3.0)] {
            let root =
                integrated_noise(&DMatrix::from_element(1, 1, -a), &[0.7], dt).expect("finite");
            let expected = 0.7 * (1.0 - f64::exp(-2.0 * a * dt)) / (2.0 * a);
            let found = root[(0, 0)] * root[(0, 0)];
            assert!((found / expected - 1.0).abs() < 1e-12, "{found} {expected}");
        }
        let a = DMatrix::from_row_slice(2, 2, &[0.0, 0.0, 1.0, 0.0]);
        let root = integrated_noise(&a, &[2.0, 0.0], 3.0).expect("finite");
        let q = &root * root.transpose();
        let expected = DMatrix::from_row_slice(2, 2, &[6.0, 9.0, 9.0, 18.0]);
        assert!((q - expected).amax() < 1e-12);
    }
}
