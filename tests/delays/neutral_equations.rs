//! Neutral equations, in which derivatives act late, against closed forms: an algebraic unknown is the
//! derivative, and late.
//!
//! # Source
//!
//! Enright and Hayashi, The Evaluation of Numerical Software for Delay Differential Equations (1997):
//! F1, F3–F5, G1, G2 and H1 of DDETST.

use std::f64::consts::PI;

use dgd_runtime::{Inputs, Options, Problem, simulate};

use crate::inline::system;

/// Runs from 0 to the end of the problem and compares at each of 50 times.
#[track_caller]
fn verify(text: &str, p: &[f64], until: f64, solution_at: impl Fn(f64) -> f64) {
    let system = system(text);
    let times: Vec<f64> = (0..=50).map(|k| until * f64::from(k) / 50.0).collect();
    let options = Options { rtol: 1e-11, atol: 1e-11, ..Options::default() };
    let problem = Problem { system: &system, p, inputs: &Inputs::none(), start: &[] };
    let solution = simulate(&problem, &times, &options).expect("a solution");
    for (k, &t) in times.iter().enumerate() {
        let (found, expected) = (solution.y(k)[0], solution_at(t));
        // Local errors of the tolerance add up over some hundred steps.
        let allowed = 1e-8 * expected.abs().max(1.0);
        assert!((found - expected).abs() <= allowed, "{p:?} at {t}: {found}, expected {expected}");
    }
}

/// F1, u = exp(sin 2t): u and u̇ of half the time, and no delay at the start.
#[test]
fn a_derivative_at_half_the_time() {
    verify(
        "
model f1
let t = time / 1 [s]
state u [1] = 1
unknown rate [1/s] = 2
equation rate: rate = der(u)
equation u: 1 [s] * der(u) = 2*cos(2*t)*delay(u, time/2)^(2*cos(t)) + log(delay(rate, time/2) * 1 [s]) - log(2*cos(t)) - sin(t)
",
        &[],
        1.0,
        |t| (2.0 * t).sin().exp(),
    );
}

/// F3, F4 and F5, u = log(t + 3): the delay t (1 + cos 2πt)/2 vanishes at every half of a second.
#[test]
fn a_late_derivative_whose_delay_vanishes_again_and_again() {
    for strength in [0.2, 0.4, 0.6] {
        verify(
            "
model f3
parameter L [1] = 0.2
let t      = time / 1 [s]
let before = t*(1 - cos(2*pi*t))/2
state u [1] = log(3)
unknown rate [1/s] = 0.3
equation rate: rate = der(u)
equation u: 1 [s] * der(u) = exp(-u) + L*(sin(delay(rate, time*(1 + cos(2*pi*t))/2) * 1 [s]) - sin(1/(3 + before)))
",
            &[strength],
            10.0,
            |t| (t + 3.0).ln(),
        );
    }
}

/// G1 and G2, u = t + 1 where u = 1 − t was before: delays that the solution makes.
#[test]
fn a_late_derivative_whose_delay_depends_on_the_solution() {
    for delay in ["u^2/4 * 1 [s]", "time + (2 - u) * 1 [s]"] {
        verify(
            &format!(
                "
model g
state u [1] = 1  history 1 - time / 1 [s]
unknown rate [1/s] = 1  history -1 [1/s]
equation rate: rate = der(u)
equation u: der(u) = -delay(rate, {delay})
"
            ),
            &[],
            1.0,
            |t| t + 1.0,
        );
    }
}

/// H1, u = −½ log(cos 2t): the delay t/(1 + u²) is nothing at the start.
#[test]
fn a_late_derivative_whose_delay_depends_on_time_and_the_solution() {
    verify(
        "
model h1
let t = time / 1 [s]
state u [1] = 0
unknown rate [1/s] = 0
equation rate: rate = der(u)
equation u: 1 [s] * der(u) = -4*t*u^2/(4 + log(cos(2*t))^2) + tan(2*t) + 0.5*atan(delay(rate, time/(1 + u^2)) * 1 [s])
",
        &[],
        0.225 * PI,
        |t| -0.5 * (2.0 * t).cos().ln(),
    );
}
