//! The search for the few columns that explain the residuals.
//!
//! All columns are whitened: the sum of squares that a set of them leaves is −2 times its log-likelihood, up to a
//! constant. Sets grow by one column at a time, from the best few of each size.

use std::collections::{BTreeMap, BTreeSet};

use dgd_runtime::parallel::in_parallel_stateless;
use nalgebra::{DMatrix, DVector};

/// Number of sets of each size that are kept and grown.
const BEAM: usize = 12;
/// Minimum fraction of a column that the others must not explain.
const DETERMINED: f64 = 1e-5;

/// Residuals and columns, whitened at one intensity of everything else that is missing.
pub(super) struct WhitenedLevel {
    pub(super) residuals: Vec<f64>,
    pub(super) columns: Vec<Vec<f64>>,
    /// Columns that are always in the set.
    pub(super) always: Vec<Vec<f64>>,
    pub(super) log_determinant: f64,
}

/// A set of columns, and the sum of squares that it leaves.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct ColumnSet {
    pub(super) columns: Vec<usize>,
    pub(super) left: f64,
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    // Four sums at once.
    let (mut sums, mut rest) = ([0.0; 4], 0.0);
    let (a4, b4) = (a.chunks_exact(4), b.chunks_exact(4));
    for (a, b) in a4.remainder().iter().zip(b4.remainder()) {
        rest += a * b;
    }
    for (a, b) in a4.zip(b4) {
        for i in 0..4 {
            sums[i] += a[i] * b[i];
        }
    }
    sums.iter().sum::<f64>() + rest
}

fn normalised(mut column: Vec<f64>, basis: &[Vec<f64>]) -> Option<Vec<f64>> {
    let whole = dot(&column, &column);
    for _ in 0..2 {
        for b in basis {
            let along = dot(&column, b);
            column.iter_mut().zip(b).for_each(|(x, b)| *x -= along * b);
        }
    }
    let left = dot(&column, &column);
    if !(left > DETERMINED * whole && left > 0.0) {
        return None;
    }
    let size = left.sqrt();
    for x in &mut column {
        *x /= size;
    }
    Some(column)
}

impl WhitenedLevel {
    /// Keeps only these columns.
    pub(super) fn keep(&mut self, kept: &[usize]) {
        self.columns = kept.iter().map(|i| std::mem::take(&mut self.columns[*i])).collect();
    }

    /// The sets of up to `most` columns that leave least, of each size.
    pub(super) fn search(&self, most: usize, price: &[f64], threads: usize) -> Vec<ColumnSet> {
        let mut sets: Vec<ColumnSet> = Vec::new();
        let mut products = ColumnProducts::new(self, threads);
        let cost =
            |set: &ColumnSet| set.left + 2.0 * set.columns.iter().map(|i| price[*i]).sum::<f64>();
        let mut frontier = vec![ColumnSet { columns: Vec::new(), left: 0.0 }];
        for _ in 0..most {
            products.extend(frontier.iter().flat_map(|set| set.columns.iter().copied()), threads);
            let grown = in_parallel_stateless(frontier.len(), threads, |k| {
                products.grown(&frontier[k].columns)
            });
            let mut next: Vec<ColumnSet> = grown.into_iter().flatten().collect();
            next.sort_by(|a, b| {
                cost(a).total_cmp(&cost(b)).then_with(|| a.columns.cmp(&b.columns))
            });
            next.dedup_by(|a, b| a.columns == b.columns);
            next.truncate(BEAM);
            sets.extend(next.iter().cloned());
            frontier = next;
        }
        sets
    }

    /// Coefficients of a set of columns, and the sum of squares that it leaves; `None` if they are not determined.
    pub(super) fn fit(&self, columns: &[usize]) -> Option<(Vec<f64>, f64)> {
        let used: Vec<&Vec<f64>> =
            columns.iter().map(|i| &self.columns[*i]).chain(&self.always).collect();
        let scales: Vec<f64> = used.iter().map(|column| dot(column, column).sqrt()).collect();
        let n = used.len();
        let scale = |i: usize| if scales[i] > 0.0 { scales[i] } else { 1.0 };
        let mut matrix =
            DMatrix::from_fn(n, n, |i, j| dot(used[i], used[j]) / (scale(i) * scale(j)));
        for (i, size) in scales.iter().enumerate() {
            if *size == 0.0 {
                matrix[(i, i)] = 1.0;
            }
        }
        let right = DVector::from_fn(n, |i, _| dot(used[i], &self.residuals) / scale(i));
        let solution = matrix.cholesky()?.solve(&right);
        let left = dot(&self.residuals, &self.residuals) - solution.dot(&right);
        let coefficients = (0..columns.len()).map(|i| solution[i] / scale(i)).collect();
        Some((coefficients, left))
    }
}

/// Products of the columns, after those that are always in the set have been projected out.
///
/// Adding a column to a set then needs no pass over the readings: with G the products within the set, g those of the
/// column with it, g₀ the square of the column, and r and r₀ the products of both with the residuals, the column
/// reduces the sum of squares by (r₀ − gᵀ G⁻¹ r)²/(g₀ − gᵀ G⁻¹ g).
struct ColumnProducts {
    columns: Vec<Vec<f64>>,
    /// Squares of the columns before and after the projection.
    whole: Vec<f64>,
    squares: Vec<f64>,
    /// Products with the residuals, and the square of these.
    residuals: Vec<f64>,
    left: f64,
    /// Products of each column that is in a set with all columns.
    rows: BTreeMap<usize, Vec<f64>>,
}

impl ColumnProducts {
    fn new(level: &WhitenedLevel, threads: usize) -> ColumnProducts {
        let mut basis: Vec<Vec<f64>> = Vec::new();
        for column in &level.always {
            basis.extend(normalised(column.clone(), &basis));
        }
        let beside = |column: &[f64]| {
            let mut column = column.to_vec();
            for b in &basis {
                let along = dot(&column, b);
                column.iter_mut().zip(b).for_each(|(x, b)| *x -= along * b);
            }
            column
        };
        let residuals = beside(&level.residuals);
        let columns: Vec<Vec<f64>> =
            in_parallel_stateless(level.columns.len(), threads, |i| beside(&level.columns[i]));
        ColumnProducts {
            whole: level.columns.iter().map(|column| dot(column, column)).collect(),
            squares: columns.iter().map(|column| dot(column, column)).collect(),
            residuals: columns.iter().map(|column| dot(column, &residuals)).collect(),
            left: dot(&residuals, &residuals),
            rows: BTreeMap::new(),
            columns,
        }
    }

    /// Adds the products of some columns with all.
    fn extend(&mut self, columns: impl Iterator<Item = usize>, threads: usize) {
        let new: BTreeSet<usize> = columns.filter(|i| !self.rows.contains_key(i)).collect();
        let new: Vec<usize> = new.into_iter().collect();
        let rows = in_parallel_stateless(new.len(), threads, |k| {
            let new_column = &self.columns[new[k]];
            self.columns.iter().map(|column| dot(new_column, column)).collect::<Vec<f64>>()
        });
        self.rows.extend(new.into_iter().zip(rows));
    }

    /// The set with each other column.
    fn grown(&self, set: &[usize]) -> Vec<ColumnSet> {
        let n = set.len();
        let rows: Vec<&Vec<f64>> = set.iter().filter_map(|i| self.rows.get(i)).collect();
        // In units of the columns' sizes, as they differ by orders of magnitude.
        let size = |i: usize| self.squares[i].sqrt();
        let matrix = DMatrix::from_fn(n, n, |a, b| rows[a][set[b]] / (size(set[a]) * size(set[b])));
        let Some(matrix) = matrix.cholesky() else { return Vec::new() };
        let of_set =
            |values: &dyn Fn(usize) -> f64| DVector::from_fn(n, |a, _| values(a) / size(set[a]));
        let right = of_set(&|a| self.residuals[set[a]]);
        let solution = matrix.solve(&right);
        let left = self.left - solution.dot(&right);
        let with = |i: usize| {
            if set.contains(&i) {
                return None;
            }
            let products = of_set(&|a| rows[a][i]);
            let square = self.squares[i] - products.dot(&matrix.solve(&products));
            (square > DETERMINED * self.whole[i]).then(|| {
                let gain = self.residuals[i] - products.dot(&solution);
                let mut columns = set.to_vec();
                columns.push(i);
                columns.sort_unstable();
                ColumnSet { columns, left: left - gain * gain / square }
            })
        };
        (0..self.columns.len()).filter_map(with).collect()
    }
}

#[cfg(test)]
mod tests {
    use rand_pcg::Pcg64;
    use rand_pcg::rand_core::Rng;

    use super::*;

    /// Columns of random numbers, and residuals of two of them with noise.
    fn level(seed: u64, coefficients: &[(usize, f64)]) -> WhitenedLevel {
        let mut random = Pcg64::new(u128::from(seed), 5);
        let mut number = || (random.next_u64() >> 11) as f64 / (1_u64 << 53) as f64 - 0.5;
        let mut column = || -> Vec<f64> { (0..200).map(|_| number()).collect() };
        let columns: Vec<Vec<f64>> = (0..40).map(|_| column()).collect();
        let mut residuals: Vec<f64> = column().iter().map(|x| 0.1 * x).collect();
        for (i, value) in coefficients {
            for (r, x) in residuals.iter_mut().zip(&columns[*i]) {
                *r += value * x;
            }
        }
        WhitenedLevel { residuals, columns, always: Vec::new(), log_determinant: 0.0 }
    }

    #[test]
    fn the_columns_that_explain_the_residuals_are_found_for_any_number_of_threads() {
        let level = level(1, &[(7, 2.0), (23, -1.5)]);
        let sets = level.search(3, &[5.0; 40], 1);
        assert_eq!(sets, level.search(3, &[5.0; 40], 4));
        let pairs: Vec<&ColumnSet> = sets.iter().filter(|set| set.columns.len() == 2).collect();
        assert_eq!(pairs[0].columns, [7, 23]);
        let (coefficients, left) = level.fit(&[7, 23]).expect("coefficients");
        assert!((coefficients[0] - 2.0).abs() < 0.02 && (coefficients[1] + 1.5).abs() < 0.02);
        assert!((left - pairs[0].left).abs() < 1e-9);
    }

    #[test]
    fn scaled_columns_give_scaled_coefficients_and_the_same_sets() {
        let plain = level(2, &[(3, 1.0), (4, 1.0)]);
        let mut scaled = level(2, &[(3, 1.0), (4, 1.0)]);
        for x in &mut scaled.columns[3] {
            *x *= 1e-9;
        }
        let columns = |level: &WhitenedLevel| -> Vec<Vec<usize>> {
            level.search(2, &[5.0; 40], 1).into_iter().map(|set| set.columns).collect()
        };
        assert_eq!(columns(&plain), columns(&scaled));
        let (of_plain, of_scaled) = (plain.fit(&[3, 4]), scaled.fit(&[3, 4]));
        let (of_plain, of_scaled) = (of_plain.expect("a fit").0, of_scaled.expect("a fit").0);
        assert!((of_scaled[0] * 1e-9 / of_plain[0] - 1.0).abs() < 1e-9);
    }

    #[test]
    fn a_column_that_is_always_there_is_in_no_set() {
        let mut level = level(3, &[(7, 2.0)]);
        level.always = vec![level.columns[7].clone()];
        let sets = level.search(1, &[5.0; 40], 1);
        assert!(sets.iter().all(|set| set.columns != [7]));
    }
}
