//! Times of written constants as fractions.
//!
//! 0.1 s is a tenth of a second, though no double is; 1.1 h is 3960 s, though the product of 1.1 and 3600 as doubles is
//! not. So a number represents the fraction within its rounding error that takes the fewest digits to write, as a
//! decimal or as a quotient of whole numbers.

use dgd_signature::ExactTicks;

/// Relative accuracy of a number that was converted to another unit or is the sum or product of others.
const ROUNDING: f64 = 2.0 * f64::EPSILON;
/// Decimals with more digits are as likely to match by chance.
const DIGITS: usize = 15;

/// The times first + k period as fractions of one denominator, if these can be written.
pub(in crate::dae) fn exact_ticks(first: f64, period: f64) -> Option<ExactTicks> {
    let (a, b) = (fraction(first)?, fraction(period)?);
    let denominator =
        a.denominator.checked_mul(b.denominator / gcd(a.denominator, b.denominator))?;
    let over = |of: Fraction| of.numerator.checked_mul(denominator / of.denominator);
    Some(ExactTicks { first: over(a)?, period: over(b)?, denominator })
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Fraction {
    numerator: i64,
    denominator: i64,
}

impl Fraction {
    fn new(numerator: i64, denominator: i64) -> Self {
        let factor = gcd(numerator, denominator);
        Self { numerator: numerator / factor, denominator: denominator / factor }
    }

    /// Number of digits needed to write it.
    fn length(self) -> f64 {
        (self.numerator.abs() as f64).log10() + (self.denominator as f64).log10()
    }
}

fn gcd(a: i64, b: i64) -> i64 {
    let (mut a, mut b) = (a.abs(), b.abs());
    while b != 0 {
        (a, b) = (b, a % b);
    }
    a.max(1)
}

fn is_near(a: f64, b: f64) -> bool {
    (a - b).abs() <= ROUNDING * b.abs()
}

/// The fraction that a double represents.
fn fraction(x: f64) -> Option<Fraction> {
    if x == 0.0 {
        return Some(Fraction { numerator: 0, denominator: 1 });
    }
    let (decimal, quotient) = (decimal(x), quotient(x));
    match (decimal, quotient) {
        (Some((decimal, digits)), Some(quotient)) => {
            Some(if digits as f64 <= quotient.length() { decimal } else { quotient })
        }
        (decimal, quotient) => decimal.map(|(decimal, _)| decimal).or(quotient),
    }
}

/// The shortest decimal within rounding error, and its number of digits.
fn decimal(x: f64) -> Option<(Fraction, usize)> {
    (0..DIGITS).find_map(|behind| {
        let text = format!("{x:.behind$e}");
        let near: f64 = text.parse().ok()?;
        if !is_near(near, x) {
            return None;
        }
        let (digits, exponent) = text.split_once('e')?;
        let exponent = exponent.parse::<i32>().ok()? - i32::try_from(behind).ok()?;
        let numerator: i64 = digits.replace('.', "").parse().ok()?;
        let power = 10_i64.checked_pow(exponent.unsigned_abs())?;
        let fraction = if exponent < 0 {
            Fraction::new(numerator, power)
        } else {
            Fraction::new(numerator.checked_mul(power)?, 1)
        };
        Some((fraction, behind + 1))
    })
}

/// The first convergent of the continued fraction within rounding error.
fn quotient(x: f64) -> Option<Fraction> {
    let (mut before, mut now) = ((0_i64, 1_i64), (1_i64, 0_i64));
    let mut rest = x.abs();
    loop {
        let whole = rest.floor();
        if whole.is_nan() || whole > 1e15 {
            return None;
        }
        let next = |before: i64, now: i64| now.checked_mul(whole as i64)?.checked_add(before);
        let convergent = (next(before.0, now.0)?, next(before.1, now.1)?);
        (before, now) = (now, convergent);
        if is_near(now.0 as f64 / now.1 as f64, x.abs()) {
            return Some(Fraction::new(if x < 0.0 { -now.0 } else { now.0 }, now.1));
        }
        rest = 1.0 / (rest - whole);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_stand_for_what_was_written() {
        let cases: [(f64, i64, i64); 12] = [
            (0.1, 1, 10),
            (3.0 * 0.1, 3, 10),
            (1.1 * 3600.0, 3960, 1),
            (0.7 * 60.0, 42, 1),
            (1.0 / 3.0, 1, 3),
            (1.0 / (1.0 / 0.3), 3, 10),
            (86400.0 / 365.25, 115_200, 487),
            (0.123_456_789_01, 12_345_678_901, 100_000_000_000),
            (3.0 * 0.123_456_789_01, 37_037_036_703, 100_000_000_000),
            (-2.5e-3, -1, 400),
            (86400.0, 86400, 1),
            (1e-9, 1, 1_000_000_000),
        ];
        for (x, numerator, denominator) in cases {
            assert_eq!(fraction(x), Some(Fraction { numerator, denominator }), "{x}");
        }
        // Even a period of π is a fraction within its rounding error.
        let pi =
            fraction(std::f64::consts::PI).map(|of| of.numerator as f64 / of.denominator as f64);
        assert!(pi.is_some_and(|pi| is_near(pi, std::f64::consts::PI)));
        assert_eq!([f64::NAN, f64::INFINITY, 1e300].map(fraction), [None; 3]);
    }

    #[test]
    fn a_clock_has_one_denominator() {
        let ticks = ExactTicks { first: 1, period: 6, denominator: 20 };
        assert_eq!(exact_ticks(0.05, 0.3), Some(ticks));
        assert_eq!(ticks.time(3.0), Some(0.95));
    }
}
