//! LU factorisation of full matrices with partial pivoting, of a size known at compile time or at run time.

// Lengths are constants if storage has a fixed size, but only after inlining.
#![allow(clippy::inline_always)]

use super::weights::{alone, reciprocal, weigh};
use super::{Factorisation, KeptSum, Pivot, Singular};
use crate::system::Pattern;

/// Columns up to this length are solved inline, without a call.
const FEW: usize = 4;

/// LU factorisation of a matrix whose size is known at compile time, on the stack.
#[derive(Debug, Clone)]
pub struct FixedLu<const N: usize> {
    /// Column by column: L below the diagonal, U on and above it.
    factors: [[f64; N]; N],
    reciprocal_pivots: [f64; N],
    /// For each k, the row of W that became row k of U.
    order: [usize; N],
    /// Whether rows were exchanged.
    exchanged: bool,
    /// Rows of equations that read no unknown.
    alone: Vec<usize>,
}

impl<const N: usize> Factorisation for FixedLu<N> {
    fn new(n: usize, jacobian: &Pattern) -> Self {
        assert_eq!(n, N, "factorisation of fixed size");
        Self {
            factors: [[0.0; N]; N],
            reciprocal_pivots: [0.0; N],
            order: [0; N],
            exchanged: false,
            alone: alone(n, jacobian),
        }
    }

    #[inline]
    fn factorise(
        &mut self,
        c: f64,
        differential: impl Fn(usize) -> bool,
        jacobian: &Pattern,
        values: &[f64],
        sizes: Option<&[f64]>,
    ) -> Result<(), Singular> {
        let mut weights = [0.0; N];
        weigh(&mut weights, c, &differential, jacobian, values, sizes, &self.alone);
        let Self { factors, reciprocal_pivots, order, .. } = self;
        let a = factors.as_flattened_mut();
        assemble(a, N, c, differential, jacobian, values);
        self.exchanged = eliminate(a, N, &mut weights, reciprocal_pivots, order)?;
        Ok(())
    }

    fn factorise_keeping(
        &mut self,
        c: f64,
        differential: impl Fn(usize) -> bool,
        jacobian: &Pattern,
        values: &[f64],
        sizes: &[f64],
        sums: &[KeptSum],
    ) -> Result<bool, Singular> {
        let mut weights = [0.0; N];
        weigh(&mut weights, c, &differential, jacobian, values, Some(sizes), &self.alone);
        let Self { factors, reciprocal_pivots, order, .. } = self;
        let a = factors.as_flattened_mut();
        assemble(a, N, c, &differential, jacobian, values);
        replace(a, &mut weights, c, differential, sizes, sums);
        self.exchanged = eliminate(a, N, &mut weights, reciprocal_pivots, order)?;
        Ok(true)
    }

    #[inline(always)]
    fn solve(&mut self, b: &mut [f64]) {
        if N <= FEW {
            self.solve_columns(b.as_chunks_mut::<N>().0);
        } else {
            self.solve_long_columns(b.as_chunks_mut::<N>().0);
        }
    }

    #[inline]
    fn smallest_pivot(&self) -> Option<Pivot> {
        smallest_pivot(self.factors.as_flattened(), N, &self.order)
    }
}

impl<const N: usize> FixedLu<N> {
    /// Inlined, so that short columns can stay in registers.
    #[inline(always)]
    fn solve_columns(&self, columns: &mut [[f64; N]]) {
        if self.exchanged {
            for column in &mut *columns {
                // Two rows allow only one exchange.
                *column = if N == 2 { swapped(*column) } else { reordered(*column, &self.order) };
            }
        }
        let (fours, rest) = columns.as_chunks_mut::<4>();
        for columns in fours {
            self.substitute_lanes(columns);
        }
        let (pairs, rest) = rest.as_chunks_mut::<2>();
        for columns in pairs {
            self.substitute_lanes(columns);
        }
        for column in rest {
            self.substitute_lanes(std::array::from_mut(column));
        }
    }

    /// x ← U⁻¹ L⁻¹ x for L columns at once, row by row: the columns are the lanes of vector instructions.
    // Indexed loops: compilers do not vectorise iterators over rows and lanes.
    #[allow(clippy::needless_range_loop)]
    #[inline(always)]
    fn substitute_lanes<const L: usize>(&self, columns: &mut [[f64; N]; L]) {
        let mut x = [[0.0; L]; N];
        for i in 0..N {
            for lane in 0..L {
                x[i][lane] = columns[lane][i];
            }
        }
        for k in 0..N {
            for i in k + 1..N {
                for lane in 0..L {
                    x[i][lane] -= self.factors[k][i] * x[k][lane];
                }
            }
        }
        for k in (0..N).rev() {
            for lane in 0..L {
                x[k][lane] *= self.reciprocal_pivots[k];
            }
            for i in 0..k {
                for lane in 0..L {
                    x[i][lane] -= self.factors[k][i] * x[k][lane];
                }
            }
        }
        for i in 0..N {
            for lane in 0..L {
                columns[lane][i] = x[i][lane];
            }
        }
    }

    #[inline(never)]
    fn solve_long_columns(&self, columns: &mut [[f64; N]]) {
        self.solve_columns(columns);
    }
}

/// b, last row first.
#[inline(always)]
fn swapped<const N: usize>(mut b: [f64; N]) -> [f64; N] {
    b.reverse();
    b
}

/// P b. Not inlined: an index that depends on data would force b into memory in the caller.
#[inline(never)]
fn reordered<const N: usize>(b: [f64; N], order: &[usize; N]) -> [f64; N] {
    order.map(|row| b[row])
}

/// LU factorisation of a full matrix whose size is known at run time.
#[derive(Debug, Clone)]
pub struct DenseLu {
    n: usize,
    factors: Vec<f64>,
    reciprocal_pivots: Vec<f64>,
    order: Vec<usize>,
    scratch: Vec<f64>,
    /// Rows of equations that read no unknown.
    alone: Vec<usize>,
}

impl Factorisation for DenseLu {
    fn new(n: usize, jacobian: &Pattern) -> Self {
        Self {
            n,
            alone: alone(n, jacobian),
            factors: vec![0.0; n * n],
            reciprocal_pivots: vec![0.0; n],
            order: vec![0; n],
            scratch: vec![0.0; n],
        }
    }

    fn factorise(
        &mut self,
        c: f64,
        differential: impl Fn(usize) -> bool,
        jacobian: &Pattern,
        values: &[f64],
        sizes: Option<&[f64]>,
    ) -> Result<(), Singular> {
        let Self { n, factors, reciprocal_pivots, order, scratch: weights, alone } = self;
        weigh(weights, c, &differential, jacobian, values, sizes, alone);
        assemble(factors, *n, c, differential, jacobian, values);
        eliminate(factors, *n, weights, reciprocal_pivots, order)?;
        Ok(())
    }

    fn factorise_keeping(
        &mut self,
        c: f64,
        differential: impl Fn(usize) -> bool,
        jacobian: &Pattern,
        values: &[f64],
        sizes: &[f64],
        sums: &[KeptSum],
    ) -> Result<bool, Singular> {
        let Self { n, factors, reciprocal_pivots, order, scratch: weights, alone } = self;
        weigh(weights, c, &differential, jacobian, values, Some(sizes), alone);
        assemble(factors, *n, c, &differential, jacobian, values);
        replace(factors, weights, c, differential, sizes, sums);
        eliminate(factors, *n, weights, reciprocal_pivots, order)?;
        Ok(true)
    }

    fn solve(&mut self, b: &mut [f64]) {
        if self.n == 0 {
            return;
        }
        let Self { n, factors, reciprocal_pivots, order, scratch, .. } = self;
        for column in b.chunks_exact_mut(*n) {
            for (x, &row) in scratch.iter_mut().zip(order.iter()) {
                *x = column[row];
            }
            substitute(factors, *n, reciprocal_pivots, scratch);
            column.copy_from_slice(scratch);
        }
    }

    fn smallest_pivot(&self) -> Option<Pivot> {
        smallest_pivot(&self.factors, self.n, &self.order)
    }
}

/// a ← c M − J, column by column.
#[inline(always)]
fn assemble(
    a: &mut [f64],
    n: usize,
    c: f64,
    differential: impl Fn(usize) -> bool,
    jacobian: &Pattern,
    values: &[f64],
) {
    a.fill(0.0);
    jacobian.for_each(values, |row, column, value| a[column * n + row] = -value);
    for i in 0..n {
        if differential(i) {
            a[i * n + i] += c;
        }
    }
}

/// Replaces rows by c times those of conserved sums.
fn replace(
    a: &mut [f64],
    weights: &mut [f64],
    c: f64,
    differential: impl Fn(usize) -> bool,
    sizes: &[f64],
    sums: &[KeptSum],
) {
    let n = weights.len();
    let per_rate = if (0..n).all(differential) { 1.0 } else { c };
    for sum in sums {
        let mut largest = 0.0_f64;
        for (column, (share, size)) in sum.shares.iter().zip(sizes).enumerate() {
            a[column * n + sum.row] = c * share;
            largest = largest.max((share * size).abs());
        }
        weights[sum.row] = reciprocal(per_rate * largest);
    }
}

/// P A = L U in place, with pivots that are largest in their columns with weighted rows. Returns whether P differs from
/// the identity. Inlined, so that n is a constant in [`FixedLu`].
#[inline(always)]
fn eliminate(
    a: &mut [f64],
    n: usize,
    weights: &mut [f64],
    reciprocal_pivots: &mut [f64],
    order: &mut [usize],
) -> Result<bool, Singular> {
    let mut exchanged = false;
    for (k, row) in order.iter_mut().enumerate() {
        *row = k;
    }
    for k in 0..n {
        let (left, right) = a.split_at_mut((k + 1) * n);
        let pivot_column = &mut left[k * n..];

        let mut pivot_row = k;
        let mut largest = pivot_column[k].abs() * weights[k];
        let mut finite = pivot_column[k].is_finite();
        for (i, value) in pivot_column.iter().enumerate().skip(k + 1) {
            finite &= value.is_finite();
            let magnitude = value.abs() * weights[i];
            if magnitude > largest {
                largest = magnitude;
                pivot_row = i;
            }
        }
        order.swap(k, pivot_row);
        if pivot_column[pivot_row] == 0.0 || !finite {
            return Err(Singular { row: order[k] });
        }
        if pivot_row != k {
            exchanged = true;
            weights.swap(k, pivot_row);
            for column in left.chunks_exact_mut(n).chain(right.chunks_exact_mut(n)) {
                column.swap(k, pivot_row);
            }
        }

        let pivot_column = &mut left[k * n..];
        let reciprocal = 1.0 / pivot_column[k];
        reciprocal_pivots[k] = reciprocal;
        for l in &mut pivot_column[k + 1..] {
            *l *= reciprocal;
        }
        for column in right.chunks_exact_mut(n) {
            let u = column[k];
            for (value, l) in column[k + 1..].iter_mut().zip(&pivot_column[k + 1..]) {
                *value -= l * u;
            }
        }
    }
    Ok(exchanged)
}

/// x ← U⁻¹ L⁻¹ x.
#[inline(always)]
fn substitute(factors: &[f64], n: usize, reciprocal_pivots: &[f64], x: &mut [f64]) {
    for (k, l) in factors.chunks_exact(n).enumerate() {
        let (x_k, below) = (x[k], &mut x[k + 1..]);
        for (value, l) in below.iter_mut().zip(&l[k + 1..]) {
            *value -= l * x_k;
        }
    }
    for (k, u) in factors.chunks_exact(n).enumerate().rev() {
        x[k] *= reciprocal_pivots[k];
        let (x_k, above) = (x[k], &mut x[..k]);
        for (value, u) in above.iter_mut().zip(u) {
            *value -= u * x_k;
        }
    }
}

#[inline(always)]
fn smallest_pivot(factors: &[f64], n: usize, order: &[usize]) -> Option<Pivot> {
    let magnitude = |k: usize| factors[k * n + k].abs();
    let k = (0..n).min_by(|&i, &j| magnitude(i).total_cmp(&magnitude(j)))?;
    Some(Pivot { row: order[k], magnitude: magnitude(k) })
}
