//! Clocks: what ticks at times t₀ + x T.

use crate::List;

/// A clock that ticks at the times t₀ + x T, for all whole numbers x or for each of its marks.
///
/// It occupies two consecutive conditions on time: the time of the first is t₀ and that of the second T, which may be
/// negative. The discrete number of the first counts its ticks: with x = (t − t₀)/T it is ⌊x⌋, or the number of marks
/// that are not above x. Its `after` value is x for infinite T. The discrete number of the second is zero.
#[derive(Debug, Clone, PartialEq)]
pub struct Clock {
    /// The first of the two among the conditions on time.
    pub condition: usize,
    /// The automaton, of kind [`Every`](crate::AutomatonKind::Every), whose transition is made at each tick, if any. It
    /// acts from t₀ on.
    pub automaton: Option<usize>,
    /// The x at which it ticks, ascending; all whole numbers if there are none.
    pub marks: List<f64>,
    /// Whether t₀ and T depend on discrete numbers of other conditions on time, so that they change at ticks of others.
    pub follows: bool,
    /// t₀ and T of written constants.
    pub exact: Option<ExactTicks>,
}

/// Times (first + x period)/denominator, s, for whole numbers x.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ExactTicks {
    /// t₀, times the denominator.
    pub first: i64,
    /// T, times the denominator.
    pub period: i64,
    /// Above zero.
    pub denominator: i64,
}

impl ExactTicks {
    /// The x-th time, rounded once.
    pub fn time(self, x: f64) -> Option<f64> {
        // From here on not every whole number is a double.
        if x.abs() >= 9.0e15 {
            return None;
        }
        let product = i128::from(self.period) * i128::from(x as i64);
        Some(quotient(product + i128::from(self.first), i128::from(self.denominator)))
    }
}

/// The double nearest to a fraction whose denominator is above zero and below 2⁶³.
fn quotient(numerator: i128, denominator: i128) -> f64 {
    let (size, denominator) = (numerator.unsigned_abs(), denominator.unsigned_abs());
    let length = |number: u128| u128::BITS - number.leading_zeros();
    // At least two bits more than a double has; the last of them also stands for all that follow.
    let shift = (length(denominator) + 56).saturating_sub(length(size));
    let (bits, rest) = ((size << shift) / denominator, (size << shift) % denominator);
    let rounded = (bits | u128::from(rest != 0)) as f64;
    let size = rounded * 0.5_f64.powi(shift.cast_signed());
    if numerator < 0 { -size } else { size }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_the_nearest_doubles() {
        let tenths = ExactTicks { first: 0, period: 1, denominator: 10 };
        let thirds = ExactTicks { first: 1, period: 2, denominator: 3 };
        assert_eq!(tenths.time(3.0), Some(0.3));
        assert_eq!(tenths.time(-7.0), Some(-0.7));
        assert_eq!(thirds.time(0.0), Some(1.0 / 3.0));
        assert_eq!(thirds.time(1.0), Some(1.0));
        for k in [1_i64, 3, 299_999_999, 1_000_000_000, 123_456_789_012_345] {
            let text = format!("{}.{}", k / 10, k % 10);
            assert_eq!(tenths.time(k as f64), text.parse().ok(), "{text}");
        }
        assert_eq!(tenths.time(0.0), Some(0.0));
        assert_eq!(tenths.time(1e16), None);
    }

    #[test]
    fn long_fractions_are_rounded_once() {
        // 123456789.0123456789 s, written with ten digits behind the point.
        let long =
            ExactTicks { first: 0, period: 1_234_567_890_123_456_789, denominator: 10_000_000_000 };
        assert_eq!(long.time(1.0), "123456789.0123456789".parse().ok());
        assert_eq!(long.time(1e9), "123456789012345678.9".parse().ok());
        let small = ExactTicks { first: 0, period: 1, denominator: i64::MAX };
        assert_eq!(small.time(1.0), Some(1.0 / i64::MAX as f64));
    }
}
