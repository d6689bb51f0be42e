//! Measurement noise, for simulated readings.

use dgd_runtime::signature::Distribution;
use dgd_runtime::{Observations, Signature};
use rand_pcg::Pcg64;
use rand_pcg::rand_core::Rng;

/// Adds the noise that each output declares, white.
///
/// Each output has its own random stream, so that its noise does not depend on the others.
pub(super) fn add(signature: &Signature, observations: &mut Observations, seed: u64) {
    let n_w = observations.n_w;
    for (i, output) in signature.outputs.iter().enumerate() {
        let mut random = Pcg64::new(u128::from(seed), i as u128);
        if let Some(density) = signature.density(i) {
            for w in observations.w.chunks_exact_mut(n_w) {
                let sigma = w[density.deviation];
                w[i] = scattered(w[i], sigma, density.distribution, &mut random);
            }
        }
        let Some(noise) = output.noise else { continue };
        for value in observations.w.iter_mut().skip(i).step_by(n_w) {
            *value += noise * standard_normal(&mut random);
        }
    }
}

/// A noisy reading of an output.
fn scattered(w: f64, sigma: f64, distribution: Distribution, random: &mut Pcg64) -> f64 {
    match distribution {
        Distribution::Normal => w + sigma * standard_normal(random),
        Distribution::LogNormal => w * (sigma * standard_normal(random)).exp(),
        Distribution::Student { freedom } => w + sigma * student(freedom, random),
    }
}

/// A deviate of Student's distribution, by Bailey, Math. Comp. 62 (1994) 779: Box–Muller with a different radius.
fn student(freedom: f64, random: &mut Pcg64) -> f64 {
    let (radius, angle) = (uniform(random), uniform(random));
    let square = freedom * (-2.0 / freedom * radius.ln()).exp_m1();
    square.sqrt() * (std::f64::consts::TAU * angle).cos()
}

/// A uniform number in (0, 1], of 53 bits.
fn uniform(random: &mut Pcg64) -> f64 {
    ((random.next_u64() >> 11) + 1) as f64 / (1u64 << 53) as f64
}

/// A normal deviate of mean 0 and variance 1, by Box and Muller, Ann. Math. Stat. 29 (1958) 610.
fn standard_normal(random: &mut Pcg64) -> f64 {
    let (radius, angle) = (uniform(random), uniform(random));
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

    /// Tail probabilities at tabulated quantiles of Student's distribution.
    #[test]
    fn student_s_deviates_have_its_tails() {
        for (freedom, quantile, beyond) in [(4.0, 2.776_445, 0.05), (1.0, 12.706_205, 0.05)] {
            let mut random = Pcg64::new(7, 0);
            let n = 100_000;
            let out = (0..n).filter(|_| student(freedom, &mut random).abs() > quantile).count();
            let share = out as f64 / f64::from(n);
            let error = (beyond * (1.0 - beyond) / f64::from(n)).sqrt();
            assert!((share - beyond).abs() < 5.0 * error, "{freedom}: {share}");
        }
    }
}
