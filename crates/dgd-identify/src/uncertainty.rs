//! Covariance of the estimates, and undetermined combinations.
//!
//! ```text
//!   covariance of z:  (JᵀJ)⁻¹        residuals weighted by 1/σ; θ: T (JᵀJ)⁻¹ T,  T = diag(∂θ/∂z)
//!   rank:             D⁻½ JᵀJ D⁻½ = V Λ Vᵀ,  D = diag(JᵀJ)
//! ```
//!
//! σ is either known or estimated from the residuals; in both cases it is the weight, and the covariance is not scaled
//! again. Residuals are taken as white: if the model is wrong they are not, and the true uncertainty is larger.
//!
//! Columns of V with λ below a cutoff are combinations of variables that affect no output. A variable at a bound counts
//! as known.

use dgd_runtime::Direction;
use nalgebra::{DMatrix, DVector, SVD, SymmetricEigen};

use crate::keep_by_fields;
use crate::variables::BoundReached;

/// A variable is part of a combination from this share of its squares on.
const TAKES_PART: f64 = 1e-4;

/// Terms of a combination below this fraction of its largest are rounding errors.
const NEGLIGIBLE: f64 = 1e-3;

/// An estimated parameter or start value.
#[derive(Debug, Clone, PartialEq)]
pub struct ParameterEstimate {
    /// A parameter by its name, a start value as `x(0)`.
    pub name: String,
    /// The estimated quantity.
    pub of: Direction,
    /// The recording that a start value belongs to, from 0.
    pub recording: Option<usize>,
    /// Value, SI.
    pub value: f64,
    /// Standard deviation, SI; `None` at a bound, and if the data does not determine the value.
    pub std: Option<f64>,
    /// The bound that was reached.
    pub at_bound: Option<BoundReached>,
}

/// A term of a combination.
#[derive(Debug, Clone, PartialEq)]
pub struct CombinationTerm {
    /// Position among the estimates.
    pub estimate: usize,
    /// Its change, relative to its size; that of the largest is 1.
    pub change: f64,
}

keep_by_fields!(CombinationTerm { estimate, change });

/// Changes of the estimates that together affect no output.
#[derive(Debug, Clone, PartialEq)]
pub struct UndeterminedDirection {
    /// The changing estimates, in order.
    pub terms: Vec<CombinationTerm>,
}

/// Two strongly correlated estimates.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CorrelatedPair {
    /// Position among the estimates.
    pub first: usize,
    /// Position among the estimates.
    pub second: usize,
    /// Correlation of their errors.
    pub correlation: f64,
}

/// Covariance of determined combinations, and undetermined ones.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Uncertainty {
    /// For each variable, its position in `covariance`.
    pub places: Vec<Option<usize>>,
    /// Covariance of the determined variables z.
    pub covariance: DMatrix<f64>,
    /// Covariance of all z, including undetermined ones: the inverse of JᵀJ over the determined combinations.
    pub seen: DMatrix<f64>,
    pub undetermined: Vec<UndeterminedDirection>,
    /// For each z, (H⁻¹)ᵢᵢ over its variance: 1 if errors are weighted according to their scatter.
    pub worth: Vec<f64>,
}

impl Uncertainty {
    /// Replaces H⁻¹ by H⁻¹ G H⁻¹: the covariance of the minimum of a sum with the curvature H and a gradient with the
    /// covariance G.
    pub(super) fn with_influence(mut self, g: &DMatrix<f64>) -> Self {
        let sandwich = &self.seen * g * &self.seen;
        for (i, worth) in self.worth.iter_mut().enumerate() {
            if sandwich[(i, i)] > 0.0 {
                *worth = self.seen[(i, i)] / sandwich[(i, i)];
            }
        }
        for (i, row) in self.places.iter().enumerate() {
            for (j, column) in self.places.iter().enumerate() {
                if let (Some(row), Some(column)) = (row, column) {
                    self.covariance[(*row, *column)] = sandwich[(i, j)];
                }
            }
        }
        self.seen = sandwich;
        self
    }

    /// Drops the standard errors.
    pub(super) fn forget(&mut self, estimates: &mut [ParameterEstimate]) {
        for estimate in estimates {
            estimate.std = None;
        }
        self.places.fill(None);
    }

    /// `held` variables count as known; eigenvalues up to `cutoff` times the largest are zero.
    pub(super) fn new(information: &DMatrix<f64>, held: &[bool], cutoff: f64) -> Self {
        let n = held.len();
        let mut undetermined = Vec::new();
        let mut kept = Vec::new();
        for i in (0..n).filter(|i| !held[*i]) {
            if information[(i, i)] > 0.0 && information[(i, i)].is_finite() {
                kept.push(i);
            } else {
                let terms = vec![CombinationTerm { estimate: i, change: 1.0 }];
                undetermined.push(UndeterminedDirection { terms });
            }
        }
        let size = DVector::from_fn(kept.len(), |i, _| information[(kept[i], kept[i])].sqrt());
        let scaled = DMatrix::from_fn(kept.len(), kept.len(), |i, j| {
            information[(kept[i], kept[j])] / (size[i] * size[j])
        });
        let (vectors, values) = eigen(scaled);
        Self::from_spectrum(n, &kept, &size, &vectors, &values, cutoff, undetermined)
    }

    /// From R of the weighted residuals' Jacobian, JᵀJ = RᵀR, whose singular values keep the digits that its square has
    /// lost. Those up to `cutoff` times the largest are zero.
    pub(super) fn of_triangle(r: &DMatrix<f64>, held: &[bool], cutoff: f64) -> Self {
        let n = held.len();
        let mut undetermined = Vec::new();
        let mut kept = Vec::new();
        for i in (0..n).filter(|i| !held[*i]) {
            if r.column(i).norm() > 0.0 {
                kept.push(i);
            } else {
                let terms = vec![CombinationTerm { estimate: i, change: 1.0 }];
                undetermined.push(UndeterminedDirection { terms });
            }
        }
        let size = DVector::from_fn(kept.len(), |i, _| r.column(kept[i]).norm());
        let mut scaled = r.select_columns(&kept);
        for (j, size) in size.iter().enumerate() {
            scaled.column_mut(j).unscale_mut(*size);
        }
        let (mut vectors, mut values) = (DMatrix::zeros(0, 0), DVector::zeros(0));
        if !kept.is_empty()
            && let SVD { v_t: Some(v_t), singular_values, .. } = scaled.svd(false, true)
        {
            vectors = v_t.transpose();
            values = singular_values.map(|value| value * value);
        }
        Self::from_spectrum(n, &kept, &size, &vectors, &values, cutoff * cutoff, undetermined)
    }

    /// From the eigenvectors and eigenvalues of the scaled information matrix over the `seen` combinations, and the
    /// undetermined ones.
    fn from_spectrum(
        n: usize,
        seen: &[usize],
        size: &DVector<f64>,
        vectors: &DMatrix<f64>,
        values: &DVector<f64>,
        cutoff: f64,
        mut undetermined: Vec<UndeterminedDirection>,
    ) -> Self {
        let largest = values.iter().copied().fold(0.0, f64::max);
        let (seeing, blind): (Vec<usize>, Vec<usize>) =
            (0..values.len()).partition(|k| values[*k] > cutoff * largest);
        // Rows: combinations in units of the variables.
        let mut combinations =
            DMatrix::from_fn(blind.len(), seen.len(), |k, i| vectors[(i, blind[k])] / size[i]);
        make_sparse(&mut combinations);
        for row in combinations.row_iter() {
            let largest = row.amax();
            let sign = row[row.iamax_full().1].signum();
            let terms = (0..seen.len())
                .map(|i| CombinationTerm { estimate: seen[i], change: sign * row[i] / largest })
                .filter(|term| term.change.abs() > NEGLIGIBLE)
                .collect();
            undetermined.push(UndeterminedDirection { terms });
        }

        let share = |i: usize| blind.iter().map(|k| vectors[(i, *k)].powi(2)).sum::<f64>();
        let determined: Vec<usize> = (0..seen.len()).filter(|i| share(*i) <= TAKES_PART).collect();
        let mut places = vec![None; n];
        for (place, i) in determined.iter().enumerate() {
            places[seen[*i]] = Some(place);
        }
        let inverse = |a: usize, b: usize| {
            let sum: f64 =
                seeing.iter().map(|k| vectors[(a, *k)] * vectors[(b, *k)] / values[*k]).sum();
            sum / (size[a] * size[b])
        };
        let covariance = DMatrix::from_fn(determined.len(), determined.len(), |a, b| {
            inverse(determined[a], determined[b])
        });
        let mut full = DMatrix::zeros(n, n);
        for (a, i) in seen.iter().enumerate() {
            for (b, j) in seen.iter().enumerate() {
                full[(*i, *j)] = inverse(a, b);
            }
        }
        Self { places, covariance, seen: full, undetermined, worth: vec![1.0; n] }
    }

    /// Covariance of two variables, if both are determined.
    pub(super) fn covariance(&self, i: usize, j: usize) -> Option<f64> {
        Some(self.covariance[(self.places[i]?, self.places[j]?)])
    }
}

/// Eigenvectors and eigenvalues; zeros if they do not exist, so that nothing is determined.
fn eigen(matrix: DMatrix<f64>) -> (DMatrix<f64>, DVector<f64>) {
    let n = matrix.nrows();
    if n > 0
        && matrix.iter().all(|value| value.is_finite())
        && let Some(eigen) = SymmetricEigen::try_new(matrix, f64::EPSILON, 1000)
    {
        return (eigen.eigenvectors, eigen.eigenvalues);
    }
    (DMatrix::identity(n, n), DVector::zeros(n))
}

/// Gauss–Jordan elimination with full pivoting: a basis of the same space in which each row has a variable of its own.
fn make_sparse(rows: &mut DMatrix<f64>) {
    let mut used = vec![false; rows.ncols()];
    for k in 0..rows.nrows() {
        let mut pivot = (k, 0, 0.0);
        for i in k..rows.nrows() {
            for j in (0..rows.ncols()).filter(|j| !used[*j]) {
                let size = rows[(i, j)].abs() / rows.row(i).amax();
                if size > pivot.2 {
                    pivot = (i, j, size);
                }
            }
        }
        let (row, column, size) = pivot;
        if size == 0.0 {
            return;
        }
        used[column] = true;
        rows.swap_rows(k, row);
        let scale = rows[(k, column)];
        for j in 0..rows.ncols() {
            rows[(k, j)] /= scale;
        }
        for i in (0..rows.nrows()).filter(|i| *i != k) {
            let factor = rows[(i, column)];
            for j in 0..rows.ncols() {
                rows[(i, j)] -= factor * rows[(k, j)];
            }
        }
    }
}
