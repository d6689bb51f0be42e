//! `every`, and values that are held between: states and sensitivities against closed forms and differences.

use dgd_execute::InterpretedSystem;
use dgd_runtime::{
    InputColumn, Inputs, Interpolation, Options, Problem, find_method, observe, simulate,
};

use crate::exact::{
    assert_close, assert_slopes_are_differences, options, parameters, run, run_with, slopes, value,
};
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
    let column = InputColumn { name: "w", interpolation: Interpolation::Hold, values: &values };
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

fn outputs(system: &InterpretedSystem, times: &[f64]) -> Vec<Vec<f64>> {
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

/// Which of two tasks acts first is told by whether the second has read what the first has just written.
fn tasks(first: &str, second: &str, declared: &str) -> InterpretedSystem {
    system(&format!(
        "model tasks\n{declared}\nheld a = 0\nheld b = 0\nheld late = 0\n\
         every {first} {{ reset a = a + 1 }}\n\
         every {second} {{\n  reset b = b + 1\n  reset late = late + (if mod(a, 3) > 0.5 and mod(a, 3) < 1.5 then 0 else 1)\n}}"
    ))
}

#[test]
fn ticks_that_coincide_act_in_the_order_of_the_file() {
    let parameters_of = "parameter T [s] = 0.1\nconstant S [s] = 0.1";
    let (n, every) = (3000, 0.1);
    for (fast, slow) in [
        ("0.1 [s]", "0.3 [s]"),
        ("T", "3*T"),
        ("S", "3*S"),
        ("T", "0.3 [s]"),
        ("100 [ms]", "T + 2*T"),
        ("1/10 [Hz]", "0.005 [min]"),
    ] {
        let system = tasks(fast, slow, parameters_of);
        for rows in [1, 7, 10, 100] {
            // Rows at ticks, and between them.
            let times: Vec<f64> = (0..=n / rows).map(|k| every * f64::from(k * rows)).collect();
            let times: Vec<f64> = times.into_iter().chain([every * f64::from(n) + 0.05]).collect();
            let solution = run_plain(&system, &times);
            let last = times.len() - 1;
            let found = ["a", "b", "late"].map(|name| value(&system, &solution, name, last));
            assert_eq!(
                found,
                [f64::from(n + 1), f64::from(n / 3 + 1), 0.0],
                "{fast} {slow} {rows}"
            );
        }
        // The other way round the slow task has not seen the tick.
        let system = tasks_reversed(slow, fast, parameters_of);
        let solution = run_plain(&system, &[0.0, 300.05]);
        assert_eq!(value(&system, &solution, "late", 1), 1001.0, "{slow} before {fast}");
    }
}

fn tasks_reversed(first: &str, second: &str, declared: &str) -> InterpretedSystem {
    system(&format!(
        "model tasks\n{declared}\nheld a = 0\nheld late = 0\n\
         every {first} {{ reset late = late + (if mod(a, 3) > 0.5 and mod(a, 3) < 1.5 then 0 else 1) }}\n\
         every {second} {{ reset a = a + 1 }}"
    ))
}

fn run_plain(system: &InterpretedSystem, times: &[f64]) -> dgd_runtime::Solution {
    let (p, inputs) = (parameters(system), Inputs::none());
    let problem = Problem { system, p: &p, inputs: &inputs, start: &[] };
    simulate(&problem, times, &options()).expect("a run")
}

#[test]
fn an_offset_shifts_all_ticks() {
    let system = system(
        "model shifts\nparameter d [h] = 2\nheld shift = 0\nheld late = 0\nheld both = 0\n\
         every 8 [h] offset 2 [h] { reset shift = shift + 1 }\n\
         every 8 [h] offset 12*d { reset late = late + 1 }\n\
         every 4 [h] offset d { reset both = shift }",
    );
    let times: Vec<f64> =
        [0.0, 1.9, 2.0, 9.9, 10.0, 23.9, 24.0, 32.1].iter().map(|h| h * 3600.0).collect();
    let solution = run_plain(&system, &times);
    let of = |name: &str| {
        (0..times.len()).map(|k| value(&system, &solution, name, k)).collect::<Vec<_>>()
    };
    assert_eq!(of("shift"), [0.0, 0.0, 1.0, 1.0, 2.0, 3.0, 3.0, 4.0]);
    assert_eq!(of("late"), [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 2.0]);
    // In the order of the file.
    assert_eq!(of("both"), [0.0, 0.0, 1.0, 1.0, 2.0, 3.0, 3.0, 4.0]);
}

/// Doses of 1 at d + k T decay with the rate 1/s: x is the sum of exp(−(t − d − k T)).
#[test]
fn derivatives_to_an_offset_and_to_a_period() {
    let system = system(
        "model doses\nparameter T [s] = 1.3\nparameter d [s] = 0.4\nstate x = 0\nequation x: der(x) = -x/1 [s]\n\
         every T offset d { reset x = x + 1 }",
    );
    let t = 10.0;
    let solution = run(&system, &[0.0, t]);
    let since: Vec<(f64, f64)> =
        (0..8).map(|k| (f64::from(k), (-(t - 0.4 - 1.3 * f64::from(k))).exp())).collect();
    let expected = [
        since.iter().map(|(_, x)| x).sum::<f64>(),
        since.iter().map(|(k, x)| k * x).sum(),
        since.iter().map(|(_, x)| x).sum(),
    ];
    assert_close(&[value(&system, &solution, "x", 1)], &expected[..1], CLOSE);
    assert_close(&slopes(&system, &solution, "x", 1), &expected[1..], CLOSE);
}

#[test]
fn derivatives_end_where_the_order_of_ticks_matters() {
    let model = |second: &str| {
        system(&format!(
            "model order\nparameter T [s] = 2\nheld a = 0\nheld b = 0\nstate x = 1\nequation x: der(x) = -x*b/10 [s]\n\
             every T {{ reset a = a + x }}\nevery {second} offset 1 [s] {{ reset b = a }}"
        ))
    };
    // At 4 s both act: one moves with T, the other does not.
    let system = model("3 [s]");
    let solution = run(&system, &[0.0, 3.9, 4.1]);
    assert_eq!(solution.undefined.len(), 1);
    let told = solution.undefined[0].to_string();
    assert_eq!(
        told,
        "sensitivities are undefined from t = 4 s to 4.1 s, where `every T` and `every 3 [s] offset 1 [s]` happen at one \
         time, in an order that matters"
    );
    // Never at one time.
    let solution = run(&model("4 [s]"), &[0.0, 30.0]);
    assert!(solution.undefined.is_empty());
    // Clocks that coincide for each T do in the order of the file.
    let together = crate::inline::system(
        "model order\nparameter T [s] = 0.7\nheld a = 0\nheld b = 0\nstate x = 1\nequation x: der(x) = -x*b/10 [s]\n\
         every T { reset a = a + x }\nevery 3*T { reset b = a }",
    );
    assert_slopes_are_differences(&together, &Inputs::none(), &[0.0, 10.0], 1e-6);
}

#[test]
fn conditions_on_time_and_steps_of_time_are_at_ticks() {
    // At each third tick all hold already: 3 · 0.1 is not 0.3, and 0.3 · 3 is not 0.9.
    let system = system(
        "model schedule\nparameter k = 3\nheld n = 0\nheld on = 0\nheld steps = 0\nheld phase = 0\n\
         every 0.3 [s] {\n  reset n = n + 1\n  reset on = on + (if time > k*0.1 [s] then 1 else 0)\n\
         reset steps = floor(time/0.1 [s])\n  reset phase = phase + (if mod(time, 0.3 [s]) < 0.15 [s] then 0 else 1)\n}",
    );
    let solution = run_plain(&system, &[0.0, 0.3, 300.0]);
    let of =
        |k: usize| ["n", "on", "steps", "phase"].map(|name| value(&system, &solution, name, k));
    assert_eq!(of(1), [2.0, 1.0, 3.0, 0.0]);
    assert_eq!(of(2), [1001.0, 1000.0, 3000.0, 0.0]);
}

/// A heater on between 6 h and 22 h of each day, for fractions of days of any length.
#[test]
fn a_daily_schedule_is_exact() {
    let system = system(
        "model day\nparameter on [h] = 6\nparameter length [h] = 16\nparameter day [h] = 24\n\
         let clock = mod(time, day)\nstate E [kW*h] = 0\n\
         equation E: der(E) = if clock > on and clock < on + length then 1 [kW] else 0",
    );
    assert!(dgd_runtime::System::signature(&system).discrete.automata.is_empty());
    let times = [0.0, 7.0, 24.0, 365.0 * 24.0, 365.0 * 24.0 + 23.0].map(|h| h * 3600.0);
    for name in ["rodas5p", "tsit5", "kencarp4", "bdf", "taylor"] {
        let Ok(method) = find_method(name) else { panic!("{name} is a method") };
        let (p, inputs) = (parameters(&system), Inputs::none());
        let problem = Problem { system: &system, p: &p, inputs: &inputs, start: &[] };
        let given = Options { method, ..Options::default() };
        let solution = simulate(&problem, &times, &given).expect(name);
        let found: Vec<f64> =
            (0..times.len()).map(|k| value(&system, &solution, "E", k) / 3.6e6).collect();
        assert_close(&found, &[0.0, 1.0, 16.0, 5840.0, 5856.0], 1e-10);
    }
    let solution = run(&system, &times);
    // Just before the 366th day ends: it has been on 366 times.
    let found = slopes(&system, &solution, "E", 4).iter().map(|s| s / 1e3).collect::<Vec<_>>();
    assert_close(&found, &[0.0, 366.0, 0.0], 1e-9);
}
