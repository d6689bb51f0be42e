//! Stiff problems with published end values, solved with every stiff method.

use dgd_runtime::{
    Inputs, IntegrateError, METHODS, Method, MethodKind, Options, Problem, find_method, simulate,
};

use crate::support::problems::{Robertson, RobertsonDae, VanDerPol};
use crate::support::{Equations, Heaped, parameters};

/// Largest permitted error of the end values, in units of atol · size + rtol |y|, for rtol from 1e-4 to 1e-10.
/// `rodas5p` stays below the tolerance itself, and `rodas4` below twice that. With the other two errors add up: the
/// error estimate of `kencarp4` is one order below its solution, and the errors of `bdf` have the same sign from step
/// to step.
fn most(method: &Method) -> f64 {
    match method.kind {
        MethodKind::Rosenbrock(_) if method.order == 5 => 1.0,
        MethodKind::Rosenbrock(_) => 2.0,
        MethodKind::Esdirk(_) => 30.0,
        MethodKind::Bdf(_) => 150.0,
        MethodKind::Explicit(_) | MethodKind::Taylor(_) => unreachable!("not for stiff problems"),
    }
}

fn verify<E: Equations>(until: f64, expected: &[f64], atol: f64) {
    let system = Heaped::of::<E>();
    let p = parameters::<E>();
    let inputs = Inputs::none();
    let problem = Problem { system: &system, p: &p, inputs: &inputs, start: &[] };
    let implicit = METHODS.iter().filter(|m| m.kind.is_implicit());
    for method in implicit {
        for digits in [4, 6, 8, 10] {
            let rtol = 10.0_f64.powi(-digits);
            let options = Options { rtol, atol: atol * rtol, method, ..Options::default() };
            let solution = simulate(&problem, &[0.0, until], &options).unwrap();
            let sizes = E::UNKNOWNS.iter().map(|(_, size, _)| size);
            for ((y, expected), size) in solution.y(1).iter().zip(expected).zip(sizes) {
                let error = (y - expected).abs() / (rtol * (atol * size + expected.abs()));
                assert!(error <= most(method), "{} at {rtol:e}: {error}", method.name);
            }
        }
    }
}

/// Test Set for IVP Solvers (Mazzia and Magherini), problem VDPOL with μ = 1000.
#[test]
fn van_der_pol() {
    verify::<VanDerPol>(2000.0, &[1.706_167_732_170_469, -0.892_809_701_024_812_5e-3], 1.0);
}

/// Test Set for IVP Solvers, problem ROBER.
#[test]
fn robertson() {
    let expected = [0.208_334_014_970_125_5e-7, 0.833_336_077_033_471_3e-13, 0.999_999_979_166_505];
    verify::<Robertson>(1e11, &expected, 1e-6);
    // c comes from 1 − a − b, whose rounding must stay below the tolerance of c = 0.
    verify::<RobertsonDae>(1e11, &expected, 1e-4);
}

#[test]
fn an_explicit_method_says_that_the_model_is_not_for_it() {
    let inputs = Inputs::none();
    let tsit5 = find_method("tsit5").unwrap();
    let options = Options { method: tsit5, max_steps: 20_000, ..Options::default() };

    let (system, p) = (Heaped::of::<VanDerPol>(), parameters::<VanDerPol>());
    let problem = Problem { system: &system, p: &p, inputs: &inputs, start: &[] };
    let failure = simulate(&problem, &[0.0, 2000.0], &options).unwrap_err();
    assert!(matches!(failure.error, IntegrateError::TooStiff { steps: 20_000, .. }), "{failure}");

    let (system, p) = (Heaped::of::<RobertsonDae>(), parameters::<RobertsonDae>());
    let problem = Problem { system: &system, p: &p, inputs: &inputs, start: &[] };
    let failure = simulate(&problem, &[0.0, 1.0], &options).unwrap_err();
    let message = failure.to_string();
    assert!(message.contains("cannot solve `of_c`"), "{message}");
}
