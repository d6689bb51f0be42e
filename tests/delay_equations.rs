//! Unknowns that act late, in equations, against closed forms and other integrations.

#[path = "support/inline.rs"]
mod inline;
mod support;

use dgd::{
    Column, Inputs, Observations, Options, Problem, Solution, System, observe, simulate,
    simulate_with_sensitivities,
};
use inline::system;

const TIGHT: f64 = 1e-11;

fn options() -> Options {
    Options { rtol: TIGHT, atol: TIGHT, ..Options::default() }
}

fn run(
    system: &impl System,
    p: &[f64],
    inputs: &Inputs,
    times: &[f64],
) -> (Solution, Observations) {
    let problem = Problem { system, p, inputs, start: &[] };
    let solution = simulate_with_sensitivities(&problem, times, &options()).expect("a solution");
    let observed = observe(&problem, &solution);
    (solution, observed)
}

/// Local errors of the tolerance add up over some hundred steps of problems whose numbers, and
/// sensitivities, are near one.
const CLOSE: f64 = 1e-8;

#[track_caller]
fn close(what: &str, t: f64, found: f64, expected: f64) {
    let allowed = CLOSE * expected.abs().max(1.0);
    assert!((found - expected).abs() <= allowed, "{what} at {t}: {found}, expected {expected}");
}

/// u̇ = −k u(t − τ) with u = u₀ before and at the start, by steps:
/// u = u₀ Σ (−k)ʲ (t − (j − 1) τ)₊ʲ / j!, and its derivatives to k, τ and u₀.
fn decay(t: f64, [k, tau, u0]: [f64; 3]) -> [f64; 4] {
    let mut sums = [1.0, 0.0, 0.0];
    let mut factorial = 1.0;
    for j in 1..60_i32 {
        factorial *= f64::from(j);
        let since = t - f64::from(j - 1) * tau;
        if since <= 0.0 {
            break;
        }
        let (power, less) = (since.powi(j), f64::from(j) * since.powi(j - 1));
        sums[0] += (-k).powi(j) * power / factorial;
        sums[1] += -f64::from(j) * (-k).powi(j - 1) * power / factorial;
        sums[2] += (-k).powi(j) * less * -f64::from(j - 1) / factorial;
    }
    [u0 * sums[0], u0 * sums[1], u0 * sums[2], sums[0]]
}

#[test]
fn a_decay_that_acts_late() {
    let system = system(
        "
model decay
parameter k   [1/s] = 1
parameter tau [s]   = 1
parameter u_0 [1]   = 1
state u [1] = u_0
equation decay: der(u) = -k*delay(u, tau)
",
    );
    let times: Vec<f64> = (0..=101).map(|k| 0.1 * f64::from(k) + 0.003).collect();
    let times = [&[0.0], &times[..]].concat();
    for p in [[1.0, 1.0, 1.0], [0.7, 1.3, 2.0], [2.0, 0.3, 0.5], [1.0, 100.0, 1.0]] {
        let (solution, _) = run(&system, &p, &Inputs::none(), &times);
        for (k, &t) in times.iter().enumerate() {
            let [u, by_k, by_tau, by_start] = decay(t, p);
            close("u", t, solution.y(k)[0], u);
            close("du/dk", t, solution.s(k)[0], by_k);
            close("du/dtau", t, solution.s(k)[1], by_tau);
            close("du/du_0", t, solution.s(k)[2], by_start);
        }
    }
}
