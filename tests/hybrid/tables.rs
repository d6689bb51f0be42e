//! Tables: their knots and ends as events, and solutions against closed forms, differences and SciPy.

use dgd_compiler::diagnostics::Diagnostics;
use dgd_compiler::source::SourceMap;
use dgd_data::read;
use dgd_runtime::{
    AutomatonKind, Inputs, IntegrateError, Problem, System, observe, simulate,
    simulate_with_sensitivities,
};

use crate::exact::{
    assert_close, assert_slopes_are_differences, options, parameters, run, run_with, slopes, value,
};
use crate::inline::system;
use crate::recorded::recorded;
use crate::support::{compiled, interpreted, native, root};

/// What a few hundred steps make of a tolerance of 1e-11.
const CLOSE: f64 = 1e-9;

/// Kinds of the automata of a model that reads a table with these attributes at an argument.
fn made_of(attributes: &str, argument: &str) -> Vec<AutomatonKind> {
    let text = format!(
        "model m\nparameter a = 0.3\ninput u hold\nstate q = 1\nstate p = 2\n\
         table f(x) = (0, 1), (1, 3), (2.5, 2), (4, 4) {attributes}\n\
         table line(x) = (0, 1), (1, 3), (2, 5) linear, beyond extend\n\
         equation one: der(q) = 1 [1/s]*f({argument}) + 1 [1/s]*line(p)\n\
         equation two: der(p) = -1 [1/s]*q*u"
    );
    let system = system(&text);
    system.signature().discrete.automata.iter().map(|automaton| automaton.kind).collect()
}

#[test]
fn knots_of_lines_are_one_automaton_and_those_of_cubics_none() {
    use AutomatonKind::{Knots, Limit};
    assert_eq!(made_of("linear", "q"), [Knots, Limit]);
    assert_eq!(made_of("linear, beyond hold", "q*p"), [Knots]);
    assert_eq!(made_of("linear, beyond extend", "q"), [Knots]);
    for smooth in ["pchip", "natural"] {
        assert_eq!(made_of(smooth, "q"), [Limit], "{smooth}");
        assert_eq!(made_of(&format!("{smooth}, beyond extend"), "q"), []);
        assert_eq!(made_of(&format!("{smooth}, beyond hold"), "q"), [Knots]);
    }
    // The default, and what only samples move.
    assert_eq!(made_of("", "q"), [Limit]);
    assert_eq!(made_of("linear, beyond hold", "u"), []);
    assert_eq!(made_of("linear", "a*u"), [Limit]);
    // Two reads at one argument share both.
    assert_eq!(made_of("linear", "q)*f(q"), [Knots, Limit]);
}

/// x' = f(y), y' = 1: x is the integral of the broken line, exactly, and its derivative to an ordinate that of a hat.
#[test]
fn the_integral_of_a_broken_line_and_its_derivatives_to_the_ordinates() {
    let system = system(
        "model m\nparameter a = 1\nparameter b = 3\nparameter c = 2\nstate x = 0\nstate y = -0.5\n\
         table f(y) = (0, a), (1, b), (2.5, c), (4, 4) linear, beyond hold\n\
         equation x: der(x) = f(y)/1 [s]\nequation y: der(y) = 1 [1/s]",
    );
    let solution = run(&system, &[0.0, 0.5, 1.5, 3.0, 5.5]);
    let integral = [0.0, 0.5, 0.5 + 2.0, 2.5 + 3.75, 6.25 + 4.5 + 4.0];
    for (k, expected) in integral.into_iter().enumerate() {
        let found = value(&system, &solution, "x", k);
        assert_close(&[found], &[expected], CLOSE);
    }
    assert_close(
        &slopes(&system, &solution, "x", 4)[..3],
        &[0.5 + 0.5, 0.5 + 0.75, 0.75 + 0.75],
        CLOSE,
    );
    assert!(solution.undefined.is_empty());
}

#[test]
fn tables_of_parameters_have_derivatives_between_and_beyond_their_points() {
    for (shape, beyond) in
        [("linear", "extend"), ("natural", "extend"), ("natural", "hold"), ("linear", "hold")]
    {
        let system = system(&format!(
            "model m\nparameter a = 1\nparameter b = 2.5\nparameter c = 0.7\nparameter w = 3\n\
             state x = 0\nstate y = 0.3\nstate v = 1.1\n\
             table f(y) at (-1, 0.2, 1.5) = (a, 2*b, c - a) {shape}, beyond {beyond}\n\
             equation x: der(x) = (f(y) - 0.1*x)/1 [s]\n\
             equation y: der(y) = v/1 [s]\nequation v: der(v) = -w*y/1 [s]"
        ));
        assert_slopes_are_differences(&system, &Inputs::none(), &[0.0, 3.3], 1e-5);
    }
}

/// y = sin t passes the knots up and down, again and again.
#[test]
fn knots_are_counted_up_and_down() {
    let system = system(
        "model m\nstate x = 0\nstate y = 0\nstate v = 1\n\
         table f(y) = (-0.8, 0.8), (-0.3, 0.3), (0, 0), (0.3, 0.3), (0.8, 0.8) linear, beyond extend\n\
         equation x: der(x) = f(y)/1 [s]\n\
         equation y: der(y) = v/1 [s]\nequation v: der(v) = -y/1 [s]",
    );
    // Of |y|, the corner of which is one of the five knots.
    let solution = run(&system, &[0.0, 20.0 * std::f64::consts::PI]);
    assert_close(&[value(&system, &solution, "x", 1)], &[40.0], 1e-8);
}

/// It decays towards a knot and rests there; a reset throws it over all others.
#[test]
fn a_solution_may_rest_at_a_knot_and_be_thrown_over_several() {
    let text = "model m\nstate x = 1\n\
         table f(x) = (-3, -9), (-2, -4), (-1, -1), (0, 0), (1, 2), (2, 4) linear, beyond extend\n\
         equation x: der(x) = -f(x)/1 [s]\n\
         when time rises above 60 [s] { reset x = -2.5 }";
    let system = system(text);
    let solution = run(&system, &[0.0, 30.0, 60.0, 60.05, 120.0]);
    let found = |k| value(&system, &solution, "x", k);
    assert_close(&[found(1)], &[(-60.0_f64).exp()], 1e-9);
    // x' = −5 x − 6 from −2.5 on.
    assert_close(&[found(3)], &[-1.2 - 1.3 * (-0.25_f64).exp()], CLOSE);
    assert_close(&[found(4)], &[0.0], 1e-9);
}

#[test]
fn a_run_ends_where_an_argument_leaves_its_table() {
    let text = |row: &str, output: &str| {
        format!(
            "model m\nstate x [m] = 2\nstate y [m] = 0\n\
             table f(x [cm]) [m] = (0, 1), (300, 3), (400, 4)\n\
             equation x: der(x) = {row}\nequation y: der(y) = f(x)/1 [s]\n{output}"
        )
    };
    let left = |text: &str| {
        let system = system(text);
        let failure = run_with(&system, &parameters(&system), &Inputs::none(), &[0.0, 9.0]);
        match failure.expect_err("a run that ends").error {
            IntegrateError::TableLeft { t, what } => (t, what),
            other => panic!("{other}"),
        }
    };
    let (t, what) = left(&text("0.5 [m/s]", ""));
    assert_close(&[t], &[4.0], 1e-4);
    assert_eq!(what, "`x` leaves the table `f`, which goes from 0 to 400 cm");
    let (t, _) = left(&text("-0.5 [m/s]", ""));
    assert_close(&[t], &[4.0], 1e-4);
    // At once, by a jump, and in what is only read.
    let (t, _) = left(&text("0.1 [m/s]", "").replace("state x [m] = 2", "state x [m] = 4.1"));
    assert_close(&[t], &[0.0], 0.0);
    let thrown = "when time rises above 1 [s] { reset x = 5 [m] }";
    let (t, _) = left(&text("0.1 [m/s]", thrown));
    assert_close(&[t], &[1.0], 1e-9);
    let read = "table g(x [m]) = (0, 1), (2.5, 1) linear\noutput read = g(x)";
    let (t, what) = left(&text("0.25 [m/s]", read));
    assert_close(&[t], &[2.0], 1e-4);
    assert!(what.contains("`g`"), "{what}");
    // What rests at an end has not left it.
    let resting = system(&text("-3 [1/s]*(x - 4 [m])", ""));
    run(&resting, &[0.0, 30.0]);
}

#[test]
fn the_filling_pump_needs_the_power_that_scipy_gives() {
    let path = "models/filling_pump.dgd";
    let recording = recorded(
        &compiled(&root().join(path), &[]),
        &root().join("tests/reference/filling_pump_inputs.csv"),
    );
    let (mut sources, mut diagnostics) = (SourceMap::default(), Diagnostics::default());
    let reference = root().join("tests/reference/filling_pump_power.csv");
    let reference = read(&reference, &mut sources, &mut diagnostics).expect("a table");
    let times = reference.time.as_deref().expect("times");
    let system = interpreted(path, &[]);
    let p = parameters(&system);
    let problem = Problem { system: &system, p: &p, inputs: &recording.inputs, start: &[] };
    let solution = simulate(&problem, times, &options()).expect("a run");
    let observations = observe(&problem, &solution);
    let power = system.signature().outputs.iter().position(|output| output.name == "power");
    let power = power.expect("an output");
    let found: Vec<f64> = (0..times.len()).map(|k| observations.w(k)[power]).collect();
    let expected = &reference.columns[0].values;
    let off = found.iter().zip(expected).map(|(a, b)| (a / b - 1.0).abs());
    assert!(off.fold(0.0, f64::max) < 1e-8);
    let machine = native(path, &[]);
    let problem = Problem { system: &machine, p: &p, inputs: &recording.inputs, start: &[] };
    let same = simulate_with_sensitivities(&problem, times, &options()).expect("a run");
    let problem = Problem { system: &system, p: &p, inputs: &recording.inputs, start: &[] };
    assert_eq!(simulate_with_sensitivities(&problem, times, &options()).expect("a run"), same);
}
