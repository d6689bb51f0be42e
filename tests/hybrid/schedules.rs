//! Conditions that time moves while nothing else limits the step: schedules, shutters, ripples, tables that shake.
//! Against closed forms, and quadratures between crossings that are found by brute force.

use std::f64::consts::{PI, TAU};

use dgd_compiler::expr::intrinsics::{INTRINSICS, IntrinsicDefinition};
use dgd_execute::InterpretedSystem;
use dgd_runtime::{
    InputColumn, Inputs, IntegrateError, Interpolation, METHODS, Options, Problem, Solution,
    UndefinedCause, encloses, simulate, simulate_with_sensitivities,
};

use crate::exact::{assert_close, options, parameters, position, run, slopes, value};
use crate::inline::system;

/// Locations are exact to rounding of the time, and between them rates are constants.
const CLOSE: f64 = 1e-9;

/// Runs a model with every method that takes it, at loose tolerances: nothing but its crossings limits the step.
fn with_all_methods(
    system: &InterpretedSystem,
    inputs: &Inputs,
    times: &[f64],
    check: impl Fn(&str, &Solution),
) {
    with_all_methods_to(1e-6, system, inputs, times, check);
}

/// The same to a tolerance.
fn with_all_methods_to(
    rtol: f64,
    system: &InterpretedSystem,
    inputs: &Inputs,
    times: &[f64],
    check: impl Fn(&str, &Solution),
) {
    let p = parameters(system);
    let mut made = 0;
    for method in METHODS {
        let options = Options { method, rtol, max_steps: 10_000_000, ..Options::default() };
        let problem = Problem { system, p: &p, inputs, start: &[] };
        match simulate(&problem, times, &options) {
            Ok(solution) => check(method.name, &solution),
            Err(failure) if method.name == "taylor" => {
                assert!(failure.error.to_string().contains("taylor"), "{}", failure.error);
                continue;
            }
            Err(failure) => panic!("{}: {}", method.name, failure.error),
        }
        made += 1;
    }
    assert!(made >= 5);
}

#[track_caller]
fn assert_near(name: &str, found: f64, expected: f64, close: f64) {
    let near = close * expected.abs().max(1.0);
    assert!((found - expected).abs() <= near, "{name}: {found} is not {expected}");
}

/// The time during which f is above zero from a to b, between crossings that `n` samples part.
fn time_above(f: impl Fn(f64) -> f64, a: f64, b: f64, n: usize) -> f64 {
    crossings(&f, a, b, n)
        .windows(2)
        .filter(|pair| f(0.5 * (pair[0] + pair[1])) > 0.0)
        .map(|pair| pair[1] - pair[0])
        .sum()
}

/// a, the zeros between, and b.
fn crossings(f: &impl Fn(f64) -> f64, a: f64, b: f64, n: usize) -> Vec<f64> {
    let at = |k: usize| a + (b - a) * k as f64 / n as f64;
    let mut all = vec![a];
    for k in 0..n {
        let (mut low, mut high) = (at(k), at(k + 1));
        if (f(low) > 0.0) == (f(high) > 0.0) {
            continue;
        }
        for _ in 0..100 {
            let middle = 0.5 * (low + high);
            if (f(low) > 0.0) == (f(middle) > 0.0) { low = middle } else { high = middle }
        }
        all.push(high);
    }
    all.push(b);
    all
}

const HEATER: &str = "model sched
parameter C [MJ/K] = 1
parameter level = 0.8
state T [°C] = 5
state E [kWh] = 0
let on = if cos(2*pi*(time - 15 [h])/1 [d]) > level then 1 else 0
equation T: C*der(T) = 2 [kW]*on - 100 [W/K]*(T - 5 [°C])
equation E: der(E) = 2 [kW]*on
";

/// Energy and excess temperature of [`HEATER`] at the end of a day: on around 15 h for acos(level)/π of the day.
fn heated(days: u32, level: f64) -> [f64; 2] {
    let day = 86400.0;
    let half = level.acos() / TAU * day;
    let (rate, most) = (100.0 / 1e6, 2000.0 / 100.0);
    let mut excess = 0.0;
    for _ in 0..days {
        let until =
            |excess: f64, target: f64, t: f64| target + (excess - target) * (-rate * t).exp();
        excess = until(excess, 0.0, 15.0 * 3600.0 - half);
        excess = until(excess, most, 2.0 * half);
        excess = until(excess, 0.0, 9.0 * 3600.0 - half);
    }
    [2000.0 * 2.0 * half * f64::from(days), excess]
}

#[test]
fn a_heater_that_follows_a_daily_cosine_runs_all_year() {
    let system = system(HEATER);
    let [energy, excess] = heated(365, 0.8);
    assert_near("kWh", energy / 3.6e6, 3588.67, 2e-6);
    with_all_methods(&system, &Inputs::none(), &[0.0, 365.0 * 86400.0], |method, solution| {
        assert_near(method, value(&system, solution, "E", 1), energy, CLOSE);
        assert_near(method, value(&system, solution, "T", 1), 278.15 + excess, 1e-5);
    });
}

#[test]
fn what_a_heater_has_used_does_not_depend_on_the_times_that_are_asked_for() {
    let system = system(HEATER);
    let p = parameters(&system);
    let problem = Problem { system: &system, p: &p, inputs: &Inputs::none(), start: &[] };
    for every in [3600.0, 86400.0, 777_777.0] {
        let until = 30.0 * 86400.0;
        let times = (0..).map(|k| every * f64::from(k)).take_while(|t| *t < until);
        let times: Vec<f64> = times.chain([until]).collect();
        let solution = simulate(&problem, &times, &Options::default()).expect("a solution");
        let found = value(&system, &solution, "E", times.len() - 1);
        assert_near("E", found, heated(30, 0.8)[0], CLOSE);
    }
}

#[test]
fn the_heater_moves_with_its_level() {
    let system = system(HEATER);
    let solution = run(&system, &[0.0, 20.0 * 86400.0]);
    assert!(solution.undefined.is_empty(), "{:?}", solution.undefined);
    let by_level = |which: usize| {
        let h = 1e-5;
        (heated(20, 0.8 + h)[which] - heated(20, 0.8 - h)[which]) / (2.0 * h)
    };
    assert_close(&slopes(&system, &solution, "E", 1)[1..], &[by_level(0)], 1e-7);
    assert_close(&slopes(&system, &solution, "T", 1)[1..], &[by_level(1)], 1e-7);
}

/// A ripple of this period, and a count of its rises.
fn ripple(period: &str, level: f64) -> String {
    format!(
        "model ripple
         parameter lev = {level}
         held n = 0
         state E [s] = 0
         let s = sin(2*pi*time/{period})
         equation E: der(E) = if s > lev then 1 else 0
         when s rises above lev {{ reset n = n + 1 }}"
    )
}

#[test]
fn ripples_of_any_period_are_counted_and_added_up() {
    for (period, seconds) in [("1 [s]", 1.0), ("20 [ms]", 0.02), ("1 [d]", 86400.0)] {
        for level in [0.9, 0.5, -0.3, 0.9999] {
            let system = system(&ripple(period, level));
            let share = 0.5 - level.asin() / PI;
            let n = 200.0;
            with_all_methods(&system, &Inputs::none(), &[0.0, n * seconds], |method, solution| {
                let name = format!("{method}, {period}, {level}");
                assert_near(&name, value(&system, solution, "E", 1) / seconds, n * share, 1e-8);
                assert_near(&name, value(&system, solution, "n", 1), n, 0.0);
            });
        }
    }
}

#[test]
fn ripples_move_with_their_level() {
    let system = system(&ripple("1 [s]", 0.9));
    let solution = run(&system, &[0.0, 50.25]);
    // Fifty windows of 1/2 − asin(l)/π, and half of one.
    let slope = -50.5 / (PI * (1.0_f64 - 0.81).sqrt());
    assert_close(&slopes(&system, &solution, "E", 1), &[slope], CLOSE);
}

#[test]
fn runs_that_begin_late_or_early_find_the_same_ripples() {
    let system = system(&ripple("1 [s]", 0.9));
    let share = 0.5 - 0.9_f64.asin() / PI;
    for from in [-1000.0, 1e6] {
        with_all_methods(&system, &Inputs::none(), &[from, from + 100.0], |method, solution| {
            assert_near(method, value(&system, solution, "E", 1), 100.0 * share, 1e-7);
            assert_near(method, value(&system, solution, "n", 1), 100.0, 0.0);
        });
    }
}

/// A model whose E is the time during which a condition holds.
fn open(condition: &str) -> InterpretedSystem {
    system(&format!(
        "model shutter
         table profile(t [s]) = (0, 0), (100, 1), (101, 5), (102, 1), (400, 0) linear, beyond hold
         table smooth(t [s]) = (0, 0), (150, 1), (151, 5), (152, 1), (400, 0) pchip, beyond hold
         input u linear
         state E [s] = 0
         equation E: der(E) = if {condition} then 1 else 0"
    ))
}

fn ramps() -> (Inputs, impl Fn(f64) -> f64) {
    let times = [0.0, 90.0, 200.0, 1000.0];
    let values = [0.0, 40.0, -10.0, 70.0];
    let column = InputColumn { name: "u", interpolation: Interpolation::Linear, values: &values };
    let inputs = Inputs::recorded(&times, &[column]).expect("inputs");
    let u = move |t: f64| {
        let k = times[1..3].iter().filter(|begin| **begin <= t).count();
        values[k] + (values[k + 1] - values[k]) * (t - times[k]) / (times[k + 1] - times[k])
    };
    (inputs, u)
}

/// A function of time that is positive where a condition holds.
type Excess<'a> = Box<dyn Fn(f64) -> f64 + 'a>;

#[test]
fn shutters_are_open_as_long_as_their_conditions_hold() {
    let s = |w: f64| move |t: f64| (w * t).sin();
    let (inputs, u) = ramps();
    let (u, other) = (&u, ramps().1);
    let profile = |t: f64| match t {
        t if t < 100.0 => t / 100.0,
        t if t < 101.0 => 1.0 + 4.0 * (t - 100.0),
        t if t < 102.0 => 5.0 - 4.0 * (t - 101.0),
        t => 1.0 - (t - 102.0) / 298.0,
    };
    let cases: Vec<(&str, Excess)> = vec![
        ("sin(3*time/1 [s])*cos(0.11*time/1 [s]) > 0.7", {
            Box::new(|t| s(3.0)(t) * (0.11 * t).cos() - 0.7)
        }),
        ("sin(7*time/1 [s]) + 0.3*sin(7.7*time/1 [s]) > 1.1", {
            Box::new(|t| s(7.0)(t) + 0.3 * s(7.7)(t) - 1.1)
        }),
        ("max(sin(3*time/1 [s]), cos(1.1*time/1 [s])) > 0.97", {
            Box::new(|t| s(3.0)(t).max((1.1 * t).cos()) - 0.97)
        }),
        ("abs(sin(2*time/1 [s])) < 0.05", Box::new(|t| 0.05 - s(2.0)(t).abs())),
        ("clamp(2*sin(2*time/1 [s]), -0.5, 1.5) > 1.4", {
            Box::new(|t| (2.0 * s(2.0)(t)).clamp(-0.5, 1.5) - 1.4)
        }),
        ("mod(time, 7.3 [s]) > 7.2 [s]", Box::new(|t| t % 7.3 - 7.2)),
        ("mod(time, 7.3 [s])*sin(time/1 [s]) > 7 [s]", Box::new(|t| t % 7.3 * s(1.0)(t) - 7.0)),
        ("sin(time*time/1000 [s^2]) > 0.9", Box::new(|t| (t * t / 1000.0).sin() - 0.9)),
        ("exp(sin(2*time/1 [s])) > 2.5", Box::new(|t| s(2.0)(t).exp() - 2.5)),
        ("sin(2*time/1 [s])^3 > 0.8", Box::new(|t| s(2.0)(t).powi(3) - 0.8)),
        ("atan2(sin(time/1 [s]), 2 + cos(time/1 [s])) > 0.52", {
            Box::new(|t| s(1.0)(t).atan2(2.0 + t.cos()) - 0.52)
        }),
        ("profile(time) > 4", Box::new(move |t| profile(t) - 4.0)),
        ("sin(u) > 0.95", Box::new(move |t| u(t).sin() - 0.95)),
        ("u*sin(time/1 [s]) > 35", Box::new(move |t| other(t) * s(1.0)(t) - 35.0)),
    ];
    let until = 300.0;
    for (condition, f) in cases {
        let system = open(condition);
        let expected = time_above(f, 0.0, until, 300_000);
        assert!(expected > 0.1, "{condition}: {expected}");
        with_all_methods(&system, &inputs, &[0.0, until], |method, solution| {
            let found = value(&system, solution, "E", 1);
            assert_near(&format!("{condition}, {method}"), found, expected, 1e-8);
        });
    }
}

#[test]
fn a_smooth_table_of_time_is_above_its_level_as_long_as_it_is() {
    // The peak is above 4 for some time near 151 s, which is symmetric about it.
    let system = open("smooth(time) > 4");
    let (inputs, _) = ramps();
    let p = parameters(&system);
    let problem = Problem { system: &system, p: &p, inputs: &inputs, start: &[] };
    let fine: Vec<f64> = (0..=3000).map(|k| 0.1 * f64::from(k)).collect();
    let reference = simulate(&problem, &fine, &options()).expect("a solution");
    let expected = value(&system, &reference, "E", 3000);
    assert!(expected > 0.1 && expected < 2.0, "{expected}");
    with_all_methods(&system, &inputs, &[0.0, 300.0], |method, solution| {
        assert_near(method, value(&system, solution, "E", 1), expected, 1e-8);
    });
}

#[test]
fn every_sunny_day_counts() {
    // Rates with corners at sunrise and sunset: each day gives 1/π of a day at noon's rate.
    for rate in
        ["max(0, sin(2*pi*time/1 [d]))", "0.5*(sin(2*pi*time/1 [d]) + abs(sin(2*pi*time/1 [d])))"]
    {
        let system = system(&format!(
            "model sun
             parameter peak [W] = 1000
             state E [J] = 0
             equation E: der(E) = peak*{rate}"
        ));
        let expected = 1000.0 * 365.0 * 86400.0 / PI;
        with_all_methods_to(
            1e-9,
            &system,
            &Inputs::none(),
            &[0.0, 365.0 * 86400.0],
            |method, solution| {
                assert_near(method, value(&system, solution, "E", 1), expected, 1e-4);
            },
        );
        let solution = run(&system, &[0.0, 365.0 * 86400.0]);
        assert_near("exact", value(&system, &solution, "E", 1), expected, 1e-8);
        assert_close(&slopes(&system, &solution, "E", 1), &[expected / 1000.0], 1e-8);
    }
}

/// A ball above a table that shakes.
const SHAKEN: &str = "model shaken
parameter g [m/s^2] = 9.81
parameter e = 0.6
parameter A [mm] = 2
parameter f [Hz] = 50
parameter w [1/s] = 314.159265358979
state x [m] = 0.5
state v [m/s] = 0
held n = 0
let table = A*sin(w*time)
let speed = A*w*cos(w*time)
equation height: der(x) = v
equation speed: der(v) = -g
when x falls below table {
  reset v = speed - e*(v - speed)
  reset n = n + 1
}
";

/// Height, speed and number of impacts of [`SHAKEN`] at t, by parabolas of which small steps find the first that is
/// below the table.
fn shaken(until: f64) -> [f64; 3] {
    let (g, e, a, w) = (9.81, 0.6, 2e-3, 314.159_265_358_979);
    let table = |t: f64| a * f64::sin(w * t);
    let (mut t0, mut x0, mut v0, mut n) = (0.0_f64, 0.5_f64, 0.0_f64, 0.0);
    loop {
        let x = |t: f64| x0 + v0 * (t - t0) - 0.5 * g * (t - t0).powi(2);
        let step = 1e-6;
        let mut t = t0 + step;
        while t < until && x(t) > table(t) {
            t += step;
        }
        if t >= until {
            return [x(until), v0 - g * (until - t0), n];
        }
        let (mut low, mut high) = (t - step, t);
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if x(middle) > table(middle) { low = middle } else { high = middle }
        }
        let speed = a * w * f64::cos(w * high);
        let v = v0 - g * (high - t0);
        (x0, v0, t0, n) = (x(high), speed - e * (v - speed), high, n + 1.0);
    }
}

#[test]
fn a_ball_does_not_fall_through_a_table_that_shakes() {
    let system = system(SHAKEN);
    let until = 1.6;
    let [x, v, n] = shaken(until);
    assert!(n >= 3.0, "{n}");
    let p = parameters(&system);
    for method in METHODS {
        let options = Options { method, rtol: 1e-10, atol: 1e-10, ..Options::default() };
        let inputs = Inputs::none();
        let problem = Problem { system: &system, p: &p, inputs: &inputs, start: &[] };
        let solution = simulate(&problem, &[0.0, until], &options).expect("a solution");
        assert_near(method.name, value(&system, &solution, "n", 1), n, 0.0);
        assert_near(method.name, value(&system, &solution, "x", 1), x, 1e-5);
        assert_near(method.name, value(&system, &solution, "v", 1), v, 1e-5);
    }
}

#[test]
fn conditions_on_a_polynomial_of_the_state_are_found_between_samples() {
    // x = t exactly, whatever the step: (x − 3)² (x − 7)² is below its threshold for a short time twice.
    let system = system(
        "model bumps
         parameter close = 1e-4
         state x = 0
         state E [s] = 0
         equation x: der(x) = 1 [1/s]
         equation E: der(E) = if ((x - 3.1)*(x - 7.7))^2 < close then 1 else 0",
    );
    let expected = time_above(|t| 1e-4 - ((t - 3.1) * (t - 7.7)).powi(2), 0.0, 1000.0, 2_000_000);
    with_all_methods(&system, &Inputs::none(), &[0.0, 1000.0], |method, solution| {
        assert_near(method, value(&system, solution, "E", 1), expected, 1e-8);
    });
}

#[test]
fn bounds_that_time_moves_hold() {
    // x is pushed against a ceiling that comes down and goes up again.
    let system = system(
        "model ceiling
         state x = 0
         let top = 2 + sin(2*pi*time/1 [s])
         equation x: der(x) = 0.01 [1/s]
         state E [s] = 0
         equation E: der(E) = if x > top then 1 else 0",
    );
    let expected = time_above(|t| 0.01 * t - 2.0 - (TAU * t).sin(), 0.0, 500.0, 1_000_000);
    with_all_methods(&system, &Inputs::none(), &[0.0, 500.0], |method, solution| {
        assert_near(method, value(&system, solution, "E", 1), expected, 1e-7);
    });
}

#[test]
fn modes_that_time_changes_are_entered() {
    let system = system(
        "model shift
         state E [s] = 0
         state D [s] = 0
         let s = sin(2*pi*time/10 [s])
         modes m {
             night { equation E: der(E) = 0
                     equation D: der(D) = 1 }
             day { equation E: der(E) = 1
                   equation D: der(D) = 0 }
             night -> day when s rises above 0.95
             day -> night when s falls below 0.9
         }",
    );
    // From where s rises above 0.95 to where it falls below 0.9.
    let (rises, falls) = (0.95_f64.asin() / TAU * 10.0, 5.0 - 0.9_f64.asin() / TAU * 10.0);
    let expected = 100.0 * (falls - rises);
    with_all_methods(&system, &Inputs::none(), &[0.0, 1000.0], |method, solution| {
        assert_near(method, value(&system, solution, "E", 1), expected, 1e-8);
        assert_near(method, value(&system, solution, "D", 1), 1000.0 - expected, 1e-8);
    });
}

#[test]
fn a_touch_below_rounding_ends_derivatives_whether_it_is_a_crossing_or_not() {
    for (period, seconds) in [("1 [s]", 1.0), ("3 [s]", 3.0), ("7.3 [h]", 26280.0)] {
        let system = system(&ripple(period, 1.0));
        let solution = run(&system, &[0.0, 0.2 * seconds, 0.3 * seconds, 20.0 * seconds]);
        assert_near(period, value(&system, &solution, "E", 3) / seconds, 0.0, 1e-6);
        let [undefined] = &solution.undefined[..] else { panic!("{:?}", solution.undefined) };
        assert_eq!(undefined.cause, UndefinedCause::Grazing);
        assert_near(period, undefined.from / seconds, 0.25, 1e-7);
        assert!(solution.s(1).iter().all(|s| s.is_finite()), "{period}");
        assert!(solution.s(2).iter().all(|s| s.is_nan()), "{period}");
    }
}

#[test]
fn a_threshold_that_is_nearly_touched_keeps_derivatives() {
    for above in [1e-12, 1e-9, 1e-3] {
        let system = system(&ripple("1 [s]", 1.0 + above));
        let solution = run(&system, &[0.0, 20.0]);
        assert!(solution.undefined.is_empty(), "{above}: {:?}", solution.undefined);
        assert_eq!(value(&system, &solution, "n", 1), 0.0);
    }
}

#[test]
fn a_touch_that_no_parameter_moves_keeps_derivatives() {
    let text = ripple("1 [s]", 1.0).replace("s > lev", "s > 1").replace("above lev", "above 1");
    let system = system(&text.replace("then 1", "then lev"));
    let solution = run(&system, &[0.0, 20.0]);
    assert!(solution.undefined.is_empty(), "{:?}", solution.undefined);
}

#[test]
fn a_square_that_touches_for_all_parameters_keeps_derivatives() {
    let text = "model square
         parameter a = 2
         state x = 1
         state y = 0
         equation x: der(x) = -a/1 [s]
         equation y: der(y) = a*sign(x^2)/1 [s]";
    for moved in ["x^2", "(x - 0.1*sin(x))^2", "(x*a)^2"] {
        let system = system(&text.replace("x^2", moved));
        let solution = run(&system, &[0.0, 0.2, 1.0]);
        assert!(solution.undefined.is_empty(), "{moved}: {:?}", solution.undefined);
        assert_near(moved, value(&system, &solution, "y", 2), 2.0, 1e-6);
    }
    let system = system(&text.replace("x^2", "(x^2 + a - 2)"));
    let solution = run(&system, &[0.0, 0.2, 1.0]);
    assert_eq!(solution.undefined.len(), 1, "{:?}", solution.undefined);
}

#[test]
fn a_peak_of_an_input_at_a_threshold_ends_derivatives() {
    let system = system(
        "model peak
         input u linear
         parameter lev = 5
         held n = 0
         state x = 0
         equation x: der(x) = lev/1 [s]
         when u rises above lev { reset n = n + 1 }",
    );
    let p = parameters(&system);
    for (peak, touches) in [(5.0, true), (4.999, false)] {
        let values = [0.0, 1.0, peak, 1.0];
        let column =
            InputColumn { name: "u", interpolation: Interpolation::Linear, values: &values };
        let inputs = Inputs::recorded(&[0.0, 1.0, 2.0, 3.0], &[column]).expect("inputs");
        let problem = Problem { system: &system, p: &p, inputs: &inputs, start: &[] };
        let solution = simulate_with_sensitivities(&problem, &[0.0, 1.5, 3.0], &options())
            .expect("a solution");
        assert_eq!(!solution.undefined.is_empty(), touches, "{:?}", solution.undefined);
        assert!(solution.s(1).iter().all(|s| s.is_finite()));
    }
}

#[test]
fn a_condition_that_changes_ever_faster_is_named() {
    let system = system(
        "model wild
         state E [s] = 0
         equation E: der(E) = if sin(1 [s]/time) > 0.5 then 1 else 0",
    );
    let p = parameters(&system);
    let problem = Problem { system: &system, p: &p, inputs: &Inputs::none(), start: &[] };
    let failure = simulate(&problem, &[0.0, 1.0], &Options::default()).expect_err("an error");
    match failure.error {
        IntegrateError::UnresolvedCondition { t, automaton }
        | IntegrateError::EndlessEvents { t, automaton, .. } => {
            assert!(t < 1e-3 && automaton.contains("sin"), "{t} {automaton}");
        }
        other => panic!("{other}"),
    }
    let solution = simulate(&problem, &[0.01, 1.0], &Options::default()).expect("a solution");
    let expected = time_above(|t| (1.0 / t).sin() - 0.5, 0.01, 1.0, 1_000_000);
    assert_near("E", value(&system, &solution, "E", 1), expected, 1e-8);
}

#[test]
fn sensitivities_are_those_of_every_method() {
    let system = system(
        "model pulses
         parameter period [s] = 3
         parameter lev = 0.4
         parameter k [1/s] = 0.2
         state x = 1
         equation x: der(x) = if sin(2*pi*time/period)*cos(0.3*time/1 [s]) > lev then 1 [1/s] - k*x else -k*x",
    );
    let p = parameters(&system);
    let inputs = Inputs::none();
    let times = [0.0, 40.0];
    let at = |p: &[f64]| {
        let problem = Problem { system: &system, p, inputs: &inputs, start: &[] };
        simulate(&problem, &times, &options()).expect("a solution").y(1)[0]
    };
    let differences: Vec<f64> = (0..p.len())
        .map(|j| {
            let central = |h: f64| {
                let moved = |step: f64| {
                    let mut p = p.clone();
                    p[j] += step;
                    at(&p)
                };
                (moved(h) - moved(-h)) / (2.0 * h)
            };
            let h = 1e-4 * p[j];
            (4.0 * central(0.5 * h) - central(h)) / 3.0
        })
        .collect();
    let x = position(&system, "x");
    for method in METHODS {
        let options = Options { method, ..options() };
        let problem = Problem { system: &system, p: &p, inputs: &inputs, start: &[] };
        let Ok(solution) = simulate_with_sensitivities(&problem, &times, &options) else {
            assert_eq!(method.name, "taylor");
            continue;
        };
        let found: Vec<f64> = solution.s(1).chunks(solution.n).map(|column| column[x]).collect();
        assert_close(&found, &differences, 1e-5);
    }
}

#[test]
fn every_function_has_an_enclosure() {
    for function in INTRINSICS {
        if !matches!(function.definition, IntrinsicDefinition::Expansion(..)) {
            assert!(encloses(function.name), "{}", function.name);
        }
    }
}
