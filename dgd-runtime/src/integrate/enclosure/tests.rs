//! Enclosures contain the exact ranges, and converge like the square of the interval.

use dgd_signature::{Curve, Formulas, Operation as Op};

use super::{Enclosures, Interval, StepInterval, Tube, functions};

/// Pseudo-random numbers between 0 and 1.
fn number(seed: usize) -> f64 {
    let mixed = (seed as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15).rotate_left(29);
    (mixed.wrapping_mul(0xbf58_476d_1ce4_e5b9) >> 11) as f64 / (1_u64 << 53) as f64
}

/// Time from a to b.
fn time(a: f64, b: f64) -> Tube {
    let (left, right) = (Interval::point(a), Interval::point(b));
    Tube::moving(left, right, left.hull(right), Interval::around(b - a, f64::EPSILON * b.abs()))
}

fn line(x: Tube, from: f64, slope: f64) -> Tube {
    let still = |x| Tube::still(Interval::point(x));
    still(from).plus(x.times(still(slope)))
}

/// Arguments from where each function is defined, and its value.
type One = (&'static str, fn(f64) -> f64, [f64; 2]);

const ONE: &[One] = &[
    ("sqrt", f64::sqrt, [0.0, 9.0]),
    ("exp", f64::exp, [-5.0, 5.0]),
    ("log", f64::ln, [1e-3, 9.0]),
    ("log10", f64::log10, [1e-3, 9.0]),
    ("sin", f64::sin, [-40.0, 40.0]),
    ("cos", f64::cos, [-40.0, 40.0]),
    ("tan", f64::tan, [-1.5, 1.5]),
    ("asin", f64::asin, [-1.0, 1.0]),
    ("acos", f64::acos, [-1.0, 1.0]),
    ("atan", f64::atan, [-9.0, 9.0]),
    ("sinh", f64::sinh, [-4.0, 4.0]),
    ("cosh", f64::cosh, [-4.0, 4.0]),
    ("tanh", f64::tanh, [-4.0, 4.0]),
    ("abs", f64::abs, [-4.0, 4.0]),
    ("floor", f64::floor, [-9.0, 9.0]),
    ("erf", dgd_signature::special::erf, [-3.0, 3.0]),
    ("erfc", dgd_signature::special::erfc, [-3.0, 3.0]),
    ("lgamma", dgd_signature::special::lgamma, [0.1, 9.0]),
];

type Two = (&'static str, fn(f64, f64) -> f64, [[f64; 2]; 2]);

const TWO: &[Two] = &[
    ("^", f64::powf, [[0.0, 4.0], [-2.0, 3.0]]),
    ("^", |x, _| x.powi(3), [[-4.0, 4.0], [3.0, 3.0]]),
    ("^", |x, _| x.powi(2), [[-4.0, 4.0], [2.0, 2.0]]),
    ("atan2", f64::atan2, [[-4.0, 4.0], [-4.0, 4.0]]),
    ("hypot", f64::hypot, [[-4.0, 4.0], [-4.0, 4.0]]),
];

/// Verifies a tube against values at points, and its change against differences.
fn verify(name: &str, tube: Tube, value: impl Fn(f64) -> f64) {
    let slack = |x: f64| 1e-14 * (1.0 + x.abs());
    let mut before: Option<f64> = None;
    for k in 0..=64 {
        let part = f64::from(k) / 64.0;
        let x = value(part);
        if x.is_nan() {
            continue;
        }
        let Interval { lo, hi } = tube.range;
        assert!(lo - slack(x) <= x && x <= hi + slack(x), "{name}: {x} in {tube:?}");
        if let Some(before) = before {
            let change = (x - before) * 64.0;
            let near = 128.0 * slack(x);
            let Interval { lo, hi } = tube.change;
            assert!(lo - near <= change && change <= hi + near, "{name}: {change} in {tube:?}");
        }
        before = Some(x);
    }
}

fn between([lo, hi]: [f64; 2], part: f64) -> f64 {
    lo + part * (hi - lo)
}

#[test]
fn functions_of_one_argument_are_enclosed() {
    for (n, (name, value, domain)) in ONE.iter().enumerate() {
        let f = functions::of_one(name).unwrap();
        for seed in 0..400 {
            let [p, q] = [2 * seed, 2 * seed + 1].map(|s| number(1000 * n + s));
            // Wide and narrow.
            let width = if seed % 2 == 0 { 1.0 } else { 1e-3 };
            let (a, b) = (between(*domain, p), between(*domain, p + (q - p) * width));
            let x = line(time(0.0, 1.0), a, b - a);
            verify(name, f(x), |part| value(a + part * (b - a)));
        }
    }
}

#[test]
fn functions_of_two_arguments_are_enclosed() {
    for (n, (name, value, [first, second])) in TWO.iter().enumerate() {
        let f = functions::of_two(name).unwrap();
        for seed in 0..400 {
            let [p, q, r, s] = [0, 1, 2, 3].map(|k| number(4000 * n + 4 * seed + k));
            let width = if seed % 2 == 0 { 1.0 } else { 1e-3 };
            let x = [between(*first, p), between(*first, p + (q - p) * width)];
            let y = [between(*second, r), between(*second, r + (s - r) * width)];
            let tube = |[a, b]: [f64; 2]| line(time(0.0, 1.0), a, b - a);
            let between = |[a, b]: [f64; 2], part: f64| a + part * (b - a);
            verify(name, f(tube(x), tube(y)), |part| value(between(x, part), between(y, part)));
        }
    }
}

#[test]
fn what_is_defined_nowhere_is_empty() {
    let f = functions::of_one("sqrt").unwrap();
    assert!(f(line(time(0.0, 1.0), -3.0, 1.0)).range.is_empty());
    let f = functions::of_one("log").unwrap();
    assert!(f(line(time(0.0, 1.0), -3.0, 1.0)).range.is_empty());
}

/// cos(2π t/T) − c over a year, with T a day.
fn daily(threshold: f64) -> Enclosures {
    let operations = vec![
        Op::Time,
        Op::Constant(std::f64::consts::TAU / 86400.0),
        Op::Multiply(0, 1),
        Op::Call("cos", 2),
        Op::Constant(threshold),
        Op::Subtract(3, 4),
    ];
    Enclosures::new(&Formulas { operations: operations.into(), results: vec![5].into() })
}

fn along(of: &mut Enclosures, [a, b]: [f64; 2]) -> Tube {
    of.begin(|_| true, &[], &[], |_, _| unreachable!());
    let input = |_| unreachable!();
    of.evaluate(&StepInterval { ends: [0.0, 1.0], time: time(a, b), input: &input });
    of.value_of(0)
}

#[test]
fn a_threshold_that_is_never_reached_is_excluded_at_once() {
    assert!(along(&mut daily(1.001), [0.0, 3e7]).range.hi < 0.0);
}

#[test]
fn ranges_narrow_with_the_square_of_the_interval() {
    let mut enclosures = daily(0.8);
    let width = |of: &mut Enclosures, w: f64| {
        // The true range at a maximum is 1 − cos(π w/T).
        let tube = along(of, [86400.0 - 0.5 * w, 86400.0 + 0.5 * w]);
        tube.range.width()
    };
    let [wide, narrow] = [8000.0, 800.0].map(|w| width(&mut enclosures, w));
    assert!(narrow < 0.02 * wide, "{wide} {narrow}");
    assert!(along(&mut enclosures, [20000.0, 23000.0]).change.hi < 0.0);
}

#[test]
fn curves_are_enclosed() {
    let pieces = vec![
        [1.0, 0.0, 0.0, 0.0],
        [1.0, 0.5, -0.75, 0.25],
        [1.0, -0.25, 0.0, 0.0],
        [0.5, 0.0, 0.0, 0.0],
    ];
    let curve = Curve { knots: vec![0.0, 1.0, 3.0].into(), pieces: pieces.into() };
    for seed in 0..400 {
        let [p, q] = [2 * seed, 2 * seed + 1].map(|s| 6.0 * number(s) - 1.5);
        let x = line(time(0.0, 1.0), p, q - p);
        verify("curve", super::curve::along(&curve, x), |part| curve.value(p + part * (q - p)));
    }
}

#[test]
fn sums_that_cancel_are_zero_to_rounding() {
    // 1 − x − y with x = θ − θ³/3 and y = 1 − x.
    let operations = vec![
        Op::Constant(1.0),
        Op::Unknown(0),
        Op::Unknown(1),
        Op::Subtract(0, 1),
        Op::Subtract(3, 2),
    ];
    let formulas = Formulas { operations: operations.into(), results: vec![4].into() };
    let mut enclosures = Enclosures::new(&formulas);
    enclosures.begin(
        |_| true,
        &[],
        &[],
        |i, out| {
            let third = 1.0 / 3.0;
            let x = [[0.0, 1.0, 0.0, -third], [1.0, -1.0, 0.0, third]][i];
            out[..4].copy_from_slice(&x);
            4
        },
    );
    let input = |_| unreachable!();
    enclosures.evaluate(&StepInterval { ends: [0.0, 1.0], time: time(0.0, 1.0), input: &input });
    let tube = enclosures.value_of(0);
    assert!(tube.range.width() < 1e-13, "{tube:?}");
    assert!(tube.range.hi <= tube.left.width().min(tube.right.width()), "{tube:?}");
}
