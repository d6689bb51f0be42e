//! Curves of tables: piecewise polynomials of one variable. Compiler and runtime call the same code, so that a value
//! has the same bits in both.

use crate::List;

/// A piecewise polynomial, continuous from the right.
///
/// ```text
///   y = c₀ + c₁ d + c₂ d² + c₃ d³,   d = x − the last knot that is not above x
/// ```
///
/// Before the first knot d = x − that knot.
#[derive(Debug, Clone, PartialEq)]
pub struct Curve {
    /// Where pieces meet, ascending; at least one.
    pub knots: List<f64>,
    /// Coefficients c₀ to c₃ of the piece before the first knot, then of those that begin at each knot.
    pub pieces: List<[f64; 4]>,
}

impl Curve {
    /// The value at x; NaN if x is NaN.
    #[must_use]
    #[inline(never)]
    pub fn value(&self, x: f64) -> f64 {
        let piece = self.knots.partition_point(|knot| *knot <= x);
        let d = x - self.knots[piece.saturating_sub(1)];
        let [c0, c1, c2, c3] = self.pieces[piece];
        c0 + d * (c1 + d * (c2 + d * c3))
    }

    /// The derivative, which jumps where the slope of the curve jumps.
    #[must_use]
    pub fn derivative(&self) -> Self {
        let derived = |[_, c1, c2, c3]: &[f64; 4]| [*c1, 2.0 * c2, 3.0 * c3, 0.0];
        Self { knots: self.knots.clone(), pieces: self.pieces.iter().map(derived).collect() }
    }

    /// Whether it is zero everywhere.
    #[must_use]
    pub fn is_zero(&self) -> bool {
        self.pieces.iter().flatten().all(|coefficient| *coefficient == 0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// |x − 1|, and 3 from x = 4 on.
    fn corner() -> Curve {
        let pieces = vec![[0.0, -1.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [3.0, 0.0, 0.0, 0.0]];
        Curve { knots: vec![1.0, 4.0].into(), pieces: pieces.into() }
    }

    #[test]
    fn a_piece_begins_at_its_knot() {
        let curve = corner();
        let at = [-2.0, 1.0, 2.5, 4.0, 9.0].map(|x| curve.value(x));
        assert_eq!(at, [3.0, 0.0, 1.5, 3.0, 3.0]);
        let slopes = [-2.0, 1.0, 2.5, 4.0, 9.0].map(|x| curve.derivative().value(x));
        assert_eq!(slopes, [-1.0, 1.0, 1.0, 0.0, 0.0]);
        assert!(curve.value(f64::NAN).is_nan());
        assert!(curve.derivative().derivative().is_zero());
    }

    #[test]
    fn derivatives_are_those_of_the_polynomial() {
        let curve = Curve { knots: vec![2.0].into(), pieces: vec![[1.0, 2.0, 3.0, 4.0]; 2].into() };
        let d = 0.5;
        let expected = [2.0 + 6.0 * d + 12.0 * d * d, 6.0 + 24.0 * d, 24.0, 0.0];
        let mut derivative = curve;
        for value in expected {
            derivative = derivative.derivative();
            assert_eq!(derivative.value(2.0 + d), value);
        }
    }
}
