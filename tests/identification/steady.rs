//! Starts at rest, against closed forms: values, derivatives, and fits in which each recording has its own.

use dgd_execute::InterpretedSystem;
use dgd_identify::{NoiseSource, OutputErrorProblem, Recording, fit};
use dgd_runtime::{
    Direction, InputColumn, Inputs, IntegrateError, Interpolation, Options, Problem, Solution,
    System, consistent_start, simulate, simulate_with_sensitivities,
};

use super::{declared, system};

/// Monod's chemostat: S = K D/(μ − D), X = Y (F − S) at rest.
const CHEMOSTAT: &str = "\
model chemostat
start steady
input D [1/s]
parameter mu [1/s] = 0.5 in 0.01 .. 5
parameter K [kg/m^3] = 0.2 in 0.001 .. 10
parameter Y [1] = 0.45 in 0.05 .. 1
parameter X_0 [kg/m^3] = 4 in 0 .. 100
state X [kg/m^3] = X_0
state S [kg/m^3] = 0.5
equation growth: der(X) = (mu*S/(K + S) - D)*X
equation consumption: der(S) = D*(10 [kg/m^3] - S) - mu*S/(K + S)*X/Y
output X
output S
";

fn rates(times: &[f64], values: &[f64]) -> Inputs {
    let column = InputColumn { name: "D", interpolation: Interpolation::Hold, values };
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

/// The rest and its derivatives by the four parameters.
fn at_rest([mu, k, y]: [f64; 3], d: f64) -> ([f64; 2], [[f64; 2]; 4]) {
    let s = k * d / (mu - d);
    let (s_mu, s_k) = (-s / (mu - d), s / k);
    ([y * (10.0 - s), s], [[-y * s_mu, s_mu], [-y * s_k, s_k], [10.0 - s, 0.0], [0.0, 0.0]])
}

#[test]
fn a_run_begins_where_nothing_moves_and_knows_by_what_that_moves() {
    let system = system(CHEMOSTAT);
    let p = declared(&system);
    let directions: Vec<_> = system.signature().directions.iter().copied().collect();
    assert_eq!(
        directions,
        (0..4).map(Direction::Parameter).collect::<Vec<_>>(),
        "no start is free"
    );
    for d in [0.1, 0.3, 0.42] {
        let inputs = rates(&[0.0, 100.0], &[d, d]);
        let solution = run(&system, &p, &inputs, &[0.0, 50.0]);
        let (wanted, slopes) = at_rest([0.5, 0.2, 0.45], d);
        for k in 0..2 {
            for i in 0..2 {
                close(solution.y(k)[i], wanted[i], 1e-8);
                for (j, slope) in slopes.iter().enumerate() {
                    close(solution.s(k)[2 * j + i], slope[i], 1e-6);
                }
            }
        }
        let problem = Problem { system: &system, p: &p, inputs: &inputs, start: &[] };
        let start = consistent_start(&problem, 0.0, &tight()).expect("it rests");
        close(start.y[1], wanted[1], 1e-9);
        // Start values of all unknowns are where a run begins.
        let given = Problem { start: &[(0, 3.0), (1, 0.1)], ..problem };
        let given = simulate(&given, &[0.0], &tight()).expect("it can be simulated");
        assert_eq!(given.y(0), [3.0, 0.1]);
    }
}

/// ẋ = a x(t − τ) − p x² + b rests where p x² = a x + b, whatever τ is, and stays there.
#[test]
fn what_is_late_at_rest_is_what_it_is_now() {
    let system = system(
        "model late\nstart steady\n\
         parameter a [1/s] = 0.8 in 0 .. 9\nparameter p [1/s] = 0.7 in 0 .. 9\n\
         parameter b [1/s] = 0.1 in 0 .. 9\nparameter tau [s] = 1.5 in 0 .. 9\n\
         state x [1] = 2\nequation x: der(x) = a*delay(x, tau) - p*x^2 + b\noutput x\n",
    );
    let solution = run(&system, &declared(&system), &Inputs::none(), &[0.0, 1.0, 4.0]);
    let [a, p, b]: [f64; 3] = [0.8, 0.7, 0.1];
    let x = (a + (a * a + 4.0 * p * b).sqrt()) / (2.0 * p);
    let by_x = 2.0 * p * x - a;
    for k in 0..3 {
        close(solution.y(k)[0], x, 1e-9);
        for (j, slope) in [x / by_x, -x * x / by_x, 1.0 / by_x, 0.0].iter().enumerate() {
            close(solution.s(k)[j], *slope, 1e-8);
        }
    }
}

/// V₁ ḣ₁ = −q, V₂ ḣ₂ = q, q = k (h₁ − h₂): the level is (V₁ a + V₂ b)/(V₁ + V₂), whatever k is.
#[test]
fn what_is_conserved_keeps_the_total_of_the_declared_starts() {
    let system = system(
        "model tanks\nstart steady\n\
         parameter A_1 [m^2] = 2 in 0.1 .. 10\nparameter A_2 [m^2] = 3 in 0.1 .. 10\n\
         parameter k [m^2/s] = 0.1 in 0.01 .. 1\nparameter a [m] = 1.5 in 0 .. 9\n\
         state h_1 [m] = a\nstate h_2 [m] = 0.5\n\
         equation left: A_1*der(h_1) = -k*(h_1 - h_2)\n\
         equation right: A_2*der(h_2) = k*(h_1 - h_2)\n\
         output h_1\n",
    );
    let p = declared(&system);
    let solution = run(&system, &p, &Inputs::none(), &[0.0, 10.0]);
    let level = (2.0 * 1.5 + 3.0 * 0.5) / 5.0;
    let slopes = [(1.5 - level) / 5.0, (0.5 - level) / 5.0, 0.0, 2.0 / 5.0];
    for k in 0..2 {
        for i in 0..2 {
            close(solution.y(k)[i], level, 1e-9);
            for (j, slope) in slopes.iter().enumerate() {
                close(solution.s(k)[2 * j + i], *slope, 1e-6);
            }
        }
    }
}

/// Two cultures at rest with different feeds, then shifted: the fit finds what made the readings, and each begins
/// at its own rest all along.
#[test]
fn a_fit_finds_the_rest_of_each_recording() {
    let system = system(CHEMOSTAT);
    let times: Vec<f64> = (0..60).map(f64::from).collect();
    let truth = [0.42, 0.31, 0.5, 4.0];
    let shifts = [[0.1, 0.3], [0.25, 0.12]];
    let recordings = shifts.map(|[before, after]| {
        let inputs = rates(&[0.0, 10.0, 59.0], &[before, after, after]);
        let solution = run(&system, &truth, &inputs, &times);
        let of = |i: usize| Some((0..times.len()).map(|k| solution.y(k)[i]).collect());
        Recording::new(times.clone(), inputs, vec![of(0), of(1)])
    });
    let p = declared(&system);
    let problem = OutputErrorProblem {
        noise: vec![Some(NoiseSource::Known(0.01)); 2],
        free: vec![true, true, true, false],
        options: tight(),
        ..OutputErrorProblem::new(&system, &p, &recordings)
    };
    let found = fit(&problem).expect("it can be simulated");
    assert!(found.termination.is_converged(), "{:?}", found.termination);
    for (estimate, wanted) in found.estimates.iter().zip(truth) {
        close(estimate.value, wanted, 1e-5);
    }
    assert!(found.starts.iter().all(Vec::is_empty), "{:?}", found.starts);
}

#[test]
fn a_model_that_never_rests_is_refused_by_name() {
    let system = system(
        "model filling\nstart steady\nparameter q [m/s] = 1 in 0.1 .. 2\n\
         state h [m] = 1\nequation level: der(h) = q\noutput h\n",
    );
    let p = declared(&system);
    let problem = Problem { system: &system, p: &p, inputs: &Inputs::none(), start: &[] };
    let failure = simulate(&problem, &[0.0, 1.0], &tight()).expect_err("it fills for ever");
    let IntegrateError::Initial(error) = &failure.error else { panic!("{}", failure.error) };
    assert!(error.to_string().contains("`h`"), "{error}");
}
