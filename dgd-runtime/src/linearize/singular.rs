//! Whether a matrix is singular, and which row and column are to blame.

use nalgebra::DMatrix;

/// Singular values below this fraction of the largest are zero, with rows and columns scaled by their sizes.
const SINGULAR: f64 = 1e-12;
/// Pivots above this fraction of the largest need no singular value decomposition.
const FAR_FROM_SINGULAR: f64 = 1e-8;

/// If the matrix is singular with its rows scaled by their largest entries, the row that depends most on others and the
/// least determined column.
pub(super) fn open(matrix: &DMatrix<f64>) -> Option<(usize, usize)> {
    if matrix.is_empty() || matrix.iter().any(|value| !value.is_finite()) {
        return None;
    }
    let mut scaled = matrix.clone();
    for mut row in scaled.row_iter_mut() {
        let largest = row.amax();
        if largest > 0.0 {
            row /= largest;
        }
    }
    // Scales columns so that units of unknowns do not matter.
    for mut column in scaled.column_iter_mut() {
        let largest = column.amax();
        if largest > 0.0 {
            column /= largest;
        }
    }
    // With complete pivoting the last pivot is about as small as the smallest singular value.
    let pivots = scaled.clone().full_piv_lu().u().diagonal().abs();
    if pivots.min() > FAR_FROM_SINGULAR * pivots.max() {
        return None;
    }
    let svd = scaled.svd(true, true);
    let smallest = svd.singular_values.imin();
    if svd.singular_values[smallest] > SINGULAR * svd.singular_values.max() {
        return None;
    }
    let (left, right) = (svd.u?, svd.v_t?);
    Some((left.column(smallest).iamax(), right.row(smallest).transpose().iamax()))
}
