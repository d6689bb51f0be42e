//! Equations that determine their unknown by little, and by nothing.

use dgd_execute::InterpretedSystem;
use dgd_runtime::{
    Inputs, MethodKind, Options, Problem, Solution, System, find_method, method_to_begin, observe,
    simulate, simulate_with_sensitivities,
};

use crate::inline::system;

/// A diode that closes, with a resistance beside it, between an inductor and a capacitor.
const RECTIFIER: &str = "model rectifier
    parameter L [H] = 0.001
    parameter R [ohm] = 1e5
    constant Is [A] = 1e-9
    constant Vt [V] = 0.04
    state i [A] = 0
    state vc [V] = 0
    unknown v [V] = 0
    equation coil: L*der(i) = 10 [V]*sin(314 [1/s]*time) - v
    equation diode: i = Is*(exp((v - vc)/Vt) - 1) + (v - vc)/R
    equation cap: 1 [mF]*der(vc) = i - vc/15 [ohm]
    output vc";

/// A rate that starts from nothing.
const HILL: &str = "model hill
    parameter n = 1
    parameter K = 0.4
    state x = 0 fixed
    state y = 1 fixed
    equation e: 1 [s]*der(x) = 1
    equation f: 1 [s]*der(y) = -y*x^n/(K^n + x^n)
    output y";

fn declared(system: &InterpretedSystem) -> Vec<f64> {
    system.signature().parameters.iter().map(|p| p.value).collect()
}

/// dvc/dL at 0.1 s, for a resistance.
fn of_inductance(resistance: f64, options: &Options) -> f64 {
    let system = system(RECTIFIER);
    let mut p = declared(&system);
    p[1] = resistance;
    let problem = Problem { system: &system, p: &p, inputs: &Inputs::none(), start: &[] };
    let solution = simulate_with_sensitivities(&problem, &[0.0, 0.1], options).expect("a solution");
    assert!(solution.undefined.is_empty(), "{resistance:e} Ω: {}", solution.undefined[0]);
    observe(&problem, &solution).dw(1)[0]
}

/// A diode that closed leaves its voltage to the resistance, which is a small part of the conductance that
/// it had, and all that there is. True values are quotients of differences of runs.
#[test]
fn an_equation_that_became_weak_still_determines_its_unknown() {
    for (resistance, expected) in [(1e4, 752.134), (1e5, 751.067), (1e6, 750.960)] {
        for (tolerance, within) in [(1e-4, 0.05), (1e-6, 1e-3), (1e-8, 1e-4)] {
            let options = Options { rtol: tolerance, atol: tolerance, ..Options::default() };
            let found = of_inductance(resistance, &options);
            let apart = (found / expected - 1.0).abs();
            assert!(apart < within, "{resistance:e} Ω, {tolerance:e}: {found} for {expected}");
        }
    }
}

fn end(problem: &Problem<'_, InterpretedSystem>, options: &Options) -> Solution {
    let solution = simulate_with_sensitivities(problem, &[0.0, 3.0], options);
    solution.unwrap_or_else(|failure| panic!("{}", failure.error))
}

/// What is not finite at the start alone keeps no other method from going.
#[test]
fn the_method_that_can_begin_is_chosen_beforehand() {
    let system = system(HILL);
    // dy/dn and dy/dK at 3 s, by runs at 1e-12 from 1e-9 s on.
    for n in [1.0, 1.5, 1.9] {
        let p = [n, 0.4];
        let problem = Problem { system: &system, p: &p, inputs: &Inputs::none(), start: &[] };
        let other = method_to_begin(&problem, 0.0, &Options::default()).expect("another method");
        assert_eq!((other.method.name, &*other.equation, other.t), ("kencarp4", "f", 0.0));
        let tight = Options { rtol: 1e-9, atol: 1e-9, ..Options::default() };
        let found = end(&problem, &Options { method: other.method, ..tight });
        let bdf = find_method("bdf").expect("a method");
        let expected = end(&problem, &Options { method: bdf, rtol: 1e-11, atol: 1e-11, ..tight });
        for (found, expected) in found.s(1).iter().zip(expected.s(1)) {
            assert!((found - expected).abs() < 1e-7, "n = {n}: {found} for {expected}");
        }
    }
    for n in [2.0, 2.5, 4.0] {
        let p = [n, 0.4];
        let problem = Problem { system: &system, p: &p, inputs: &Inputs::none(), start: &[] };
        assert!(method_to_begin(&problem, 0.0, &Options::default()).is_none(), "n = {n}");
    }
}

/// ẋ = 1 and ẏ = −y x^0.9/(…): ∂f/∂x is not finite at the start, and nothing else is wrong.
#[test]
fn a_first_derivative_that_is_not_finite_is_stepped_off_from() {
    let text = HILL.replace("parameter", "constant");
    let system = system(&text.replace("n = 1", "n = 0.9"));
    let problem = Problem { system: &system, p: &[], inputs: &Inputs::none(), start: &[] };
    let other = method_to_begin(&problem, 0.0, &Options::default()).expect("another method");
    assert!(matches!(other.method.kind, MethodKind::Bdf(_)));
    let solution = |name: &str, tolerance: f64| {
        let method = find_method(name).expect("a method");
        let options = Options { rtol: tolerance, atol: tolerance, method, ..Options::default() };
        simulate(&problem, &[0.0, 3.0], &options).expect("a solution").y(1)[1]
    };
    let (found, expected) = (solution(other.method.name, 1e-6), solution("tsit5", 1e-10));
    assert!((found - expected).abs() < 1e-5, "{found} for {expected}");
    // The one that cannot says why.
    let failure = simulate(&problem, &[0.0, 3.0], &Options::default()).expect_err("a refusal");
    let said = failure.error.to_string();
    assert!(said.starts_with("a derivative of equation `f` is not finite at t = 0 s"), "{said}");
}
