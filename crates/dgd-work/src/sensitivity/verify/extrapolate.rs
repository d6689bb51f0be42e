//! Extrapolation of difference quotients.

/// A derivative computed from differences.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct DifferenceDerivative {
    pub(super) value: f64,
    /// Error estimated by the extrapolation: from curvature, and from the simulations.
    pub(super) error: f64,
}

/// A difference quotient.
#[derive(Debug, Clone, Copy)]
pub(super) struct DifferenceQuotient {
    pub(super) value: f64,
    /// Error due to the simulations.
    pub(super) noise: f64,
}

/// The limit of difference quotients D(h), D(h/2), D(h/4), … whose error is a series in hᵏ, where k is the `order`;
/// `None` for fewer than two.
///
/// ```text
///   T(i, j) = T(i, j−1) + (T(i, j−1) − T(i−1, j−1)) / (2^(k j) − 1)
/// ```
///
/// The error of an entry is its difference from its two predecessors plus the noise of the latest quotient in it, so
/// that noisy entries that happen to agree are not trusted. The entry with the smallest error is used, so that smaller
/// steps do no harm when noise takes over.
///
/// # Source
///
/// Ridders, Accurate computation of F′(x) and F′(x) F″(x), Adv. Eng. Softw. 4 (1982) 75–76.
pub(super) fn extrapolated(
    quotients: &[DifferenceQuotient],
    order: i32,
) -> Option<DifferenceDerivative> {
    let mut best: Option<DifferenceDerivative> = None;
    let mut previous: Vec<f64> = Vec::new();
    for quotient in quotients {
        let mut row = vec![quotient.value];
        let mut factor = 1.0;
        for (j, &above) in previous.iter().enumerate() {
            let left = row[j];
            factor *= 2f64.powi(order);
            let value = left + (left - above) / (factor - 1.0);
            let error = (value - left).abs().max((value - above).abs()) + quotient.noise;
            if best.is_none_or(|best| error < best.error) {
                best = Some(DifferenceDerivative { value, error });
            }
            row.push(value);
        }
        previous = row;
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;

    fn central(f: impl Fn(f64) -> f64, x: f64) -> DifferenceDerivative {
        let quotient = |k: i32| {
            let h = 0.1 * 0.5f64.powi(k);
            DifferenceQuotient { value: (f(x + h) - f(x - h)) / (2.0 * h), noise: f64::EPSILON / h }
        };
        extrapolated(&[0, 1, 2, 3].map(quotient), 2).expect("four quotients")
    }

    #[test]
    fn smooth_functions_have_their_derivatives() {
        let DifferenceDerivative { value, error } = central(f64::sin, 1.0);
        // h⁸/8! of the last column; the estimate is that of the column before.
        assert!((value - 1f64.cos()).abs() <= 10.0 * error && error < 1e-9, "{value} ± {error}");
    }

    #[test]
    fn a_kink_makes_the_difference_uncertain() {
        // The slopes 0 and 2 on the two sides: D is 1 at the kink, and in between near it.
        let kinked = |x: f64| if x > 0.02 { 2.0 * (x - 0.02) } else { 0.0 };
        let DifferenceDerivative { value, error } = central(kinked, 0.0);
        assert!(value.abs() <= error + 1e-9, "{value} ± {error}");
    }

    #[test]
    fn noisy_quotients_that_happen_to_be_alike_are_not_trusted() {
        let quotients = [1.0, 1.0, 3.0].map(|value| DifferenceQuotient { value, noise: 0.5 });
        assert_eq!(extrapolated(&quotients, 2).map(|difference| difference.error), Some(0.5));
    }

    #[test]
    fn one_quotient_is_no_difference() {
        let quotient = DifferenceQuotient { value: 1.0, noise: 0.0 };
        assert_eq!(extrapolated(&[quotient], 2), None);
        assert_eq!(extrapolated(&[], 2), None);
    }
}
