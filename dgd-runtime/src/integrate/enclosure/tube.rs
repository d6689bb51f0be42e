//! Tubes: enclosures of a quantity and its slope along an interval of time.
//!
//! A natural extension of an expression to intervals forgets that its operands move together. With values at the ends
//! and an enclosure of the change d = x'(t) (b − a) the mean value theorem gives
//!
//! ```text
//!   x(t) ∈ x(a) + [0, 1] d,    x(t) ∈ x(b) − [0, 1] d,    and between x(a) and x(b) where d has one sign
//! ```
//!
//! so that enclosures become exact as fast as the square of the interval's length. It holds where x is continuous with
//! slopes that jump; where x itself may jump d is everything.

use super::interval::Interval;

/// A quantity along an interval.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Tube {
    /// At its ends; wider than a point by rounding only.
    pub(crate) left: Interval,
    pub(crate) right: Interval,
    /// Anywhere in it.
    pub(crate) range: Interval,
    /// Its slopes times the length of the interval.
    pub(crate) change: Interval,
}

impl Tube {
    pub(crate) const EMPTY: Self = Self::still(Interval::EMPTY);
    /// A quantity of which nothing is known.
    pub(super) const ANY: Self = Self { change: Interval::ENTIRE, ..Self::still(Interval::ENTIRE) };

    /// A constant.
    pub(crate) const fn still(at: Interval) -> Self {
        Self { left: at, right: at, range: at, change: Interval::ZERO }
    }

    /// A quantity with a known change, with a range that need not be narrow.
    #[inline]
    pub(crate) fn moving(
        left: Interval,
        right: Interval,
        range: Interval,
        change: Interval,
    ) -> Self {
        // Where there are no slopes nothing follows from them.
        let change = if change.is_empty() { Interval::ENTIRE } else { change };
        let range = if change.lo >= 0.0 {
            range.meet(Interval::new(left.lo, right.hi))
        } else if change.hi <= 0.0 {
            range.meet(Interval::new(right.lo, left.hi))
        } else {
            let part = change.hull(Interval::ZERO);
            range.meet(left + part).meet(right - part)
        };
        Self { left, right, range, change }
    }

    /// Whether it only rises, or only falls.
    pub(crate) fn is_monotone(self) -> bool {
        self.change.lo >= 0.0 || self.change.hi <= 0.0
    }

    #[inline]
    pub(crate) fn negated(self) -> Self {
        let Self { left, right, range, change } = self;
        Self { left: -left, right: -right, range: -range, change: -change }
    }

    #[inline]
    pub(crate) fn plus(self, other: Self) -> Self {
        Self::moving(
            self.left + other.left,
            self.right + other.right,
            self.range + other.range,
            self.change + other.change,
        )
    }

    #[inline]
    pub(crate) fn minus(self, other: Self) -> Self {
        self.plus(other.negated())
    }

    pub(crate) fn times(self, other: Self) -> Self {
        Self::moving(
            self.left * other.left,
            self.right * other.right,
            self.range * other.range,
            self.change * other.range + self.range * other.change,
        )
    }

    pub(super) fn divide(self, other: Self) -> Self {
        let range = self.range / other.range;
        // (a' − q b')/b
        let change = if other.range.contains(0.0) {
            Interval::ENTIRE
        } else if other.change.is_zero() {
            self.change / other.range
        } else {
            (self.change - range * other.change) / other.range
        };
        Self::moving(self.left / other.left, self.right / other.right, range, change)
    }

    /// The same by another function of intervals, whose slope is given.
    pub(super) fn mapped(self, value: fn(Interval) -> Interval, slope: Interval) -> Self {
        Self::moving(
            value(self.left),
            value(self.right),
            value(self.range),
            if self.change.is_zero() { Interval::ZERO } else { slope * self.change },
        )
    }

    pub(super) fn larger(self, other: Self) -> Self {
        let change = if self.range.lo >= other.range.hi {
            self.change
        } else if other.range.lo >= self.range.hi {
            other.change
        } else {
            self.change.hull(other.change)
        };
        Self::moving(
            self.left.larger(other.left),
            self.right.larger(other.right),
            self.range.larger(other.range),
            change,
        )
    }

    pub(super) fn smaller(self, other: Self) -> Self {
        self.negated().larger(other.negated()).negated()
    }

    /// Whether it is above zero, as a condition.
    pub(super) fn above_zero(self) -> Self {
        let holds = |at: Interval| match at {
            at if at.lo > 0.0 => Interval::ONE,
            at if at.hi <= 0.0 || at.is_empty() => Interval::ZERO,
            _ => Interval::EITHER,
        };
        self.condition(holds)
    }

    /// Whether it is not below zero.
    pub(super) fn not_below_zero(self) -> Self {
        let holds = |at: Interval| match at {
            at if at.lo >= 0.0 => Interval::ONE,
            at if at.hi < 0.0 || at.is_empty() => Interval::ZERO,
            _ => Interval::EITHER,
        };
        self.condition(holds)
    }

    fn condition(self, holds: impl Fn(Interval) -> Interval) -> Self {
        Self {
            left: holds(self.left),
            right: holds(self.right),
            range: holds(self.range),
            change: Interval::ZERO,
        }
    }

    /// Both conditions.
    pub(super) fn and(self, other: Self) -> Self {
        let both = |a: Interval, b: Interval| Interval::new(a.lo.min(b.lo), a.hi.min(b.hi));
        Self {
            left: both(self.left, other.left),
            right: both(self.right, other.right),
            range: both(self.range, other.range),
            change: Interval::ZERO,
        }
    }

    /// Not the condition.
    pub(super) fn not(self) -> Self {
        let not = |a: Interval| Interval::new(1.0 - a.hi, 1.0 - a.lo);
        self.condition(not)
    }

    /// The first where this condition holds, otherwise the second.
    pub(super) fn select(self, a: Self, b: Self) -> Self {
        let choose = |holds: Interval, a: Interval, b: Interval| {
            if holds.lo == 1.0 {
                a
            } else if holds.hi == 0.0 {
                b
            } else {
                a.hull(b)
            }
        };
        let change = match self.range {
            Interval { lo: 1.0, .. } => a.change,
            Interval { hi: 0.0, .. } => b.change,
            _ => Interval::ENTIRE,
        };
        Self {
            left: choose(self.left, a.left, b.left),
            right: choose(self.right, a.right, b.right),
            range: choose(self.range, a.range, b.range),
            change,
        }
    }
}
