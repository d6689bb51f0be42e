//! Block means of a missing input and of shapes, and least squares on them.
//!
//! The smoothed estimate is correlated over the time that it resolves, so means over blocks of that length are used
//! instead of samples. Sums of their products are stored for each tenth of the training recordings, so that a fit
//! without a tenth, or to resampled tenths, needs no pass over the data.

use nalgebra::{DMatrix, DVector};

use super::formula::FormulaShape;

/// Maximum number of blocks of a recording.
const BLOCKS: f64 = 600.0;
/// Number of parts of each recording that are left out in turn.
pub(super) const FOLDS: usize = 10;
/// Prior standard deviation of a parameter's error, relative to its size.
const PARAMETER: f64 = 0.3;
/// Error of a formula in addition to that of d, relative to its size.
const FLOOR: f64 = 0.05;
/// Minimum fraction of a column that the others must not explain.
const DETERMINED: f64 = 1e-4;
/// Correlation above which two shapes count as one.
const ALIKE: f64 = 0.9999;

/// A missing input over one recording, with the quantities that a formula may contain.
#[derive(Debug, Clone)]
pub(crate) struct InputTrace {
    /// Times of the samples, s.
    pub times: Vec<f64>,
    /// d, SI.
    pub value: Vec<f64>,
    /// Its standard deviation.
    pub std: Vec<f64>,
    /// Correlation time of the errors of d, s.
    pub resolved: f64,
    /// Each name's values, SI.
    pub names: Vec<Vec<f64>>,
    /// For each parameter, the d that an error of 100 % would cause.
    pub parameters: Vec<Vec<f64>>,
}

/// Weighted products of all columns, summed over blocks.
///
/// Columns are the equation's parameters, a constant, the shapes, and d.
pub(super) struct BlockMoments {
    pub(super) shapes: Vec<FormulaShape>,
    n_parameters: usize,
    /// Sums of each part of the training recordings, and of all of them.
    pub(super) parts: Vec<DMatrix<f64>>,
    pub(super) train: DMatrix<f64>,
    /// Sums of the validation recordings, if there are any.
    held_out: Option<DMatrix<f64>>,
}

impl BlockMoments {
    pub(super) fn new(
        train: &[InputTrace],
        held_out: &[InputTrace],
        shapes: Vec<FormulaShape>,
    ) -> BlockMoments {
        let n_parameters = train.first().map_or(0, |trace| trace.parameters.len());
        let size = n_parameters + 1 + shapes.len() + 1;
        let mut parts = vec![DMatrix::zeros(size, size); FOLDS];
        for trace in train {
            let blocks = blocks(trace, &shapes);
            let n = blocks.len();
            for (k, (weight, row)) in blocks.iter().enumerate() {
                add(&mut parts[k * FOLDS / n], *weight, row);
            }
        }
        for part in &mut parts {
            part.fill_lower_triangle_with_upper_triangle();
        }
        let mut sum = DMatrix::zeros(size, size);
        for part in &parts {
            sum += part;
        }
        let mut of_held_out = DMatrix::zeros(size, size);
        for (weight, row) in held_out.iter().flat_map(|trace| blocks(trace, &shapes)) {
            add(&mut of_held_out, weight, &row);
        }
        of_held_out.fill_lower_triangle_with_upper_triangle();
        let held_out = (!held_out.is_empty()).then_some(of_held_out);
        BlockMoments { shapes, n_parameters, parts, train: sum, held_out }
    }

    /// Removes shapes that are collinear with an earlier one in all training recordings.
    pub(super) fn without_twins(self) -> BlockMoments {
        let column = |i: usize| self.n_parameters + 1 + i;
        let alike = |i: usize, j: usize| {
            let product = self.train[(column(i), column(j))].abs();
            product
                > ALIKE
                    * (self.train[(column(i), column(i))] * self.train[(column(j), column(j))])
                        .sqrt()
        };
        let mut kept: Vec<usize> = Vec::new();
        for i in 0..self.shapes.len() {
            if self.train[(column(i), column(i))] > 0.0 && !kept.iter().any(|j| alike(i, *j)) {
                kept.push(i);
            }
        }
        self.select(&kept)
    }

    /// The moments of some shapes.
    pub(super) fn select(&self, kept: &[usize]) -> BlockMoments {
        let last = self.train.nrows() - 1;
        let of_shapes = kept.iter().map(|i| self.n_parameters + 1 + i);
        let columns: Vec<usize> = (0..=self.n_parameters).chain(of_shapes).chain([last]).collect();
        let those = |all: &DMatrix<f64>| all.select_rows(&columns).select_columns(&columns);
        BlockMoments {
            shapes: kept.iter().map(|i| self.shapes[*i].clone()).collect(),
            n_parameters: self.n_parameters,
            parts: self.parts.iter().map(those).collect(),
            train: those(&self.train),
            held_out: self.held_out.as_ref().map(those),
        }
    }

    /// Σ w (d − formula)² in some parts, for a fit to others.
    pub(super) fn square_of(
        &self,
        parts: &DMatrix<f64>,
        fitted: &DMatrix<f64>,
        chosen: &[usize],
    ) -> Option<f64> {
        let columns = self.columns(chosen);
        let beta = self.fit(fitted, None, &columns)?;
        Some(Self::square(parts, &columns, &beta))
    }

    /// Positions of the columns of the equation's parameters and of some shapes.
    fn columns(&self, chosen: &[usize]) -> Vec<usize> {
        (0..self.n_parameters).chain(chosen.iter().map(|i| self.n_parameters + 1 + i)).collect()
    }

    /// Least-squares coefficients of some columns, from products without those of a part; `None` if they are not
    /// determined.
    fn fit(
        &self,
        all: &DMatrix<f64>,
        without: Option<&DMatrix<f64>>,
        columns: &[usize],
    ) -> Option<DVector<f64>> {
        let last = all.nrows() - 1;
        let product =
            |i: usize, j: usize| all[(i, j)] - without.map_or(0.0, |without| without[(i, j)]);
        // A parameter without effect here stays unchanged.
        let scale = |i: &usize| {
            let scale = product(*i, *i).sqrt();
            if scale > 0.0 { scale } else { 1.0 }
        };
        let scales: Vec<f64> = columns.iter().map(scale).collect();
        let n = columns.len();
        let mut matrix = DMatrix::from_fn(n, n, |r, c| {
            product(columns[r], columns[c]) / (scales[r] * scales[c])
        });
        let right = DVector::from_fn(n, |r, _| product(columns[r], last) / scales[r]);
        for (r, i) in columns.iter().enumerate() {
            if *i < self.n_parameters {
                matrix[(r, r)] += (PARAMETER * scales[r]).powi(-2);
            }
        }
        let cholesky = matrix.cholesky()?;
        if cholesky.l_dirty().diagonal().iter().any(|pivot| *pivot < DETERMINED) {
            return None;
        }
        let mut solution = cholesky.solve(&right);
        for (value, scale) in solution.iter_mut().zip(&scales) {
            *value /= scale;
        }
        Some(solution)
    }

    /// Σ w (d − Σ βᵢ columnᵢ)².
    fn square(all: &DMatrix<f64>, columns: &[usize], beta: &DVector<f64>) -> f64 {
        let last = all.nrows() - 1;
        let mut sum = all[(last, last)];
        for (i, b) in columns.iter().zip(beta.iter()) {
            sum -= 2.0 * b * all[(*i, last)];
            for (j, c) in columns.iter().zip(beta.iter()) {
                sum += b * c * all[(*i, *j)];
            }
        }
        sum.max(0.0)
    }

    /// The sum of squares that the best constant and the equation's parameters leave.
    pub(super) fn around_a_constant(&self, all: &DMatrix<f64>) -> Option<f64> {
        let columns: Vec<usize> = (0..=self.n_parameters).collect();
        let left = Self::square(all, &columns, &self.fit(all, None, &columns)?);
        (left > 0.0).then_some(left)
    }

    /// 1 − R² in parts of the training recordings left out in turn.
    pub(super) fn left_out(&self, chosen: &[usize]) -> Option<f64> {
        let columns = self.columns(chosen);
        let mut sum = 0.0;
        for part in &self.parts {
            let beta = self.fit(&self.train, Some(part), &columns)?;
            sum += Self::square(part, &columns, &beta);
        }
        Some(sum / self.around_a_constant(&self.train)?)
    }

    /// Coefficients from all training recordings, and R² in the validation ones.
    pub(super) fn held_out(&self, chosen: &[usize]) -> Option<(Vec<f64>, f64)> {
        let columns = self.columns(chosen);
        let beta = self.fit(&self.train, None, &columns)?;
        let left = match &self.held_out {
            Some(all) => Self::square(all, &columns, &beta) / self.around_a_constant(all)?,
            None => self.left_out(chosen)?,
        };
        Some((beta.iter().skip(self.n_parameters).copied().collect(), 1.0 - left))
    }
}

/// Adds w z zᵀ, its upper triangle only.
fn add(sum: &mut DMatrix<f64>, weight: f64, row: &[f64]) {
    for (j, b) in row.iter().enumerate() {
        let factor = weight * b;
        for (entry, a) in sum.column_mut(j).iter_mut().zip(&row[..=j]) {
            *entry += factor * a;
        }
    }
}

/// Weights and columns of means over blocks.
pub(super) fn blocks(trace: &InputTrace, shapes: &[FormulaShape]) -> Vec<(f64, Vec<f64>)> {
    let InputTrace { times, value, std, resolved, names, parameters } = trace;
    let (Some(first), Some(last)) = (times.first(), times.last()) else { return Vec::new() };
    let length = resolved.max((last - first) / BLOCKS);
    let square = value.iter().map(|d| d * d).sum::<f64>() / value.len() as f64;
    let floor = FLOOR * FLOOR * square;
    let size = parameters.len() + 1 + shapes.len() + 1;
    let mut blocks: Vec<(f64, Vec<f64>)> = Vec::new();
    let mut k = 0;
    while k < times.len() {
        let until = times[k..].partition_point(|t| *t < times[k] + length).max(1) + k;
        let mut row = vec![0.0; size];
        let mut variance = 0.0;
        for sample in k..until {
            let of_parameters = parameters.iter().map(|values| values[sample]);
            let with_constant = of_parameters.chain([1.0]);
            let formed = shapes.iter().map(|shape| shape.value(|name| names[name][sample]));
            for (sum, x) in row.iter_mut().zip(with_constant.chain(formed).chain([value[sample]])) {
                *sum += x;
            }
            variance += std[sample] * std[sample];
        }
        let n = (until - k) as f64;
        for sum in &mut row {
            *sum /= n;
        }
        let weight = 1.0 / (variance / n + floor);
        if weight.is_finite() && row.iter().all(|x| x.is_finite()) {
            blocks.push((weight, row));
        }
        k = until;
    }
    blocks
}
