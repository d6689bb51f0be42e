//! Are numbers uniform in (0, 1)?

/// Probability that as many uniform numbers are as far from uniform: Kolmogorov's and Smirnov's test.
///
/// D is the largest distance between their distribution and the diagonal, and
/// P = 2 Σ (−1)^(k−1) exp(−2 k² λ²) with λ = (√n + 0.12 + 0.11/√n) D.
///
/// Source: Stephens, J. R. Stat. Soc. B 32 (1970) 115.
pub(crate) fn kolmogorov_smirnov(numbers: &[f64]) -> f64 {
    let mut numbers = numbers.to_vec();
    numbers.sort_unstable_by(f64::total_cmp);
    let n = numbers.len() as f64;
    let distances =
        numbers.iter().enumerate().map(|(k, p)| (p - k as f64 / n).max((k + 1) as f64 / n - p));
    let lambda = (n.sqrt() + 0.12 + 0.11 / n.sqrt()) * distances.fold(0.0, f64::max);
    let term = |k: i32| {
        2.0 * f64::from(1 - 2 * ((k + 1) % 2)) * (-2.0 * f64::from(k * k) * lambda * lambda).exp()
    };
    // Below 0.2 the series converges slowly to a probability of one.
    if lambda < 0.2 { 1.0 } else { (1..=20).map(term).sum::<f64>().clamp(0.0, 1.0) }
}
