//! Factorisations of the iteration matrix, chosen by size and pattern.
//!
//! [`FixedLu`] and [`DenseLu`] run the same elimination, on the stack and on the heap, so that a
//! generated model and its interpreted twin give the same bits. [`SparseLu`] serves models of more
//! than a few dozen unknowns; [`AutoLu`] picks between the last two.

mod auto;
mod dense;
pub(crate) mod norm;
mod sparse;

pub use auto::AutoLu;
pub use dense::{DenseLu, FixedLu};
pub use sparse::SparseLu;

use crate::system::Pattern;

/// A matrix could not be factorised.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Singular {
    /// A row that is zero, or depends on others, where the elimination stopped.
    pub row: usize,
}

/// What an elimination divided by.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pivot {
    /// Row of the matrix it came from.
    pub row: usize,
    /// Its absolute value.
    pub magnitude: f64,
}

/// LU factorisation of W = c M − J, with M = diag(1 or 0) and J by its non-zeros.
///
/// Neither rows nor columns are scaled: pivots are those of W as it is given.
pub trait Factorisation: Clone {
    /// Work space for n unknowns and this pattern of J.
    fn new(n: usize, jacobian: &Pattern) -> Self;

    /// Factorises c M − J.
    ///
    /// # Errors
    ///
    /// [`Singular`] where a pivot is zero or not finite; the previous factors are gone then.
    fn factorise(
        &mut self,
        c: f64,
        differential: impl Fn(usize) -> bool,
        jacobian: &Pattern,
        values: &[f64],
    ) -> Result<(), Singular>;

    /// Overwrites B with W⁻¹ B; `b` is one right-hand side of n numbers, or several, one after the
    /// other.
    fn solve(&mut self, b: &mut [f64]);

    /// The smallest pivot of the last factorisation; `None` for an empty matrix.
    fn smallest_pivot(&self) -> Option<Pivot>;
}
