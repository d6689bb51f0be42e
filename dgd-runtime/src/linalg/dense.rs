// Lengths are constants where storage has a fixed size, and only once inlined there.
#![allow(clippy::inline_always)]

use super::{Factorisation, Pivot, Singular};
use crate::system::Pattern;

/// LU factorisation of a matrix whose size is known when the program is compiled, on the stack.
#[derive(Debug, Clone)]
pub struct FixedLu<const N: usize> {
    /// Column by column: L below the diagonal, U on and above it.
    factors: [[f64; N]; N],
    reciprocal_pivots: [f64; N],
    /// Row of W that became row k of U.
    order: [usize; N],
}

impl<const N: usize> Factorisation for FixedLu<N> {
    fn new(n: usize, _: &Pattern) -> Self {
        assert_eq!(n, N, "factorisation of fixed size");
        Self { factors: [[0.0; N]; N], reciprocal_pivots: [0.0; N], order: [0; N] }
    }

    #[inline]
    fn factorise(
        &mut self,
        c: f64,
        differential: impl Fn(usize) -> bool,
        jacobian: &Pattern,
        values: &[f64],
    ) -> Result<(), Singular> {
        let a = self.factors.as_flattened_mut();
        assemble(a, N, c, differential, jacobian, values);
        eliminate(a, N, &mut self.reciprocal_pivots, &mut self.order)
    }

    #[inline]
    fn solve(&mut self, b: &mut [f64]) {
        let factors = self.factors.as_flattened();
        for column in b.as_chunks_mut::<N>().0 {
            let mut x = permuted(column, &self.order);
            substitute(factors, N, &self.reciprocal_pivots, &mut x);
            *column = x;
        }
    }

    #[inline]
    fn smallest_pivot(&self) -> Option<Pivot> {
        smallest_pivot(self.factors.as_flattened(), N, &self.order)
    }
}

/// LU factorisation of a full matrix whose size is known when the program runs.
#[derive(Debug, Clone)]
pub struct DenseLu {
    n: usize,
    factors: Vec<f64>,
    reciprocal_pivots: Vec<f64>,
    order: Vec<usize>,
    scratch: Vec<f64>,
}

impl Factorisation for DenseLu {
    fn new(n: usize, _: &Pattern) -> Self {
        Self {
            n,
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
    ) -> Result<(), Singular> {
        assemble(&mut self.factors, self.n, c, differential, jacobian, values);
        eliminate(&mut self.factors, self.n, &mut self.reciprocal_pivots, &mut self.order)
    }

    fn solve(&mut self, b: &mut [f64]) {
        if self.n == 0 {
            return;
        }
        let Self { n, factors, reciprocal_pivots, order, scratch } = self;
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

/// P A = L U with partial pivoting, in place. Inlined, so that n is a constant in [`FixedLu`].
#[inline(always)]
fn eliminate(
    a: &mut [f64],
    n: usize,
    reciprocal_pivots: &mut [f64],
    order: &mut [usize],
) -> Result<(), Singular> {
    for (k, row) in order.iter_mut().enumerate() {
        *row = k;
    }
    for k in 0..n {
        let (left, right) = a.split_at_mut((k + 1) * n);
        let pivot_column = &mut left[k * n..];

        let mut pivot_row = k;
        let mut largest = pivot_column[k].abs();
        let mut finite = largest < f64::INFINITY;
        for (i, value) in pivot_column.iter().enumerate().skip(k + 1) {
            finite &= value.is_finite();
            if value.abs() > largest {
                largest = value.abs();
                pivot_row = i;
            }
        }
        order.swap(k, pivot_row);
        if largest == 0.0 || !finite {
            return Err(Singular { row: order[k] });
        }
        if pivot_row != k {
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
    Ok(())
}

/// Up to so many numbers are put into another order by comparing, not by an index that depends on
/// data: only so can they stay in registers.
const FEW: usize = 4;

/// P b.
#[inline(always)]
fn permuted<const N: usize>(b: &[f64; N], order: &[usize; N]) -> [f64; N] {
    if N > FEW {
        return order.map(|row| b[row]);
    }
    order.map(|row| {
        let mut chosen = 0.0;
        for (j, b) in b.iter().enumerate() {
            chosen = if row == j { *b } else { chosen };
        }
        chosen
    })
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
