//! A place with its estimates in each recording.

use dgd_identify::Starts;
use dgd_runtime::Solution;

use super::place_fit::{LinearisedRecording, LinearisedRecordings, ParameterColumns, PlaceFit};

/// A place with its estimates.
pub(super) struct EstimatedPlace {
    pub(super) place: usize,
    pub(super) fit: PlaceFit,
    /// Parameters of the trajectory around which it was fitted, if they differ from those of the base model.
    pub(super) p: Option<Vec<f64>>,
    /// Estimates in each training recording; the validation recordings follow.
    pub(super) train: Vec<RecordedInput>,
    pub(super) valid: Vec<RecordedInput>,
}

/// The missing input at a place in one recording.
pub(super) struct RecordedInput {
    pub(super) piece: ReferencePart,
    /// Standard deviation of d.
    pub(super) std: Vec<f64>,
    /// The trajectory, if it is that of a filter.
    pub(super) followed: Option<Solution>,
}

/// A trajectory's start and its missing term in one recording.
#[derive(Clone)]
pub(super) struct ReferencePart {
    /// Start values, SI.
    pub(super) start: Starts,
    pub(super) d: Vec<f64>,
}

impl EstimatedPlace {
    pub(super) fn new(
        place: usize,
        fit: PlaceFit,
        sights: &LinearisedRecordings<'_>,
        columns: &ParameterColumns,
    ) -> Self {
        let smoothed =
            |all: &[LinearisedRecording], columns: &[Vec<Vec<f64>>]| -> Vec<RecordedInput> {
                let both = all.iter().zip(columns);
                both.map(|(sight, columns)| {
                    let smoothed = sights.smoothed(sight, place, &fit, columns);
                    let moved = sight.start.iter().zip(&smoothed.start);
                    let start = moved.map(|((state, value), change)| (*state, value + change));
                    let piece = ReferencePart { start: start.collect(), d: smoothed.input };
                    RecordedInput { piece, std: smoothed.std, followed: sight.followed.clone() }
                })
                .collect()
            };
        let train = smoothed(sights.train, &columns.train);
        let valid = smoothed(sights.valid, &columns.valid);
        EstimatedPlace { place, fit, p: None, train, valid }
    }
}
