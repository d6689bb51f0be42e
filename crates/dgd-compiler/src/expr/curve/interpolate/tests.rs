//! Reference values from SciPy 1.17.1: `PchipInterpolator`, which has the slopes of Fritsch and Butland, and
//! `CubicSpline` with natural ends. `tests/reference/make_curves.py` generates more.

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
            2.328_500_000_000_000_5,
            1.972_000_000_000_000_2,
            1.0,
            1.0,
            1.703_999_999_999_996,
            2.530_428_249_436_514,
            -1.474_139_744_552_970_5,
        ],
        [
            0.735_000_000_000_000_1,
            -4.32,
            0.0,
            0.0,
            11.519_999_999_999_985,
            -1.126_972_201_352_366_6,
            -5.065_063_861_758_078_5,
        ],
        [
            -2.1,
            -7.200_000_000_000_006,
            0.0,
            0.0,
            38.400_000_000_000_546,
            -1.803_155_522_163_786_7,
            -3.822_689_706_987_228_3,
        ],
    ];
    check(&through(TableInterpolation::Pchip, TableExtrapolation::Refuse, &X, &Y), expected);
}

#[test]
fn the_natural_spline_is_that_of_scipy() {
    let expected = [
        [
            2.466_155_234_711_345,
            2.015_504_264_607_22,
            -0.773_594_635_169_245_6,
            0.281_251_716_824_064_25,
            1.798_397_428_298_938,
            5.656_792_520_328_851,
            -1.350_979_330_501_106_2,
        ],
        [
            1.345_396_781_462_572,
            -2.940_278_229_894_670_6,
            -3.303_123_467_524_301_3,
            6.733_748_816_891_152,
            8.190_045_880_254_042,
            -2.320_799_522_571_852_5,
            -6.477_834_566_880_826,
        ],
        [
            -2.084_540_009_085_794_4,
            -4.292_759_945_485_235,
            1.618_994_726_027_192_4,
            8.946_133_994_410_127,
            1.516_261_466_302_869_3,
            -5.567_457_648_628_091,
            -0.371_163_843_241_872,
        ],
    ];
    check(&through(TableInterpolation::Natural, TableExtrapolation::Refuse, &X, &Y), expected);
}

#[test]
fn slopes_at_the_ends_of_pchip_make_no_turn() {
    let near = |a: f64, b: f64| (a - b).abs() < 1e-14;
    let rising = through(
        TableInterpolation::Pchip,
        TableExtrapolation::Refuse,
        &[0.0, 1.0, 3.0],
        &[0.0, 1.0, 5.0],
    );
    assert!(
        near(rising.value(0.5), 0.422_619_047_619_047_6)
            && near(rising.value(2.0), 2.654_761_904_761_905)
    );
    let turning = through(
        TableInterpolation::Pchip,
        TableExtrapolation::Refuse,
        &[0.0, 1.0, 3.0],
        &[0.0, 1.0, -5.0],
    );
    assert!(near(turning.value(0.5), 0.791_666_666_666_666_7));
    assert!(near(turning.derivative().value(0.0), 2.333_333_333_333_333_5));
    let two =
        through(TableInterpolation::Pchip, TableExtrapolation::Refuse, &[0.0, 2.0], &[1.0, 5.0]);
    assert_eq!([two.value(0.5), two.value(3.0)], [2.0, 7.0]);
}

#[test]
fn beyond_the_ends_a_curve_keeps_its_value_or_its_slope() {
    for shape in
        [TableInterpolation::Linear, TableInterpolation::Pchip, TableInterpolation::Natural]
    {
        let held = through(shape, TableExtrapolation::Hold, &X, &Y);
        assert_eq!([held.value(-3.0), held.value(9.0)], [2.0, -2.0]);
        let extended = through(shape, TableExtrapolation::Extend, &X, &Y);
        let slope = extended.derivative();
        for (end, outside) in [(0.0, -3.0), (7.0, 9.0)] {
            let line = extended.value(end) + slope.value(end) * (outside - end);
            assert!((extended.value(outside) - line).abs() < 1e-12);
            // The slope equals that of the table just inside.
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
