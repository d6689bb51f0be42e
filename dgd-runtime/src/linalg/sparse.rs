//! Sparse LU factorisation with faer.

use std::fmt;

use faer::dyn_stack::{MemBuffer, MemStack, StackReq};
use faer::perm::PermRef;
use faer::sparse::linalg::SupernodalThreshold;
use faer::sparse::linalg::lu::simplicial::{
    SimplicialLu, factorize_simplicial_numeric_lu, factorize_simplicial_numeric_lu_scratch,
};
use faer::sparse::linalg::lu::{LuSymbolicParams, factorize_symbolic_lu};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};

use super::weights::{alone, weigh};
use super::{Factorisation, Pivot, Singular};
use crate::system::Pattern;

/// LU factorisation of a large matrix with few non-zeros.
///
/// The fill-reducing order of the columns is computed once, the order of the rows by partial pivoting in each
/// factorisation. The factors grow with fill-in; otherwise nothing is allocated after `new`.
///
/// Rows are multiplied by their weights, powers of two, as faer compares the elements themselves.
///
/// Works column by column rather than by blocks of columns: models are sparse enough for that, and the pivots, which
/// reveal a singular matrix, are accessible.
pub struct SparseLu {
    n: usize,
    /// W in compressed column storage.
    starts: Vec<usize>,
    rows: Vec<usize>,
    values: Vec<f64>,
    weights: Vec<f64>,
    /// Rows of equations that read no unknown.
    alone: Vec<usize>,
    /// Positions in `values` of each non-zero of J, and of each diagonal element.
    jacobian_slots: Vec<usize>,
    diagonal_slots: Vec<usize>,
    column_order: Permutation,
    row_order: Permutation,
    factors: SimplicialLu<usize, f64>,
    scratch: MemBuffer,
    permuted: Vec<f64>,
}

/// A permutation and its inverse.
#[derive(Debug, Clone)]
struct Permutation {
    forward: Vec<usize>,
    inverse: Vec<usize>,
}

impl SparseLu {
    fn scratch(n: usize) -> MemBuffer {
        let needed: StackReq = factorize_simplicial_numeric_lu_scratch::<usize, f64>(n, n);
        MemBuffer::new(needed)
    }

    /// U's diagonal: the last entry of each column.
    fn pivots(&self) -> impl Iterator<Item = f64> + '_ {
        let u = self.factors.u_factor_unsorted();
        u.col_ptr()[1..].iter().map(move |&end| u.val()[end - 1])
    }
}

impl fmt::Debug for SparseLu {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let non_zeros = self.values.len();
        f.debug_struct("SparseLu")
            .field("n", &self.n)
            .field("non_zeros", &non_zeros)
            .finish_non_exhaustive()
    }
}

impl Clone for SparseLu {
    fn clone(&self) -> Self {
        Self {
            n: self.n,
            starts: self.starts.clone(),
            rows: self.rows.clone(),
            values: self.values.clone(),
            weights: self.weights.clone(),
            alone: self.alone.clone(),
            jacobian_slots: self.jacobian_slots.clone(),
            diagonal_slots: self.diagonal_slots.clone(),
            column_order: self.column_order.clone(),
            row_order: self.row_order.clone(),
            factors: self.factors.clone(),
            scratch: Self::scratch(self.n),
            permuted: self.permuted.clone(),
        }
    }
}

impl Factorisation for SparseLu {
    fn new(n: usize, jacobian: &Pattern) -> Self {
        // The pattern of W is that of J and the diagonal.
        let mut positions: Vec<(usize, usize)> = jacobian
            .positions()
            .map(|(row, column)| (column, row))
            .chain((0..n).map(|i| (i, i)))
            .collect();
        positions.sort_unstable();
        positions.dedup();
        let slot = |column: usize, row: usize| {
            positions.binary_search(&(column, row)).expect("every position was listed above")
        };
        let jacobian_slots = jacobian.positions().map(|(row, column)| slot(column, row)).collect();
        let diagonal_slots = (0..n).map(|i| slot(i, i)).collect();
        let starts: Vec<usize> =
            (0..=n).map(|column| positions.partition_point(|&(c, _)| c < column)).collect();
        let rows: Vec<usize> = positions.iter().map(|&(_, row)| row).collect();

        let symbolic = factorize_symbolic_lu(
            SymbolicSparseColMatRef::new_checked(n, n, &starts, None, &rows),
            LuSymbolicParams {
                supernodal_flop_ratio_threshold: SupernodalThreshold::FORCE_SIMPLICIAL,
                ..LuSymbolicParams::default()
            },
        )
        .expect("the index type is as wide as memory");
        let (forward, inverse) = symbolic.col_perm().arrays();

        Self {
            n,
            values: vec![0.0; rows.len()],
            weights: vec![1.0; n],
            alone: alone(n, jacobian),
            starts,
            rows,
            jacobian_slots,
            diagonal_slots,
            column_order: Permutation { forward: forward.to_vec(), inverse: inverse.to_vec() },
            row_order: Permutation { forward: vec![0; n], inverse: vec![0; n] },
            factors: SimplicialLu::new(),
            scratch: Self::scratch(n),
            permuted: vec![0.0; n],
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
        let (weights, alone) = (&mut self.weights, &self.alone);
        weigh(weights, c, &differential, jacobian, values, sizes, alone);
        self.values.fill(0.0);
        for (&slot, value) in self.jacobian_slots.iter().zip(values) {
            self.values[slot] = -value;
        }
        for (i, &slot) in self.diagonal_slots.iter().enumerate() {
            if differential(i) {
                self.values[slot] += c;
            }
        }
        for (value, &row) in self.values.iter_mut().zip(&self.rows) {
            *value *= self.weights[row];
        }

        let n = self.n;
        let pattern = SymbolicSparseColMatRef::new_checked(n, n, &self.starts, None, &self.rows);
        factorize_simplicial_numeric_lu(
            &mut self.row_order.forward,
            &mut self.row_order.inverse,
            &mut self.factors,
            SparseColMatRef::new(pattern, &self.values),
            PermRef::new_checked(&self.column_order.forward, &self.column_order.inverse, n),
            MemStack::new(&mut self.scratch),
        )
        .map_err(|_| Singular { row: first_unused(&self.row_order.inverse, n) })?;

        // faer divides by a zero pivot without an error, so pivots are checked afterwards.
        match self.pivots().position(|pivot| pivot == 0.0 || !pivot.is_finite()) {
            None => Ok(()),
            Some(k) => Err(Singular { row: self.row_order.forward[k] }),
        }
    }

    fn solve(&mut self, b: &mut [f64]) {
        if self.n == 0 {
            return;
        }
        let (l, u) = (self.factors.l_factor_unsorted(), self.factors.u_factor_unsorted());
        let x = &mut self.permuted;
        for b in b.chunks_exact_mut(self.n) {
            for (x, &row) in x.iter_mut().zip(&self.row_order.forward) {
                *x = b[row] * self.weights[row];
            }
            // Columns of L begin with the unit diagonal, those of U end with the pivot.
            for (k, ends) in l.col_ptr().windows(2).enumerate() {
                let x_k = x[k];
                let below = ends[0] + 1..ends[1];
                for (&row, value) in l.row_idx()[below.clone()].iter().zip(&l.val()[below]) {
                    x[row] -= value * x_k;
                }
            }
            for (k, ends) in u.col_ptr().windows(2).enumerate().rev() {
                let pivot = ends[1] - 1;
                let x_k = x[k] / u.val()[pivot];
                x[k] = x_k;
                let above = ends[0]..pivot;
                for (&row, value) in u.row_idx()[above.clone()].iter().zip(&u.val()[above]) {
                    x[row] -= value * x_k;
                }
            }
            for (x, &column) in x.iter().zip(&self.column_order.forward) {
                b[column] = *x;
            }
        }
    }

    fn smallest_pivot(&self) -> Option<Pivot> {
        let (k, pivot) =
            self.pivots().map(f64::abs).enumerate().min_by(|a, b| a.1.total_cmp(&b.1))?;
        let row = self.row_order.forward[k];
        Some(Pivot { row, magnitude: pivot / self.weights[row] })
    }
}

/// The first row that has not been a pivot row yet.
fn first_unused(row_order_inverse: &[usize], n: usize) -> usize {
    row_order_inverse.iter().position(|&place| place == n).unwrap_or(0)
}
