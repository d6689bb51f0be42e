//! Sparsity patterns of a model's matrices.

use crate::List;

/// The non-zeros of a matrix, each once.
///
/// Those of single rows come first, columns ascending, rows ascending within a column; then those of arrays, run by
/// run.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Pattern {
    /// Row of each single non-zero.
    pub rows: List<usize>,
    /// Column of each single non-zero.
    pub columns: List<usize>,
    /// Non-zeros in the rows of families.
    pub runs: List<PatternRun>,
}

/// Places (row + k, column + k) or (row + k, column) of a matrix, for k from 0 to `count` − 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PatternRun {
    /// Row of the first place.
    pub row: usize,
    /// Column of the first place.
    pub column: usize,
    /// Whether the column moves with the row.
    pub diagonal: bool,
    /// Number of places.
    pub count: usize,
}

impl Pattern {
    /// A matrix of zeros.
    pub const EMPTY: Self = Self::single(&[], &[]);

    /// Single non-zeros.
    pub const fn single(rows: &'static [usize], columns: &'static [usize]) -> Self {
        Self {
            rows: List::Borrowed(rows),
            columns: List::Borrowed(columns),
            runs: List::Borrowed(&[]),
        }
    }

    /// Single non-zeros at these places (row, column).
    pub fn from_places(places: &[(usize, usize)]) -> Self {
        Self {
            rows: places.iter().map(|place| place.0).collect(),
            columns: places.iter().map(|place| place.1).collect(),
            runs: List::Borrowed(&[]),
        }
    }

    /// Number of non-zeros.
    pub fn len(&self) -> usize {
        self.rows.len() + self.runs.iter().map(|run| run.count).sum::<usize>()
    }

    /// Whether the matrix is zero everywhere.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Positions (row, column) in storage order.
    pub fn positions(&self) -> impl Iterator<Item = (usize, usize)> + '_ {
        let single = self.rows.iter().copied().zip(self.columns.iter().copied());
        let of_run = |run: &PatternRun| {
            let PatternRun { row, column, diagonal, count } = *run;
            (0..count).map(move |k| (row + k, if diagonal { column + k } else { column }))
        };
        single.chain(self.runs.iter().flat_map(of_run))
    }

    /// Position (row, column) of the k-th non-zero.
    ///
    /// # Panics
    ///
    /// If there are fewer.
    pub fn position(&self, k: usize) -> (usize, usize) {
        let Some(mut rest) = k.checked_sub(self.rows.len()) else {
            return (self.rows[k], self.columns[k]);
        };
        for run in self.runs.iter() {
            if rest < run.count {
                let column = if run.diagonal { run.column + rest } else { run.column };
                return (run.row + rest, column);
            }
            rest -= run.count;
        }
        panic!("non-zero {k} of {}", self.len())
    }

    /// Visits rows, columns and values of the non-zeros.
    // Lengths are constants in generated models, but only after inlining.
    #[allow(clippy::inline_always)]
    #[inline(always)]
    pub fn for_each(&self, values: &[f64], mut visit: impl FnMut(usize, usize, f64)) {
        let (single, mut rest) = values.split_at(self.rows.len());
        for ((row, column), value) in self.rows.iter().zip(self.columns.iter()).zip(single) {
            visit(*row, *column, *value);
        }
        for run in self.runs.iter() {
            let (values, after) = rest.split_at(run.count);
            rest = after;
            if run.diagonal {
                for (k, value) in values.iter().enumerate() {
                    visit(run.row + k, run.column + k, *value);
                }
            } else {
                for (k, value) in values.iter().enumerate() {
                    visit(run.row + k, run.column, *value);
                }
            }
        }
    }

    /// The same with mutable values.
    // Lengths are constants in generated models, but only after inlining.
    #[allow(clippy::inline_always)]
    #[inline(always)]
    pub fn for_each_mut(&self, values: &mut [f64], mut visit: impl FnMut(usize, usize, &mut f64)) {
        let (single, mut rest) = values.split_at_mut(self.rows.len());
        for ((row, column), value) in self.rows.iter().zip(self.columns.iter()).zip(single) {
            visit(*row, *column, value);
        }
        for run in self.runs.iter() {
            let (values, after) = rest.split_at_mut(run.count);
            rest = after;
            let step = usize::from(run.diagonal);
            for (k, value) in values.iter_mut().enumerate() {
                visit(run.row + k, run.column + step * k, value);
            }
        }
    }

    /// Visits rows and columns of the non-zeros.
    pub fn for_each_place(&self, mut visit: impl FnMut(usize, usize)) {
        for (row, column) in self.rows.iter().zip(self.columns.iter()) {
            visit(*row, *column);
        }
        for run in self.runs.iter() {
            let step = usize::from(run.diagonal);
            for k in 0..run.count {
                visit(run.row + k, run.column + step * k);
            }
        }
    }
}
