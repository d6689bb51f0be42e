//! Factorisations of the iteration matrix, chosen by size and pattern.
//!
//! [`FixedLu`] and [`DenseLu`] run the same elimination, on the stack and on the heap, so that a generated model and
//! its interpreted twin give the same bits. Models of more than a few dozen unknowns use [`AutoLu`], which chooses by
//! the pattern: [`TridiagonalLu`] or [`BandedLu`] if it finds an order of the unknowns in which the matrix is narrowly
//! banded or block-tridiagonal with small blocks; otherwise `SparseLu`, of the feature `sparse`, or [`DenseLu`] if
//! neither is faster. Without that feature, runs of models that need it are refused ([`Factorisation::is_built`]).

mod auto;
mod banded;
pub(crate) mod blocks;
mod dense;
pub(crate) mod full;
pub(crate) mod norm;
mod order;
#[cfg(feature = "sparse")]
mod sparse;
mod staircase;
pub(crate) mod sums;
mod tridiagonal;
pub(crate) mod weights;
pub(crate) mod width;

pub use auto::AutoLu;
pub use banded::BandedLu;
pub use dense::{DenseLu, FixedLu};
#[cfg(feature = "sparse")]
pub use sparse::SparseLu;
pub use sums::KeptSum;
pub use tridiagonal::TridiagonalLu;

use crate::system::Pattern;

/// Error for a singular matrix.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Singular {
    /// The row, zero or linearly dependent on others, at which the elimination stopped.
    pub row: usize,
}

/// A pivot of an elimination.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pivot {
    /// Its row in the matrix.
    pub row: usize,
    /// Its absolute value.
    pub magnitude: f64,
}

/// LU factorisation of W = c M − J, with M = diag(1 or 0) and J given by its non-zeros.
///
/// Pivots are chosen by weighted rows (`weights`), whatever the units of unknowns and the factors of equations; the
/// pivots themselves are those of W as given.
pub trait Factorisation: Clone {
    /// Whether this build has the factorisation that is fastest for n unknowns and this pattern of J.
    #[inline]
    fn is_built(_n: usize, _jacobian: &Pattern) -> bool {
        true
    }

    /// Work space for n unknowns and this pattern of J.
    fn new(n: usize, jacobian: &Pattern) -> Self;

    /// Factorises c M − J, with unknowns of these `sizes`; without them, rows are compared as they are.
    ///
    /// # Errors
    ///
    /// [`Singular`] if a pivot is zero or not finite; the previous factors are then lost.
    fn factorise(
        &mut self,
        c: f64,
        differential: impl Fn(usize) -> bool,
        jacobian: &Pattern,
        values: &[f64],
        sizes: Option<&[f64]>,
    ) -> Result<(), Singular>;

    /// [`Factorisation::factorise`] with rows of W replaced by those of conserved sums, if the factorisation supports
    /// it. Returns whether it does.
    ///
    /// # Errors
    ///
    /// As for [`Factorisation::factorise`].
    fn factorise_keeping(
        &mut self,
        c: f64,
        differential: impl Fn(usize) -> bool,
        jacobian: &Pattern,
        values: &[f64],
        sizes: &[f64],
        _sums: &[KeptSum],
    ) -> Result<bool, Singular> {
        self.factorise(c, differential, jacobian, values, Some(sizes))?;
        Ok(false)
    }

    /// Overwrites B with W⁻¹ B; `b` is one right-hand side of n numbers, or several, one after the
    /// other.
    fn solve(&mut self, b: &mut [f64]);

    /// The smallest pivot of the last factorisation; `None` for an empty matrix.
    fn smallest_pivot(&self) -> Option<Pivot>;
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Pseudo-random numbers between ± 1/2.
    fn random_numbers() -> impl FnMut() -> f64 {
        let mut state = 12_345_u64;
        move || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
        }
    }

    /// A matrix with pseudo-random entries in about a fifth of the places, by columns, and a full off-diagonal, so that
    /// rows must be exchanged.
    fn scattered(n: usize) -> (Pattern, Vec<f64>) {
        let mut next = random_numbers();
        let (mut places, mut values) = (Vec::new(), Vec::new());
        for j in 0..n {
            for i in 0..n {
                let value = next();
                let main = i == (j + 1) % n;
                if main || next() > 0.3 {
                    places.push((i, j));
                    values.push(if main { value + 4.0 } else { value });
                }
            }
        }
        (Pattern::from_places(&places), values)
    }

    /// The largest |W x − b| for x from the factorisation.
    fn residual<F: Factorisation>(n: usize, pattern: &Pattern, values: &[f64]) -> f64 {
        let differential = |i: usize| i.is_multiple_of(3);
        let mut lu = F::new(n, pattern);
        lu.factorise(2.5, differential, pattern, values, None).unwrap();
        let right: Vec<f64> = (0..2 * n).map(|i| 1.0 + i as f64).collect();
        let mut x = right.clone();
        lu.solve(&mut x);
        let mut rest = right;
        for (x, b) in x.chunks_exact(n).zip(rest.chunks_exact_mut(n)) {
            for ((i, j), value) in pattern.positions().zip(values) {
                b[i] += value * x[j];
            }
            for i in (0..n).filter(|&i| differential(i)) {
                b[i] -= 2.5 * x[i];
            }
        }
        rest.iter().fold(0.0, |largest, r| largest.max(r.abs()))
    }

    #[test]
    fn all_factorisations_solve() {
        // Right-hand sides up to 2n, well-conditioned matrices.
        let (pattern, values) = scattered(12);
        assert!(residual::<FixedLu<12>>(12, &pattern, &values) < 1e-12);
        assert!(residual::<DenseLu>(12, &pattern, &values) < 1e-12);
        #[cfg(feature = "sparse")]
        assert!(residual::<SparseLu>(12, &pattern, &values) < 1e-12);
        assert!(residual::<BandedLu>(12, &pattern, &values) < 1e-12);
        let (pattern, values) = scattered(90);
        #[cfg(feature = "sparse")]
        assert!(residual::<SparseLu>(90, &pattern, &values) < 1e-10);
        assert!(residual::<AutoLu>(90, &pattern, &values) < 1e-10);
    }

    /// A matrix with a full band, its unknowns and rows shuffled in the same way.
    fn shuffled_band(n: usize, width: usize) -> (Pattern, Vec<f64>) {
        // 7 and n are coprime.
        let shuffled = |i: usize| (i * 7 + 3) % n;
        let mut next = random_numbers();
        let (mut places, mut values) = (Vec::new(), Vec::new());
        for j in 0..n {
            for i in j.saturating_sub(width)..n.min(j + width + 1) {
                places.push((shuffled(i), shuffled(j)));
                values.push(next());
            }
        }
        (Pattern::from_places(&places), values)
    }

    #[test]
    fn narrow_bands_are_found_and_solved() {
        // Pivots are anywhere in the band. Residuals grow with the condition number, at most some
        // thousands for matrices of this size.
        for n in [33, 34, 100, 2000] {
            for width in [1, 2, 5] {
                let (pattern, values) = shuffled_band(n, width);
                let lu = AutoLu::new(n, &pattern);
                assert_eq!(matches!(lu, AutoLu::Tridiagonal(_)), width == 1, "{lu:?}");
                assert_eq!(matches!(lu, AutoLu::Banded(_)), width > 1, "{lu:?}");
                let rest = residual::<AutoLu>(n, &pattern, &values);
                assert!(rest < 1e-12 * n as f64 * n as f64, "{n} {width}: {rest}");
            }
        }
    }

    #[test]
    fn blocks_in_a_row_are_solved_by_their_steps() {
        // Dense blocks of six and their neighbours, shuffled; the first diagonal block is singular.
        let (b, n) = (6, 300);
        let shuffled = |i: usize| (i * 7 + 3) % n;
        let mut next = random_numbers();
        let (mut places, mut values) = (Vec::new(), Vec::new());
        for j in 0..n {
            for i in (0..n).filter(|i| (i / b).abs_diff(j / b) <= 1) {
                places.push((shuffled(i), shuffled(j)));
                values.push(if i < b && j < b { 1.0 } else { next() });
            }
        }
        let pattern = Pattern::from_places(&places);
        assert!(matches!(AutoLu::new(n, &pattern), AutoLu::Banded(_)));
        let banded = residual::<AutoLu>(n, &pattern, &values);
        assert!(banded < 1e-12 * n as f64 * n as f64, "{banded}");
    }

    #[test]
    fn matrices_without_a_band_are_full_or_sparse() {
        let (pattern, _) = scattered(90);
        assert!(matches!(AutoLu::new(90, &pattern), AutoLu::Dense(_)));
        assert!(AutoLu::is_built(90, &pattern));
        // Each row reads two distant unknowns.
        let n = 3000;
        let far = (0..n).flat_map(|i| [1, 7919].map(|k| (i, (i * i * k + 5) % n)));
        let pattern = Pattern::from_places(&far.collect::<Vec<_>>());
        #[cfg(feature = "sparse")]
        assert!(matches!(AutoLu::new(n, &pattern), AutoLu::Sparse(_)));
        assert_eq!(AutoLu::is_built(n, &pattern), cfg!(feature = "sparse"));
    }

    #[test]
    fn the_tridiagonal_factorisation_serves_all_lengths() {
        for n in 2..12 {
            let (places, values): (Vec<_>, Vec<_>) = {
                let mut next = random_numbers();
                let near = |i: usize| i.saturating_sub(1)..n.min(i + 2);
                (0..n).flat_map(|j| near(j).map(move |i| (i, j))).map(|at| (at, next())).unzip()
            };
            let pattern = Pattern::from_places(&places);
            let right: Vec<f64> = (0..n).map(|i| 1.0 + i as f64).collect();
            let mut of_band = right.clone();
            let mut lu = TridiagonalLu::new(n, &pattern, order::UnknownOrder::Natural);
            lu.factorise(0.3, |_| true, &pattern, &values, None).unwrap();
            lu.solve(&mut of_band);
            let mut full = DenseLu::new(n, &pattern);
            full.factorise(0.3, |_| true, &pattern, &values, None).unwrap();
            let mut of_full = right;
            full.solve(&mut of_full);
            for (a, b) in of_band.iter().zip(&of_full) {
                assert!((a - b).abs() <= 1e-10 * (1.0 + b.abs()), "{n}: {of_band:?} {of_full:?}");
            }
        }
    }

    #[test]
    fn singular_bands_are_told_with_a_row() {
        let n = 100;
        for width in [1, 3] {
            let (pattern, mut values) = shuffled_band(n, width);
            let empty = 42;
            pattern.for_each_mut(&mut values, |row, _, value| {
                if row == empty {
                    *value = 0.0;
                }
            });
            let mut lu = AutoLu::new(n, &pattern);
            let failure = lu.factorise(1.0, |i| i != empty, &pattern, &values, None).unwrap_err();
            assert_eq!(failure.row, empty, "width {width}");
            values[200] = f64::NAN;
            lu.factorise(1.0, |_| true, &pattern, &values, None).unwrap_err();
            values[200] = f64::INFINITY;
            lu.factorise(1.0, |_| true, &pattern, &values, None).unwrap_err();
            values[200] = 0.0;
            lu.factorise(1.0, |_| true, &pattern, &values, None).unwrap();
        }
    }

    #[test]
    fn the_smallest_pivot_of_a_band_bears_its_row() {
        let n = 40;
        for width in [1, 2] {
            let (pattern, mut values) = shuffled_band(n, width);
            pattern.for_each_mut(&mut values, |row, column, value| {
                *value = match (row == column, row) {
                    (true, 17) => 1e-3,
                    (true, _) => 2.0,
                    (false, _) => 0.0,
                };
            });
            let mut lu = AutoLu::new(n, &pattern);
            lu.factorise(0.0, |_| false, &pattern, &values, None).unwrap();
            assert_eq!(lu.smallest_pivot(), Some(Pivot { row: 17, magnitude: 1e-3 }));
        }
    }

    #[test]
    fn singular_matrices_are_told_with_a_row() {
        fn row_of_failure<F: Factorisation>(n: usize, values: &[f64]) -> usize {
            // W = −J: rows 0 and 1 are regular, row 2 is the zero row.
            let pattern = Pattern::from_places(&[(1, 0), (2, 0), (0, 1), (1, 2), (2, 2)]);
            let mut lu = F::new(n, &pattern);
            lu.factorise(1.0, |_| false, &pattern, values, None).unwrap_err().row
        }
        let zero_row = [1.0, 0.0, 1.0, 1.0, 0.0];
        assert_eq!(row_of_failure::<FixedLu<3>>(3, &zero_row), 2);
        assert_eq!(row_of_failure::<DenseLu>(3, &zero_row), 2);
        #[cfg(feature = "sparse")]
        assert_eq!(row_of_failure::<SparseLu>(3, &zero_row), 2);
        let not_finite = [1.0, f64::NAN, 1.0, 1.0, 0.0];
        row_of_failure::<FixedLu<3>>(3, &not_finite);
        #[cfg(feature = "sparse")]
        row_of_failure::<SparseLu>(3, &not_finite);
    }

    #[test]
    fn the_smallest_pivot_bears_its_row() {
        fn smallest<F: Factorisation>() -> Pivot {
            let pattern = Pattern::from_places(&[(1, 0), (0, 1)]);
            let mut lu = F::new(2, &pattern);
            lu.factorise(1.0, |_| false, &pattern, &[3.0, -0.5], None).unwrap();
            lu.smallest_pivot().unwrap()
        }
        let expected = Pivot { row: 0, magnitude: 0.5 };
        assert_eq!(smallest::<FixedLu<2>>(), expected);
        assert_eq!(smallest::<DenseLu>(), expected);
        #[cfg(feature = "sparse")]
        assert_eq!(smallest::<SparseLu>(), expected);
    }
}
