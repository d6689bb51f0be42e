//! The error of a program's values relative to the reference.

use std::fs;
use std::path::Path;

use crate::catalogue::{Case, Outputs};

/// States and sensitivities in a row of the two-state model.
const WIDTH: usize = 12;
const STATES: usize = 2;
/// The row at which inputs jump: whether an algebraic unknown has its value before or after is a convention, in which
/// peers differ.
const JUMP: usize = 100;

/// The correct values of a case.
#[derive(Debug)]
pub(crate) struct Reference {
    values: Vec<f64>,
    outputs: Outputs,
    skipped: Option<usize>,
}

impl Reference {
    /// Reads the reference of a case.
    ///
    /// # Errors
    ///
    /// The reference cannot be read.
    pub(crate) fn read(data: &Path, case: &Case) -> Result<Self, String> {
        let values = read(&data.join(format!("{}.bin", case.reference)))?;
        let skipped = (case.reference == "p2").then_some(JUMP);
        Ok(Self { values, outputs: case.outputs, skipped })
    }

    /// The largest difference: relative to a column's largest value, to the range of a series, or to the number itself.
    ///
    /// # Errors
    ///
    /// There are too few or too many values.
    pub(crate) fn error(&self, values: &[f64]) -> Result<f64, String> {
        let expected = &self.values;
        let (width, given, counted) = match self.outputs {
            Outputs::States => (WIDTH, STATES, 0..STATES),
            Outputs::Sensitivities => (WIDTH, WIDTH, STATES..WIDTH),
            Outputs::Series | Outputs::Numbers => (1, 1, 0..1),
        };
        if values.len() * width != expected.len() * given {
            return Err(format!("{} values for {} rows", values.len(), expected.len() / width));
        }
        let pairs = |column: usize| {
            let rows = expected.chunks_exact(width).zip(values.chunks_exact(given)).enumerate();
            rows.filter(|(row, _)| Some(*row) != self.skipped)
                .map(move |(_, (expected, given))| (expected[column], given[column]))
        };
        let mut worst: f64 = 0.0;
        for column in counted {
            let lowest = pairs(column).map(|(x, _)| x).fold(f64::INFINITY, f64::min);
            let highest = pairs(column).map(|(x, _)| x).fold(f64::NEG_INFINITY, f64::max);
            for (expected, given) in pairs(column) {
                let size = match self.outputs {
                    Outputs::States | Outputs::Sensitivities => lowest.abs().max(highest.abs()),
                    Outputs::Series => highest - lowest,
                    Outputs::Numbers => expected.abs(),
                };
                // A zero column, such as that of M in the static model, is compared absolutely.
                let size = if size > 0.0 { size } else { 1.0 };
                let error = (given - expected).abs() / size;
                worst = if error.is_nan() { f64::INFINITY } else { worst.max(error) };
            }
        }
        Ok(worst)
    }
}

/// Little-endian doubles.
///
/// # Errors
///
/// The file cannot be read.
pub(crate) fn read(path: &Path) -> Result<Vec<f64>, String> {
    let bytes = fs::read(path).map_err(|error| format!("{}: {error}", path.display()))?;
    let (numbers, _) = bytes.as_chunks::<8>();
    Ok(numbers.iter().map(|x| f64::from_le_bytes(*x)).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn series(values: &[f64]) -> Reference {
        Reference { values: values.to_vec(), outputs: Outputs::Series, skipped: None }
    }

    #[test]
    fn a_series_is_compared_with_its_range() {
        assert_eq!(series(&[10.0, 14.0]).error(&[10.0, 13.0]), Ok(0.25));
    }

    #[test]
    fn a_value_that_is_not_a_number_is_no_agreement() {
        assert_eq!(series(&[10.0, 14.0]).error(&[f64::NAN, 14.0]), Ok(f64::INFINITY));
    }

    #[test]
    fn a_missing_value_is_told() {
        assert!(series(&[10.0, 14.0]).error(&[10.0]).is_err());
    }
}
