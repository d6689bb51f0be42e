//! Powers of positive numbers in lanes, from additions and products only.

use super::lanes::Lanes;

/// x^e for normal x > 0 and |e log₂ x| < 1000, to about 1e-14; unspecified for other numbers.
///
/// ```text
///   x = m 2^k, √½ ≤ m < √2,  log₂ m = 2/ln 2 · artanh s,  s = (m − 1)/(m + 1)
///   x^e = 2^(e (k + log₂ m)),  2^(j + r) = 2^j exp(r ln 2), |r| ≤ ½
/// ```
///
/// Both series end where their next term is below 2e-15. The library's power cannot be computed in
/// vectors, and its last bit differs from machine to machine.
#[inline(always)]
#[allow(clippy::inline_always)]
pub(super) fn power(x: Lanes, e: f64) -> Lanes {
    x.map(|x| power_of(x, e))
}

/// 2⁵² + 2⁵¹: adding this rounds a number to an integer, held in the last bits of the sum.
const ROUND: f64 = 6_755_399_441_055_744.0;
/// 2⁵²: integers added to it appear in its last bits.
const COUNT: u64 = 0x4330_0000_0000_0000;

#[inline(always)]
#[allow(clippy::inline_always)]
fn power_of(x: f64, e: f64) -> f64 {
    // k and m: the exponent is split off where the mantissa passes √½.
    let bits = x.to_bits();
    let shifted = bits.wrapping_sub(std::f64::consts::FRAC_1_SQRT_2.to_bits());
    // Arithmetic shift by 52, in numbers that stay positive: |k| < 2048.
    let biased = shifted.wrapping_add(2048 << 52) >> 52;
    let k = f64::from_bits(biased | COUNT) - (4_503_599_627_370_496.0 + 2048.0);
    let m = f64::from_bits(bits.wrapping_sub((biased.wrapping_sub(2048)) << 52));

    let s = (m - 1.0) / (m + 1.0);
    let z = s * s;
    // artanh s / s = Σ zⁿ/(2n + 1); z ≤ 0.0295, the next term z¹⁰/21 is below 3e-17.
    let mut series = 1.0 / 19.0;
    for n in [17.0, 15.0, 13.0, 11.0, 9.0, 7.0, 5.0, 3.0, 1.0] {
        series = series * z + 1.0 / n;
    }
    let exponent = e * (k + std::f64::consts::LOG2_E * 2.0 * s * series);

    let rounded = exponent + ROUND;
    let j = rounded - ROUND;
    let r = (exponent - j) * std::f64::consts::LN_2;
    // exp r = Σ rⁿ/n!; |r| ≤ 0.347, the next term r¹³/13! is below 2e-16.
    let mut exponential = 1.0;
    for n in [12.0, 11.0, 10.0, 9.0, 8.0, 7.0, 6.0, 5.0, 4.0, 3.0, 2.0, 1.0] {
        exponential = exponential * (r * (1.0 / n)) + 1.0;
    }
    let scale = f64::from_bits(rounded.to_bits().wrapping_add(1023) << 52);
    exponential * scale
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn powers_are_those_of_the_library() {
        for e in [-0.1, -0.2, -0.5, 0.02, 0.015, 1.0, 0.2] {
            for exponent in -300..=300 {
                let x = 10.0_f64.powi(exponent) * 1.2345;
                let found = power(Lanes::splat(x), e).0[3];
                let expected = x.powf(e);
                // The rounding of e log₂ x, up to 1000 · ε/2 · ln 2, plus a few ε from the series.
                let error = (found / expected - 1.0).abs();
                assert!(error < 1e-13, "{x}^{e}: {found} {expected}");
            }
        }
        for x in [0.5, 0.7, 0.71, 1.0, 1.4, 1.42, 2.0, 4.0] {
            let found = power(Lanes::splat(x), 0.5).0[0];
            assert!((found - x.sqrt()).abs() < 4.0 * f64::EPSILON, "{x}: {found}");
        }
    }
}
