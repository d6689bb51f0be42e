//! A recording thinned to the times at which places are examined.

use dgd_identify::{Recording, Starts};
use dgd_runtime::Observations;

/// A recording at fewer times, with the start values of its simulation.
#[derive(Clone)]
pub(super) struct ThinnedRecording<'a> {
    pub(super) recording: &'a Recording,
    pub(super) times: Vec<f64>,
    /// Positions of `times` among all samples.
    samples: Vec<usize>,
    pub(super) start: Starts,
    pub(super) counts_from: f64,
}

impl<'a> ThinnedRecording<'a> {
    pub(super) fn new(
        recording: &'a Recording,
        most: usize,
        start: Starts,
        counts_from: f64,
    ) -> Self {
        let stride = recording.times.len().div_ceil(most.max(1)).max(1);
        let samples: Vec<usize> = (0..recording.times.len()).step_by(stride).collect();
        let times = samples.iter().map(|k| recording.times[*k]).collect();
        ThinnedRecording { recording, times, samples, start, counts_from }
    }

    /// Readings, n_w per sample.
    pub(super) fn readings(&self) -> Vec<f64> {
        let measured = &self.recording.measured;
        let of_sample = |k: &usize| {
            let read = |of: &Option<Vec<f64>>| of.as_ref().map_or(f64::NAN, |all| all[*k]);
            measured.iter().map(read).collect::<Vec<f64>>()
        };
        self.samples.iter().flat_map(of_sample).collect()
    }

    /// Measured minus simulated, n_w per sample.
    pub(super) fn residuals(&self, simulated: &Observations) -> Vec<f64> {
        self.readings().iter().zip(&simulated.w).map(|(read, w)| read - w).collect()
    }
}
