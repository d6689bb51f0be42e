//! Cross-validation over parts of the recordings, if there are no validation recordings.
//!
//! Each recording is cut into [`PARTS`] parts in time. One part of all recordings at a time is left out of a fit, which
//! then predicts it from the inputs of that part.

use dgd_identify::Recording;

use super::super::effort::EVALUATIONS;
use super::super::tried::EffectSearch;
use crate::fit::{FittedStructure, SearchData, StartPoint, chi_square, mean};
use crate::library::StructureId;

/// Number of parts that are left out in turn.
pub(crate) const PARTS: usize = 4;

impl EffectSearch<'_> {
    /// Mean square of the errors relative to the noise in left-out parts, for each output with readings there; `None`
    /// if a part cannot be predicted.
    pub(crate) fn cross_validated(&self, structure: StructureId) -> Option<Vec<f64>> {
        let fitted = self.fitted(structure)?;
        let (whole, values) = (&self.data, &fitted.values);
        let sums = (0..PARTS).map(|part| {
            let train: Vec<Recording> =
                whole.train.iter().map(|recording| without(recording, part)).collect();
            let data = SearchData { train: &train, ..whole.not_kept() };
            let points = [StartPoint::default()];
            let again =
                FittedStructure::new(fitted.structure.clone(), values, &points, &data, EVALUATIONS);
            let mut left = again.ok()?.residuals(whole);
            for (recording, outputs) in whole.train.iter().zip(&mut left) {
                for residuals in outputs {
                    for (k, residual) in residuals.iter_mut().enumerate() {
                        if part_of(recording, k) != part {
                            *residual = f64::NAN;
                        }
                    }
                }
            }
            Some(chi_square(&left, &whole.noise))
        });
        let sums = sums.collect::<Option<Vec<Vec<(f64, usize)>>>>()?;
        let outputs = self.data.noise.len();
        let of_output = |output: usize| {
            let parts = sums.iter().map(|of_part| of_part[output]);
            parts.fold((0.0, 0), |(sum, n), (more, m)| (sum + more, n + m))
        };
        let totals: Vec<(f64, usize)> = (0..outputs).map(of_output).collect();
        Some(totals.iter().filter_map(|one| mean(std::slice::from_ref(one))).collect())
    }
}

/// The part of a recording to which a sample belongs.
fn part_of(recording: &Recording, k: usize) -> usize {
    let (Some(first), Some(last)) = (recording.times.first(), recording.times.last()) else {
        return 0;
    };
    let share = (recording.times[k] - first) / (last - first);
    ((share * PARTS as f64) as usize).min(PARTS - 1)
}

/// A recording without the readings of one part.
fn without(recording: &Recording, part: usize) -> Recording {
    let mut recording = recording.clone();
    let parts: Vec<usize> = (0..recording.times.len()).map(|k| part_of(&recording, k)).collect();
    for readings in recording.measured.iter_mut().flatten() {
        for (reading, own) in readings.iter_mut().zip(&parts) {
            if *own == part {
                *reading = f64::NAN;
            }
        }
    }
    recording
}
