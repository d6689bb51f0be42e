//! Factorisations of the iteration matrix, chosen by size and pattern.

use crate::system::Pattern;

/// A matrix could not be factorised.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Singular;

/// LU factorisation of W = c M − J, with M = diag(1 or 0) and J by its non-zeros.
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

    /// Overwrites b with W⁻¹ b.
    fn solve(&self, b: &mut [f64]);
}
