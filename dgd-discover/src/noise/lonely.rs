//! Readings that stand alone far outside their neighbours: no model explains them, and none is judged by them.

use dgd_identify::Recording;
use dgd_screen::spikes;

use super::recorded::{noise_of, readings};

/// Recordings without such readings, and how many each output has lost. Readings that are more than a share of
/// [`MOST`] of an output's are none: whatever comes so often is not a spike.
pub(crate) fn without_spikes(recordings: &[Recording]) -> (Vec<Recording>, Vec<usize>) {
    let noise = noise_of(recordings, &readings(recordings));
    let mut lost = vec![0; noise.len()];
    let mut kept = recordings.to_vec();
    for (output, noise) in noise.iter().enumerate() {
        let found: Vec<Vec<usize>> = recordings
            .iter()
            .map(|recording| {
                let Some(values) = &recording.measured[output] else { return Vec::new() };
                let spikes = spikes(values, noise.as_ref());
                spikes.into_iter().flat_map(|spike| spike.samples.0..=spike.samples.1).collect()
            })
            .collect();
        let all = recordings.iter().filter_map(|recording| recording.measured[output].as_ref());
        let count: usize = all.map(|values| values.iter().filter(|v| v.is_finite()).count()).sum();
        let number: usize = found.iter().map(Vec::len).sum();
        if number as f64 > MOST * count as f64 {
            continue;
        }
        lost[output] = number;
        for (recording, samples) in kept.iter_mut().zip(found) {
            if let Some(values) = &mut recording.measured[output] {
                for sample in samples {
                    values[sample] = f64::NAN;
                }
            }
        }
    }
    (kept, lost)
}

/// Largest share of an output's readings that are left out.
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
}
