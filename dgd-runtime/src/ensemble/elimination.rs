//! Elimination of small full matrices, one in each lane.
//!
//! The operations of each lane, and so the bits of its results, are those of [`FixedLu`](crate::linalg::FixedLu):
//! partial pivoting by weighted rows and exchanges of whole rows, which are selections here.

#![allow(clippy::inline_always)]

use super::lanes::{LANES, LaneStorage, Lanes};
use crate::linalg::weights::{ALONE, alone, reciprocal, weight};
use crate::system::{Pattern, Storage};

/// P A = L U of W = c M − J in each lane.
#[derive(Debug, Clone)]
pub(super) struct LaneLu<V: Storage> {
    /// Column by column: L below the diagonal, U on and above it.
    factors: V::LaneSquare,
    reciprocal_pivots: V::Lanes,
    /// The row that was exchanged with row k, stored as a number.
    pivot_rows: V::Lanes,
    weights: V::Lanes,
    /// Rows of equations that read no unknown.
    alone: Vec<usize>,
    /// Whether there was an exchange in any lane.
    exchanged: bool,
}

impl<V: Storage> LaneLu<V> {
    pub(super) fn new(n: usize, jacobian: &Pattern) -> Self {
        Self {
            factors: V::LaneSquare::zeros(n * n),
            reciprocal_pivots: V::Lanes::zeros(n),
            pivot_rows: V::Lanes::zeros(n),
            weights: V::Lanes::zeros(n),
            alone: alone(n, jacobian),
            exchanged: false,
        }
    }

    /// Factorises c M − J, with unknowns of these sizes. A singular matrix gives solutions that are not finite.
    #[inline(always)]
    pub(super) fn factorise(
        &mut self,
        c: Lanes,
        mass: &[f64],
        jacobian: &Pattern,
        values: &[Lanes],
        sizes: &[Lanes],
    ) {
        let n = mass.len();
        let weights = &mut self.weights.lanes_mut()[..n];
        weigh(weights, c, mass, jacobian, values, sizes);
        for row in &self.alone {
            weights[*row] = weights[*row] * Lanes::splat(ALONE);
        }
        let a = &mut self.factors.lanes_mut()[..n * n];
        a.fill(Lanes::ZERO);
        for ((&row, &column), value) in
            jacobian.rows.iter().zip(jacobian.columns.iter()).zip(values)
        {
            a[column * n + row] = -*value;
        }
        for (i, mass) in mass.iter().enumerate() {
            if *mass != 0.0 {
                a[i * n + i] = a[i * n + i] + c;
            }
        }
        self.exchanged = false;
        for k in 0..n {
            self.exchanged |= choose_pivot(a, n, k, weights, &mut self.pivot_rows.lanes_mut()[k]);
            let (left, right) = a.split_at_mut((k + 1) * n);
            let pivot_column = &mut left[k * n..];
            let reciprocal = pivot_column[k].map(|pivot| 1.0 / pivot);
            self.reciprocal_pivots.lanes_mut()[k] = reciprocal;
            for entry in &mut pivot_column[k + 1..] {
                *entry = *entry * reciprocal;
            }
            for column in right.chunks_exact_mut(n) {
                let u = column[k];
                for (value, factor) in column[k + 1..].iter_mut().zip(&pivot_column[k + 1..]) {
                    *value = *value - *factor * u;
                }
            }
        }
    }

    /// Overwrites b with W⁻¹ b.
    #[inline(always)]
    pub(super) fn solve(&self, n: usize, b: &mut [Lanes]) {
        let factors = &self.factors.lanes()[..n * n];
        let (reciprocals, pivot_rows) =
            (&self.reciprocal_pivots.lanes()[..n], &self.pivot_rows.lanes()[..n]);
        let b = &mut b[..n];
        if self.exchanged {
            for (k, row) in pivot_rows.iter().enumerate() {
                exchange(b, k, *row);
            }
        }
        for k in 0..n {
            let x = b[k];
            for (value, l) in b[k + 1..].iter_mut().zip(&factors[k * n + k + 1..(k + 1) * n]) {
                *value = *value - *l * x;
            }
        }
        for k in (0..n).rev() {
            let x = b[k] * reciprocals[k];
            b[k] = x;
            for (value, u) in b[..k].iter_mut().zip(&factors[k * n..k * n + k]) {
                *value = *value - *u * x;
            }
        }
    }
}

/// Writes the weight of each row of c M − J, as [`linalg::weights`](crate::linalg::weights) has them.
#[inline(always)]
fn weigh(
    weights: &mut [Lanes],
    c: Lanes,
    mass: &[f64],
    jacobian: &Pattern,
    values: &[Lanes],
    sizes: &[Lanes],
) {
    if mass.iter().all(|mass| *mass != 0.0) {
        for (weight, size) in weights.iter_mut().zip(sizes) {
            *weight = size.map(reciprocal);
        }
        return;
    }
    for ((weight, size), mass) in weights.iter_mut().zip(sizes).zip(mass) {
        *weight = if *mass == 0.0 { Lanes::ZERO } else { (c * *size).map(f64::abs) };
    }
    for ((&row, &column), value) in jacobian.rows.iter().zip(jacobian.columns.iter()).zip(values) {
        let share = (*value * sizes[column]).map(f64::abs);
        weights[row] = share.combine(weights[row], |new, old| if new > old { new } else { old });
    }
    for (own, mass) in weights.iter_mut().zip(mass) {
        *own = own.map(|largest| weight(largest, *mass != 0.0));
    }
}

/// Brings the largest entry of column k with weighted rows, from row k on, into row k. Returns whether any lane
/// exchanges.
#[inline(always)]
fn choose_pivot(
    a: &mut [Lanes],
    n: usize,
    k: usize,
    weights: &mut [Lanes],
    pivot_row: &mut Lanes,
) -> bool {
    let mut largest = a[k * n + k].map(f64::abs) * weights[k];
    let mut chosen = Lanes::splat(k as f64);
    for i in k + 1..n {
        let magnitude = a[k * n + i].map(f64::abs) * weights[i];
        let row = i as f64;
        for l in 0..LANES {
            let is_larger = magnitude.0[l] > largest.0[l];
            chosen.0[l] = if is_larger { row } else { chosen.0[l] };
        }
        largest = magnitude.combine(largest, |new, old| if new > old { new } else { old });
    }
    *pivot_row = chosen;
    if chosen.0 == [k as f64; LANES] {
        return false;
    }
    exchange(weights, k, chosen);
    for column in a.chunks_exact_mut(n) {
        exchange(column, k, chosen);
    }
    true
}

/// Exchanges row k with another one, lane by lane.
#[inline(always)]
fn exchange(column: &mut [Lanes], k: usize, with: Lanes) {
    for i in k + 1..column.len() {
        let row = i as f64;
        let (upper, lower) = (column[k], column[i]);
        let choose =
            |yes: Lanes, no: Lanes| no.choose(yes, with.lanes_where(with, |with, _| with == row));
        (column[k], column[i]) = (choose(lower, upper), choose(upper, lower));
    }
}
