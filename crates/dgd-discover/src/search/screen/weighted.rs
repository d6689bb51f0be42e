//! Residuals and sensitivities of the measured samples, in units of the noise and whitened.

use dgd_execute::LoadedSystem;
use dgd_identify::outputs_with_sensitivities as observe;
use dgd_identify::{DerivativeUse, Recording, outputs_of};
use dgd_runtime::{Direction, System};

use super::projection::OrthonormalBasis;
use super::resampled::BLOCKS;
use crate::fit::{FittedStructure, SearchData, whitened};
use crate::library::CarriedValues;
use crate::noise::NoiseWhitener;

/// The span of the fitted directions (parameters, and start values of each recording), and the number of measured
/// samples at which their derivatives are undefined.
pub(super) fn fitted_directions(
    fitted: &FittedStructure,
    data: &SearchData<'_>,
) -> Option<(OrthonormalBasis, usize)> {
    let structure = &fitted.structure;
    let system = &structure.system;
    let is_held = |j: usize| {
        let name = system.signature().direction_name(j);
        fitted.estimates.iter().any(|e| e.name == name && e.at_bound.is_some())
    };
    let shared = |j: usize| matches!(system.signature().directions[j], Direction::Parameter(_));
    let per_recording = sensitivities_by_recording(system, &fitted.values, data)?;
    let samples: usize = per_recording.iter().map(|columns| columns.rows).sum();
    let mut columns = Vec::new();
    for j in 0..system.signature().directions.len() {
        if is_held(j) {
            continue;
        }
        if shared(j) {
            columns.push(per_recording.iter().flat_map(|part| part.columns[j].clone()).collect());
            continue;
        }
        let mut before = 0;
        for part in &per_recording {
            let mut column = vec![0.0; samples];
            column[before..before + part.rows].copy_from_slice(&part.columns[j]);
            before += part.rows;
            columns.push(column);
        }
    }
    let undefined = per_recording.iter().map(|part| part.undefined).sum();
    Some((OrthonormalBasis::new(&columns), undefined))
}

/// Weighted sensitivities of the measured samples of one recording.
struct WeightedPart {
    rows: usize,
    /// One for each direction.
    columns: Vec<Vec<f64>>,
    /// Number of these rows at which a derivative is undefined.
    undefined: usize,
}

/// One column for each direction over the samples of all training recordings, and the number of samples at which a
/// derivative is undefined.
pub(super) fn sensitivities(
    system: &LoadedSystem,
    values: &CarriedValues,
    data: &SearchData<'_>,
) -> Option<(Vec<Vec<f64>>, usize)> {
    let parts = sensitivities_by_recording(system, values, data)?;
    let directions = system.signature().directions.len();
    let joined = |j: usize| parts.iter().flat_map(|part| part.columns[j].iter().copied()).collect();
    let undefined = parts.iter().map(|part| part.undefined).sum();
    Some(((0..directions).map(joined).collect(), undefined))
}

/// Simulated outputs at the measured samples, in units of the noise and whitened, in the order of the columns above.
pub(super) fn outputs(
    system: &LoadedSystem,
    values: &CarriedValues,
    data: &SearchData<'_>,
) -> Option<Vec<f64>> {
    let p = values.parameters(system);
    let mut outputs = Vec::new();
    for (r, recording) in data.train.iter().enumerate() {
        let (start, options) = (values.starts(system, r), data.options_for(system));
        let without = DerivativeUse::No;
        let simulated =
            outputs_of(system.as_model(), recording, &p, &start, &options, without).ok()?;
        let sensors = data.noise.iter().zip(&recording.measured).enumerate();
        for (output, (noise, measured)) in sensors {
            let (Some(noise), Some(measured)) = (noise, measured) else { continue };
            let whitener = NoiseWhitener::new(&recording.times, |k| measured[k].is_finite(), noise);
            let of_sample = |(k, measured): (usize, &f64)| {
                if measured.is_finite() { simulated.w(k)[output] } else { f64::NAN }
            };
            let whitened = whitener.apply(measured.iter().enumerate().map(of_sample));
            let counted = measured.iter().zip(whitened);
            outputs.extend(counted.filter(|(measured, _)| measured.is_finite()).map(|(_, w)| w));
        }
    }
    Some(outputs)
}

fn sensitivities_by_recording(
    system: &LoadedSystem,
    values: &CarriedValues,
    data: &SearchData<'_>,
) -> Option<Vec<WeightedPart>> {
    let p = values.parameters(system);
    let directions = system.signature().directions.len();
    let recordings = data.train.iter().enumerate();
    recordings
        .map(|(r, recording)| {
            let start = values.starts(system, r);
            let observations =
                observe(system.as_model(), recording, &p, &start, &data.options_for(system))
                    .ok()?;
            let mut columns = vec![Vec::new(); directions];
            let mut undefined = 0;
            for (output, noise) in data.noise.iter().enumerate() {
                let (Some(noise), Some(measured)) = (noise, &recording.measured[output]) else {
                    continue;
                };
                let is_measured = |k: usize| measured[k].is_finite();
                let whitener = NoiseWhitener::new(&recording.times, is_measured, noise);
                let is_undefined = |k: usize| {
                    let value = |j: usize| observations.dw(k)[j * observations.n_w + output];
                    is_measured(k) && !(0..directions).all(|j| value(j).is_finite())
                };
                undefined += (0..measured.len()).filter(|k| is_undefined(*k)).count();
                for (j, column) in columns.iter_mut().enumerate() {
                    // A derivative that is unknown from some point on does not count.
                    let derivative = |k: usize| {
                        let value = observations.dw(k)[j * observations.n_w + output];
                        if value.is_finite() { value } else { 0.0 }
                    };
                    let of_sample =
                        |k: usize| if is_measured(k) { derivative(k) } else { f64::NAN };
                    let whitened = whitener.apply((0..measured.len()).map(of_sample));
                    let measured = whitened.into_iter().enumerate();
                    column.extend(measured.filter(|(k, _)| is_measured(*k)).map(|(_, e)| e));
                }
            }
            Some(WeightedPart { rows: columns.first().map_or(0, Vec::len), columns, undefined })
        })
        .collect()
}

/// Whitened residuals in units of the noise, in the order of the columns above.
pub(crate) fn weighted(data: &SearchData<'_>, residuals: &[Vec<Vec<f64>>]) -> Vec<f64> {
    let mut weighted = Vec::new();
    for (recording, outputs) in data.train.iter().zip(residuals) {
        for (values, noise) in outputs.iter().zip(&data.noise) {
            let Some(noise) = noise else { continue };
            weighted
                .extend(whitened(recording, values, noise).into_iter().filter(|e| e.is_finite()));
        }
    }
    weighted
}

/// Minimum length of blocks, in correlation times of the noise: the remaining correlation, which is never known
/// exactly, then stays within a block.
const MEMORIES: f64 = 5.0;

/// Minimum number of blocks.
const FEWEST_BLOCKS: f64 = 10.0;

/// Number of nearly independent blocks in all recordings.
pub(crate) fn independent_blocks(data: &SearchData<'_>) -> usize {
    let colours = data.noise.iter().flatten().filter_map(|noise| noise.colour);
    let memory = colours.map(|colour| colour.memory).fold(0.0, f64::max);
    let length = |recording: &Recording| match recording.times.as_slice() {
        [first, .., last] => last - first,
        _ => 0.0,
    };
    let seconds: f64 = data.train.iter().map(length).sum();
    (seconds / (MEMORIES * memory)).clamp(FEWEST_BLOCKS, BLOCKS as f64) as usize
}

/// The block of each weighted residual, in their order, out of `number` blocks.
pub(crate) fn blocks(
    data: &SearchData<'_>,
    residuals: &[Vec<Vec<f64>>],
    number: usize,
) -> Vec<usize> {
    let samples: usize = data.train.iter().map(|recording| recording.times.len()).sum();
    let (mut all, mut before) = (Vec::new(), 0);
    for (recording, outputs) in data.train.iter().zip(residuals) {
        for (values, noise) in outputs.iter().zip(&data.noise) {
            let measured =
                values.iter().enumerate().filter(|(_, e)| noise.is_some() && e.is_finite());
            all.extend(measured.map(|(k, _)| (before + k) * number / samples.max(1)));
        }
        before += recording.times.len();
    }
    all
}
