//! LU factorisation of a banded or block-tridiagonal matrix with partial pivoting within the band.
//!
//! Columns are stored one after the other, each with the l + u places above the diagonal that row exchanges can fill,
//! its diagonal element and the l below it, as in LAPACK's `dgbtrf`.
//!
//! If the band ends in steps, elimination stops at the steps ([`Staircase`]). In a block-tridiagonal matrix of b × b
//! blocks these are the ends of the blocks: the columns of a block then involve 2b rows, b fewer than the band at its
//! widest, and 3b columns, which halves the work. Pivots come from the rows of both blocks, so a block may be singular.
//!
//! Source: Golub and Van Loan, *Matrix Computations*, 4th ed. (2013), §4.3.

use super::order::{Bandwidth, UnknownOrder, narrowest};
use super::staircase::Staircase;
use super::weights::{alone, weigh};
use super::{Factorisation, Pivot, Singular};
use crate::system::Pattern;

/// LU factorisation of a matrix that is banded in a certain order of the unknowns.
#[derive(Debug, Clone)]
pub struct BandedLu {
    n: usize,
    order: UnknownOrder,
    width: Bandwidth,
    steps: Staircase,
    /// Column by column: U on and above the diagonal, the multiples of L below.
    factors: Vec<f64>,
    reciprocal_pivots: Vec<f64>,
    /// Distance of each pivot below the diagonal.
    exchanges: Vec<u32>,
    /// The row of W that is at each place.
    rows: Vec<u32>,
    /// The weight of each row of W.
    weights: Vec<f64>,
    /// Rows of equations that read no unknown.
    alone: Vec<usize>,
    /// A right-hand side by places.
    permuted: Vec<f64>,
}

impl BandedLu {
    /// Work space for `n` unknowns, in whose `order` the matrix has this bandwidth and these steps.
    pub(super) fn with_order(
        n: usize,
        jacobian: &Pattern,
        order: UnknownOrder,
        width: Bandwidth,
        steps: Staircase,
    ) -> Self {
        let height = 2 * width.lower + width.upper + 1;
        let permuted = match order {
            UnknownOrder::Natural => Vec::new(),
            UnknownOrder::Permuted { .. } => vec![0.0; n],
        };
        Self {
            n,
            order,
            width,
            steps,
            factors: vec![0.0; n * height],
            reciprocal_pivots: vec![0.0; n],
            exchanges: vec![0; n],
            rows: vec![0; n],
            weights: vec![0.0; n],
            alone: alone(n, jacobian),
            permuted,
        }
    }
}

impl Factorisation for BandedLu {
    fn new(n: usize, jacobian: &Pattern) -> Self {
        let (order, width) = narrowest(n, jacobian);
        let steps = Staircase::new(n, jacobian, &order);
        Self::with_order(n, jacobian, order, width, steps)
    }

    fn factorise(
        &mut self,
        c: f64,
        differential: impl Fn(usize) -> bool,
        jacobian: &Pattern,
        values: &[f64],
        sizes: Option<&[f64]>,
    ) -> Result<(), Singular> {
        let Self { n, order, width, steps, factors, reciprocal_pivots, .. } = self;
        let Self { exchanges, rows, weights, alone, .. } = self;
        weigh(weights, c, &differential, jacobian, values, sizes, alone);
        let (n, lower, filled) = (*n, width.lower, width.lower + width.upper);
        let height = filled + lower + 1;

        // Element (i, j) is at place filled + i − j of column j.
        factors.fill(0.0);
        jacobian.for_each(values, |row, column, value| {
            let (row, column) = (order.place(row), order.place(column));
            factors[column * height + filled + row - column] = -value;
        });
        for unknown in 0..n {
            if differential(unknown) {
                factors[order.place(unknown) * height + filled] += c;
            }
        }
        for (place, row) in rows.iter_mut().enumerate() {
            *row = place as u32;
        }

        for k in 0..n {
            let (below, reach) = (steps.bottom(k) - k, steps.reach(k) - k);
            let (left, right) = factors.split_at_mut((k + 1) * height);
            let column = &mut left[k * height + filled..][..=below];

            let mut exchange = 0;
            let weight = |place: usize| weights[order.unknown(rows[place] as usize)];
            let mut largest = column[0].abs() * weight(k);
            let mut is_finite = column[0].is_finite();
            for (i, value) in column.iter().enumerate().skip(1) {
                is_finite &= value.is_finite();
                let magnitude = value.abs() * weight(k + i);
                if magnitude > largest {
                    largest = magnitude;
                    exchange = i;
                }
            }
            rows.swap(k, k + exchange);
            if !column[exchange].recip().is_finite() || !is_finite {
                return Err(Singular { row: order.unknown(rows[k] as usize) });
            }
            exchanges[k] = exchange as u32;

            column.swap(0, exchange);
            let (pivot, multiples) = column.split_at_mut(1);
            let reciprocal = 1.0 / pivot[0];
            reciprocal_pivots[k] = reciprocal;
            for multiple in &mut *multiples {
                *multiple *= reciprocal;
            }
            for (distance, column) in (1..=reach).zip(right.chunks_exact_mut(height)) {
                let column = &mut column[filled - distance..];
                column.swap(0, exchange);
                let (u, rest) = column.split_at_mut(1);
                for (value, multiple) in rest.iter_mut().zip(&*multiples) {
                    *value -= multiple * u[0];
                }
            }
        }
        Ok(())
    }

    fn solve(&mut self, b: &mut [f64]) {
        let Self { n, order, width, steps, factors, .. } = self;
        let Self { reciprocal_pivots, exchanges, permuted, .. } = self;
        let band = BandFactors {
            filled: width.lower + width.upper,
            lower: width.lower,
            steps,
            factors,
            reciprocal_pivots,
            exchanges,
        };
        for b in b.chunks_exact_mut((*n).max(1)) {
            match order {
                UnknownOrder::Natural => band.solve(b),
                UnknownOrder::Permuted { unknowns, .. } => {
                    for (x, unknown) in permuted.iter_mut().zip(&*unknowns) {
                        *x = b[*unknown as usize];
                    }
                    band.solve(permuted);
                    for (x, unknown) in permuted.iter().zip(&*unknowns) {
                        b[*unknown as usize] = *x;
                    }
                }
            }
        }
    }

    fn smallest_pivot(&self) -> Option<Pivot> {
        let height = 2 * self.width.lower + self.width.upper + 1;
        let filled = self.width.lower + self.width.upper;
        let magnitudes = self.factors.chunks_exact(height).map(|column| column[filled].abs());
        let (k, magnitude) = magnitudes.enumerate().min_by(|a, b| a.1.total_cmp(&b.1))?;
        Some(Pivot { row: self.order.unknown(self.rows[k] as usize), magnitude })
    }
}

/// The factors.
struct BandFactors<'a> {
    filled: usize,
    lower: usize,
    steps: &'a Staircase,
    factors: &'a [f64],
    reciprocal_pivots: &'a [f64],
    exchanges: &'a [u32],
}

impl BandFactors<'_> {
    /// Overwrites x, by places, with the solution.
    fn solve(&self, x: &mut [f64]) {
        let Self { filled, lower, steps, factors, reciprocal_pivots, exchanges } = self;
        let height = filled + lower + 1;
        // x ← L⁻¹ P x
        for ((k, column), exchange) in factors.chunks_exact(height).enumerate().zip(*exchanges) {
            x.swap(k, k + *exchange as usize);
            let (x_k, below) = (x[k], &mut x[k + 1..=steps.bottom(k)]);
            for (value, multiple) in below.iter_mut().zip(&column[filled + 1..]) {
                *value -= multiple * x_k;
            }
        }
        // x ← U⁻¹ x
        let columns = factors.chunks_exact(height).enumerate().zip(*reciprocal_pivots);
        for ((k, column), reciprocal) in columns.rev() {
            let above = k - steps.top(k);
            let (before, rest) = x.split_at_mut(k);
            rest[0] *= reciprocal;
            for (value, u) in before[k - above..].iter_mut().zip(&column[filled - above..*filled]) {
                *value -= u * rest[0];
            }
        }
    }
}
