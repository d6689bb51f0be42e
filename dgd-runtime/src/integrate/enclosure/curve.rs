//! Tubes of curves of tables.

use dgd_signature::Curve;

use super::interval::Interval;
use super::polynomial::tube_of;
use super::tube::Tube;

/// Rounding of a polynomial at the end of its piece, relative to its terms.
const ROUNDING: f64 = 16.0 * f64::EPSILON;

/// A curve of an argument that moves along an interval.
pub(super) fn along(curve: &Curve, x: Tube) -> Tube {
    let over = |x: Interval| over(curve, x);
    let whole = over(x.range);
    let change = if x.change.is_zero() { Interval::ZERO } else { whole.slope * x.change };
    Tube::moving(over(x.left).value, over(x.right).value, whole.value, change)
}

/// The values and slopes of a curve over an interval.
struct CurveRange {
    value: Interval,
    slope: Interval,
}

fn over(curve: &Curve, x: Interval) -> CurveRange {
    if x.is_empty() {
        return CurveRange { value: x, slope: x };
    }
    if !x.width().is_finite() {
        return CurveRange { value: Interval::ENTIRE, slope: Interval::ENTIRE };
    }
    let Curve { knots, pieces } = curve;
    let piece_at = |x: f64| knots.partition_point(|knot| *knot <= x);
    let (first, last) = (piece_at(x.lo), piece_at(x.hi));
    let mut hull = CurveRange { value: Interval::EMPTY, slope: Interval::EMPTY };
    for piece in first..=last {
        let origin = knots[piece.saturating_sub(1)];
        let from = if piece == first { x.lo } else { origin };
        let end = if piece == last { x.hi } else { knots[piece] };
        let (a, b) = (from - origin, end - origin);
        let here = tube_of(&pieces[piece], a, b);
        hull.value = hull.value.hull(here.range);
        let slope = slope_of(&pieces[piece], a, b);
        hull.slope = hull.slope.hull(slope);
        if piece > first && jumps(curve, piece) {
            hull.slope = Interval::ENTIRE;
        }
    }
    hull
}

/// The slopes of a cubic from a to b.
fn slope_of([_, c1, c2, c3]: &[f64; 4], a: f64, b: f64) -> Interval {
    tube_of(&[*c1, 2.0 * c2, 3.0 * c3], a, b).range
}

/// Whether the curve jumps where a piece begins.
fn jumps(curve: &Curve, piece: usize) -> bool {
    let before = curve.knots[piece.saturating_sub(2)];
    let d = curve.knots[piece - 1] - before;
    let [c0, c1, c2, c3] = curve.pieces[piece - 1];
    let left = c0 + d * (c1 + d * (c2 + d * c3));
    let size = c0.abs() + d.abs() * (c1.abs() + d.abs() * (c2.abs() + d.abs() * c3.abs()));
    let right = curve.pieces[piece][0];
    (left - right).abs() > ROUNDING * size.max(right.abs())
}
