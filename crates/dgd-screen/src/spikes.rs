//! Detects spikes: isolated outliers.
//!
//! A spike is a run of at most three readings outside the range of its ten neighbours, without their highest and
//! lowest, by more than five standard deviations of the noise and by more than twice that range. Resolved steps, ramps
//! and peaks do not count: there the neighbours on one side reach as far.
//!
//! Source: the comparison with neighbours is Hampel's identifier (Davies, Gather, The identification of multiple
//! outliers, J. Am. Stat. Assoc. 88 (1993) 782–792), with the range instead of the median deviation, which is zero for
//! rounded readings.

use crate::statistics::noise::SensorNoise;

/// A spike.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spike {
    /// First and last sample.
    pub samples: (usize, usize),
    /// Its distance outside the neighbours' range, with sign.
    pub height: f64,
}

/// Maximum number of readings of a spike.
const LONGEST: usize = 3;
/// Number of neighbours on either side.
const NEIGHBOURS: usize = 5;
/// Minimum distance, in multiples of the neighbours' range.
const DISTANCE: f64 = 2.0;
/// Minimum distance, in standard deviations.
const CLEAR: f64 = 5.0;

/// Spikes of a channel with this noise; without noise, of an otherwise constant channel.
pub fn spikes(values: &[f64], noise: Option<&SensorNoise>) -> Vec<Spike> {
    let valid: Vec<usize> = (0..values.len()).filter(|k| values[*k].is_finite()).collect();
    let floor =
        noise.map_or(0.0, |noise| (CLEAR * noise.std).max(2.0 * noise.quantisation.unwrap_or(0.0)));
    let mut spikes = Vec::new();
    let mut position = NEIGHBOURS;
    while position + NEIGHBOURS < valid.len() {
        // Without noise a short pulse may be intended: only a single reading counts.
        let longest = if noise.is_some() { LONGEST } else { 1 };
        let length = (1..=longest).find_map(|length| {
            spike(values, &valid, position, length, floor).map(|height| (length, height))
        });
        match length {
            Some((length, height)) => {
                spikes.push(Spike {
                    samples: (valid[position], valid[position + length - 1]),
                    height,
                });
                position += length;
            }
            None => position += 1,
        }
    }
    spikes
}

/// The height of a spike of this length that begins at the valid sample `at`.
fn spike(values: &[f64], valid: &[usize], at: usize, length: usize, floor: f64) -> Option<f64> {
    let value = |k: usize| values[valid[k]];
    // Most readings are close to the previous one: two comparisons suffice for them.
    let end = at + length;
    if end + NEIGHBOURS > valid.len() || (value(at) - value(at - 1)).abs() <= floor {
        return None;
    }
    let mut neighbours = [0.0; 2 * NEIGHBOURS];
    for (place, k) in neighbours.iter_mut().zip((at - NEIGHBOURS..at).chain(end..end + NEIGHBOURS))
    {
        *place = value(k);
    }
    neighbours.sort_unstable_by(f64::total_cmp);
    // Another spike may be among the neighbours.
    let (low, high) = (neighbours[1], neighbours[2 * NEIGHBOURS - 2]);
    let clear = floor.max(DISTANCE * (high - low));
    let all_above = |height: &dyn Fn(f64) -> f64| {
        (at..end).map(|k| height(value(k))).fold(f64::INFINITY, f64::min)
    };
    let above = all_above(&|x| x - high);
    let below = all_above(&|x| low - x);
    if above > clear {
        Some(above)
    } else if below > clear {
        Some(-below)
    } else {
        None
    }
}
