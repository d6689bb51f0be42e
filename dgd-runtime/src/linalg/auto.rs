//! The factorisation that suits a pattern: dense, tridiagonal, banded or sparse.

#[cfg(feature = "sparse")]
use super::SparseLu;
use super::order::narrowest;
use super::staircase::Staircase;
use super::{BandedLu, DenseLu, Factorisation, Pivot, Singular, TridiagonalLu};
use crate::system::Pattern;

/// Up to here a full elimination is faster than any other, however empty the matrix.
const DENSE_UP_TO: usize = 32;
/// How often one factorisation is solved with, for the comparison of costs.
const SOLUTIONS: f64 = 8.0;

/// The factorisation that suits size and pattern best, by the time that it would take.
#[derive(Debug, Clone)]
pub enum AutoLu {
    /// A small or a full matrix.
    Dense(DenseLu),
    /// A matrix with neighbours only, in some order.
    Tridiagonal(TridiagonalLu),
    /// A matrix with a narrow band, or with small blocks beside its diagonal ones, in some order.
    Banded(BandedLu),
    /// A large matrix with few non-zeros all over.
    #[cfg(feature = "sparse")]
    Sparse(Box<SparseLu>),
}

impl AutoLu {
    /// Whether it takes the matrix of `n` unknowns for a band.
    pub(crate) fn is_for_band(n: usize, jacobian: &Pattern) -> bool {
        let (order, width) = narrowest(n, jacobian);
        width.lower.max(width.upper) <= 1
            || cheapest(n, jacobian.len(), &Staircase::new(n, jacobian, &order)) == Kind::Banded
    }
}

impl Factorisation for AutoLu {
    fn new(n: usize, jacobian: &Pattern) -> Self {
        if n <= DENSE_UP_TO {
            return Self::Dense(DenseLu::new(n, jacobian));
        }
        let (order, width) = narrowest(n, jacobian);
        if width.lower.max(width.upper) <= 1 {
            return Self::Tridiagonal(TridiagonalLu::new(n, order));
        }
        let steps = Staircase::new(n, jacobian, &order);
        match cheapest(n, jacobian.len(), &steps) {
            Kind::Banded => Self::Banded(BandedLu::with_order(n, order, width, steps)),
            Kind::Dense => Self::Dense(DenseLu::new(n, jacobian)),
            #[cfg(feature = "sparse")]
            Kind::Sparse => {
                drop((order, steps));
                Self::Sparse(Box::new(SparseLu::new(n, jacobian)))
            }
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
            Self::Tridiagonal(lu) => lu.factorise(c, differential, jacobian, values),
            Self::Banded(lu) => lu.factorise(c, differential, jacobian, values),
            #[cfg(feature = "sparse")]
            Self::Sparse(lu) => lu.factorise(c, differential, jacobian, values),
        }
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
enum Kind {
    Dense,
    Banded,
    #[cfg(feature = "sparse")]
    Sparse,
}

/// Which of them takes the least time for a factorisation and [`SOLUTIONS`] solutions, in units of one
/// multiplication in a loop over consecutive numbers.
///
/// ```text
///   dense     n³/3 + s n²
///   banded    Σ below (right + 1) + s Σ (below + right)    of each pivot, to the steps of the band
///   sparse    20 z̄ n log₂ n (z̄ + s)                        z̄ non-zeros a row; fill-in as on a grid
/// ```
///
/// Twenty is what an indexed access costs. A band has to save a fifth, as its columns are longer than
/// those of a full matrix and its right-hand sides are put in order.
#[cfg_attr(not(feature = "sparse"), allow(unused_variables))]
fn cheapest(n: usize, non_zeros: usize, steps: &Staircase) -> Kind {
    let (elimination, solution) = steps.work();
    let n = n as f64;
    let dense = n * n * (n / 3.0 + SOLUTIONS);
    let banded = 1.25 * (elimination + SOLUTIONS * solution);
    #[cfg(feature = "sparse")]
    {
        let per_row = 1.0 + non_zeros as f64 / n;
        let sparse = 20.0 * n * per_row * n.log2() * (per_row + SOLUTIONS);
        if sparse < dense.min(banded) {
            return Kind::Sparse;
        }
    }
    if banded <= dense { Kind::Banded } else { Kind::Dense }
}
