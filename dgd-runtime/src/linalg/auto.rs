#[cfg(feature = "sparse")]
use super::SparseLu;
use super::{DenseLu, Factorisation, Pivot, Singular};
use crate::system::Pattern;

/// Up to here a full elimination is faster than a sparse one, however empty the matrix.
#[cfg(feature = "sparse")]
const DENSE_UP_TO: usize = 32;
/// A matrix with more than one non-zero in so many places is treated as full.
#[cfg(feature = "sparse")]
const SPARSE_FROM: usize = 5;

/// Dense or, with the feature `sparse`, sparse, whichever suits the size and the pattern.
#[derive(Debug, Clone)]
pub enum AutoLu {
    /// A small or a full matrix.
    Dense(DenseLu),
    /// A large matrix with few non-zeros.
    #[cfg(feature = "sparse")]
    Sparse(Box<SparseLu>),
}

impl Factorisation for AutoLu {
    fn new(n: usize, jacobian: &Pattern) -> Self {
        #[cfg(feature = "sparse")]
        if n > DENSE_UP_TO && jacobian.len() <= n * (n / SPARSE_FROM) {
            return Self::Sparse(Box::new(SparseLu::new(n, jacobian)));
        }
        Self::Dense(DenseLu::new(n, jacobian))
    }

    fn factorise(
        &mut self,
        c: f64,
        differential: impl Fn(usize) -> bool,
        jacobian: &Pattern,
        values: &[f64],
    ) -> Result<(), Singular> {
        match self {
            Self::Dense(lu) => lu.factorise(c, differential, jacobian, values),
            #[cfg(feature = "sparse")]
            Self::Sparse(lu) => lu.factorise(c, differential, jacobian, values),
        }
    }

    fn solve(&mut self, b: &mut [f64]) {
        match self {
            Self::Dense(lu) => lu.solve(b),
            #[cfg(feature = "sparse")]
            Self::Sparse(lu) => lu.solve(b),
        }
    }

    fn smallest_pivot(&self) -> Option<Pivot> {
        match self {
            Self::Dense(lu) => lu.smallest_pivot(),
            #[cfg(feature = "sparse")]
            Self::Sparse(lu) => lu.smallest_pivot(),
        }
    }
}
