//! Finds windows in which the misfit stands out from the noise.
//!
//! The average of m samples of white noise has a standard deviation of σ/√m. Times at which such an average exceeds c
//! σ/√m are marked, with c from
//!
//! ```text
//!   P(|z| > c) = α/(number of averages taken),   α = 10⁻³
//! ```
//!
//! Bonferroni's bound over all samples and lengths: pure noise has a window in at most one of a thousand recordings.
//! Short lengths find short misfits of several σ, long ones find faint and lasting ones.
//!
//! If the noise has a correlated part of variance c² and correlation time T, the sum of m samples has a variance of
//!
//! ```text
//!   σ² m + c² (m + 2 Σ_{i<j} e^(−(t_j − t_i)/T))
//! ```

use super::windows::{SignalWindow, gather};
use dgd_screen::distribution::normal_threshold;
use dgd_screen::noise::SensorNoise;
use dgd_screen::usual_spacing;

/// Lengths of the moving averages, in typical intervals of the readings.
const AVERAGED: [f64; 4] = [10.0, 30.0, 100.0, 300.0];

/// Lengths of moving averages over 10, 30, 100 and 300 readings at their typical interval, s; empty with fewer than two
/// readings. A reading is a finite residual.
///
/// # Panics
///
/// If the slices differ in length.
pub fn averaging_lengths(times: &[f64], residuals: &[f64]) -> Vec<f64> {
    assert_eq!(times.len(), residuals.len(), "a residual for each time");
    let read = times.iter().zip(residuals).filter(|(_, residual)| residual.is_finite());
    let read: Vec<f64> = read.map(|(t, _)| *t).collect();
    let usual = usual_spacing(&read);
    usual.map_or_else(Vec::new, |usual| AVERAGED.iter().map(|n| n * usual).collect())
}

/// False alarm rate: how often pure noise may have a window.
const FALSE_ALARMS: f64 = 1e-3;

/// Windows in which the residuals of one output stand out from its noise, in order of time.
///
/// Each average above its threshold marks the inner half of its length, so that averages on the flank of a misfit do
/// not widen it. Lengths are taken in ascending order, and samples marked by a shorter one are left out of the longer
/// ones, which would smear them. A length below the sample interval is one sample. Samples that are not finite are
/// skipped. There are no windows if the noise is not positive.
///
/// # Panics
///
/// If the slices differ in length.
pub fn discrepancy_windows(
    times: &[f64],
    residuals: &[f64],
    noise: &SensorNoise,
    lengths: &[f64],
) -> Vec<SignalWindow> {
    assert_eq!(times.len(), residuals.len(), "a residual for each time");
    let valid: Vec<usize> = (0..times.len()).filter(|k| residuals[*k].is_finite()).collect();
    if valid.is_empty() || lengths.is_empty() || !(noise.std > 0.0 && noise.std.is_finite()) {
        return Vec::new();
    }
    let mut lengths = lengths.to_vec();
    lengths.sort_unstable_by(f64::total_cmp);
    let threshold = normal_threshold(FALSE_ALARMS / (valid.len() * lengths.len()) as f64);

    let mut marked: Vec<Option<f64>> = vec![None; times.len()];
    for length in &lengths {
        let left: Vec<usize> = valid.iter().copied().filter(|k| marked[*k].is_none()).collect();
        for (centre, sigma) in standing_out(times, residuals, noise, &left, *length, threshold) {
            let within = |i: &&usize| (times[**i] - times[left[centre]]).abs() <= 0.25 * length;
            let before = left[..centre].iter().rev().take_while(within);
            for &k in before.chain(left[centre..].iter().take_while(within)) {
                if marked[k].is_none_or(|earlier| sigma.abs() > earlier.abs()) {
                    marked[k] = Some(sigma);
                }
            }
        }
    }
    // Pieces closer than the resolution of the shortest average are merged.
    gather(times, residuals, &marked, lengths[0])
}

/// Averages over `length` around each of the samples `left` that exceed the threshold: position in `left`, and average
/// divided by its standard deviation.
fn standing_out(
    times: &[f64],
    residuals: &[f64],
    noise: &SensorNoise,
    left: &[usize],
    length: f64,
    threshold: f64,
) -> Vec<(usize, f64)> {
    let mut sums = vec![0.0];
    for &k in left {
        sums.push(sums[sums.len() - 1] + residuals[k]);
    }
    let left_times: Vec<f64> = left.iter().map(|k| times[*k]).collect();
    let pairs = noise.colour.map(|colour| (colour, PairSums::new(&left_times, colour.memory)));
    let std = |first: usize, end: usize| {
        let m = (end - first) as f64;
        match &pairs {
            None => m.sqrt() * noise.std,
            Some((colour, pairs)) => {
                let of_colour = m + 2.0 * pairs.sum(first, end);
                (m * noise.std * noise.std + of_colour * colour.std * colour.std).sqrt()
            }
        }
    };
    let (mut first, mut end) = (0, 0);
    let mut exceeding = Vec::new();
    for (centre, &k) in left.iter().enumerate() {
        while first < centre && times[left[first]] < times[k] - 0.5 * length {
            first += 1;
        }
        end = end.max(centre + 1);
        while end < left.len() && times[left[end]] <= times[k] + 0.5 * length {
            end += 1;
        }
        let sigma = (sums[end] - sums[first]) / std(first, end);
        if sigma.abs() > threshold {
            exceeding.push((centre, sigma));
        }
    }
    exceeding
}

/// Sums of correlations over all pairs of samples in a range, Σ ρ(t_j − t_i) with ρ(τ) = e^(−τ/T).
struct PairSums {
    /// ρ from each sample to the next.
    to_next: Vec<f64>,
    /// Σ_{i≤k} ρ(t_k − t_i) and Σ_{j≥k} ρ(t_j − t_k).
    back: Vec<f64>,
    ahead: Vec<f64>,
    /// Σ_{j<k} Σ_{i<j} ρ(t_j − t_i), with one more entry than samples.
    before: Vec<f64>,
    times: Vec<f64>,
    memory: f64,
}

impl PairSums {
    fn new(times: &[f64], memory: f64) -> PairSums {
        let n = times.len();
        let to_next: Vec<f64> =
            times.windows(2).map(|pair| ((pair[0] - pair[1]) / memory).exp()).collect();
        let (mut back, mut ahead, mut before) = (vec![1.0; n], vec![1.0; n], vec![0.0]);
        for k in 1..n {
            back[k] += to_next[k - 1] * back[k - 1];
        }
        for k in (1..n).rev() {
            ahead[k - 1] += to_next[k - 1] * ahead[k];
        }
        for k in 0..n {
            before.push(before[k] + back[k] - 1.0);
        }
        PairSums { to_next, back, ahead, before, times: times.to_vec(), memory }
    }

    /// The sum over the samples from `first` to before `end`.
    fn sum(&self, first: usize, end: usize) -> f64 {
        let inner = self.before[end] - self.before[first];
        let Some(last) = first.checked_sub(1) else { return inner };
        // Minus pairs with an earlier sample: Σ_j ρ(t_j − t_last) times Σ_i ρ(t_last − t_i).
        let beyond = self
            .times
            .get(end)
            .map_or(0.0, |t| ((self.times[first] - t) / self.memory).exp() * self.ahead[end]);
        inner - self.back[last] * self.to_next[last] * (self.ahead[first] - beyond)
    }
}

#[cfg(test)]
mod tests {
    use super::PairSums;

    #[test]
    fn pairs_between_any_two_samples_are_those_summed_one_by_one() {
        let times: Vec<f64> = (0..60).map(|k| f64::from(k) + f64::from(k % 7) * 0.1).collect();
        let memory = 4.0;
        let pairs = PairSums::new(&times, memory);
        for (first, end) in [(0, 60), (0, 1), (7, 30), (40, 60), (12, 14)] {
            let mut sum = 0.0;
            for j in first..end {
                for i in first..j {
                    sum += ((times[i] - times[j]) / memory).exp();
                }
            }
            assert!((pairs.sum(first, end) - sum).abs() < 1e-9, "{first}..{end}");
        }
    }
}
