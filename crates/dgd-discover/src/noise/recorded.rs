//! Estimates the noise of each output of a model from recordings.

use dgd_identify::Recording;
use dgd_screen::noise::{SensorNoise, white_noise};

/// The noise of each output, from residuals or readings of some recordings; `None` if it is not measured.
pub(crate) fn noise_of(
    recordings: &[Recording],
    residuals: &[Vec<Vec<f64>>],
) -> Vec<Option<SensorNoise>> {
    let outputs = recordings.first().map_or(0, |recording| recording.measured.len());
    let of_output = |output: usize| {
        let parts = recordings.iter().zip(residuals).filter_map(|(recording, residuals)| {
            let measured = recording.measured[output].as_ref()?;
            let noise = white_noise(&recording.times, &residuals[output], measured)?;
            Some((noise, measured.len() as f64))
        });
        let parts: Vec<(SensorNoise, f64)> = parts.collect();
        let total: f64 = parts.iter().map(|(_, n)| n).sum();
        // σ² = Σ n σᵢ² / Σ n; relative errors of independent parts add in squares.
        let mean = |f: &dyn Fn(&SensorNoise) -> f64| {
            parts.iter().map(|(noise, n)| n / total * f(noise)).sum::<f64>()
        };
        let (noise, _) = parts.first()?;
        Some(SensorNoise {
            std: mean(&|noise| noise.std * noise.std).sqrt(),
            relative_error: mean(&|noise| noise.relative_error) / (parts.len() as f64).sqrt(),
            ..*noise
        })
    };
    (0..outputs).map(of_output).collect()
}

/// Readings of each recording and output; NaN where nothing was measured.
pub(crate) fn readings(recordings: &[Recording]) -> Vec<Vec<Vec<f64>>> {
    let of_recording = |recording: &Recording| {
        let missing = || vec![f64::NAN; recording.times.len()];
        let outputs = recording.measured.iter();
        outputs.map(|samples| samples.clone().unwrap_or_else(missing)).collect()
    };
    recordings.iter().map(of_recording).collect()
}
