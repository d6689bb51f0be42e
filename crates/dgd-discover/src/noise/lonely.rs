//! Removes isolated outliers: no model explains them, and none is judged by them.

use dgd_identify::Recording;
use dgd_screen::distribution::normal_threshold;
use dgd_screen::noise::SensorNoise;
use dgd_screen::spikes;

use super::recorded::{noise_of, readings};

/// Recordings without isolated outliers, and the number of readings that each output has lost. If they are more than a
/// fraction [`MOST`] of an output's readings, all are kept: anything that frequent is not a spike.
pub(crate) fn without_spikes(recordings: &[Recording]) -> (Vec<Recording>, Vec<usize>) {
    let noise = noise_of(recordings, &readings(recordings));
    without(recordings, noise.len(), |_, values, output| {
        let spikes = spikes(values, noise[output].as_ref());
        spikes.into_iter().flat_map(|spike| spike.samples.0..=spike.samples.1).collect()
    })
}

/// [`without_spikes`] with the residuals of a fitted model: if a quantity changes quickly, spikes show only there.
///
/// A reading is a spike only if both its residual and the reading itself stand out from their neighbours: a residual at
/// a step may be the model's fault.
pub(crate) fn without_lonely(
    recordings: &[Recording],
    residuals: &[Vec<Vec<f64>>],
    noise: &[Option<SensorNoise>],
) -> (Vec<Recording>, Vec<usize>) {
    without(recordings, noise.len(), |recording, values, output| {
        let (Some(noise), Some(left)) = (&noise[output], residuals.get(recording)) else {
            return Vec::new();
        };
        lonely(values, &left[output], noise.total())
    })
}

/// Positions of isolated outliers.
fn lonely(readings: &[f64], residuals: &[f64], std: f64) -> Vec<usize> {
    let valid: Vec<usize> = (0..readings.len()).filter(|k| residuals[*k].is_finite()).collect();
    let clear = 1.5_f64.sqrt() * std * normal_threshold(FALSE_ALARMS / valid.len().max(1) as f64);
    let stands_alone = |near: &&[usize]| {
        let [before, k, after] = **near else { return false };
        let height = |of: &[f64]| of[k] - 0.5 * (of[before] + of[after]);
        let residual_height = height(residuals);
        residual_height.abs() > clear
            && (residuals[before] - residuals[after]).abs() < 0.5 * residual_height.abs()
            && height(readings) * residual_height.signum() > OF_ITS_OWN * residual_height.abs()
    };
    valid.windows(3).filter(stands_alone).map(|near| near[1]).collect()
}

/// Recordings without the readings that `find` returns for a recording's position, readings and output.
fn without(
    recordings: &[Recording],
    outputs: usize,
    find: impl Fn(usize, &[f64], usize) -> Vec<usize>,
) -> (Vec<Recording>, Vec<usize>) {
    let mut lost = vec![0; outputs];
    let mut kept = recordings.to_vec();
    for (output, lost) in lost.iter_mut().enumerate() {
        let outliers: Vec<Vec<usize>> = recordings
            .iter()
            .enumerate()
            .map(|(r, recording)| match &recording.measured[output] {
                Some(values) => find(r, values, output),
                None => Vec::new(),
            })
            .collect();
        let columns = recordings.iter().filter_map(|recording| recording.measured[output].as_ref());
        let count: usize =
            columns.map(|values| values.iter().filter(|v| v.is_finite()).count()).sum();
        let number: usize = outliers.iter().map(Vec::len).sum();
        if number as f64 > MOST * count as f64 {
            continue;
        }
        *lost = number;
        for (recording, samples) in kept.iter_mut().zip(outliers) {
            if let Some(values) = &mut recording.measured[output] {
                for sample in samples {
                    values[sample] = f64::NAN;
                }
            }
        }
    }
    (kept, lost)
}

/// Minimum fraction of the residual's height that the reading itself must have. At a step that a model follows one
/// sample late it is half.
const OF_ITS_OWN: f64 = 0.75;

/// Probability that pure noise loses a reading.
const FALSE_ALARMS: f64 = 1e-3;

/// Largest fraction of an output's readings that may be left out.
const MOST: f64 = 0.05;

#[cfg(test)]
mod tests {
    use super::*;
    use dgd_runtime::Inputs;

    #[test]
    fn single_readings_far_off_are_left_out_and_steps_are_not() {
        let times: Vec<f64> = (0..400).map(f64::from).collect();
        let noise = |k: usize| 0.01 * ((k * 7919 % 101) as f64 / 50.0 - 1.0);
        let mut values: Vec<f64> =
            (0..400).map(|k| f64::from(u8::from(k > 200)) + noise(k)).collect();
        values[50] += 3.0;
        values[300] -= 2.0;
        let recording = Recording::new(times, Inputs::none(), vec![Some(values)]);
        let (kept, lost) = without_spikes(&[recording]);
        assert_eq!(lost, [2]);
        let left = kept[0].measured[0].as_ref().expect("an output");
        let missing: Vec<usize> = (0..400).filter(|k| left[*k].is_nan()).collect();
        assert_eq!(missing, [50, 300]);
    }

    #[test]
    fn of_what_moves_quickly_the_residual_tells_and_a_residual_at_a_step_does_not() {
        let mut readings: Vec<f64> = (0..400).map(|k| (f64::from(k) * 0.7).sin()).collect();
        let mut residuals: Vec<f64> =
            (0..400).map(|k| 0.01 * (f64::from(k * 7919 % 101) / 50.0 - 1.0)).collect();
        for k in [90, 250] {
            readings[k] += 0.1 * readings[k].signum();
            residuals[k] += 0.1 * readings[k].signum();
        }
        // The model is one sample late at a step: its residual is isolated, the reading is not.
        for reading in &mut readings[300..] {
            *reading += 5.0;
        }
        residuals[300] += 5.0;
        assert_eq!(lonely(&readings, &residuals, 0.006), [90, 250]);
    }
}
