//! Eliminates algebraic unknowns from rows of derivatives.
//!
//! The subscript d means rows or columns of states, a those of the other unknowns, and * all columns but a:
//!
//! ```text
//!   K = −(∂f_a/∂y_a)⁻¹ ∂f_a/∂*          R = rows_* + rows_a K
//!   K' = −(∂f_a/∂y_a)⁻¹ (∂f_a/∂*' + ∂f_a/∂y_a' K)
//!   R' = rows_*' + rows_a' K + rows_a K'
//! ```
//!
//! where ' is the derivative with respect to a parameter.

use nalgebra::allocator::Allocator;
use nalgebra::{DMatrix, DVector, DefaultAllocator, Dim, Dyn, OMatrix};

use super::error::LinearizeError;
use super::singular;
use crate::linalg::full::FullLu;
use crate::problem::unknown_sizes;
use crate::solved::SolvableSystem;
use crate::system::{EvaluationPoint, Storage};

/// Which unknowns are states at a point, and how the others follow from them.
#[derive(Debug, Clone)]
pub struct Elimination {
    /// Positions of the states among the unknowns.
    pub states: Vec<usize>,
    /// Positions of the others.
    pub eliminated: Vec<usize>,
    /// K: columns of the states, then those after the unknowns.
    pub follows: DMatrix<f64>,
    own: Option<FullLu>,
    n: usize,
}

impl Elimination {
    /// The elimination from ∂f/∂(y, …), with rows of all n equations.
    ///
    /// # Errors
    ///
    /// [`LinearizeError::Undetermined`].
    pub fn new<S: SolvableSystem>(
        system: &S,
        at: EvaluationPoint<'_>,
        f: &DMatrix<f64>,
    ) -> Result<Self, LinearizeError> {
        let signature = system.signature();
        let n = signature.unknowns.len();
        let mut mass = S::Vector::zeros(n);
        system.mass(at, mass.as_mut());
        let (states, eliminated): (Vec<usize>, Vec<usize>) =
            (0..n).partition(|i| mass.as_ref()[*i] != 0.0);
        let f_a = f.select_rows(&eliminated);
        let of_others = select(&f_a, &states, n);
        if eliminated.is_empty() {
            return Ok(Self { states, eliminated, follows: of_others, own: None, n });
        }
        let columns = f_a.select_columns(&eliminated);
        let open = singular::open(&columns);
        let mut sizes = vec![0.0; n];
        unknown_sizes(system, at.y, &mut sizes);
        let sizes: Vec<f64> = eliminated.iter().map(|i| sizes[*i]).collect();
        let factors = FullLu::new(columns, &sizes);
        match (open, factors.solve(&of_others)) {
            (None, Some(response)) => {
                Ok(Self { states, eliminated, follows: -response, own: Some(factors), n })
            }
            (open, _) => {
                let (row, column) = open.unwrap_or((0, 0));
                Err(LinearizeError::Undetermined {
                    t: at.t,
                    equation: signature.equations.get(eliminated[row]).to_string(),
                    unknown: signature.unknowns.name(eliminated[column]).to_string(),
                })
            }
        }
    }

    /// −(∂f_a/∂y_a)⁻¹ f_a: Newton's step of the eliminated unknowns, from the residuals of all equations.
    pub fn step(&self, f: &[f64]) -> DVector<f64> {
        let right = DVector::from_fn(self.eliminated.len(), |i, _| -f[self.eliminated[i]]);
        self.solved(right)
    }

    /// R of these rows.
    pub fn reduced(&self, rows: &DMatrix<f64>) -> DMatrix<f64> {
        select(rows, &self.states, self.n) + rows.select_columns(&self.eliminated) * &self.follows
    }

    /// R of the states' rows of f.
    pub fn of_states(&self, f: &DMatrix<f64>) -> DMatrix<f64> {
        self.reduced(&f.select_rows(&self.states))
    }

    /// K', from the derivative of f's rows.
    pub(super) fn slope(&self, f: &DMatrix<f64>) -> DMatrix<f64> {
        self.solved(-self.reduced(&f.select_rows(&self.eliminated)))
    }

    /// (∂f_a/∂y_a)⁻¹ applied to `right`.
    fn solved<C: Dim>(&self, right: OMatrix<f64, Dyn, C>) -> OMatrix<f64, Dyn, C>
    where
        DefaultAllocator: Allocator<Dyn, C>,
    {
        match &self.own {
            // The factorisation succeeded before, so this cannot fail.
            Some(own) => own.solve(&right).unwrap_or(right),
            None => right,
        }
    }

    /// R' of these rows, from their derivative and K'.
    pub(super) fn reduced_slope(
        &self,
        rows: &DMatrix<f64>,
        slopes: &DMatrix<f64>,
        follows: &DMatrix<f64>,
    ) -> DMatrix<f64> {
        self.reduced(slopes) + rows.select_columns(&self.eliminated) * follows
    }
}

/// Columns of `rows` that belong to the states, then those after all n unknowns.
fn select(rows: &DMatrix<f64>, states: &[usize], n: usize) -> DMatrix<f64> {
    let chosen: Vec<usize> = states.iter().copied().chain(n..rows.ncols()).collect();
    rows.select_columns(&chosen)
}
