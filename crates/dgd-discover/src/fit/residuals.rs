//! Sums of squared residuals in units of the noise.

use dgd_identify::Recording;
use dgd_screen::noise::SensorNoise;
use dgd_screen::normality::normal_quantile;

use crate::noise::NoiseWhitener;

/// Σ ε² and the number of samples, where ε are the residuals in units of the noise, with the noise's correlation
/// removed.
pub(crate) fn whitened_square(
    recordings: &[Recording],
    residuals: &[Vec<Vec<f64>>],
    noise: &[Option<SensorNoise>],
) -> (f64, usize) {
    let whitened_errors = recordings.iter().zip(residuals).flat_map(|(recording, outputs)| {
        outputs
            .iter()
            .zip(noise)
            .filter_map(|(errors, noise)| Some(whitened(recording, errors, noise.as_ref()?)))
    });
    let finite = whitened_errors.flatten().filter(|e| e.is_finite());
    finite.fold((0.0, 0), |(sum, n), e| (sum + e * e, n + 1))
}

/// Residuals of one output of a recording in units of its noise, with the noise's correlation removed; NaN where
/// nothing was measured.
pub(crate) fn whitened(recording: &Recording, errors: &[f64], noise: &SensorNoise) -> Vec<f64> {
    let whitener = NoiseWhitener::new(&recording.times, |k| errors[k].is_finite(), noise);
    whitener.apply(errors.iter().copied())
}

/// Σ (e/σ)² and the number of samples, for each output.
pub(crate) fn chi_square(
    residuals: &[Vec<Vec<f64>>],
    noise: &[Option<SensorNoise>],
) -> Vec<(f64, usize)> {
    let of_output = |(output, noise): (usize, &Option<SensorNoise>)| {
        let Some(noise) = noise else { return (0.0, 0) };
        let finite =
            residuals.iter().flat_map(|outputs| &outputs[output]).filter(|e| e.is_finite());
        finite.fold((0.0, 0), |(sum, n), e| (sum + (e / noise.total()).powi(2), n + 1))
    };
    noise.iter().enumerate().map(of_output).collect()
}

/// Numbers minus the mean of the finite ones.
fn centred(all: &[f64]) -> Vec<f64> {
    let finite = || all.iter().copied().filter(|x| x.is_finite());
    let mean = finite().sum::<f64>() / finite().count().max(1) as f64;
    all.iter().map(|x| x - mean).collect()
}

/// Whether a simulation diverges from readings: its residuals vary more about their mean than the readings do about
/// theirs. Values that are not finite do not count.
pub(super) fn runs_away(readings: &[f64], left: &[f64]) -> bool {
    let spread =
        |all: &[f64]| centred(all).iter().filter(|x| x.is_finite()).map(|x| x * x).sum::<f64>();
    spread(left) > spread(readings)
}

/// Residuals; for an output from which the simulation diverges, readings minus their mean instead, because its
/// distance from them does not locate what is missing.
pub(crate) fn as_far_as_readings(
    recordings: &[Recording],
    mut residuals: Vec<Vec<Vec<f64>>>,
) -> Vec<Vec<Vec<f64>>> {
    for (recording, outputs) in recordings.iter().zip(&mut residuals) {
        for (read, left) in recording.measured.iter().zip(outputs) {
            let Some(read) = read else { continue };
            let counts = |(x, left): (&f64, &f64)| if left.is_finite() { *x } else { f64::NAN };
            let read: Vec<f64> = read.iter().zip(left.iter()).map(counts).collect();
            if runs_away(&read, left) {
                *left = centred(&read);
            }
        }
    }
    residuals
}

/// The mean over all outputs; `None` without samples.
pub(crate) fn mean(by_output: &[(f64, usize)]) -> Option<f64> {
    let (sum, n) = by_output.iter().fold((0.0, 0), |(sum, n), (s, m)| (sum + s, n + m));
    (n > 0).then(|| sum / n as f64)
}

/// Factor by which to raise the limit of each output's mean square relative to the noise, for the uncertainty of both:
/// a limit of 1.1 then accepts a correct model in 99 of 100 recordings, however short and however many outputs they
/// have.
pub(crate) fn slack(
    by_output: &[(f64, usize)],
    noise: &[Option<SensorNoise>],
    limit: f64,
) -> Vec<f64> {
    let count = noise.iter().flatten().count().max(1);
    let sure = normal_quantile(1.0 - REJECTED / count as f64);
    let of_output = |((_, n), noise): (&(f64, usize), &Option<SensorNoise>)| {
        let Some(noise) = noise else { return 1.0 };
        let of_noise = 2.0 * noise.relative_error;
        let scatter = of_noise.hypot((2.0 / (*n).max(1) as f64).sqrt());
        ((1.0 + sure * scatter) / limit).max(1.0)
    };
    by_output.iter().zip(noise).map(of_output).collect()
}

/// Probability that one of a correct model's outputs exceeds its raised limit.
const REJECTED: f64 = 0.01;
