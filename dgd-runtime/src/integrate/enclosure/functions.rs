//! THE table of enclosures: each function of the language over an interval, with its slope.

use dgd_signature::special;

use super::interval::Interval;
use super::tube::Tube;

/// A function of one argument along an interval.
pub(crate) type OfOne = fn(Tube) -> Tube;
/// A function of two arguments along an interval.
pub(crate) type OfTwo = fn(Tube, Tube) -> Tube;

/// The enclosure of a function of one argument; `None` for a name that is not in the table.
pub(crate) fn of_one(name: &str) -> Option<OfOne> {
    ONE.iter().find(|(of, _)| *of == name).map(|(_, enclosure)| *enclosure)
}

/// The enclosure of a function of two arguments.
pub(crate) fn of_two(name: &str) -> Option<OfTwo> {
    TWO.iter().find(|(of, _)| *of == name).map(|(_, enclosure)| *enclosure)
}

const ONE: &[(&str, OfOne)] = &[
    ("sqrt", |x| {
        let two = Interval::point(2.0);
        x.mapped(Interval::square_root, Interval::ONE / (two * x.range.square_root()))
    }),
    ("exp", |x| x.mapped(Interval::exponential, x.range.exponential())),
    ("log", |x| x.mapped(|x| x.logarithm(f64::ln), per(Interval::ONE, x.range))),
    ("log10", |x| {
        let per_decade = Interval::around(std::f64::consts::LOG10_E, f64::EPSILON);
        x.mapped(|x| x.logarithm(f64::log10), per(per_decade, x.range))
    }),
    ("sin", |x| x.mapped(Interval::sine, x.range.cosine())),
    ("cos", |x| x.mapped(Interval::cosine, -x.range.sine())),
    ("tan", |x| {
        let tangent = x.range.tangent();
        x.mapped(Interval::tangent, Interval::ONE + tangent.square())
    }),
    ("asin", |x| x.mapped(Interval::inverse_sine, Interval::ONE / leg(x.range))),
    ("acos", |x| x.mapped(Interval::inverse_cosine, -(Interval::ONE / leg(x.range)))),
    ("atan", |x| {
        let slope = Interval::ONE / (Interval::ONE + x.range.square());
        x.mapped(|x| x.rising(f64::atan), slope)
    }),
    ("sinh", |x| x.mapped(|x| x.rising(f64::sinh), hyperbolic_cosine(x.range))),
    ("cosh", |x| x.mapped(hyperbolic_cosine, x.range.rising(f64::sinh))),
    ("tanh", |x| {
        let tanh = x.range.rising(f64::tanh);
        x.mapped(|x| x.rising(f64::tanh), (Interval::ONE - tanh.square()).meet(UNIT))
    }),
    ("abs", |x| {
        let slope = side(x.range, Interval::new(-1.0, 1.0));
        x.mapped(Interval::absolute, slope)
    }),
    ("sign", |x| {
        let value = |x: Interval| match x {
            x if x.is_empty() => x,
            x => Interval::new(signum(x.lo), signum(x.hi)),
        };
        let jumps = x.range.contains(0.0) && !x.range.is_zero();
        x.mapped(value, if jumps { Interval::ENTIRE } else { Interval::ZERO })
    }),
    ("floor", |x| {
        let floor = x.range.floor();
        x.mapped(
            Interval::floor,
            if floor.width() == 0.0 { Interval::ZERO } else { Interval::ENTIRE },
        )
    }),
    ("erf", |x| x.mapped(|x| x.rising(special::erf), bell(x.range))),
    ("erfc", |x| x.mapped(|x| x.falling(special::erfc), -bell(x.range))),
    ("lgamma", |x| {
        let digamma = x.range.rising(|x| special::polygamma(0.0, x));
        x.mapped(log_gamma, if x.range.lo > 0.0 { digamma } else { Interval::ENTIRE })
    }),
];

const TWO: &[(&str, OfTwo)] = &[
    ("^", |x, y| {
        // x^y (y x'/x + y' ln x)
        let range = x.range.power(y.range);
        let by_x = if x.change.is_zero() {
            Interval::ZERO
        } else {
            y.range * x.range.power(y.range - Interval::ONE) * x.change
        };
        let by_y = if y.change.is_zero() {
            Interval::ZERO
        } else {
            range * x.range.logarithm(f64::ln) * y.change
        };
        Tube::moving(x.left.power(y.left), x.right.power(y.right), range, by_x + by_y)
    }),
    ("atan2", |y, x| {
        let square = x.range.square() + y.range.square();
        let change = (x.range * y.change - y.range * x.change) / square;
        let jumps = y.range.crosses_cut(x.range);
        let change = if jumps { Interval::ENTIRE } else { change };
        Tube::moving(y.left.angle(x.left), y.right.angle(x.right), y.range.angle(x.range), change)
    }),
    ("hypot", |x, y| {
        let range = x.range.hypotenuse(y.range);
        let share = |leg: Interval| (leg / range).meet(Interval::new(-1.0, 1.0));
        let change = share(x.range) * x.change + share(y.range) * y.change;
        Tube::moving(x.left.hypotenuse(y.left), x.right.hypotenuse(y.right), range, change)
    }),
    ("polygamma", |n, x| {
        let order = n.range.lo;
        let whole = n.range.width() == 0.0;
        let value = |x: Interval| poly_gamma(order, x);
        let known = whole && x.range.lo > 0.0;
        let change =
            if known { poly_gamma(order + 1.0, x.range) * x.change } else { Interval::ENTIRE };
        let everything = Interval::ENTIRE;
        let bound = |x: Interval| if whole { value(x) } else { everything };
        Tube::moving(bound(x.left), bound(x.right), bound(x.range), change)
    }),
];

const UNIT: Interval = Interval::new(0.0, 1.0);

fn signum(x: f64) -> f64 {
    if x == 0.0 { 0.0 } else { x.signum() }
}

/// 1 above zero, −1 below, and `either` if x may be on either side.
fn side(x: Interval, either: Interval) -> Interval {
    if x.lo >= 0.0 {
        Interval::ONE
    } else if x.hi <= 0.0 {
        -Interval::ONE
    } else {
        either
    }
}

/// a/x for the x above zero, where logarithms are.
fn per(a: Interval, x: Interval) -> Interval {
    a / Interval::new(x.lo.max(0.0), x.hi)
}

/// √(1 − x²)
fn leg(x: Interval) -> Interval {
    (Interval::ONE - x.square()).square_root()
}

fn hyperbolic_cosine(x: Interval) -> Interval {
    x.absolute().rising(f64::cosh)
}

/// 2/√π exp(−x²)
fn bell(x: Interval) -> Interval {
    let factor = Interval::around(std::f64::consts::FRAC_2_SQRT_PI, f64::EPSILON);
    factor * (-x.square()).exponential()
}

/// Minimum of the gamma function for positive arguments, and the logarithm of its value there.
const LEAST_AT: f64 = 1.461_632_144_968_362_3;
const LEAST: f64 = -0.121_486_290_535_849_6;

fn log_gamma(x: Interval) -> Interval {
    if x.is_empty() {
        return x;
    }
    // Below zero it is not monotone between its poles.
    if x.lo <= 0.0 {
        return Interval::ENTIRE;
    }
    let ends = [x.lo, x.hi].map(special::lgamma);
    let mut bounds = Interval::new(ends[0].min(ends[1]), ends[0].max(ends[1]));
    if x.contains(LEAST_AT) {
        bounds.lo = LEAST;
    }
    Interval::around(bounds.lo, 8.0 * f64::EPSILON * (1.0 + bounds.lo.abs()))
        .hull(Interval::around(bounds.hi, 8.0 * f64::EPSILON * (1.0 + bounds.hi.abs())))
}

/// Derivatives of the digamma function alternate in sign and fall towards zero.
fn poly_gamma(order: f64, x: Interval) -> Interval {
    if x.is_empty() {
        return x;
    }
    if x.lo <= 0.0 {
        return Interval::ENTIRE;
    }
    let ends = [x.lo, x.hi].map(|x| special::polygamma(order, x));
    let error = |end: f64| 1e-13 * (1.0 + end.abs());
    Interval::around(ends[0], error(ends[0])).hull(Interval::around(ends[1], error(ends[1])))
}
