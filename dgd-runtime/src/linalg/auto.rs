use super::{DenseLu, Factorisation, Pivot, Singular, SparseLu};
use crate::system::Pattern;

/// Up to here a full elimination is faster than a sparse one, however empty the matrix.
const DENSE_UP_TO: usize = 32;
/// A matrix with more than one non-zero in so many places is treated as full.
const SPARSE_FROM: usize = 5;

/// Dense or sparse, whichever suits the size and the pattern.
#[derive(Debug, Clone)]
pub enum AutoLu {
    /// A small or a full matrix.
    Dense(DenseLu),
    /// A large matrix with few non-zeros.
    Sparse(Box<SparseLu>),
}

impl Factorisation for AutoLu {
    fn new(n: usize, jacobian: &Pattern) -> Self {
        if n <= DENSE_UP_TO || jacobian.len() > n * (n / SPARSE_FROM) {
            Self::Dense(DenseLu::new(n, jacobian))
        } else {
            Self::Sparse(Box::new(SparseLu::new(n, jacobian)))
        }
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
            Self::Sparse(lu) => lu.factorise(c, differential, jacobian, values),
        }
    }

    fn solve(&mut self, b: &mut [f64]) {
        match self {
            Self::Dense(lu) => lu.solve(b),
            Self::Sparse(lu) => lu.solve(b),
        }
    }

    fn smallest_pivot(&self) -> Option<Pivot> {
        match self {
            Self::Dense(lu) => lu.smallest_pivot(),
            Self::Sparse(lu) => lu.smallest_pivot(),
        }
    }
}
