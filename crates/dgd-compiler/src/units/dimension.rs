//! Dimensions: exponents of the base quantities.

use std::fmt;

/// An exponent, a fraction in lowest terms with a positive denominator.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Exponent {
    numerator: i32,
    denominator: i32,
}

impl Exponent {
    /// Zero.
    pub const ZERO: Exponent = Exponent { numerator: 0, denominator: 1 };

    /// n/d in lowest terms; `None` if d is zero or the result does not fit.
    pub fn new(numerator: i64, denominator: i64) -> Option<Exponent> {
        if denominator == 0 {
            return None;
        }
        let (mut a, mut b) = (numerator.unsigned_abs(), denominator.unsigned_abs());
        while b != 0 {
            (a, b) = (b, a % b);
        }
        let divisor = i64::try_from(a.max(1)).ok()? * denominator.signum();
        Some(Exponent {
            numerator: i32::try_from(numerator / divisor).ok()?,
            denominator: i32::try_from(denominator / divisor).ok()?,
        })
    }

    /// The fraction equal to a number, if there is one with a denominator up to 64.
    pub fn from_f64(x: f64) -> Option<Exponent> {
        (1..=64i32).find_map(|d| {
            let n = x * f64::from(d);
            (n.abs() < 1e6 && (n - n.round()).abs() < 1e-9)
                .then(|| Exponent::new(n.round() as i64, i64::from(d)))
                .flatten()
        })
    }

    /// As a number.
    pub fn value(self) -> f64 {
        f64::from(self.numerator) / f64::from(self.denominator)
    }

    fn add(self, other: Exponent) -> Option<Exponent> {
        let (a, b) = (i64::from(self.numerator), i64::from(self.denominator));
        let (c, d) = (i64::from(other.numerator), i64::from(other.denominator));
        Exponent::new(a * d + c * b, b * d)
    }

    /// The product; `None` if it does not fit.
    pub fn times(self, other: Exponent) -> Option<Exponent> {
        Exponent::new(
            i64::from(self.numerator) * i64::from(other.numerator),
            i64::from(self.denominator) * i64::from(other.denominator),
        )
    }
}

impl fmt::Display for Exponent {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match (self.numerator, self.denominator) {
            (n, 1) => write!(f, "{n}"),
            (n, d) => write!(f, "({n}/{d})"),
        }
    }
}

/// Symbols of the base units, in the order of [`Dimension`]'s exponents.
pub const BASE_UNITS: [&str; 7] = ["kg", "m", "s", "A", "K", "mol", "cd"];

/// Exponents of the base units. The radian is 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Dimension([Exponent; 7]);

impl Dimension {
    /// The dimension of a plain number.
    pub const ONE: Dimension = Dimension([Exponent::ZERO; 7]);

    /// A dimension of integer exponents, in the order of [`BASE_UNITS`].
    pub const fn from_exponents(exponents: [i32; 7]) -> Dimension {
        let mut fractions = [Exponent::ZERO; 7];
        let mut i = 0;
        while i < 7 {
            fractions[i] = Exponent { numerator: exponents[i], denominator: 1 };
            i += 1;
        }
        Dimension(fractions)
    }

    /// Exponents in the order of [`BASE_UNITS`].
    pub fn exponents(&self) -> &[Exponent; 7] {
        &self.0
    }

    fn combine(
        self,
        other: Dimension,
        f: impl Fn(Exponent, Exponent) -> Option<Exponent>,
    ) -> Option<Dimension> {
        let mut combined = [Exponent::ZERO; 7];
        for (out, (a, b)) in combined.iter_mut().zip(self.0.into_iter().zip(other.0)) {
            *out = f(a, b)?;
        }
        Some(Dimension(combined))
    }

    /// The dimension of a product; `None` if an exponent does not fit.
    pub fn times(self, other: Dimension) -> Option<Dimension> {
        self.combine(other, Exponent::add)
    }

    /// The dimension of a quotient.
    pub fn divide(self, other: Dimension) -> Option<Dimension> {
        self.times(other.power(Exponent::new(-1, 1)?)?)
    }

    /// The dimension of a power.
    pub fn power(self, exponent: Exponent) -> Option<Dimension> {
        self.combine(self, |a, _| a.times(exponent))
    }
}
