//! LU factorisation of a matrix of nalgebra, with weighted rows.

use nalgebra::allocator::Allocator;
use nalgebra::{DMatrix, DefaultAllocator, Dim, Dyn, LU, OMatrix};

use super::weights::reciprocal;

/// LU factorisation with pivots that depend neither on units of unknowns nor on factors of equations.
#[derive(Debug, Clone)]
pub(crate) struct FullLu {
    lu: LU<f64, Dyn, Dyn>,
    /// The factor of each row, a power of two.
    weights: Vec<f64>,
}

impl FullLu {
    /// The factors of a matrix whose columns belong to unknowns of these sizes.
    pub(crate) fn new(mut matrix: DMatrix<f64>, sizes: &[f64]) -> Self {
        let weight = |i: usize| {
            let row = matrix.row(i);
            let terms = row.iter().zip(sizes).map(|(value, size)| (value * size).abs());
            reciprocal(terms.fold(0.0, f64::max))
        };
        let weights: Vec<f64> = (0..matrix.nrows()).map(weight).collect();
        weighted(&mut matrix, &weights);
        Self { lu: matrix.lu(), weights }
    }

    /// A⁻¹ B; `None` if A is singular to the last bit.
    pub(crate) fn solve<C: Dim>(&self, right: &OMatrix<f64, Dyn, C>) -> Option<OMatrix<f64, Dyn, C>>
    where
        DefaultAllocator: Allocator<Dyn, C>,
    {
        let mut right = right.clone();
        weighted(&mut right, &self.weights);
        self.lu.solve(&right)
    }
}

fn weighted<C: Dim>(matrix: &mut OMatrix<f64, Dyn, C>, weights: &[f64])
where
    DefaultAllocator: Allocator<Dyn, C>,
{
    for (mut row, weight) in matrix.row_iter_mut().zip(weights) {
        row *= *weight;
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::DVector;

    use super::*;

    #[test]
    fn powers_of_two_change_no_bit() {
        let a = DMatrix::from_row_slice(3, 3, &[1.0, 2.0, 0.3, 0.7, 1.0, 5.0, 0.1, 0.9, 0.4]);
        let b = DVector::from_column_slice(&[1.0, 0.2, 3.0]);
        let plain = FullLu::new(a.clone(), &[1.0; 3]).solve(&b).unwrap();
        let (row, unit) = (2.0_f64.powi(70), 2.0_f64.powi(-40));
        let (mut a, mut b) = (a, b);
        a.row_mut(1).scale_mut(row);
        b[1] *= row;
        a.column_mut(2).scale_mut(1.0 / unit);
        let mut scaled = FullLu::new(a, &[1.0, 1.0, unit]).solve(&b).unwrap();
        scaled[2] /= unit;
        assert_eq!(scaled, plain);
    }
}
