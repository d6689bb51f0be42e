//! Measurement noise, for simulated readings.

use dgd_runtime::{Observations, Signature};
use rand_pcg::Pcg64;
use rand_pcg::rand_core::Rng;

/// Adds white noise of the declared size to each output that declares one.
///
/// Each output has a random stream of its own, so that its noise does not depend on the others.
pub(super) fn add(signature: &Signature, observations: &mut Observations, seed: u64) {
    let n_w = observations.n_w;
    for (i, output) in signature.outputs.iter().enumerate() {
        let Some(noise) = output.noise else { continue };
        let mut random = Pcg64::new(u128::from(seed), i as u128);
        for value in observations.w.iter_mut().skip(i).step_by(n_w) {
            *value += noise * standard_normal(&mut random);
        }
    }
}

/// A normal deviate of mean 0 and variance 1, by Box and Muller, Ann. Math. Stat. 29 (1958) 610.
fn standard_normal(random: &mut Pcg64) -> f64 {
    // Two uniform numbers in (0, 1], 53 bits each.
    let mut uniform = || ((random.next_u64() >> 11) + 1) as f64 / (1u64 << 53) as f64;
    let (radius, angle) = (uniform(), uniform());
    (-2.0 * radius.ln()).sqrt() * (std::f64::consts::TAU * angle).cos()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn deviates_have_mean_zero_and_variance_one() {
        let mut random = Pcg64::new(7, 0);
        let n = 100_000;
        let sample: Vec<f64> = (0..n).map(|_| standard_normal(&mut random)).collect();
        let mean = sample.iter().sum::<f64>() / f64::from(n);
        let variance = sample.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / f64::from(n);
        // Five standard errors: 1/√n of the mean, √(2/n) of the variance.
        assert!(mean.abs() < 5.0 / f64::from(n).sqrt(), "mean {mean}");
        assert!((variance - 1.0).abs() < 5.0 * (2.0 / f64::from(n)).sqrt(), "variance {variance}");
    }
}
