//! Numbers of SciPy 1.17.1: `PchipInterpolator`, which has the slopes of Fritsch and Butland, and `CubicSpline` with
//! natural ends. `tests/reference/make_curves.py` makes more of them.

use super::*;

const X: [f64; 6] = [0.0, 1.0, 1.5, 4.0, 4.25, 7.0];
const Y: [f64; 6] = [2.0, 2.5, 1.0, 1.0, 3.0, -2.0];
const AT: [f64; 7] = [0.3, 1.2, 2.0, 3.9, 4.1, 5.5, 6.9];

fn check(curve: &Curve, expected: [[f64; 7]; 3]) {
    let mut derivative = curve.clone();
    for expected in expected {
        for (x, expected) in AT.into_iter().zip(expected) {
            let found = derivative.value(x);
            assert!((found - expected).abs() <= 1e-12 * expected.abs().max(1.0), "{x}: {found}");
        }
        derivative = derivative.derivative();
    }
}

#[test]
fn pchip_is_that_of_scipy() {
    let expected = [
        [
            2.3285000000000005,
            1.9720000000000002,
            1.0,
            1.0,
            1.703999999999996,
            2.530428249436514,
            -1.4741397445529705,
        ],
        [
            0.7350000000000001,
            -4.32,
            0.0,
            0.0,
            11.519999999999985,
            -1.1269722013523666,
            -5.0650638617580785,
        ],
        [
            -2.1,
            -7.200000000000006,
            0.0,
            0.0,
            38.400000000000546,
            -1.8031555221637867,
            -3.8226897069872283,
        ],
    ];
    check(&through(Shape::Pchip, Beyond::Refuse, &X, &Y), expected);
}

#[test]
fn the_natural_spline_is_that_of_scipy() {
    let expected = [
        [
            2.466155234711345,
            2.01550426460722,
            -0.7735946351692456,
            0.28125171682406425,
            1.798397428298938,
            5.656792520328851,
            -1.3509793305011062,
        ],
        [
            1.345396781462572,
            -2.9402782298946706,
            -3.3031234675243013,
            6.733748816891152,
            8.190045880254042,
            -2.3207995225718525,
            -6.477834566880826,
        ],
        [
            -2.0845400090857944,
            -4.292759945485235,
            1.6189947260271924,
            8.946133994410127,
            1.5162614663028693,
            -5.567457648628091,
            -0.371163843241872,
        ],
    ];
    check(&through(Shape::Natural, Beyond::Refuse, &X, &Y), expected);
}

#[test]
fn slopes_at_the_ends_of_pchip_make_no_turn() {
    let near = |a: f64, b: f64| (a - b).abs() < 1e-14;
    let rising = through(Shape::Pchip, Beyond::Refuse, &[0.0, 1.0, 3.0], &[0.0, 1.0, 5.0]);
    assert!(
        near(rising.value(0.5), 0.4226190476190476) && near(rising.value(2.0), 2.654761904761905)
    );
    let turning = through(Shape::Pchip, Beyond::Refuse, &[0.0, 1.0, 3.0], &[0.0, 1.0, -5.0]);
    assert!(near(turning.value(0.5), 0.7916666666666667));
    assert!(near(turning.derivative().value(0.0), 2.3333333333333335));
    let two = through(Shape::Pchip, Beyond::Refuse, &[0.0, 2.0], &[1.0, 5.0]);
    assert_eq!([two.value(0.5), two.value(3.0)], [2.0, 7.0]);
}

#[test]
fn beyond_the_ends_a_curve_keeps_its_value_or_its_slope() {
    for shape in [Shape::Linear, Shape::Pchip, Shape::Natural] {
        let held = through(shape, Beyond::Hold, &X, &Y);
        assert_eq!([held.value(-3.0), held.value(9.0)], [2.0, -2.0]);
        let extended = through(shape, Beyond::Extend, &X, &Y);
        let slope = extended.derivative();
        for (end, outside) in [(0.0, -3.0), (7.0, 9.0)] {
            let line = extended.value(end) + slope.value(end) * (outside - end);
            assert!((extended.value(outside) - line).abs() < 1e-12);
            // The slope is that of the table just inside.
            let inside = end + if end == 0.0 { 1e-7 } else { -1e-7 };
            assert!((slope.value(inside) - slope.value(end)).abs() < 1e-5);
        }
    }
}

#[test]
fn a_position_is_whole_at_each_knot() {
    let line = position(&[1.0, 2.0, 10.0], 20.0);
    assert_eq!([1.0, 2.0, 10.0, 30.0, -19.0].map(|x| line.value(x)), [0.0, 1.0, 2.0, 3.0, -1.0]);
    assert_eq!(line.value(1.5), 0.5);
}
