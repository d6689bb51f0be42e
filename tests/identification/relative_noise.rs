//! Noise that grows with the output: the search from far starts, and what residuals are judged by.

use std::fmt::Write;

use dgd_data::InMemory;
use dgd_work::{FitRequest, SilentReporter, TaskContext, fit};
use rand_pcg::Pcg64;
use serde_json::Value;

use super::normal;

/// A reading of w by two normal deviates.
type Scatter = fn(f64, f64, f64) -> f64;

/// 200 times over 40 s.
const TIMES: usize = 200;

fn time(k: usize) -> f64 {
    0.2 * k as f64
}

/// The model of a decay whose noise is this, from this rate and first value.
fn decay(noise: &str, k: f64, y0: f64) -> String {
    format!(
        "model decay\nparameter k [1/s] = {k} in 0.001 .. 10, log\nparameter y0 = {y0}\n\
         parameter s = 0.3 in 1e-3 .. 1e3, log, fixed\n\
         state y = y0 fixed\nequation e: der(y) = -k*y\noutput y noise {noise}\n"
    )
}

/// Readings of 10 e^(−t/10), each scattered by what is made of the output and two normal deviates.
fn readings(seed: u64, scattered: impl Fn(f64, f64, f64) -> f64) -> String {
    let mut random = Pcg64::new(u128::from(seed), 3);
    let mut csv = "time [s],y\n".to_owned();
    for k in 0..TIMES {
        let w = 10.0 * (-0.1 * time(k)).exp();
        let y = scattered(w, normal(&mut random), normal(&mut random));
        writeln!(csv, "{},{y:e}", time(k)).expect("strings take all");
    }
    csv
}

/// `result.json` of a fit of these texts, and what it says.
fn fitted(model: &str, csv: &str, change: impl Fn(&mut FitRequest)) -> (Value, String) {
    let files = InMemory::default().with_file("m.dgd", model).with_file("d.csv", csv);
    let session = TaskContext::new(&SilentReporter).with_files(&files);
    let mut request = FitRequest::new("m.dgd", vec!["d.csv".into()]);
    change(&mut request);
    let found = fit(&request, session).unwrap_or_else(|error| panic!("{error}\n{model}"));
    (found.to_json().clone(), found.to_text().to_owned())
}

fn value(result: &Value, parameter: &str) -> f64 {
    result["parameters"][parameter]["value"].as_f64().expect("an estimate")
}

fn std(result: &Value, parameter: &str) -> f64 {
    result["parameters"][parameter]["std"].as_f64().expect("determined")
}

#[test]
fn white_noise_of_any_kind_is_called_autocorrelated_as_often_as_the_test_says() {
    type Scattered = fn(f64, f64, f64) -> f64;
    let kinds: [(&str, Scattered); 5] = [
        ("0.3", |w, z, _| w + 0.3 * z),
        ("0.05*abs(y)", |w, z, _| w * (1.0 + 0.05 * z)),
        ("lognormal(0.05)", |w, z, _| w * (0.05 * z).exp()),
        ("0.05 + 0.05*abs(y)", |w, z, _| w + (0.05 + 0.05 * w) * z),
        ("sqrt(0.05^2 + (0.1*y)^2)", |w, z, _| w + f64::hypot(0.05, 0.1 * w) * z),
    ];
    for (noise, scattered) in kinds {
        let sets: u32 = 40;
        let mut sum = 0.0;
        let mut alarms = 0;
        for seed in 0..sets {
            let (result, text) =
                fitted(&decay(noise, 0.09, 9.0), &readings(seed.into(), scattered), |_| {});
            let p = &result["outputs"]["y"]["quality"]["train"]["whiteness"]["p_value"];
            let p = p.as_f64().expect("enough samples");
            sum += p;
            alarms += u32::from(p < 0.05);
            assert_eq!(text.contains("are autocorrelated"), p < 0.01, "{noise} {seed}");
            assert!(!text.contains("The fit is bad"), "{noise} {seed}: {text}");
        }
        // Expected: 2 of 40, beyond 8 with a probability of 1e-4; p uniform, its mean within four standard errors.
        assert!(alarms <= 8, "{noise}: {alarms} of {sets}");
        let mean = sum / f64::from(sets);
        assert!(
            (mean - 0.5).abs() < 4.0 * (1.0 / 12.0 / f64::from(sets)).sqrt(),
            "{noise}: {mean}"
        );
    }
}

/// A column of standard deviations, and one output of constant noise beside it: each is judged by its own.
#[test]
fn recorded_noise_is_white_and_a_real_correlation_is_still_found() {
    let model = decay("0.3", 0.09, 9.0) + "output z = 2*y noise 0.1\n";
    let csv = |seed: u64, correlated: f64| {
        let mut random = Pcg64::new(u128::from(seed), 5);
        let mut csv = "time [s],y,std(y),z\n".to_owned();
        let mut last = 0.0;
        for k in 0..TIMES {
            let w = 10.0 * (-0.1 * time(k)).exp();
            last = correlated * last + (1.0 - correlated * correlated).sqrt() * normal(&mut random);
            let z = 2.0 * w + 0.1 * normal(&mut random);
            writeln!(csv, "{},{:e},{:e},{z:e}", time(k), w * (1.0 + 0.05 * last), 0.05 * w)
                .expect("strings take all");
        }
        csv
    };
    let coloured = |seed: u64, correlated: f64| {
        let (result, _) = fitted(&model, &csv(seed, correlated), |_| {});
        let named = result["left_over"]["autocorrelated"].as_array().cloned().unwrap_or_default();
        named.iter().map(|name| name.as_str().unwrap_or_default().to_owned()).collect::<Vec<_>>()
    };
    let alarms = (0..30).filter(|seed| !coloured(*seed, 0.0).is_empty()).count();
    assert!(alarms <= 3, "{alarms} of 30");
    for seed in 0..5 {
        assert_eq!(coloured(seed, 0.6), ["y"], "{seed}");
    }
}

#[test]
fn residuals_beyond_twice_the_declared_noise_are_bad_whatever_weighs_them() {
    use dgd_work::NoiseFrom;
    let csv = readings(1, |w, z, _| w + 0.3 * z);
    for (declared, noise, is_bad) in [
        ("0.0176", NoiseFrom::Estimated, true),
        ("0.0176", NoiseFrom::Declared, true),
        ("0.2", NoiseFrom::Estimated, false),
        ("0.2", NoiseFrom::Declared, false),
        ("0.001*(1 + abs(y))", NoiseFrom::Estimated, true),
    ] {
        let (result, text) =
            fitted(&decay(declared, 0.09, 9.0), &csv, |request| request.noise = noise);
        assert_eq!(text.starts_with("The fit is bad: the residuals are"), is_bad, "{text}");
        let times = result["outputs"]["y"]["over_declared_noise"]["times"].as_f64();
        if declared == "0.0176" {
            assert!((times.expect("it is declared") - 17.0).abs() < 2.0, "{times:?}");
        }
    }
    // An output that the model sees go the other way; the other one is followed.
    let model = "model line\nparameter a = 1\nstate x = 0 fixed\nequation e: der(x) = a/1 [s]\n\
                 output x noise 1\noutput y = 3 - 0.1*x noise 100\n";
    let rows = (0..60).map(|k| format!("{k},{k},{}\n", 3.0 + 1e-3 * f64::from(k)));
    let csv = rows.fold("time [s],x,y\n".to_owned(), |all, row| all + &row);
    let (_, text) = fitted(model, &csv, |request| request.noise = NoiseFrom::Declared);
    let words = "The fit is bad: the model follows `y` worse than its mean does";
    assert!(text.starts_with(words), "{text}");
}

/// Starts off by factors of two to ten either way end where the search from the truth does: at the maximum of the
/// likelihood itself, which is not that of logarithms or of weights that are held.
#[test]
fn far_starts_end_at_the_maximum_of_the_likelihood() {
    let cases: [(&str, Scatter); 6] = [
        ("0.05*abs(y)", |w, z, _| w * (1.0 + 0.05 * z)),
        ("0.2*y", |w, z, _| w * (1.0 + 0.2 * z)),
        ("0.02 + 0.05*abs(y)", |w, z, _| w + (0.02 + 0.05 * w) * z),
        ("sqrt(0.02^2 + (0.1*y)^2)", |w, z, _| w + f64::hypot(0.02, 0.1 * w) * z),
        ("s*abs(y)", |w, z, _| w * (1.0 + 0.1 * z)),
        ("student(5, 0.05*abs(y))", |w, z, _| w * (1.0 + 0.05 * z)),
    ];
    for (noise, scattered) in cases {
        let free = |model: String| {
            if noise.starts_with("s*") { model.replace(", fixed", "") } else { model }
        };
        for seed in 0..4 {
            let csv = readings(seed, scattered);
            let (best, _) = fitted(&free(decay(noise, 0.1, 10.0)), &csv, |_| {});
            assert_eq!(best["converged"], true, "{noise} {seed}");
            let least = best["deviance"].as_f64().expect("a likelihood");
            for (k, y0) in [(0.2, 8.0), (0.05, 20.0), (1.0, 1.0), (0.01, 100.0), (0.6, 60.0)] {
                let (found, text) = fitted(&free(decay(noise, k, y0)), &csv, |_| {});
                assert_eq!(found["converged"], true, "{noise} {seed} {k} {y0}: {text}");
                let deviance = found["deviance"].as_f64().expect("a likelihood");
                assert!((deviance - least).abs() < 1e-3, "{noise} {seed} {k} {y0}: {text}");
                for name in ["k", "y0"] {
                    let off = (value(&found, name) - value(&best, name)) / std(&best, name);
                    assert!(off.abs() < 0.01, "{noise} {seed} {k} {y0}: {name} is off by {off}");
                }
            }
        }
    }
}

/// Truth of the recording: fits in SciPy to the exact likelihood, as its note has them.
#[test]
fn readings_with_noise_in_proportion_are_fitted_from_a_start_that_is_off() {
    let csv = include_str!("found/white_relative_noise.csv");
    let (found, text) = fitted(include_str!("found/relative_noise_far_start.dgd"), csv, |_| {});
    assert_eq!(found["converged"], true, "{text}");
    assert!((value(&found, "k") - 0.099_615).abs() < 2e-5, "{text}");
    assert!((value(&found, "y0") - 9.9484).abs() < 2e-3, "{text}");
    assert!(!text.contains("autocorrelated"), "{text}");
    let (_, text) = fitted(include_str!("found/white_relative_noise.dgd"), csv, |_| {});
    assert!(!text.contains("autocorrelated"), "{text}");
}

#[test]
fn a_species_is_followed_as_far_down_as_it_was_read() {
    let csv = include_str!("found/small_species.csv");
    for model in
        [include_str!("found/small_species.dgd"), include_str!("found/small_species_signed.dgd")]
    {
        let (found, text) = fitted(model, csv, |_| {});
        assert_eq!(found["converged"], true, "{text}");
        let wanted = [("k1", 99.983), ("k2", 20.056), ("k3", 3.0058), ("sigma", 0.0856)];
        for (name, wanted) in wanted {
            let off = (value(&found, name) - wanted) / std(&found, name);
            assert!(off.abs() < 0.05, "{name}: {off}\n{text}");
        }
    }
}

/// Cases since the report before, where the time since then is an input that jumps.
const NOTIFY: &str = "model notify
constant N = 20000
input window [d]
parameter beta [1/d] = 0.4 in 0.01 .. 5, log
parameter gamma [1/d] = 0.2 in 0.01 .. 5, log
parameter s = 0.2 in 0.01 .. 2, log
parameter I_0 = 10 in 1 .. 1000, log
state S = N - I_0 fixed
state I = I_0 fixed
state C = 0 nominal 1000, fixed
let infect = beta*S*I/N
equation s: der(S) = -infect
equation i: der(I) = infect - gamma*I
equation c: der(C) = infect
output new_cases = C - delay(C, window)  noise lognormal(s)
";

const NOTIFICATIONS: &str = "time [d],window [d],new_cases
0,7,
7,7,71.07
14,7,236.90
21,7,562.75
35,14,5286.02
42,7,4484.21
49,7,2929.33
56,7,1832.11
63,7,930.42
77,14,676.33
84,7,115.19
98,14,82.82
";

#[test]
fn notifications_since_the_last_report_are_fitted() {
    let (result, _) = fitted(NOTIFY, NOTIFICATIONS, |_| {});
    // By another solver and optimiser.
    for (name, expected) in [("beta", 0.310_403_28), ("gamma", 0.146_177_92), ("I_0", 17.080_605_9)]
    {
        let found = value(&result, name);
        assert!((found / expected - 1.0).abs() < 1e-4, "{name}: {found} is not {expected}");
    }
}
