//! Points where the algebraic equations become singular.

use dgd_runtime::{
    InputColumn, Inputs, Interpolation, Options, Problem, simulate, simulate_with_sensitivities,
};

use crate::support::parameters;
use crate::support::problems::{Tank, TankStacked};

const TOLERANCES: [f64; 5] = [1e-4, 1e-5, 1e-6, 1e-7, 1e-8];

fn options(tolerance: f64) -> Options {
    Options { rtol: tolerance, atol: tolerance, max_steps: 3000, ..Options::default() }
}

fn times() -> Vec<f64> {
    (0..=240).map(|k| 0.25 * f64::from(k)).collect()
}

#[test]
fn the_states_arrive_and_stay_at_rest() {
    let system = TankStacked::of::<Tank>();
    let p = parameters::<Tank>();
    let inputs = Inputs::constant(&[0.0]);
    let problem = Problem { system: &system, p: &p, inputs: &inputs, start: &[] };
    let times = times();
    for tolerance in TOLERANCES {
        let solution = simulate(&problem, &times, &options(tolerance)).unwrap();
        // A small multiple of the tolerance of h, of size 5.
        let error = 20.0 * 5.0 * tolerance;
        for (k, &t) in times.iter().enumerate() {
            let [h, q] = Tank::solution(t, &p);
            assert!((solution.y(k)[0] - h).abs() <= error, "h at {t}, {tolerance:e}");
            // q² = a (5 − h) / b: an error of h affects q by its square root.
            let error = (p[0] / p[1] * error).sqrt();
            assert!((solution.y(k)[1] - q).abs() <= error, "q at {t}, {tolerance:e}");
            if t > Tank::arrival(&p) + 1.0 {
                assert!(solution.y(k)[1].abs() <= tolerance, "rest at {t}, {tolerance:e}");
            }
        }
    }
}

#[test]
fn sensitivities_end_where_the_slope_does() {
    let system = TankStacked::of::<Tank>();
    let p = parameters::<Tank>();
    let inputs = Inputs::constant(&[0.0]);
    let problem = Problem { system: &system, p: &p, inputs: &inputs, start: &[] };
    let times = times();
    let arrival = Tank::arrival(&p);
    for tolerance in TOLERANCES {
        let solution = simulate_with_sensitivities(&problem, &times, &options(tolerance)).unwrap();
        let [undefined] = &solution.undefined[..] else {
            panic!("one stretch is undefined: {:?}", solution.undefined);
        };
        assert_eq!(undefined.equation, "of_q");
        assert!((undefined.from - arrival).abs() < 0.05 && undefined.until == 60.0);
        for (k, &t) in times.iter().enumerate() {
            let s = solution.s(k);
            if t > undefined.from {
                assert!(s.iter().all(|s| s.is_nan()), "{t}");
            } else {
                assert!(s.iter().all(|s| s.is_finite()), "{t}");
            }
            if t < arrival - 1.0 {
                for (s, exact) in s.iter().zip(Tank::sensitivity_to_a(t, &p)) {
                    assert!((s - exact).abs() <= 100.0 * tolerance, "{t}, {tolerance:e}");
                }
            }
        }
    }
}

#[test]
fn undefined_sensitivities_stay_so_when_the_states_leave() {
    let system = TankStacked::of::<Tank>();
    let p = parameters::<Tank>();
    let column = InputColumn { name: "u", interpolation: Interpolation::Hold, values: &[0.0, 0.1] };
    let inputs = Inputs::recorded(&[0.0, 20.0], &[column]).unwrap();
    let problem = Problem { system: &system, p: &p, inputs: &inputs, start: &[] };
    let times = times();
    let solution = simulate_with_sensitivities(&problem, &times, &options(1e-6)).unwrap();
    assert!(solution.s(240).iter().all(|s| s.is_nan()));
    // In the end inflow equals outflow: q = A u, h = 5 − b q² / a.
    let q = p[2] * 0.1;
    assert!((solution.y(240)[1] - q).abs() < 1e-4);
    assert!((solution.y(240)[0] - (5.0 - p[1] * q * q / p[0])).abs() < 1e-4);
}

#[test]
fn a_start_at_rest_is_undefined_from_the_start() {
    let system = TankStacked::of::<Tank>();
    let p = parameters::<Tank>();
    let inputs = Inputs::constant(&[0.0]);
    let problem = Problem { system: &system, p: &p, inputs: &inputs, start: &[(0, 5.0)] };
    let solution = simulate_with_sensitivities(&problem, &[0.0, 1.0, 2.0], &options(1e-6)).unwrap();
    assert_eq!(solution.y, [5.0, 0.0, 5.0, 0.0, 5.0, 0.0]);
    assert!(solution.s.iter().all(|s| s.is_nan()));
    assert_eq!(solution.undefined[0].from, 0.0);
}
