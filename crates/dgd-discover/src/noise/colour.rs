//! Estimates correlated noise, as caused by filters and buses of sensors.
//!
//! ```text
//!   e = v + w,   w white of variance σ²,   dv = −v dt/T + …, stationary of variance c²
//!   v̂⁺ = φ (v̂ + K ε),  ε = e − v̂,  S = P + σ²,  K = P/S,  P⁺ = φ² P (1 − K) + c² (1 − φ²),  φ = e^(−Δt/T)
//! ```
//!
//! The Kalman filter's ε/√S are white with unit variance if e is such noise. σ, c and T maximise the log-likelihood, −Σ
//! (ln S + ε²/S)/2; the common factor of σ and c has a closed form.
//!
//! The correlation time is at most 2√(h L), where h is the sample interval and L the length of the longest recording.
//! With √N samples of the N readings, noise can be distinguished from model error because the recording holds √N such
//! periods, and the estimate scatters by as much as itself. Longer correlations are not attributed to a sensor.
//!
//! Source: Madsen, Time Series Analysis (2008), §10.3 and §10.6; Schweppe, IEEE Trans. Inf. Theory 11
//! (1965) 61, for the likelihood.

use dgd_screen::noise::{NoiseColour, SensorNoise};
use dgd_screen::usual_spacing;

/// Ratio of correlated to white noise above which the correlated part is model error rather than noise.
const MOST_COLOUR: f64 = 3.0;

/// Factor by which an estimate may exceed the true correlation time.
const SCATTER: f64 = 2.0;

/// Minimum gain in log-likelihood of a correlated part, times two.
const LEAST_GAIN: f64 = 30.0;

/// Points of the first grid, for the correlation time and for c/σ.
const POINTS: usize = 7;

/// Number of times the steps of the search are halved: to 1/64 of a step of the grid.
const HALVINGS: usize = 6;

/// The filter that whitens the noise of one recording and output; its gains do not depend on data.
#[derive(Debug, Clone)]
pub(crate) struct NoiseWhitener {
    /// φ to the sample, K and 1/√S at it.
    steps: Vec<[f64; 3]>,
}

impl NoiseWhitener {
    pub(crate) fn new(
        times: &[f64],
        is_measured: impl Fn(usize) -> bool,
        noise: &SensorNoise,
    ) -> Self {
        let white = noise.std * noise.std;
        let Some(NoiseColour { std, memory }) = noise.colour else {
            return Self { steps: vec![[0.0, 0.0, 1.0 / noise.std]; times.len()] };
        };
        let coloured = std * std;
        let (mut p, mut before) = (coloured, None);
        let step = |(k, t): (usize, &f64)| {
            let phi = before.map_or(0.0, |before: f64| ((before - t) / memory).exp());
            before = Some(*t);
            p = phi * phi * p + coloured * (1.0 - phi * phi);
            if !is_measured(k) {
                return [phi, 0.0, 0.0];
            }
            let s = p + white;
            let gain = p / s;
            p *= 1.0 - gain;
            [phi, gain, 1.0 / s.sqrt()]
        };
        Self { steps: times.iter().enumerate().map(step).collect() }
    }

    /// The signal with its correlation removed, divided by its standard deviation; NaN where the signal is NaN.
    pub(crate) fn apply(&self, signal: impl Iterator<Item = f64>) -> Vec<f64> {
        let mut state = 0.0;
        let filtered = self.steps.iter().zip(signal).map(|([phi, gain, scale], value)| {
            state *= phi;
            let innovation = value - state;
            if !innovation.is_finite() {
                return f64::NAN;
            }
            state += gain * innovation;
            innovation * scale
        });
        filtered.collect()
    }
}

/// The typical interval of the readings behind some errors, and the longest correlation time of a sensor's noise.
fn memories(errors: &[(&[f64], &[f64])]) -> Option<(f64, f64)> {
    let of_recording = |(times, values): &(&[f64], &[f64])| {
        let measured = times.iter().zip(*values).filter(|(_, value)| value.is_finite());
        let measured: Vec<f64> = measured.map(|(t, _)| *t).collect();
        Some((usual_spacing(&measured)?, measured.last()? - measured.first()?))
    };
    let longest = errors.iter().filter_map(of_recording).max_by(|a, b| a.1.total_cmp(&b.1));
    longest.map(|(spacing, length)| (spacing, SCATTER * (spacing * length).sqrt()))
}

/// White and correlated noise of a sensor from its errors in some recordings, each with its times. `None` if a
/// correlated part gains nothing, or is too slow or too large to be noise.
pub(crate) fn coloured_noise(
    errors: &[(&[f64], &[f64])],
    white: &SensorNoise,
) -> Option<SensorNoise> {
    let (least, longest_memory) = memories(errors)?;
    if least >= longest_memory {
        return None;
    }
    // Logarithms of the correlation time and of c/σ.
    let (shortest, longest) = (least.ln(), (SCATTER * longest_memory).ln());
    let (faintest, strongest) = (0.1f64.ln(), (2.0 * MOST_COLOUR).ln());
    let likelihood = |[memory, ratio]: [f64; 2]| likelihood(errors, memory.exp(), ratio.exp());
    let step = |low: f64, high: f64| (high - low) / (POINTS - 1) as f64;
    let mut steps = [step(shortest, longest), step(faintest, strongest)];
    let grid = (0..POINTS * POINTS).map(|k| {
        [shortest + (k / POINTS) as f64 * steps[0], faintest + (k % POINTS) as f64 * steps[1]]
    });
    let better = |a: (f64, [f64; 2]), b: (f64, [f64; 2])| if b.0 > a.0 { b } else { a };
    let start = (f64::NEG_INFINITY, [shortest, faintest]);
    let mut best = grid.map(|at| (likelihood(at).0, at)).fold(start, better);
    for _ in 0..HALVINGS {
        steps = steps.map(|step| 0.5 * step);
        let [memory, ratio] = best.1;
        let about = [(1, 0), (-1, 0), (0, 1), (0, -1), (1, 1), (-1, -1), (1, -1), (-1, 1)];
        let about =
            about.map(|(i, j)| [memory + f64::from(i) * steps[0], ratio + f64::from(j) * steps[1]]);
        best = about.into_iter().map(|at| (likelihood(at).0, at)).fold(best, better);
    }
    let [memory, ratio] = best.1.map(f64::exp);
    let (_, variance) = self::likelihood(errors, memory, ratio);
    let (of_white, _) = self::likelihood(errors, least, 0.0);
    let is_noise = memory <= longest_memory && ratio <= MOST_COLOUR;
    let std = variance.sqrt();
    let colour = NoiseColour { std: ratio * std, memory };
    (is_noise && 2.0 * (best.0 - of_white) > LEAST_GAIN && std > 0.0).then_some(SensorNoise {
        std,
        colour: Some(colour),
        ..*white
    })
}

/// The log-likelihood, up to a constant, and σ².
fn likelihood(errors: &[(&[f64], &[f64])], memory: f64, ratio: f64) -> (f64, f64) {
    let colour = Some(NoiseColour { std: ratio, memory });
    let unit = SensorNoise { colour, ..SensorNoise::known(1.0) };
    let (mut sum, mut logarithms, mut n) = (0.0, 0.0, 0.0);
    for (times, values) in errors {
        let whitener = NoiseWhitener::new(times, |k| values[k].is_finite(), &unit);
        let innovations = whitener.apply(values.iter().copied());
        for (innovation, [_, _, scale]) in innovations.iter().zip(&whitener.steps) {
            if innovation.is_finite() {
                sum += innovation * innovation;
                logarithms -= 2.0 * scale.ln();
                n += 1.0;
            }
        }
    }
    let variance: f64 = sum / n;
    (-0.5 * (n * variance.ln() + logarithms), variance)
}

#[cfg(test)]
mod tests {
    use super::super::whiteness::whiteness;
    use super::*;
    use rand_pcg::Pcg64;
    use rand_pcg::rand_core::Rng;

    fn normal(random: &mut Pcg64) -> f64 {
        let mut uniform = || (random.next_u64() >> 11) as f64 / (1u64 << 53) as f64;
        (-2.0 * (1.0 - uniform()).ln()).sqrt() * (std::f64::consts::TAU * uniform()).cos()
    }

    /// White noise of 2 and a correlated part of 3 with a correlation time of 9 s, without every seventh sample.
    fn sample(seed: u128) -> (Vec<f64>, Vec<f64>) {
        let mut random = Pcg64::new(seed, 1);
        let phi = (-1.0f64 / 9.0).exp();
        let mut v = 3.0 * normal(&mut random);
        let times: Vec<f64> = (0..6000).map(f64::from).collect();
        let values = (0..6000).map(|k| {
            v = phi * v + 3.0 * (1.0 - phi * phi).sqrt() * normal(&mut random);
            let e = v + 2.0 * normal(&mut random);
            if k % 7 == 3 { f64::NAN } else { e }
        });
        let values = values.collect();
        (times, values)
    }

    #[test]
    fn both_parts_and_the_memory_are_found_and_what_is_left_is_white() {
        for seed in 1..=5 {
            let (times, values) = sample(seed);
            let found = coloured_noise(&[(&times, &values)], &SensorNoise::known(1.0)).unwrap();
            let colour = found.colour.unwrap();
            // Four standard deviations of the maximum-likelihood estimates of another program (SciPy, Nelder–Mead) over
            // twelve such samples.
            assert!((found.std - 2.0).abs() < 4.0 * 0.033, "{found:?}");
            assert!((colour.std - 3.0).abs() < 4.0 * 0.082, "{found:?}");
            assert!((colour.memory - 9.0).abs() < 4.0 * 0.71, "{found:?}");
            let whitener = NoiseWhitener::new(&times, |k| values[k].is_finite(), &found);
            let left = whitener.apply(values.iter().copied());
            let test = whiteness(&left, &SensorNoise::known(1.0), 0).unwrap();
            assert!(test.p_value > 1e-3, "{seed}: {test:?}");
        }
    }

    #[test]
    fn white_noise_and_slow_signals_have_no_colour() {
        let mut random = Pcg64::new(3, 1);
        let times: Vec<f64> = (0..3000).map(f64::from).collect();
        let white: Vec<f64> = times.iter().map(|_| normal(&mut random)).collect();
        assert!(coloured_noise(&[(&times, &white)], &SensorNoise::known(1.0)).is_none());
        let slow = |(t, w): (&f64, &f64)| w + 5.0 * (t / 300.0).sin();
        let slow: Vec<f64> = times.iter().zip(&white).map(slow).collect();
        assert!(coloured_noise(&[(&times, &slow)], &SensorNoise::known(1.0)).is_none());
    }
}
