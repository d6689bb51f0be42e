//! Linear combinations of the states that the equations conserve.
//!
//! With algebraic unknowns eliminated, ẋ = g(x). For a row of numbers c,
//!
//! ```text
//!   cᵀ g(x) = 0 for all x   ⇔   cᵀ ∂g/∂x = 0 for all x,  and  cᵀ g(x₀) = 0
//! ```
//!
//! So c is a left null vector of the Jacobians A = ∂g/∂x at several points side by side, [A(x₀) A(x₁) …]: the start and
//! points around it that avoid symmetries. Sums conserved in one mode, or on one side of a switch, need not be
//! conserved in another: A is that of the given modes.
//!
//! If c changes with x, the conserved quantity is not linear in the states, and the left null vectors at one point are
//! its linearisation there.

use nalgebra::DMatrix;

/// Singular values below this fraction of the largest are zero, with rows and columns scaled by their largest entries.
const SINGULAR: f64 = 1e-11;
/// A state that nothing depends on names the conserved combination if its share is at least this fraction of the
/// largest.
const TAKES_PART: f64 = 1e-4;
/// Shares below this fraction of the largest are rounding.
const ROUNDING: f64 = 1e-10;

/// A linear combination of states that the equations conserve in the modes of a point.
#[derive(Debug, Clone, PartialEq)]
pub struct ConservedCombination {
    /// Positions of states among the unknowns, ascending, with their coefficients, whose unit is the SI unit of the
    /// naming state over that of the state.
    pub terms: Vec<(usize, f64)>,
    /// Position of the naming state: its coefficient is one, and it occurs in no other conserved combination.
    pub named_by: usize,
    /// Its value at the point, SI unit of the naming state.
    pub value: f64,
    /// Its value at the start, which differs if modes on the way did not conserve it.
    pub at_start: f64,
    /// Whether it is conserved for any inputs; otherwise only for the given ones.
    pub whatever_inputs: bool,
    /// Whether it is conserved at all points; otherwise it linearises the conserved quantity at this one.
    pub is_linear: bool,
}

impl ConservedCombination {
    /// The value of the combination at these unknowns.
    pub(super) fn value(&self, y: &[f64]) -> f64 {
        self.terms.iter().map(|(state, c)| c * y[*state]).sum()
    }
}

/// Combinations of rows that vanish in all of these matrices, whose rows and columns are the states.
///
/// | name | shape |
/// |---|---|
/// | `slopes` | n_x × n_x each |
/// | `sizes` | n_x, of the states |
///
/// Returns the coefficients of each combination and its naming state, whose coefficient is one.
pub(super) fn left_null(slopes: &[DMatrix<f64>], sizes: &[f64]) -> Vec<(Vec<f64>, usize)> {
    let n = sizes.len();
    if n == 0 || slopes.is_empty() {
        return Vec::new();
    }
    let mut stacked = DMatrix::zeros(n, n * slopes.len());
    for (k, own) in slopes.iter().enumerate() {
        stacked.view_mut((0, k * n), (n, n)).copy_from(own);
    }
    let is_read: Vec<bool> =
        (0..n).map(|j| slopes.iter().any(|own| own.column(j).amax() > 0.0)).collect();
    for (j, mut column) in stacked.column_iter_mut().enumerate() {
        column *= sizes[j % n];
    }
    let mut rows = vec![1.0; n];
    for (mut row, scale) in stacked.row_iter_mut().zip(&mut rows) {
        let largest = row.amax();
        if largest > 0.0 {
            *scale = largest;
            row /= largest;
        }
    }
    for mut column in stacked.column_iter_mut() {
        let largest = column.amax();
        if largest > 0.0 {
            column /= largest;
        }
    }
    if stacked.iter().any(|value| !value.is_finite()) {
        return Vec::new();
    }
    let svd = stacked.svd(true, false);
    let Some(left) = svd.u else { return Vec::new() };
    let cutoff = SINGULAR * svd.singular_values.max();
    let null: Vec<usize> = (0..n).filter(|k| svd.singular_values[*k] <= cutoff).collect();
    // In units of the sizes, so that entries are comparable.
    let mut basis = DMatrix::from_fn(null.len(), n, |k, i| left[(i, null[k])] / rows[i] * sizes[i]);
    let names = reduce(&mut basis, &is_read);
    let mut combinations: Vec<(Vec<f64>, usize)> = names
        .into_iter()
        .enumerate()
        .map(|(k, name)| {
            let largest = basis.row(k).amax();
            let coefficient = |i: usize| {
                let share = basis[(k, i)];
                let coefficient =
                    if share.abs() <= ROUNDING * largest { 0.0 } else { share / sizes[i] };
                coefficient * sizes[name]
            };
            ((0..n).map(coefficient).collect(), name)
        })
        .collect();
    combinations.sort_by_key(|(_, name)| *name);
    combinations
}

/// Gauss–Jordan elimination: each row keeps a one in a pivot column where all other rows are zero.
fn reduce(basis: &mut DMatrix<f64>, is_read: &[bool]) -> Vec<usize> {
    let (m, n) = basis.shape();
    let mut names: Vec<usize> = Vec::with_capacity(m);
    for k in 0..m {
        let free = |j: &usize| !names.contains(j);
        let candidates = || (k..m).flat_map(|r| (0..n).filter(free).map(move |j| (r, j)));
        let largest = candidates().map(|at| basis[at].abs()).fold(0.0, f64::max);
        let by_size = |a: &(usize, usize), b: &(usize, usize)| {
            // Ties go to the first, so that naming states come in order.
            basis[*a].abs().total_cmp(&basis[*b].abs()).then(b.cmp(a))
        };
        let sums_up =
            candidates().filter(|at| !is_read[at.1] && basis[*at].abs() > TAKES_PART * largest);
        let Some((row, name)) = sums_up.max_by(by_size).or_else(|| candidates().max_by(by_size))
        else {
            return names;
        };
        basis.swap_rows(k, row);
        let pivot = basis[(k, name)];
        basis.row_mut(k).unscale_mut(pivot);
        let row = basis.row(k).into_owned();
        for other in (0..m).filter(|other| *other != k) {
            let factor = basis[(other, name)];
            let reduced = basis.row(other) - &row * factor;
            basis.set_row(other, &reduced);
            basis[(other, name)] = 0.0;
        }
        names.push(name);
    }
    names
}

/// A without the naming states, which follow from the others: it has the eigenvalues of A except the zeros that belong
/// to conserved combinations.
pub(super) fn without(
    a: &DMatrix<f64>,
    states: &[usize],
    conserved: &[ConservedCombination],
) -> DMatrix<f64> {
    let place = |unknown: usize| states.binary_search(&unknown).ok();
    let names: Vec<usize> = conserved.iter().filter_map(|own| place(own.named_by)).collect();
    let rest: Vec<usize> = (0..states.len()).filter(|i| !names.contains(i)).collect();
    let mut reduced = a.select_rows(&rest).select_columns(&rest);
    for own in conserved {
        let Some(name) = place(own.named_by) else { continue };
        for (state, c) in &own.terms {
            let Some(column) = place(*state).and_then(|at| rest.binary_search(&at).ok()) else {
                continue;
            };
            for (row, i) in rest.iter().enumerate() {
                reduced[(row, column)] -= a[(*i, name)] * c;
            }
        }
    }
    reduced
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_tanks_keep_their_volume() {
        // Areas of 2 and 3 m²: ḣ₁ = −q/2, ḣ₂ = q/3, whatever ∂q/∂h is.
        let slopes =
            |k: f64| DMatrix::from_row_slice(2, 2, &[-k / 2.0, k / 2.0, k / 3.0, -k / 3.0]);
        let found = left_null(&[slopes(0.1), slopes(0.7)], &[10.0, 1.0]);
        let [(c, name)] = found.as_slice() else { panic!("{found:?}") };
        assert_eq!(*name, 0);
        assert!(c[0] == 1.0 && (c[1] - 1.5).abs() < 1e-14, "{c:?}");
    }

    #[test]
    fn what_moves_from_point_to_point_is_not_linear() {
        // The second tank widens: its area is 3 m² at one point and 4 m² at another.
        let slopes = |a: f64| DMatrix::from_row_slice(2, 2, &[-0.5, 0.5, 1.0 / a, -1.0 / a]);
        assert_eq!(left_null(&[slopes(3.0)], &[1.0; 2]).len(), 1);
        assert!(left_null(&[slopes(3.0), slopes(4.0)], &[1.0; 2]).is_empty());
    }

    #[test]
    fn each_of_two_has_a_name_of_its_own() {
        // Two uncoupled loops of two states, in units a million apart; the last state of each is the sum.
        let mut slopes = DMatrix::zeros(4, 4);
        for (from, to, rate) in [(0, 1, 1e-6), (2, 3, 1e6)] {
            slopes[(from, from)] = -rate;
            slopes[(to, from)] = 2.0 * rate;
        }
        let found = left_null(&[slopes], &[1.0, 1.0, 1e-3, 1e3]);
        let expected = [(vec![2.0, 1.0, 0.0, 0.0], 1), (vec![0.0, 0.0, 2.0, 1.0], 3)];
        for ((c, name), (c_expected, name_expected)) in found.iter().zip(&expected) {
            assert_eq!(name, name_expected);
            assert!(c.iter().zip(c_expected).all(|(a, b)| (a - b).abs() < 1e-12), "{c:?}");
        }
        assert_eq!(found.len(), 2);
    }
}
