//! `every`, and values that are held between: states and sensitivities against closed forms and differences.

use dgd_execute::Interpreted;
use dgd_runtime::{
    Column, Inputs, Interpolation, Options, Problem, find_method, observe, simulate,
};

use crate::exact::{assert_close, options, parameters, run, run_with, slopes, value};
use crate::inline::system;
use crate::support::interpreted;

/// Rodas5P's error after the few hundred steps of these cases stays within a factor of a hundred of
/// the tolerance of 1e-11.
const CLOSE: f64 = 1e-8;

/// Masses in the gut and in the body at t, doses of mass d at 0, τ, 2τ, …: each decays by itself, in the body as
/// the difference of two exponentials.
fn masses(t: f64, [tau, d, k_a, k_e]: [f64; 4]) -> [f64; 2] {
    let (mut gut, mut body) = (0.0, 0.0);
    for k in 0..=(t / tau).floor() as u32 {
        let since = t - f64::from(k) * tau;
        gut += d * (-k_a * since).exp();
        body += d * k_a / (k_a - k_e) * ((-k_e * since).exp() - (-k_a * since).exp());
    }
    [gut, body]
}

/// Derivatives of [`masses`] to τ, d, k_a and k_e, by central differences, extrapolated once: the closed form is
/// exact to rounding.
fn mass_slopes(t: f64, p: [f64; 4], which: usize) -> Vec<f64> {
    let slope = |j: usize| {
        let central = |h: f64| {
            let moved = |step: f64| {
                let mut p = p;
                p[j] += step;
                masses(t, p)[which]
            };
            (moved(h) - moved(-h)) / (2.0 * h)
        };
        let h = 1e-4 * p[j];
        (4.0 * central(0.5 * h) - central(h)) / 3.0
    };
    (0..4).map(slope).collect()
}

#[test]
fn repeated_doses_add_up() {
    let system = interpreted("models/repeated_doses.dgd", &[]);
    let p = parameters(&system);
    let own = [p[0], p[1], p[2], p[3]];
    // Not at a dose, where the derivative to τ is another on each side.
    let times: Vec<f64> = (0..40).map(|k| 3600.0 * (0.7 + 2.1 * f64::from(k))).collect();
    let times: Vec<f64> = std::iter::once(0.0).chain(times).collect();
    let solution = run(&system, &times);
    for (k, t) in times.iter().enumerate() {
        let expected = masses(*t, own);
        let found = ["gut", "body"].map(|name| value(&system, &solution, name, k));
        assert_close(&found.map(|m| m * 1e6), &expected.map(|m| m * 1e6), CLOSE);
    }
    for k in [7, 21, 40] {
        for (which, name) in ["gut", "body"].into_iter().enumerate() {
            let found = slopes(&system, &solution, name, k);
            let expected = mass_slopes(times[k], own, which);
            for j in 0..4 {
                // Relative to what a parameter as it is makes.
                let (found, expected) = (found[j] * p[j] * 1e6, expected[j] * p[j] * 1e6);
                let allowed = 1e-7 * expected.abs().max(1.0);
                assert!((found - expected).abs() <= allowed, "{name} {k} {j}: {found} {expected}");
            }
        }
    }
}

#[test]
fn a_row_at_a_tick_is_that_after_it_and_a_pair_is_both() {
    // 3 · 0.1 is not 0.3.
    let system = system(
        "model count\nheld n = 0\nstate x = 0\nequation x: der(x) = n/1 [s]\nevery 0.1 [s] { reset n = n + 1 }",
    );
    let times = [0.0, 0.05, 0.1, 0.2, 0.3, 0.3, 0.6, 0.7, 1.1];
    let solution = run(&system, &times);
    let counts: Vec<f64> = (0..times.len()).map(|k| value(&system, &solution, "n", k)).collect();
    assert_eq!(counts, [1.0, 1.0, 2.0, 3.0, 3.0, 4.0, 7.0, 8.0, 12.0]);
    // What has begun at 0.25 has not ticked before.
    let later = run(&system, &[0.25, 0.3, 0.35]);
    let counts: Vec<f64> = (0..3).map(|k| value(&system, &later, "n", k)).collect();
    assert_eq!(counts, [0.0, 1.0, 1.0]);
    // Neither the ticks nor the instants are told as events.
    assert!(solution.events.is_empty());
}

#[test]
fn a_controller_reads_a_sample_that_comes_at_its_tick() {
    let system = system(
        "model control\ninput w hold\nheld u = 0\nstate x = 0\nequation x: der(x) = (u - x)/2 [s]\n\
         every 0.1 [s] { reset u = 3*w }",
    );
    let samples = [0.0, 0.3, 0.7];
    let values = [1.0, 2.0, 5.0];
    let column = Column { name: "w", interpolation: Interpolation::Hold, values: &values };
    let inputs = Inputs::recorded(&samples, &[column]).expect("inputs");
    let times = [0.0, 0.25, 0.3, 0.65, 0.7, 0.71];
    let solution = run_with(&system, &[], &inputs, &times).expect("a run");
    let found: Vec<f64> = (0..times.len()).map(|k| value(&system, &solution, "u", k)).collect();
    assert_eq!(found, [3.0, 3.0, 6.0, 6.0, 15.0, 15.0]);
}

#[test]
fn a_sampled_controller_is_a_recurrence() {
    let system = interpreted("models/sampled_level.dgd", &[]);
    let p = parameters(&system);
    let own: [f64; 6] = p.clone().try_into().expect("six parameters");
    // None of them a multiple of the period.
    let times: Vec<f64> = (0..60).map(|k| 7.3 * f64::from(k) + 1.05).collect();
    let times: Vec<f64> = std::iter::once(0.0).chain(times).collect();
    let solution = run(&system, &times);
    for (k, t) in times.iter().enumerate().skip(1) {
        let found = ["h", "valve"].map(|name| value(&system, &solution, name, k));
        let expected = level(*t, own);
        assert_close(&found, &expected, CLOSE);
    }
    for k in [1, 4, 11, 30] {
        for (which, name) in ["h", "valve"].into_iter().enumerate() {
            let found = slopes(&system, &solution, name, k);
            for j in 0..6 {
                let moved = |step: f64| {
                    let mut p = own;
                    p[j] += step;
                    level(times[k], p)[which]
                };
                // Short of where the valve leaves its stop.
                let step = 1e-6 * p[j];
                let expected = (moved(step) - moved(-step)) / 2e-6;
                let found = found[j] * p[j];
                let allowed = 1e-6 * expected.abs().max(1.0);
                assert!((found - expected).abs() <= allowed, "{name} {k} {j}: {found} {expected}");
            }
        }
    }
}

/// h and the valve of the sampled controller at t: between readings an exponential. Both resets of a tick read what
/// was before it.
fn level(until: f64, [period, gain, t_i, wanted, supply, loss]: [f64; 6]) -> [f64; 2] {
    let (area, mut h, mut sum) = (2.0, 0.6, 0.0);
    let mut k = 0_u32;
    loop {
        let t = f64::from(k) * period;
        let valve = f64::clamp(0.5 + gain * (wanted - h + sum), 0.0, 1.0);
        sum += (wanted - h) * period / t_i;
        let rest = (until - t).min(period);
        let end = valve * supply / loss;
        h = end + (h - end) * (-loss / area * rest).exp();
        if until - t <= period {
            return [h, valve];
        }
        k += 1;
    }
}

#[test]
fn every_method_ticks() {
    let system = interpreted("models/repeated_doses.dgd", &[]);
    let p = parameters(&system);
    let own = [p[0], p[1], p[2], p[3]];
    let times = [0.0, 3600.0 * 29.5];
    for name in ["rodas5p", "tsit5", "kencarp4", "bdf", "taylor"] {
        let Ok(method) = find_method(name) else { panic!("{name} is a method") };
        let given = Options { method, rtol: 1e-9, atol: 1e-9, ..Options::default() };
        let inputs = Inputs::none();
        let problem = Problem { system: &system, p: &p, inputs: &inputs, start: &[] };
        let solution = simulate(&problem, &times, &given).expect(name);
        let found = ["gut", "body"].map(|unknown| value(&system, &solution, unknown, 1) * 1e6);
        assert_close(&found, &masses(times[1], own).map(|m| m * 1e6), 1e-5);
    }
}

fn outputs(system: &Interpreted, times: &[f64]) -> Vec<Vec<f64>> {
    let (p, inputs) = (parameters(system), Inputs::none());
    let problem = Problem { system, p: &p, inputs: &inputs, start: &[] };
    let solution = simulate(&problem, times, &options()).expect("a run");
    let observations = observe(&problem, &solution);
    (0..times.len()).map(|k| observations.w(k).to_vec()).collect()
}

#[test]
fn outputs_count_the_ticks_of_time() {
    let system = interpreted("models/repeated_doses.dgd", &[]);
    let times = [0.0, 7.9, 8.0, 8.1, 16.0].map(|hours| 3600.0 * hours);
    let taken: Vec<f64> = outputs(&system, &times).into_iter().map(|w| w[1]).collect();
    assert_eq!(taken, [1.0, 1.0, 2.0, 2.0, 3.0]);
}

#[test]
fn either_of_two_conditions_resets_and_both_at_once_reset_once() {
    let system = system(
        "model either\nparameter a = 0.35\nstate x = 0\nheld n = 0\nequation x: der(x) = 1 [1/s]\n\
         when x rises above a or time rises above 0.8 [s] or x - 0.5 rises above time/2 [s] - 0.1 {\n  reset n = n + 1\n}",
    );
    // x = t: at 0.35, at 0.8 twice: t − 0.5 = t/2 − 0.1.
    let solution = run(&system, &[0.0, 0.3, 0.4, 0.7, 0.9]);
    let counts: Vec<f64> = (0..5).map(|k| value(&system, &solution, "n", k)).collect();
    assert_eq!(counts, [0.0, 0.0, 1.0, 1.0, 2.0]);
}
