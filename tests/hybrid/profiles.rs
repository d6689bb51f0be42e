//! Tables that time or a clock drives: every knot is a stop, whatever else lets a step go how far; and tables with
//! steps. Volumes are integrals of the curves, piece by piece.

use dgd_compiler::expr::curve::Curve;
use dgd_compiler::expr::curve::interpolate::through;
use dgd_compiler::syntax::ast::{TableExtrapolation, TableInterpolation};
use dgd_execute::InterpretedSystem;
use dgd_runtime::{
    Failure, Inputs, IntegrateError, Options, Problem, Solution, find_method, simulate,
    simulate_with_sensitivities,
};

use crate::exact::{assert_close, assert_slopes_within, options, parameters, run, slopes, value};
use crate::inline::system;

const METHODS: [&str; 6] = ["rodas5p", "rodas4", "kencarp4", "bdf", "tsit5", "taylor"];

/// A peak of two seconds, unlike on its two sides.
const PEAK: [(f64, f64); 5] = [(0.0, 0.0), (499.0, 0.0), (500.0, 1.0), (501.0, 0.0), (2000.0, 0.0)];
/// A rectangle, then a ramp from a step.
const STEPS: [(f64, f64); 8] = [
    (0.0, 0.2),
    (300.0, 0.2),
    (300.0, 1.0),
    (301.0, 1.0),
    (301.0, 0.2),
    (600.0, 0.5),
    (600.0, -0.4),
    (700.0, 0.0),
];

fn with(method: &str, rtol: f64) -> Options {
    let Ok(method) = find_method(method) else { panic!("{method} is a method") };
    Options { method, rtol, atol: rtol, ..Options::default() }
}

fn run_by(system: &InterpretedSystem, times: &[f64], given: &Options) -> Result<Solution, Failure> {
    let (p, inputs) = (parameters(system), Inputs::none());
    simulate(&Problem { system, p: &p, inputs: &inputs, start: &[] }, times, given)
}

fn written(points: &[(f64, f64)]) -> String {
    points.iter().map(|(x, y)| format!("({x}, {y})")).collect::<Vec<_>>().join(", ")
}

fn curve(points: &[(f64, f64)], shape: TableInterpolation) -> Curve {
    let (x, y): (Vec<f64>, Vec<f64>) = points.iter().copied().unzip();
    through(shape, TableExtrapolation::Hold, &x, &y)
}

/// ∫ from 0 to b, of cubic pieces.
fn integral(curve: &Curve, b: f64) -> f64 {
    let primitive = |piece: usize, x: f64| {
        let d = x - curve.knots[piece.saturating_sub(1)];
        let [c0, c1, c2, c3] = curve.pieces[piece];
        d * (c0 + d * (c1 / 2.0 + d * (c2 / 3.0 + d * c3 / 4.0)))
    };
    let (low, high, sign) = if b < 0.0 { (b, 0.0, -1.0) } else { (0.0, b, 1.0) };
    let n = curve.pieces.len();
    let sum: f64 = (0..n)
        .map(|piece| {
            let from = if piece == 0 { f64::NEG_INFINITY } else { curve.knots[piece - 1] };
            let to = curve.knots.get(piece).copied().unwrap_or(f64::INFINITY);
            let (from, to) = (low.max(from), high.min(to));
            if from < to { primitive(piece, to) - primitive(piece, from) } else { 0.0 }
        })
        .sum();
    sign * sum
}

/// V' = flow(argument), the table in this unit of time.
fn tank(
    points: &[(f64, f64)],
    unit: &str,
    shape: &str,
    declared: &str,
    argument: &str,
) -> InterpretedSystem {
    system(&format!(
        "model tank\n{declared}\ntable flow(t [{unit}]) [l/s] = {} {shape}, beyond hold\n\
         state V [l] = 0\nequation V: der(V) = flow({argument})\noutput q [l/s] = flow({argument})",
        written(points)
    ))
}

fn volume(system: &InterpretedSystem, solution: &Solution, k: usize) -> f64 {
    value(system, solution, "V", k) * 1e3
}

#[test]
fn no_method_loses_a_peak() {
    let shapes = [
        ("linear", TableInterpolation::Linear),
        ("pchip", TableInterpolation::Pchip),
        ("natural", TableInterpolation::Natural),
    ];
    for (unit, seconds) in [("s", 1.0), ("min", 60.0), ("h", 3600.0)] {
        for (text, shape) in shapes {
            for points in [&PEAK[..], &STEPS[..]] {
                let system = tank(points, unit, text, "", "time");
                let curve = curve(points, shape);
                let times = [0.0, 0.2505, 0.25075, 0.4, 0.9].map(|part| part * 2000.0 * seconds);
                for method in METHODS {
                    let solution = run_by(&system, &times, &with(method, 1e-6)).expect(method);
                    for (k, t) in times.iter().enumerate() {
                        let expected = seconds * integral(&curve, t / seconds);
                        let found = volume(&system, &solution, k);
                        let allowed = 1e-5 * expected.abs().max(seconds);
                        assert!(
                            (found - expected).abs() <= allowed,
                            "{method} {text} {unit} at {t}: {found} {expected}"
                        );
                    }
                }
            }
        }
    }
}

#[test]
fn peaks_at_arguments_that_time_moves() {
    let declared = "parameter t_0 [s] = 37.3\nparameter w = 1.7\nparameter P [s] = 700\nstate tau [s] = -5\n\
                    equation tau: der(tau) = 1";
    let until = 1900.0;
    for (points, shape, text) in [
        (&PEAK[..], TableInterpolation::Linear, "linear"),
        (&PEAK[..], TableInterpolation::Pchip, "pchip"),
        (&STEPS[..], TableInterpolation::Linear, "linear"),
        (&STEPS[..], TableInterpolation::Natural, "natural"),
    ] {
        let curve = curve(points, shape);
        let of = |x: f64| integral(&curve, x);
        let cases = [
            ("time - t_0", of(until - 37.3) - of(-37.3)),
            ("w*time", of(1.7 * until) / 1.7),
            ("(time - t_0)/w", 1.7 * (of((until - 37.3) / 1.7) - of(-37.3 / 1.7))),
            ("P - time/2", 2.0 * (of(700.0) - of(700.0 - until / 2.0))),
            ("mod(time, P)", 2.0 * of(700.0) + of(500.0)),
            (
                "mod(time - t_0, 700 [s])",
                of(700.0) - of(700.0 - 37.3) + 2.0 * of(700.0) + of(462.7),
            ),
            (
                "if time < P then time else P + 3*(time - P)",
                of(700.0) + (of(4300.0) - of(700.0)) / 3.0,
            ),
            ("tau", of(until - 5.0) - of(-5.0)),
        ];
        for (argument, expected) in cases {
            let system = tank(points, "s", text, declared, argument);
            for method in METHODS {
                let solution = run_by(&system, &[0.0, until], &with(method, 1e-7)).expect(method);
                let found = volume(&system, &solution, 1);
                assert!(
                    (found - expected).abs() <= 2e-5 * expected.abs().max(1.0),
                    "{method} {text} {argument}: {found} {expected}"
                );
            }
        }
    }
}

/// V(t) = F(t − t₀) − F(−t₀), so that dV/dt₀ = f(−t₀) − f(t − t₀), also across knots and steps.
#[test]
fn derivatives_to_a_shift_are_exact() {
    for (points, shape, text) in [
        (&PEAK[..], TableInterpolation::Pchip, "pchip"),
        (&PEAK[..], TableInterpolation::Linear, "linear"),
        (&STEPS[..], TableInterpolation::Linear, "linear"),
        (&STEPS[..], TableInterpolation::Natural, "natural"),
    ] {
        let curve = curve(points, shape);
        let system = tank(points, "s", text, "parameter t_0 [s] = 12.5", "time - t_0");
        let times = [0.0, 300.0, 313.0, 512.25, 620.0, 1500.0];
        let solution = run(&system, &times);
        for (k, t) in times.iter().enumerate().skip(1) {
            let found = slopes(&system, &solution, "V", k)[0] * 1e3;
            let expected = curve.value(-12.5) - curve.value(t - 12.5);
            assert!((found - expected).abs() <= 1e-8, "{text} at {t}: {found} {expected}");
        }
        // What follows is nonlinear.
        let text = format!(
            "model decay\nparameter t_0 [s] = 12.5\nparameter P [s] = 431\ntable k(t [s]) [1/h] = {} {text}, beyond hold\n\
             state x = 1\nequation x: der(x) = -x*(1 + x)*k(time - t_0)\n\
             state z = 1\nequation z: der(z) = x*k(time) - z*k(2*mod(time, P))",
            written(points)
        );
        let decay = crate::inline::system(&text);
        assert_slopes_within(&decay, &Inputs::none(), &[0.0, 640.0], 1e-5, [0.1, 1e-9]);
        assert_slopes_within(&decay, &Inputs::none(), &[0.0, 1900.0], 1e-5, [0.1, 1e-9]);
    }
}

#[test]
fn from_a_step_on_the_later_point_holds() {
    let text = "model step\ntable f(x) = (0, 1), (2, 1), (2, 5), (4, 6) linear, beyond hold\n\
                state x = 0\nequation x: der(x) = f(time/1 [s])/1 [s]\noutput y = f(time/1 [s])\noutput z = f(2)";
    let system = system(text);
    let (p, inputs) = (parameters(&system), Inputs::none());
    let problem = Problem { system: &system, p: &p, inputs: &inputs, start: &[] };
    let solution = simulate(&problem, &[0.0, 2.0, 3.0], &options()).expect("a run");
    let observed = dgd_runtime::observe(&problem, &solution);
    assert_eq!([0, 1, 2].map(|k| observed.w(k)[0]), [1.0, 5.0, 5.5]);
    assert_eq!(observed.w(0)[1], 5.0);
    assert_close(&[value(&system, &solution, "x", 2)], &[2.0 + 5.25], 1e-10);
}

/// x' = f(x) with f from 1 to 3 at x = 1: x = 1 + 3 (t − 1 + x₀).
#[test]
fn a_state_crosses_the_step_of_a_table() {
    for shape in ["linear", "pchip", "natural"] {
        let system = system(&format!(
            "model crossing\nparameter x_0 = 0.25\nparameter high = 3\n\
             table f(x) = (0, 1), (1, 1), (1, 3), (9, 3) {shape}\n\
             state x = x_0\nequation x: der(x) = f(x)/1 [s]"
        ));
        for method in METHODS {
            let solution = run_by(&system, &[0.0, 2.0], &with(method, 1e-8)).expect(method);
            let found = value(&system, &solution, "x", 1);
            assert!((found - 4.75).abs() < 1e-6, "{method} {shape}: {found}");
        }
        let solution = run(&system, &[0.0, 2.0]);
        assert_close(&slopes(&system, &solution, "x", 1), &[3.0, 0.0], 1e-9);
    }
    // Values that are fitted, on both sides.
    let fitted = system(
        "model fitted\nparameter x_0 = 0.25\nparameter low = 1\nparameter high = 3\n\
         table f(x) = (0, low), (1, low), (1, high), (9, high) linear\n\
         state x = x_0\nequation x: der(x) = f(x)/1 [s]",
    );
    // x = 1 + h (t − (1 − x₀)/l)
    let solution = run(&fitted, &[0.0, 2.0]);
    assert_close(&slopes(&fitted, &solution, "x", 1), &[3.0, 2.25, 1.25], 1e-9);
}

#[test]
fn a_run_ends_where_time_leaves_a_profile() {
    let text = "model short\nparameter t_0 [s] = 3\ntable f(t [s]) = (0, 1), (5, 1), (5, 2), (10, 2)\nstate x = 0\n\
                equation x: der(x) = f(time + t_0)/1 [s]";
    let system = system(text);
    for method in METHODS {
        let given = with(method, 1e-8);
        let solution = run_by(&system, &[0.0, 7.0], &given).expect(method);
        assert!((value(&system, &solution, "x", 1) - 12.0).abs() < 1e-6, "{method}");
        let left = run_by(&system, &[0.0, 7.1], &given).expect_err(method).error;
        let IntegrateError::TableLeft { t, what } = left else { panic!("{method}: {left:?}") };
        assert!((t - 7.0).abs() < 1e-4, "{method}: {t}");
        assert_eq!(what, "`t` leaves the table `f`, which goes from 0 to 10 s");
    }
}

#[test]
fn a_grid_of_time_and_a_state_has_its_knots() {
    // Bilinear in time and x: a peak between 499 s and 501 s, in proportion to x = 1 + time/1000 s.
    let system = system(
        "model grid\ntable f(t [s], x) = (0, 0, 0), (0, 10, 0), (499, 0, 0), (499, 10, 0), (500, 0, 0), (500, 10, 10), \
         (501, 0, 0), (501, 10, 0), (2000, 0, 0), (2000, 10, 0)\n\
         state x = 1\nequation x: der(x) = 1/1000 [s]\nstate V = 0\nequation V: der(V) = f(time, x)/1 [s]",
    );
    for method in METHODS {
        let solution = run_by(&system, &[0.0, 2000.0], &with(method, 1e-6)).expect(method);
        // ∫ hat(t) x(t) dt, the hat even about 500 s.
        let found = value(&system, &solution, "V", 1);
        assert!((found - 1.5).abs() < 1e-4, "{method}: {found}");
    }
}

/// A constraint that has to be differentiated reads a smooth profile, and is stopped at its knots all the same.
#[test]
fn a_prescribed_motion_is_differentiated() {
    let text = "model driven\ntable path(t [s]) [m] = (0, 0), (1, 0.1), (2, 0.5), (3, 0.5), (10, 0.2) natural\n\
                state x [m] = 0\nstate v [m/s] = 0\nunknown F [N] = 0\n\
                equation x: der(x) = v\nequation v: 2 [kg]*der(v) = F\nequation path: x = path(time)\n\
                state J [N*s] = 0\nequation J: der(J) = F";
    let system = system(text);
    let solution = run(&system, &[0.0, 1.5, 5.0]);
    // J is 2 kg times what v has changed by.
    let points = [(0.0, 0.0), (1.0, 0.1), (2.0, 0.5), (3.0, 0.5), (10.0, 0.2)];
    let speed = curve(&points, TableInterpolation::Natural).derivative();
    for (k, t) in [(1, 1.5), (2, 5.0)] {
        let expected = 2.0 * (speed.value(t) - speed.value(0.0));
        assert_close(&[value(&system, &solution, "J", k)], &[expected], 1e-7);
    }
}

#[test]
fn sensitivities_do_not_change_the_run() {
    let system = tank(&STEPS, "min", "pchip", "parameter t_0 [min] = 7", "time - t_0");
    let (p, inputs) = (parameters(&system), Inputs::none());
    let problem = Problem { system: &system, p: &p, inputs: &inputs, start: &[] };
    let times = [0.0, 40_000.0];
    let given = with("rodas5p", 1e-9);
    let alone = simulate(&problem, &times, &given).expect("a run");
    let both = simulate_with_sensitivities(&problem, &times, &given).expect("a run");
    assert_close(alone.y(1), both.y(1), 1e-8);
}
