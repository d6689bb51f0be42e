//! The step of a damped Gauss–Newton method within bounds.
//!
//! ```text
//!   minimise  q(δ) = gᵀδ + ½ δᵀA δ   over   lower ≤ δ ≤ upper,   A positive definite
//! ```
//!
//! by a primal active-set method. A step cut at the first bound it meets, or one whose components are clipped, is not
//! the minimum of q on the box, and a method that takes it converges slowly or to the wrong point; this one is.
//!
//! Nocedal, Wright, Numerical Optimization, 2nd ed. (2006), algorithm 16.3, for constraints that
//! are bounds.

use nalgebra::{DMatrix, DVector};

/// The minimum of q on the box, which contains δ = 0; `None` if A is not positive definite.
pub(crate) fn minimise(
    a: &DMatrix<f64>,
    g: &DVector<f64>,
    lower: &DVector<f64>,
    upper: &DVector<f64>,
) -> Option<DVector<f64>> {
    let n = g.len();
    let mut delta = DVector::zeros(n);
    // A variable that starts at a bound and is pushed against it stays there.
    let mut free: Vec<bool> = (0..n)
        .map(|i| !((lower[i] >= 0.0 && g[i] >= 0.0) || (upper[i] <= 0.0 && g[i] <= 0.0)))
        .collect();
    // Exact arithmetic ends much earlier; with rounding errors one bound could be released and met forever.
    for _ in 0..10 * (n + 1) {
        let slope = g + a * &delta;
        let towards = newton_step(a, &slope, &free)?;
        let (length, met) = first_bound(&delta, &towards, lower, upper, &free);
        delta.axpy(length, &towards, 1.0);
        if let Some((i, bound)) = met {
            delta[i] = bound;
            free[i] = false;
            continue;
        }
        let slope = g + a * &delta;
        match most_wrongly_held(a, &slope, &delta, lower, upper, &free) {
            Some(i) => free[i] = true,
            None => break,
        }
    }
    Some(delta)
}

/// A_FF d_F = −∇q_F, and 0 for variables that are not free.
fn newton_step(a: &DMatrix<f64>, slope: &DVector<f64>, free: &[bool]) -> Option<DVector<f64>> {
    let positions: Vec<usize> = (0..free.len()).filter(|i| free[*i]).collect();
    let mut step = DVector::zeros(free.len());
    if positions.is_empty() {
        return Some(step);
    }
    let block = a.select_rows(&positions).select_columns(&positions);
    let solution = block.cholesky()?.solve(&slope.select_rows(&positions));
    for (i, value) in positions.into_iter().zip(solution.iter()) {
        step[i] = -value;
    }
    Some(step)
}

/// The fraction of the step, at most 1, up to the first bound, and the variable that meets it.
fn first_bound(
    delta: &DVector<f64>,
    towards: &DVector<f64>,
    lower: &DVector<f64>,
    upper: &DVector<f64>,
    free: &[bool],
) -> (f64, Option<(usize, f64)>) {
    let mut first = (1.0, None);
    for i in (0..free.len()).filter(|i| free[*i] && towards[*i] != 0.0) {
        let bound = if towards[i] > 0.0 { upper[i] } else { lower[i] };
        let length = (bound - delta[i]) / towards[i];
        if length < first.0 {
            first = (length.max(0.0), Some((i, bound)));
        }
    }
    first
}

/// The variable held at a bound although q decreases away from it, with the largest gain per unit of its own curvature.
fn most_wrongly_held(
    a: &DMatrix<f64>,
    slope: &DVector<f64>,
    delta: &DVector<f64>,
    lower: &DVector<f64>,
    upper: &DVector<f64>,
    free: &[bool],
) -> Option<usize> {
    let mut most: Option<(usize, f64)> = None;
    for i in (0..free.len()).filter(|i| !free[*i] && lower[*i] < upper[*i]) {
        let inwards = if delta[i] <= lower[i] { -slope[i] } else { slope[i] };
        let gain = inwards / a[(i, i)].sqrt();
        if gain > most.map_or(0.0, |(_, gain)| gain) {
            most = Some((i, gain));
        }
    }
    most.map(|(i, _)| i)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// q on a grid of the box is nowhere below its value at the minimum found, for bounds that hold none, one or both
    /// of two variables.
    #[test]
    fn no_point_of_the_box_is_lower() {
        // Strongly coupled: clipping the unconstrained minimum would be far off.
        let a = DMatrix::from_row_slice(2, 2, &[2.0, 1.8, 1.8, 2.0]);
        for (g, low, high) in [
            ([-1.0, 1.0], [-9.0, -9.0], [9.0, 9.0]),
            ([-1.0, 1.0], [-9.0, -1.0], [9.0, 9.0]),
            ([-1.0, 1.0], [0.0, -0.5], [0.2, 0.0]),
            ([1.0, 1.0], [0.0, 0.0], [9.0, 9.0]),
            ([3.0, -0.1], [0.0, -9.0], [1.0, 9.0]),
        ] {
            let g = DVector::from_row_slice(&g);
            let (low, high) = (DVector::from_row_slice(&low), DVector::from_row_slice(&high));
            let q = |d: &DVector<f64>| g.dot(d) + 0.5 * d.dot(&(&a * d));
            let found = minimise(&a, &g, &low, &high).expect("positive definite");
            let least = q(&found);
            for i in 0..=100 {
                for j in 0..=100 {
                    let at =
                        |k: usize, part: i32| low[k] + (high[k] - low[k]) * f64::from(part) / 100.0;
                    let point = DVector::from_row_slice(&[at(0, i), at(1, j)]);
                    // Rounding of a few terms of size up to 1e3.
                    assert!(q(&point) >= least - 1e-12, "{found} against {point}");
                }
            }
        }
    }

    #[test]
    fn a_matrix_that_is_not_positive_definite_gives_no_step() {
        let a = DMatrix::from_row_slice(1, 1, &[-1.0]);
        let one = DVector::from_row_slice(&[1.0]);
        assert_eq!(minimise(&a, &one, &(-&one), &one), None);
    }
}
