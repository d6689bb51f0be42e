//! Starts that start equations determine, against closed forms: values, derivatives, fits.

use dgd_execute::InterpretedSystem;
use dgd_identify::{NoiseSource, OutputErrorProblem, Recording, fit};
use dgd_runtime::{
    Direction, InputColumn, Inputs, IntegrateError, Interpolation, Options, Problem, Solution,
    System, consistent_start, simulate, simulate_with_sensitivities,
};

use super::{declared, system};

/// Two vessels, of which the upper one is at rest at the start.
const VESSELS: &str = "\
model vessels
start equation even: der(h_1) = 0
input q [m^3/s]
parameter k_1 [m^2/s] = 0.02 in 0.001 .. 1
parameter k_2 [m^2/s] = 0.03 in 0.001 .. 1
state h_1 [m] = 1
state h_2 [m] = 0.5
equation upper: 2 [m^2]*der(h_1) = q - k_1*h_1
equation lower: 3 [m^2]*der(h_2) = k_1*h_1 - k_2*h_2
output h_1
output h_2
";

fn flow(times: &[f64], values: &[f64]) -> Inputs {
    let column = InputColumn { name: "q", interpolation: Interpolation::Hold, values };
    Inputs::recorded(times, &[column]).expect("samples in order")
}

fn tight() -> Options {
    Options { rtol: 1e-10, atol: 1e-10, ..Options::default() }
}

fn run(system: &InterpretedSystem, p: &[f64], inputs: &Inputs, times: &[f64]) -> Solution {
    let problem = Problem { system, p, inputs, start: &[] };
    simulate_with_sensitivities(&problem, times, &tight())
        .unwrap_or_else(|failure| panic!("{}", failure.error))
}

#[track_caller]
fn close(found: f64, wanted: f64, tolerance: f64) {
    assert!(
        (found - wanted).abs() <= tolerance * wanted.abs().max(1.0),
        "{found} against {wanted}"
    );
}

#[test]
fn one_state_is_at_rest_and_the_other_begins_where_it_is_declared() {
    let system = system(VESSELS);
    let p = declared(&system);
    let directions: Vec<_> = system.signature().directions.iter().copied().collect();
    let wanted = [Direction::Parameter(0), Direction::Parameter(1), Direction::Start(1)];
    assert_eq!(directions, wanted, "only the second start is free");
    let inputs = flow(&[0.0, 100.0], &[0.05, 0.05]);
    let solution = run(&system, &p, &inputs, &[0.0, 40.0]);
    let level = 0.05 / 0.02;
    for k in 0..2 {
        close(solution.y(k)[0], level, 1e-9);
        close(solution.s(k)[0], -level / 0.02, 1e-7);
        close(solution.s(k)[2], 0.0, 1e-9);
        close(solution.s(k)[4], 0.0, 1e-9);
    }
    // h₂ = (q/k₂) (1 − e) + h₂(0) e with e = exp(−k₂ t/A₂).
    let e = (-0.03_f64 * 40.0 / 3.0).exp();
    close(solution.y(1)[1], 0.05 / 0.03 * (1.0 - e) + 0.5 * e, 1e-8);
    close(solution.s(1)[1], 0.0, 1e-6);
    close(solution.s(1)[5], e, 1e-7);
    let problem = Problem { system: &system, p: &p, inputs: &inputs, start: &[(1, 0.7)] };
    let start = consistent_start(&problem, 0.0, &tight()).expect("it begins");
    close(start.y[0], level, 1e-10);
    close(start.y[1], 0.7, 1e-15);
}

/// A cone whose volume is known: V = c h³.
#[test]
fn an_equation_of_an_algebraic_unknown_determines_a_state() {
    let system = system(
        "model cone\nstart equation stored: V = V_0\n\
         parameter c [1] = 0.4 in 0.01 .. 10\nparameter V_0 [m^3] = 3 in 0.1 .. 50\n\
         state h [m] = 1  guess\nunknown V [m^3] = 1\n\
         equation volume: 0 = c*h^3 - V\nequation level: der(h) = -0.001 [1/s]*h\n\
         output h\noutput V\n",
    );
    let p = declared(&system);
    let solution = run(&system, &p, &Inputs::none(), &[0.0, 100.0]);
    let h = (3.0_f64 / 0.4).cbrt();
    for (k, e) in [1.0, (-0.1_f64).exp()].into_iter().enumerate() {
        close(solution.y(k)[0], h * e, 1e-9);
        close(solution.y(k)[1], 3.0 * e.powi(3), 1e-9);
        close(solution.s(k)[0], -h / 1.2 * e, 1e-7);
        close(solution.s(k)[1], 0.0, 1e-7);
        close(solution.s(k)[2], h / 9.0 * e, 1e-7);
        close(solution.s(k)[3], e.powi(3), 1e-7);
    }
}

/// h₁ + h₂ = T and k₁ h₁ = k₂ h₂, whichever guess is nearer to which.
#[test]
fn several_equations_determine_several_states_together() {
    let text = VESSELS
        .replace(
            "even: der(h_1) = 0",
            "total: h_1 + h_2 = 3 [m]\nstart equation even: der(h_2) = 0",
        )
        .replace("h_1 [m] = 1", "h_1 [m] = 9  guess")
        .replace("h_2 [m] = 0.5", "h_2 [m] = 0  guess");
    let system = system(&text);
    let (p, inputs) = (declared(&system), flow(&[0.0, 1.0], &[0.05, 0.05]));
    let solution = run(&system, &p, &inputs, &[0.0]);
    let (k_1, k_2) = (0.02, 0.03);
    let total: f64 = k_1 + k_2;
    close(solution.y(0)[0], 3.0 * k_2 / total, 1e-10);
    close(solution.y(0)[1], 3.0 * k_1 / total, 1e-10);
    let slope = 3.0 * k_2 / total.powi(2);
    close(solution.s(0)[0], -slope, 1e-8);
    close(solution.s(0)[1], slope, 1e-8);
}

#[test]
fn a_fit_has_each_recording_begin_where_the_equations_say() {
    let system = system(VESSELS);
    let times: Vec<f64> = (0..80).map(|k| 5.0 * f64::from(k)).collect();
    let truth = [0.035, 0.022];
    let recordings = [[0.05, 0.08], [0.09, 0.02]].map(|[before, after]| {
        let inputs = flow(&[0.0, 50.0, 395.0], &[before, after, after]);
        let problem = Problem { system: &system, p: &truth, inputs: &inputs, start: &[(1, 1.3)] };
        let solution = simulate(&problem, &times, &tight()).expect("it can be simulated");
        let of = |i: usize| Some((0..times.len()).map(|k| solution.y(k)[i]).collect());
        Recording::new(times.clone(), inputs, vec![of(0), of(1)])
    });
    let p = declared(&system);
    let problem = OutputErrorProblem {
        noise: vec![Some(NoiseSource::Known(0.01)); 2],
        options: tight(),
        ..OutputErrorProblem::new(&system, &p, &recordings)
    };
    let found = fit(&problem).expect("it can be simulated");
    assert!(found.termination.is_converged(), "{:?}", found.termination);
    close(found.p[0], truth[0], 1e-5);
    close(found.p[1], truth[1], 1e-5);
    for starts in &found.starts {
        assert_eq!(starts.len(), 1, "one start of each recording is free: {starts:?}");
        close(starts[0].1, 1.3, 1e-5);
    }
}

#[test]
fn equations_that_cannot_be_met_are_named() {
    let fails = |equation: &str| {
        let text = VESSELS.replace("even: der(h_1) = 0", equation);
        let system = system(&text.replace("h_1 [m] = 1", "h_1 [m] = 2  guess"));
        let (p, inputs) = (declared(&system), flow(&[0.0, 1.0], &[0.05, 0.05]));
        let problem = Problem { system: &system, p: &p, inputs: &inputs, start: &[] };
        let failure = simulate(&problem, &[0.0], &tight()).expect_err("it cannot begin");
        let IntegrateError::Initial(error) = failure.error else { panic!("{}", failure.error) };
        error.to_string()
    };
    let negative = fails("square: h_1^2 = -1 [m^2]");
    assert!(negative.contains("`square` is not met"), "{negative}");
    let other = fails("other: h_2 = 0.3 [m]");
    assert!(other.contains("`other` does not determine `h_1`"), "{other}");
}
