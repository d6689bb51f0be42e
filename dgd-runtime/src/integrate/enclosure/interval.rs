//! Arithmetic of intervals that are rounded outwards, so that they contain every value.
//!
//! # Source
//!
//! Moore, Kearfott and Cloud, Introduction to Interval Analysis (2009), §2–4.

use std::f64::consts::{FRAC_PI_2, TAU};
use std::ops::{Add, Div, Mul, Neg, Sub};

/// The numbers from `lo` to `hi`; none if these are NaN, as for the logarithm of a negative number.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Interval {
    pub(crate) lo: f64,
    pub(crate) hi: f64,
}

/// Error of a function of the standard library, relative to its value: two units in the last place.
const OF_FUNCTION: f64 = 4.0 * f64::EPSILON;

impl Interval {
    pub(crate) const ENTIRE: Self = Self { lo: f64::NEG_INFINITY, hi: f64::INFINITY };
    pub(crate) const EMPTY: Self = Self { lo: f64::NAN, hi: f64::NAN };
    pub(crate) const ZERO: Self = Self { lo: 0.0, hi: 0.0 };
    pub(crate) const ONE: Self = Self { lo: 1.0, hi: 1.0 };
    /// A condition that may hold or not.
    pub(crate) const EITHER: Self = Self { lo: 0.0, hi: 1.0 };

    #[inline]
    pub(crate) const fn new(lo: f64, hi: f64) -> Self {
        Self { lo, hi }
    }

    #[inline]
    pub(crate) const fn point(x: f64) -> Self {
        Self { lo: x, hi: x }
    }

    /// The numbers within `error` of x.
    #[inline]
    pub(crate) fn around(x: f64, error: f64) -> Self {
        if error == 0.0 { Self::point(x) } else { Self::rounded(x - error, x + error) }
    }

    /// Bounds that were rounded to the nearest number.
    #[inline]
    fn rounded(lo: f64, hi: f64) -> Self {
        Self { lo: lo.next_down(), hi: hi.next_up() }
    }

    /// Bounds computed by a function of the standard library.
    #[inline]
    fn of_function(lo: f64, hi: f64) -> Self {
        Self::rounded(lo - OF_FUNCTION * lo.abs(), hi + OF_FUNCTION * hi.abs())
    }

    #[inline]
    pub(crate) fn is_empty(self) -> bool {
        self.lo.is_nan() || self.hi.is_nan()
    }

    #[inline]
    pub(crate) fn is_zero(self) -> bool {
        self.lo == 0.0 && self.hi == 0.0
    }

    #[inline]
    pub(crate) fn contains(self, x: f64) -> bool {
        self.lo <= x && x <= self.hi
    }

    #[inline]
    pub(crate) fn width(self) -> f64 {
        self.hi - self.lo
    }

    /// The largest absolute value.
    #[inline]
    fn size(self) -> f64 {
        self.lo.abs().max(self.hi.abs())
    }

    /// The smallest interval with both.
    #[inline]
    pub(crate) fn hull(self, other: Self) -> Self {
        // The minimum of a number and NaN is the number.
        Self { lo: self.lo.min(other.lo), hi: self.hi.max(other.hi) }
    }

    /// The intersection; the first where rounding errors have separated them.
    #[inline]
    pub(crate) fn meet(self, other: Self) -> Self {
        let (lo, hi) = (self.lo.max(other.lo), self.hi.min(other.hi));
        if !self.is_empty() && lo <= hi { Self { lo, hi } } else { self }
    }

    #[inline]
    pub(crate) fn larger(self, other: Self) -> Self {
        if self.is_empty() || other.is_empty() {
            return Self::EMPTY;
        }
        Self { lo: self.lo.max(other.lo), hi: self.hi.max(other.hi) }
    }

    /// The part that is not below a number; none if all is.
    #[inline]
    fn at_least(self, least: f64) -> Self {
        if self.hi < least { Self::EMPTY } else { Self { lo: self.lo.max(least), hi: self.hi } }
    }

    #[inline]
    fn within(self, least: f64, most: f64) -> Self {
        if self.lo > most {
            Self::EMPTY
        } else {
            Self { hi: self.hi.min(most), ..self.at_least(least) }
        }
    }

    /// 1/x.
    fn reciprocal(self) -> Self {
        if self.lo > 0.0 || self.hi < 0.0 {
            Self::rounded(1.0 / self.hi, 1.0 / self.lo)
        } else if self.is_empty() {
            self
        } else if self.lo == 0.0 && self.hi > 0.0 {
            Self::new((1.0 / self.hi).next_down(), f64::INFINITY)
        } else if self.hi == 0.0 && self.lo < 0.0 {
            Self::new(f64::NEG_INFINITY, (1.0 / self.lo).next_up())
        } else {
            Self::ENTIRE
        }
    }

    /// The image under an increasing function.
    #[inline]
    pub(super) fn rising(self, f: fn(f64) -> f64) -> Self {
        if self.is_empty() { self } else { Self::of_function(f(self.lo), f(self.hi)) }
    }

    #[inline]
    pub(super) fn falling(self, f: fn(f64) -> f64) -> Self {
        if self.is_empty() { self } else { Self::of_function(f(self.hi), f(self.lo)) }
    }

    pub(super) fn square_root(self) -> Self {
        self.at_least(0.0).rising(f64::sqrt).at_least(0.0)
    }

    pub(super) fn exponential(self) -> Self {
        self.rising(f64::exp).at_least(0.0)
    }

    /// A logarithm.
    pub(super) fn logarithm(self, f: fn(f64) -> f64) -> Self {
        // At zero it is minus infinity.
        self.at_least(0.0).rising(f)
    }

    pub(super) fn inverse_sine(self) -> Self {
        self.within(-1.0, 1.0).rising(f64::asin)
    }

    pub(super) fn inverse_cosine(self) -> Self {
        self.within(-1.0, 1.0).falling(f64::acos)
    }

    pub(super) fn absolute(self) -> Self {
        if self.lo >= 0.0 {
            self
        } else if self.hi <= 0.0 {
            -self
        } else if self.is_empty() {
            self
        } else {
            Self::new(0.0, self.size())
        }
    }

    pub(super) fn square(self) -> Self {
        let size = self.absolute();
        (size * size).at_least(0.0)
    }

    /// Whether `phase` plus some multiple of a period lies in it, to rounding.
    fn meets(self, phase: f64, period: f64) -> bool {
        let (from, to) = ((self.lo - phase) / period, (self.hi - phase) / period);
        let near = 8.0 * f64::EPSILON * (1.0 + from.abs().max(to.abs()));
        (to + near).floor() >= (from - near).ceil()
    }

    /// Whether it is shorter than a period; one without bounds is not.
    fn is_within_a(self, period: f64) -> bool {
        self.width() < period
    }

    pub(super) fn sine(self) -> Self {
        if self.is_empty() {
            return self;
        }
        let whole = Self::new(-1.0, 1.0);
        if !self.is_within_a(TAU) {
            return whole;
        }
        let (a, b) = (self.lo.sin(), self.hi.sin());
        let mut bounds = Self::of_function(a.min(b), a.max(b));
        if self.meets(FRAC_PI_2, TAU) {
            bounds.hi = 1.0;
        }
        if self.meets(-FRAC_PI_2, TAU) {
            bounds.lo = -1.0;
        }
        bounds.within(-1.0, 1.0)
    }

    pub(super) fn cosine(self) -> Self {
        if self.is_empty() {
            return self;
        }
        let whole = Self::new(-1.0, 1.0);
        if !self.is_within_a(TAU) {
            return whole;
        }
        let (a, b) = (self.lo.cos(), self.hi.cos());
        let mut bounds = Self::of_function(a.min(b), a.max(b));
        if self.meets(0.0, TAU) {
            bounds.hi = 1.0;
        }
        if self.meets(0.5 * TAU, TAU) {
            bounds.lo = -1.0;
        }
        bounds.within(-1.0, 1.0)
    }

    pub(super) fn tangent(self) -> Self {
        let has_pole = !self.is_within_a(0.5 * TAU) || self.meets(FRAC_PI_2, 0.5 * TAU);
        if has_pole && !self.is_empty() { Self::ENTIRE } else { self.rising(f64::tan) }
    }

    pub(super) fn floor(self) -> Self {
        Self::new(self.lo.floor(), self.hi.floor())
    }

    /// x^y.
    pub(super) fn power(self, y: Self) -> Self {
        if self.is_empty() || y.is_empty() {
            return Self::EMPTY;
        }
        let corners = |x: Self| {
            let corners = [x.lo.powf(y.lo), x.lo.powf(y.hi), x.hi.powf(y.lo), x.hi.powf(y.hi)];
            let lo = corners.into_iter().fold(f64::INFINITY, f64::min);
            let hi = corners.into_iter().fold(f64::NEG_INFINITY, f64::max);
            Self::of_function(lo, hi)
        };
        if self.lo >= 0.0 {
            // It is monotone in x, and in y.
            return corners(self).at_least(0.0);
        }
        let is_whole = y.lo == y.hi && y.lo == y.lo.round();
        if !is_whole {
            // Below zero there is none, but for whole exponents.
            return if y.lo == y.hi { self.at_least(0.0).power(y) } else { Self::ENTIRE };
        }
        let is_even = y.lo % 2.0 == 0.0;
        if y.lo < 0.0 && self.hi >= 0.0 {
            return if is_even { self.absolute().power(y) } else { Self::ENTIRE };
        }
        if is_even { self.absolute().power(y) } else { corners(self) }
    }

    /// The angle of the points (x, self).
    pub(super) fn angle(self, x: Self) -> Self {
        if self.is_empty() || x.is_empty() {
            return Self::EMPTY;
        }
        if self.crosses_cut(x) {
            return Self::rounded(-0.5 * TAU, 0.5 * TAU);
        }
        let corners =
            [self.lo.atan2(x.lo), self.lo.atan2(x.hi), self.hi.atan2(x.lo), self.hi.atan2(x.hi)];
        let lo = corners.into_iter().fold(f64::INFINITY, f64::min);
        let hi = corners.into_iter().fold(f64::NEG_INFINITY, f64::max);
        Self::of_function(lo, hi)
    }

    /// Whether points (x, self) are where the angle jumps.
    pub(super) fn crosses_cut(self, x: Self) -> bool {
        self.lo <= 0.0 && self.hi >= 0.0 && x.lo <= 0.0
    }

    /// The length of the hypotenuse.
    pub(super) fn hypotenuse(self, other: Self) -> Self {
        let (a, b) = (self.absolute(), other.absolute());
        if a.is_empty() || b.is_empty() {
            return Self::EMPTY;
        }
        Self::of_function(a.lo.hypot(b.lo), a.hi.hypot(b.hi)).at_least(0.0)
    }
}

impl Neg for Interval {
    type Output = Self;

    #[inline]
    fn neg(self) -> Self {
        Self { lo: -self.hi, hi: -self.lo }
    }
}

impl Add for Interval {
    type Output = Self;

    #[inline]
    fn add(self, other: Self) -> Self {
        if other.is_zero() {
            return self;
        }
        if self.is_zero() {
            return other;
        }
        let (lo, hi) = (self.lo + other.lo, self.hi + other.hi);
        // A sum that is zero is exact.
        let lo = if lo == 0.0 { lo } else { lo.next_down() };
        let hi = if hi == 0.0 { hi } else { hi.next_up() };
        let sum = Self { lo, hi };
        if sum.is_empty() && !self.is_empty() && !other.is_empty() { Self::ENTIRE } else { sum }
    }
}

impl Sub for Interval {
    type Output = Self;

    #[inline]
    fn sub(self, other: Self) -> Self {
        self + -other
    }
}

impl Mul for Interval {
    type Output = Self;

    #[inline]
    fn mul(self, other: Self) -> Self {
        if self.is_empty() || other.is_empty() {
            return Self::EMPTY;
        }
        if self.is_zero() || other.is_zero() {
            return Self::ZERO;
        }
        // Zero times infinity, a bound that no number reaches, is zero.
        let product = |a: f64, b: f64| if a == 0.0 || b == 0.0 { 0.0 } else { a * b };
        let corners = [
            product(self.lo, other.lo),
            product(self.lo, other.hi),
            product(self.hi, other.lo),
            product(self.hi, other.hi),
        ];
        let lo = corners[0].min(corners[1]).min(corners[2].min(corners[3]));
        let hi = corners[0].max(corners[1]).max(corners[2].max(corners[3]));
        Self::rounded(lo, hi)
    }
}

impl Div for Interval {
    type Output = Self;

    #[inline]
    fn div(self, other: Self) -> Self {
        let ends = [self.lo / other.lo, self.lo / other.hi, self.hi / other.lo, self.hi / other.hi];
        if (other.lo > 0.0 || other.hi < 0.0) && ends.iter().all(|end| end.is_finite()) {
            let lo = ends[0].min(ends[1]).min(ends[2].min(ends[3]));
            let hi = ends[0].max(ends[1]).max(ends[2].max(ends[3]));
            return Self::rounded(lo, hi);
        }
        self * other.reciprocal()
    }
}
