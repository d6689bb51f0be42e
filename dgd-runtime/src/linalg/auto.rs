//! Chooses the factorisation for a pattern: dense, tridiagonal, banded or sparse.

#[cfg(feature = "sparse")]
use super::SparseLu;
use super::order::narrowest;
use super::staircase::Staircase;
use super::{BandedLu, DenseLu, Factorisation, KeptSum, Pivot, Singular, TridiagonalLu};
use crate::system::Pattern;

/// Size up to which dense elimination is faster than any other, however sparse the matrix.
const DENSE_UP_TO: usize = 32;
/// Number of solutions per factorisation assumed in the comparison of costs.
const SOLUTIONS: f64 = 8.0;

/// The factorisation that is fastest for a size and pattern.
#[derive(Debug, Clone)]
pub enum AutoLu {
    /// For a small or full matrix.
    Dense(DenseLu),
    /// For a matrix that is tridiagonal in some order.
    Tridiagonal(TridiagonalLu),
    /// For a matrix that is narrowly banded, or block-tridiagonal with small blocks, in some order.
    Banded(BandedLu),
    /// For a large matrix with few, scattered non-zeros.
    #[cfg(feature = "sparse")]
    Sparse(Box<SparseLu>),
}

impl AutoLu {
    /// Whether it treats the matrix of `n` unknowns as banded.
    pub(crate) fn is_for_band(n: usize, jacobian: &Pattern) -> bool {
        let (order, width) = narrowest(n, jacobian);
        width.lower.max(width.upper) <= 1
            || cheapest(n, jacobian.len(), &Staircase::new(n, jacobian, &order))
                == FactorisationKind::Banded
    }
}

impl Factorisation for AutoLu {
    #[cfg(not(feature = "sparse"))]
    fn is_built(n: usize, jacobian: &Pattern) -> bool {
        n <= DENSE_UP_TO || {
            let (order, width) = narrowest(n, jacobian);
            width.lower.max(width.upper) <= 1
                || cheapest(n, jacobian.len(), &Staircase::new(n, jacobian, &order))
                    != FactorisationKind::Sparse
        }
    }

    fn new(n: usize, jacobian: &Pattern) -> Self {
        if n <= DENSE_UP_TO {
            return Self::Dense(DenseLu::new(n, jacobian));
        }
        let (order, width) = narrowest(n, jacobian);
        if width.lower.max(width.upper) <= 1 {
            return Self::Tridiagonal(TridiagonalLu::new(n, jacobian, order));
        }
        let steps = Staircase::new(n, jacobian, &order);
        match cheapest(n, jacobian.len(), &steps) {
            FactorisationKind::Banded => {
                Self::Banded(BandedLu::with_order(n, jacobian, order, width, steps))
            }
            FactorisationKind::Dense => Self::Dense(DenseLu::new(n, jacobian)),
            #[cfg(feature = "sparse")]
            FactorisationKind::Sparse => {
                drop((order, steps));
                Self::Sparse(Box::new(SparseLu::new(n, jacobian)))
            }
            // A run of such a model is refused before it begins.
            #[cfg(not(feature = "sparse"))]
            FactorisationKind::Sparse => Self::Dense(DenseLu::new(n, jacobian)),
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
        match self {
            Self::Dense(lu) => lu.factorise(c, differential, jacobian, values, sizes),
            Self::Tridiagonal(lu) => lu.factorise(c, differential, jacobian, values, sizes),
            Self::Banded(lu) => lu.factorise(c, differential, jacobian, values, sizes),
            #[cfg(feature = "sparse")]
            Self::Sparse(lu) => lu.factorise(c, differential, jacobian, values, sizes),
        }
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
        if let Self::Dense(lu) = self {
            return lu.factorise_keeping(c, differential, jacobian, values, sizes, sums);
        }
        self.factorise(c, differential, jacobian, values, Some(sizes))?;
        Ok(false)
    }

    fn solve(&mut self, b: &mut [f64]) {
        match self {
            Self::Dense(lu) => lu.solve(b),
            Self::Tridiagonal(lu) => b.chunks_exact_mut(lu.len()).for_each(|b| lu.solve(b)),
            Self::Banded(lu) => lu.solve(b),
            #[cfg(feature = "sparse")]
            Self::Sparse(lu) => lu.solve(b),
        }
    }

    fn smallest_pivot(&self) -> Option<Pivot> {
        match self {
            Self::Dense(lu) => lu.smallest_pivot(),
            Self::Tridiagonal(lu) => lu.smallest_pivot(),
            Self::Banded(lu) => lu.smallest_pivot(),
            #[cfg(feature = "sparse")]
            Self::Sparse(lu) => lu.smallest_pivot(),
        }
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum FactorisationKind {
    Dense,
    Banded,
    Sparse,
}

/// The cheapest for a factorisation and [`SOLUTIONS`] solutions, in units of one multiplication in a loop over
/// consecutive numbers.
///
/// ```text
///   dense     n³/3 + s n²
///   banded    Σ below (right + 1) + s Σ (below + right)    of each pivot, to the steps of the band
///   sparse    20 z̄ n log₂ n (z̄ + s)                        z̄ non-zeros a row; fill-in as on a grid
/// ```
///
/// Twenty is the cost of an indexed access. A band must save at least a fifth, since its columns are longer than those
/// of a full matrix and its right-hand sides are permuted. A build without the sparse factorisation refuses runs of models
/// for which that is the cheapest.
fn cheapest(n: usize, non_zeros: usize, steps: &Staircase) -> FactorisationKind {
    let (elimination, solution) = steps.work();
    let n = n as f64;
    let dense = n * n * (n / 3.0 + SOLUTIONS);
    let banded = 1.25 * (elimination + SOLUTIONS * solution);
    let per_row = 1.0 + non_zeros as f64 / n;
    let sparse = 20.0 * n * per_row * n.log2() * (per_row + SOLUTIONS);
    if sparse < dense.min(banded) {
        FactorisationKind::Sparse
    } else if banded <= dense {
        FactorisationKind::Banded
    } else {
        FactorisationKind::Dense
    }
}
