//! Whether the noise of an output differs between recordings.

use dgd_identify::Recording;
use dgd_screen::noise::white_noise;
use dgd_screen::normality::normal_quantile;

use super::{FittedStructure, SearchData};

/// Probability that outputs with the same noise in all recordings get different levels.
const FALSE_ALARM: f64 = 1e-4;

/// Ratio of the largest level to the smallest below which all recordings share one level.
const ALIKE: f64 = 1.5;

/// The noise of each output in each recording, training recordings first, relative to its mean over the recordings;
/// `None` if it is alike in all.
///
/// It is the smaller of those of the readings and of the residuals of the base model. A recording that is too short for
/// an estimate gets the mean.
pub(crate) fn noise_levels(
    fitted: &FittedStructure,
    data: &SearchData<'_>,
) -> Option<Vec<Vec<f64>>> {
    let mut residuals = fitted.residuals(data);
    let held_out = fitted.all_held_out_residuals(data);
    let unknown = || data.valid.iter().map(|recording| vec![Vec::new(); recording.measured.len()]);
    residuals.extend(held_out.unwrap_or_else(|| unknown().collect()));
    let recordings: Vec<&Recording> = data.train.iter().chain(data.valid).collect();
    let outputs = data.noise.len();
    let tests = (outputs * recordings.len()).max(1) as f64;
    let sure = normal_quantile(1.0 - 0.5 * FALSE_ALARM / tests);
    let mut levels = vec![vec![1.0; outputs]; recordings.len()];
    let mut is_uneven = false;
    for output in 0..outputs {
        let estimated: Vec<Option<(f64, f64)>> = (recordings.iter().zip(&residuals))
            .map(|(recording, residuals)| level(recording, &residuals[output], output))
            .collect();
        let weights = || estimated.iter().flatten().map(|(log, error)| (log, error.powi(-2)));
        let sum: f64 = weights().map(|(_, weight)| weight).sum();
        let mean = weights().map(|(log, weight)| log * weight).sum::<f64>() / sum;
        let is_significant =
            estimated.iter().flatten().any(|(log, error)| (log - mean).abs() > sure * error);
        let logs = || estimated.iter().flatten().map(|(log, _)| *log);
        let span = logs().fold(f64::NEG_INFINITY, f64::max) - logs().fold(f64::INFINITY, f64::min);
        if !is_significant || span < ALIKE.ln() {
            continue;
        }
        is_uneven = true;
        for (levels, level) in levels.iter_mut().zip(&estimated) {
            levels[output] = level.map_or(1.0, |(log, _)| (log - mean).exp());
        }
    }
    is_uneven.then_some(levels)
}

/// ln σ of an output in a recording, and its standard error.
fn level(recording: &Recording, residuals: &[f64], output: usize) -> Option<(f64, f64)> {
    let measured = recording.measured[output].as_ref()?;
    let noise_of = |errors: &[f64]| white_noise(&recording.times, errors, measured);
    let readings = noise_of(measured)?;
    let residuals = if residuals.is_empty() { None } else { noise_of(residuals) };
    let least = residuals.filter(|noise| noise.std < readings.std).unwrap_or(readings);
    Some((least.std.ln(), least.relative_error))
}
