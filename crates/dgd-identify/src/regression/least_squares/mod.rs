//! Linear least squares from a triangle: free, and within bounds.
//!
//! ```text
//!   minimise ‖Rδ − ζ‖        over all δ, or over  lower ≤ δ ≤ upper
//!   R D⁻¹ = U Σ Vᵀ,  D = diag ‖R_j‖:  rank, condition number σ₁/σ_n, undetermined combinations
//! ```
//!
//! If R does not have full rank, δ is the shortest in units of D: columns that the rows cannot distinguish share the
//! change, and variables without influence do not move.
//!
//! Bounds: Stark, Parker, Bounded-variable least squares: an algorithm and applications, Computational
//! Statistics 10 (1995) 129, which is Lawson's and Hanson's non-negative least squares (Solving Least
//! Squares Problems, 1974, ch. 23) for lower and upper bounds.

pub(super) mod recursive;
pub(super) mod triangle;

use nalgebra::{DMatrix, DVector};

/// Singular values up to this fraction of the largest, with columns of length 1, are zero: readings have far fewer
/// digits, and R has rounding errors of some times 1e-16.
pub(super) const UNSEEN: f64 = 1e-12;

/// The singular values of a triangle with columns of length 1.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Spectrum {
    /// Number of linearly independent columns.
    pub rank: usize,
    /// Largest singular value over the smallest; infinite without full rank.
    pub condition_number: f64,
}

/// Rank and condition number of R.
pub(crate) fn spectrum(r: &DMatrix<f64>) -> Spectrum {
    let n = r.ncols();
    if n == 0 {
        return Spectrum { rank: 0, condition_number: 1.0 };
    }
    let (scaled, _) = with_unit_columns(r);
    let values = scaled.singular_values();
    let (largest, smallest) = (values.max(), values.min());
    let rank = values.iter().filter(|value| **value > UNSEEN * largest).count();
    let condition_number = if rank == n { largest / smallest } else { f64::INFINITY };
    Spectrum { rank, condition_number }
}

/// R with columns of length 1, and their original lengths.
fn with_unit_columns(r: &DMatrix<f64>) -> (DMatrix<f64>, DVector<f64>) {
    let size = DVector::from_fn(r.ncols(), |j, _| {
        let norm = r.column(j).norm();
        if norm == 0.0 { 1.0 } else { norm }
    });
    let mut scaled = r.clone();
    for (j, size) in size.iter().enumerate() {
        scaled.column_mut(j).unscale_mut(*size);
    }
    (scaled, size)
}

/// The δ that minimises ‖Rδ − ζ‖, the shortest one if there are several.
pub(crate) fn solve(r: &DMatrix<f64>, zeta: &DVector<f64>) -> DVector<f64> {
    if r.ncols() == 0 {
        return DVector::zeros(0);
    }
    let (scaled, size) = with_unit_columns(r);
    let svd = scaled.svd(true, true);
    let cutoff = UNSEEN * svd.singular_values.max();
    // Both factors were requested.
    let delta = svd.solve(zeta, cutoff).unwrap_or_else(|_| DVector::zeros(r.ncols()));
    delta.component_div(&size)
}

/// The δ that minimises ‖Rδ − ζ‖ within the bounds, which contain 0.
pub(crate) fn solve_bounded(
    r: &DMatrix<f64>,
    zeta: &DVector<f64>,
    lower: &DVector<f64>,
    upper: &DVector<f64>,
) -> DVector<f64> {
    let n = r.ncols();
    let mut delta = DVector::zeros(n);
    let mut free: Vec<bool> = (0..n).map(|j| lower[j] < 0.0 && 0.0 < upper[j]).collect();
    // Exact arithmetic ends much earlier.
    for _ in 0..10 * (n + 1) {
        let towards = on_free(r, zeta, &delta, &free);
        if let Some((length, j, bound)) = first_bound(&delta, &towards, lower, upper, &free) {
            delta += (&towards - &delta) * length;
            delta[j] = bound;
            free[j] = false;
            // Other bounds that are met at the same length.
            for i in (0..n).filter(|i| free[*i]) {
                delta[i] = delta[i].clamp(lower[i], upper[i]);
            }
            continue;
        }
        delta = towards;
        match most_wrongly_held(r, zeta, &delta, &free, lower, upper) {
            Some(j) => free[j] = true,
            None => break,
        }
    }
    delta
}

/// The minimum over the free variables, the others fixed.
fn on_free(
    r: &DMatrix<f64>,
    zeta: &DVector<f64>,
    delta: &DVector<f64>,
    free: &[bool],
) -> DVector<f64> {
    let positions: Vec<usize> = (0..free.len()).filter(|j| free[*j]).collect();
    let columns = r.select_columns(&positions);
    // From the current point, so that undetermined variables do not move.
    let step = solve(&columns, &(zeta - r * delta));
    let mut towards = delta.clone();
    for (j, step) in positions.into_iter().zip(step.iter()) {
        towards[j] += step;
    }
    towards
}

/// The fraction of the step at which the first bound is met, and its variable.
fn first_bound(
    delta: &DVector<f64>,
    towards: &DVector<f64>,
    lower: &DVector<f64>,
    upper: &DVector<f64>,
    free: &[bool],
) -> Option<(f64, usize, f64)> {
    let mut first: Option<(f64, usize, f64)> = None;
    for j in (0..free.len()).filter(|j| free[*j]) {
        let bound = if towards[j] < lower[j] {
            lower[j]
        } else if towards[j] > upper[j] {
            upper[j]
        } else {
            continue;
        };
        let length = ((bound - delta[j]) / (towards[j] - delta[j])).max(0.0);
        if first.is_none_or(|(least, ..)| length < least) {
            first = Some((length, j, bound));
        }
    }
    first
}

/// The variable held at a bound although the sum decreases away from it, with the largest cosine with the residual. It
/// is not released if rounding errors would put it straight back.
fn most_wrongly_held(
    r: &DMatrix<f64>,
    zeta: &DVector<f64>,
    delta: &DVector<f64>,
    free: &[bool],
    lower: &DVector<f64>,
    upper: &DVector<f64>,
) -> Option<usize> {
    let left = zeta - r * delta;
    let mut most: Option<(usize, f64)> = None;
    for j in (0..free.len()).filter(|j| !free[*j] && lower[*j] < upper[*j]) {
        let column = r.column(j);
        let inwards = if delta[j] <= lower[j] { 1.0 } else { -1.0 };
        let cosine = inwards * column.dot(&left) / column.norm();
        let is_more = cosine > most.map_or(0.0, |(_, cosine)| cosine);
        if !is_more {
            continue;
        }
        let mut released = free.to_vec();
        released[j] = true;
        if inwards * (on_free(r, zeta, delta, &released)[j] - delta[j]) > 0.0 {
            most = Some((j, cosine));
        }
    }
    most.map(|(j, _)| j)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rows() -> (DMatrix<f64>, DVector<f64>) {
        // Strongly coupled columns: clipping the free solution would be far off.
        let r = DMatrix::from_row_slice(3, 3, &[2.0, 1.9, 0.3, 0.0, 0.4, -1.0, 0.0, 0.0, 0.7]);
        (r, DVector::from_row_slice(&[1.0, -2.0, 0.5]))
    }

    #[test]
    fn no_point_of_the_box_is_lower() {
        let (r, zeta) = rows();
        let infinite = f64::INFINITY;
        for (low, high) in [
            ([-infinite; 3], [infinite; 3]),
            ([-1.0, 0.0, -1.0], [1.0, 2.0, 1.0]),
            ([0.0; 3], [infinite; 3]),
            ([-0.1, -0.1, 0.0], [0.0, 0.1, 0.0]),
            ([0.0, -9.0, -0.2], [9.0, 0.0, 0.2]),
        ] {
            let (low, high) = (DVector::from_row_slice(&low), DVector::from_row_slice(&high));
            let delta = solve_bounded(&r, &zeta, &low, &high);
            let slope = r.transpose() * (&r * &delta - &zeta);
            for j in 0..3 {
                assert!(low[j] <= delta[j] && delta[j] <= high[j], "{delta}");
                // Karush–Kuhn–Tucker conditions: no slope for free variables, an outward one at a bound.
                let at = (delta[j] == low[j], delta[j] == high[j]);
                match at {
                    (true, true) => {}
                    (true, false) => assert!(slope[j] >= -1e-12, "{slope}"),
                    (false, true) => assert!(slope[j] <= 1e-12, "{slope}"),
                    (false, false) => assert!(slope[j].abs() < 1e-12, "{slope}"),
                }
            }
        }
    }

    #[test]
    fn what_is_not_seen_stays_and_what_is_not_told_apart_moves_together() {
        // Two columns that are equal except for their units, and one of zeros.
        let r = DMatrix::from_row_slice(3, 3, &[1.0, 1e6, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
        let zeta = DVector::from_row_slice(&[2.0, 0.0, 0.0]);
        let delta = solve(&r, &zeta);
        assert!((delta[0] - 1.0).abs() < 1e-12 && (delta[1] - 1e-6).abs() < 1e-18, "{delta}");
        assert_eq!(delta[2], 0.0);
        let found = spectrum(&r);
        assert_eq!((found.rank, found.condition_number), (1, f64::INFINITY));
    }
}
