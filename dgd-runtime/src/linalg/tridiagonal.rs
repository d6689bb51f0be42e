//! LU factorisation of a tridiagonal matrix, from both ends towards the middle.
//!
//! ```text
//!   ⎡ × ×           ⎤   Rows are eliminated downwards from the first and upwards from the last; the
//!   ⎢ × × ×         ⎥   two that are left in the middle hold a full 2 × 2 matrix. Each way pivots
//!   ⎢   × × ×       ⎥   between the row that it comes with and the next, so that a row of U has up
//!   ⎢     × × ×     ⎥   to three elements. As the ways do not wait for each other, they take half
//!   ⎢       × × ×   ⎥   the time of one, which is one long chain of dependent operations.
//!   ⎣         × ×   ⎦
//! ```
//!
//! Source: the pivoting is that of LAPACK's `dgttrf`; elimination from both ends is Babuška, SIAM
//! Journal on Numerical Analysis 9 (1972) 53–77.

use std::cmp::Ordering;

use super::order::UnknownOrder;
use super::weights::{alone, weigh};
use super::{Pivot, Singular};
use crate::system::Pattern;

/// The result of eliminating one unknown: the reciprocal pivot r and the other two elements of the row of U times r.
/// Before elimination: the elements left of, on and right of the diagonal.
type EliminatedRow = [f64; 3];

/// LU factorisation of a matrix that is tridiagonal in a certain order of the unknowns.
#[derive(Debug, Clone)]
pub struct TridiagonalLu {
    order: UnknownOrder,
    /// Rows by place.
    rows: Vec<EliminatedRow>,
    /// The multiple of each pivot row that was subtracted from the other. Stored separately: only half of each solution
    /// reads them, and for many unknowns memory access dominates.
    multiples: Vec<f64>,
    /// Whether the row ahead was the pivot row.
    exchanged: Vec<bool>,
    /// The weight of each row of W.
    weights: Vec<f64>,
    /// Rows of equations that read no unknown.
    alone: Vec<usize>,
    smallest: Option<Pivot>,
}

/// The row carried along by the elimination: the element to eliminate, and the next.
#[derive(Debug, Clone, Copy)]
struct ActiveRow {
    place: usize,
    weight: f64,
    here: f64,
    next: f64,
}

/// The row ahead: the element below the one to eliminate, its diagonal element and the next.
#[derive(Debug, Clone, Copy)]
struct NextRow {
    place: usize,
    weight: f64,
    under: f64,
    diagonal: f64,
    next: f64,
}

/// Summary of the pivots so far.
#[derive(Debug, Clone, Copy)]
struct Pivots {
    smallest: f64,
    place: usize,
    /// Place of the first that is not finite.
    not_finite: Option<usize>,
}

impl Pivots {
    #[inline]
    fn note(&mut self, place: usize, magnitude: f64) {
        if magnitude < self.smallest {
            (self.smallest, self.place) = (magnitude, place);
        } else if !magnitude.is_finite() && self.not_finite.is_none() {
            self.not_finite = Some(place);
        }
    }
}

/// Eliminates one unknown. Returns the result, whether the row ahead was the pivot row, and the row to continue with.
#[inline]
fn eliminate(
    active: ActiveRow,
    ahead: NextRow,
    pivots: &mut Pivots,
) -> (EliminatedRow, f64, bool, ActiveRow) {
    if ahead.under.abs() * ahead.weight > active.here.abs() * active.weight {
        pivots.note(ahead.place, ahead.under.abs());
        let reciprocal = 1.0 / ahead.under;
        let multiple = active.here * reciprocal;
        let (next, after) = (ahead.diagonal * reciprocal, ahead.next * reciprocal);
        let here = active.next - multiple * ahead.diagonal;
        let active = ActiveRow { here, next: -multiple * ahead.next, ..active };
        ([reciprocal, next, after], multiple, true, active)
    } else {
        pivots.note(active.place, active.here.abs());
        let reciprocal = 1.0 / active.here;
        let multiple = ahead.under * reciprocal;
        let next = active.next * reciprocal;
        let here = ahead.diagonal - multiple * active.next;
        let active = ActiveRow { place: ahead.place, weight: ahead.weight, here, next: ahead.next };
        ([reciprocal, next, 0.0], multiple, false, active)
    }
}

impl TridiagonalLu {
    /// Work space for at least two unknowns, whose `order` makes the matrix tridiagonal.
    pub(super) fn new(n: usize, jacobian: &Pattern, order: UnknownOrder) -> Self {
        assert!(n >= 2, "at least two unknowns");
        Self {
            order,
            rows: vec![[0.0; 3]; n],
            multiples: vec![0.0; n],
            exchanged: vec![false; n],
            weights: vec![0.0; n],
            alone: alone(n, jacobian),
            smallest: None,
        }
    }

    /// Place of the last unknown that is eliminated downwards.
    fn middle(&self) -> usize {
        self.rows.len().div_ceil(2) - 1
    }

    /// Writes c M − J in place of the factors.
    fn assemble(
        &mut self,
        c: f64,
        differential: impl Fn(usize) -> bool,
        jacobian: &Pattern,
        values: &[f64],
    ) {
        let Self { order, rows, .. } = self;
        rows.fill([0.0; 3]);
        jacobian.for_each(values, |row, column, value| {
            let (row, column) = (order.place(row), order.place(column));
            let [left, diagonal, right] = &mut rows[row];
            match column.cmp(&row) {
                Ordering::Less => *left = -value,
                Ordering::Equal => *diagonal = -value,
                Ordering::Greater => *right = -value,
            }
        });
        for unknown in 0..rows.len() {
            if differential(unknown) {
                rows[order.place(unknown)][1] += c;
            }
        }
    }

    /// Number of unknowns.
    pub(super) fn len(&self) -> usize {
        self.rows.len()
    }

    /// Factorises c M − J.
    pub(super) fn factorise(
        &mut self,
        c: f64,
        differential: impl Fn(usize) -> bool,
        jacobian: &Pattern,
        values: &[f64],
        sizes: Option<&[f64]>,
    ) -> Result<(), Singular> {
        let (weights, alone) = (&mut self.weights, &self.alone);
        weigh(weights, c, &differential, jacobian, values, sizes, alone);
        self.assemble(c, differential, jacobian, values);
        let middle = self.middle();
        let Self { order, rows, multiples, exchanged, weights, .. } = self;
        let n = rows.len();
        let weight = |place: usize| weights[order.unknown(place)];
        let mut pivots = Pivots { smallest: f64::INFINITY, place: 0, not_finite: None };

        let active =
            |place: usize, here, next| ActiveRow { place, weight: weight(place), here, next };
        let mut down = active(0, rows[0][1], rows[0][2]);
        let mut up = active(n - 1, rows[n - 1][1], rows[n - 1][0]);
        for step in 0..=middle {
            // Upwards first: it has at least one step less, and the last row that the downward sweep meets is its
            // result.
            let place = n - 1 - step;
            if place > middle + 1 {
                let [left, diagonal, right] = rows[place - 1];
                let weight = weight(place - 1);
                let ahead =
                    NextRow { place: place - 1, weight, under: right, diagonal, next: left };
                (rows[place], multiples[place], exchanged[place], up) =
                    eliminate(up, ahead, &mut pivots);
            }
            let ahead = if step < middle {
                let [left, diagonal, right] = rows[step + 1];
                let weight = weight(step + 1);
                NextRow { place: step + 1, weight, under: left, diagonal, next: right }
            } else {
                let ActiveRow { place, weight, here, next } = up;
                NextRow { place, weight, under: next, diagonal: here, next: 0.0 }
            };
            (rows[step], multiples[step], exchanged[step], down) =
                eliminate(down, ahead, &mut pivots);
        }
        pivots.note(down.place, down.here.abs());
        rows[middle + 1] = [1.0 / down.here, 0.0, 0.0];

        let Pivots { smallest, place, not_finite } = pivots;
        let pivot = Pivot { row: order.unknown(place), magnitude: smallest };
        self.smallest = Some(pivot);
        if !smallest.recip().is_finite() {
            return Err(Singular { row: pivot.row });
        }
        match not_finite {
            None => Ok(()),
            Some(place) => Err(Singular { row: self.order.unknown(place) }),
        }
    }

    /// Overwrites b with W⁻¹ b.
    pub(super) fn solve(&self, b: &mut [f64]) {
        match &self.order {
            UnknownOrder::Natural => self.solve_in_order(b, |place| place),
            UnknownOrder::Permuted { unknowns, .. } => {
                let unknowns = &unknowns[..self.rows.len()];
                self.solve_in_order(b, |place| unknowns[place] as usize);
            }
        }
    }

    #[inline]
    fn solve_in_order(&self, b: &mut [f64], unknown: impl Fn(usize) -> usize) {
        let (n, middle) = (self.rows.len(), self.middle());
        let b = &mut b[..n];
        let (rows, multiples) = (&self.rows[..n], &self.multiples[..n]);
        let exchanged = &self.exchanged[..n];
        // y ← L⁻¹ P b, each way with its carried row.
        let (mut down, mut up) = (b[unknown(0)], b[unknown(n - 1)]);
        for step in 0..=middle {
            let place = n - 1 - step;
            if place > middle + 1 {
                let ahead = b[unknown(place - 1)];
                let (pivot, other) = if exchanged[place] { (ahead, up) } else { (up, ahead) };
                b[unknown(place)] = pivot;
                up = other - multiples[place] * pivot;
            }
            let ahead = if step < middle { b[unknown(step + 1)] } else { up };
            let (pivot, other) = if exchanged[step] { (ahead, down) } else { (down, ahead) };
            b[unknown(step)] = pivot;
            down = other - multiples[step] * pivot;
        }
        // x ← U⁻¹ y, from the middle to both ends.
        let last = down * rows[middle + 1][0];
        b[unknown(middle + 1)] = last;
        let (mut down, mut down_after) = (last, 0.0);
        let (mut up, mut up_after) = (last, 0.0);
        for step in (0..=middle).rev() {
            let [reciprocal, next, after] = rows[step];
            let x = b[unknown(step)] * reciprocal - after * down_after - next * down;
            b[unknown(step)] = x;
            (down, down_after) = (x, down);
            if step == middle {
                up_after = x;
            }
            let place = n - 1 - step;
            if place > middle + 1 {
                let [reciprocal, next, after] = rows[place];
                let x = b[unknown(place)] * reciprocal - after * up_after - next * up;
                b[unknown(place)] = x;
                (up, up_after) = (x, up);
            }
        }
    }

    /// The smallest pivot of the last factorisation.
    pub(super) fn smallest_pivot(&self) -> Option<Pivot> {
        self.smallest
    }
}
