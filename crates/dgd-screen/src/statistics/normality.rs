//! Quantiles and a histogram of residuals, to compare with a normal distribution.
//!
//! ```text
//!   QQ         z = Φ⁻¹((i − 3/8)/(n + 1/4))  against the i-th smallest of n
//!   histogram  width 2 IQR n^(−1/3)
//! ```
//!
//! Sources: Blom, Statistical Estimates and Transformed Beta-Variables (1958), for the plotting positions; Freedman &
//! Diaconis, Z. Wahrsch. verw. Gebiete 57 (1981) 453–476, for the width.

use super::distribution::normal_threshold;

/// Maximum number of bins of a histogram.
const MOST_BINS: usize = 80;

/// The quantile of the standard normal distribution.
pub fn normal_quantile(probability: f64) -> f64 {
    let size = normal_threshold(2.0 * probability.min(1.0 - probability));
    if probability < 0.5 { -size } else { size }
}

/// Pairs of a standard normal quantile and the value of that rank: all values, or at most `most` of them, evenly spaced
/// in rank and including the smallest and the largest.
pub fn normal_quantiles(values: &[f64], most: usize) -> Vec<(f64, f64)> {
    let mut sorted: Vec<f64> = values.iter().copied().filter(|value| value.is_finite()).collect();
    sorted.sort_unstable_by(f64::total_cmp);
    let n = sorted.len();
    let shown = n.min(most.max(2));
    let rank = |k: usize| if shown == n { k } else { k * (n - 1) / (shown - 1) };
    (0..shown)
        .map(|k| {
            let i = rank(k);
            let probability = (i as f64 + 1.0 - 0.375) / (n as f64 + 0.25);
            (normal_quantile(probability), sorted[i])
        })
        .collect()
}

/// The distribution of values over bins.
#[derive(Debug, Clone, PartialEq)]
pub struct Histogram {
    /// Edges of the bins, ascending, one more than there are bins.
    pub edges: Vec<f64>,
    /// For each bin, the fraction of all values in it, divided by its width.
    pub density: Vec<f64>,
}

/// The histogram of the finite values; `None` if all are equal, or there are none.
pub fn histogram(values: &[f64]) -> Option<Histogram> {
    let mut sorted: Vec<f64> = values.iter().copied().filter(|value| value.is_finite()).collect();
    sorted.sort_unstable_by(f64::total_cmp);
    let (low, high) = (*sorted.first()?, *sorted.last()?);
    let span = high - low;
    if !(span > 0.0 && span.is_finite()) {
        return None;
    }
    let n = sorted.len();
    let between = sorted[(3 * n / 4).min(n - 1)] - sorted[n / 4];
    let width = 2.0 * between / (n as f64).cbrt();
    let bins = if width > 0.0 { (span / width).ceil() as usize } else { MOST_BINS };
    let bins = bins.clamp(1, MOST_BINS);
    let edges: Vec<f64> = (0..=bins).map(|k| low + span * k as f64 / bins as f64).collect();
    let mut counts = vec![0_usize; bins];
    for value in &sorted {
        let bin = ((value - low) / span * bins as f64) as usize;
        counts[bin.min(bins - 1)] += 1;
    }
    let width = span / bins as f64;
    let density = counts.iter().map(|count| *count as f64 / (n as f64 * width)).collect();
    Some(Histogram { edges, density })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_those_of_tables() {
        // Abramowitz & Stegun, table 26.1.
        for (p, z) in
            [(0.5, 0.0), (0.841_344_746, 1.0), (0.022_750_132, -2.0), (0.975, 1.959_963_985)]
        {
            assert!((normal_quantile(p) - z).abs() < 1e-6, "{p}");
        }
    }

    #[test]
    fn normal_values_lie_on_a_line_with_their_standard_deviation_as_slope() {
        // Values that are their own expected quantiles, in another order.
        let n = 501;
        let z = |i: usize| normal_quantile((i as f64 + 0.625) / (f64::from(n) + 0.25));
        let values: Vec<f64> = (0..n as usize).map(|i| 3.0 + 2.0 * z(i * 100 % 501)).collect();
        for most in [1000, 11] {
            let pairs = normal_quantiles(&values, most);
            assert_eq!(pairs.len(), most.min(501));
            for (z, value) in pairs {
                assert!((value - (3.0 + 2.0 * z)).abs() < 1e-6, "{z} {value}");
            }
        }
    }

    #[test]
    fn a_histogram_has_all_values_and_the_density_of_their_law() {
        // Uniform over 0 … 2: the density is 1/2 in every bin.
        let values: Vec<f64> = (0..8000).map(|i| f64::from(i) / 4000.0).collect();
        let found = histogram(&values).expect("values differ");
        let widths = found.edges.windows(2).map(|edges| edges[1] - edges[0]);
        let all: f64 = widths.zip(&found.density).map(|(width, density)| width * density).sum();
        assert!((all - 1.0).abs() < 1e-12);
        // IQR 1: a width of 2/20.
        assert_eq!(found.density.len(), 20);
        assert!(found.density.iter().all(|density| (density - 0.5).abs() < 0.01), "{found:?}");
        assert_eq!(histogram(&[1.0, 1.0, f64::NAN]), None);
    }
}
